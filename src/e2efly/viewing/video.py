"""Videos of flights: the view from the vehicle, frame by frame, and video files of any frames."""

import importlib.util
import shutil
import subprocess
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from e2efly.config import CameraConfig
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import Scene
from e2efly.viewing.image_plots import exposure, in_colours, look_around, shape_of
from e2efly.viewing.tour import Tour

PANELS = {"rgb": "Colour", "depth": "Depth", "label": "Class"}
HEAD, GAP = 20, 6
"""Space for a title above a panel, and between panels, pixels."""
LOOKS = 5
"""Number of places of a flight from which the exposure of its camera is computed."""
FILMS = (".gif", ".mp4", ".webm", ".png")
"""Endings of the names of the files that `write_film` can write."""
STRETCHED = 3.0
"""Pictures wider than this many times their height are stacked. Others are placed side by side."""

Frame = UInt8[np.ndarray, "h w 3"]


def exposure_of(camera: CameraConfig, scene: Scene | MeshScene, tour: Tour) -> float:
    """The exposure factor of a camera on this flight, for `frames`. See `e2efly.viewing.image_plots.exposure`."""
    rows = np.linspace(0, len(tour.time) - 1, LOOKS).astype(int)
    places = zip(tour.time[rows], tour.position[rows], tour.quaternion[rows], strict=True)
    return exposure(look_around(camera, scene, *place, tuple(PANELS)).images["rgb"] for place in places)


def frames(
    camera: CameraConfig, scene: Scene | MeshScene, tour: Tour, width: int, exposed: float = 1.0
) -> Iterator[Frame]:
    """The flight, frame by frame.

    Args:
        camera: the camera of the vehicle.
        scene: one world.
        tour: the flight.
        width: width of a panel, pixels.
        exposed: factor on the colours.
    """
    high, wide = shape_of(camera)
    size = (width, max(round(width * high / wide), 24))
    for time, position, quaternion in zip(tour.time, tour.position, tour.quaternion, strict=True):
        images = look_around(camera, scene, time, position, quaternion, tuple(PANELS), exposed).images
        pictures = {name: in_colours(name, images[name], camera.reach[1]) for name in PANELS}
        yield compose(pictures, size, f"{time:.1f} s", stacked=wide > STRETCHED * high)


def compose(pictures: dict[str, np.ndarray], size: tuple[int, int], clock: str, stacked: bool) -> Frame:
    """Panels side by side or stacked, with their titles. Rows and columns are even numbers, as codecs require."""
    width, height = size
    across, down = (0, height + HEAD) if stacked else (width + GAP, 0)
    count = len(pictures) - 1
    whole = (width + count * across + 1) // 2 * 2, (height + HEAD + count * down + 1) // 2 * 2
    canvas = Image.new("RGB", whole, "white")
    draw, font = ImageDraw.Draw(canvas), ImageFont.load_default(size=13)
    for i, (name, picture) in enumerate(pictures.items()):
        panel = Image.fromarray(np.rint(255 * picture).astype(np.uint8)).resize(size, Image.Resampling.NEAREST)
        canvas.paste(panel, (i * across, HEAD + i * down))
        draw.text((i * across + 2, i * down + 2), PANELS[name], fill="#222222", font=font)
    draw.text((width - 4, 2), clock, fill="#222222", font=font, anchor="ra")
    return np.asarray(canvas)


def write_video(film: Iterable[Frame], path: Path, period: float) -> list[Path]:
    """Write `path`.gif and, if ffmpeg is installed, `path`.mp4.

    Args:
        film: the frames.
        path: path without suffix.
        period: time between frames, s.

    Returns:
        The files that were written.

    Raises:
        OSError: when ffmpeg is installed but fails, with its message.
    """
    kept = [np.asarray(frame) for frame in film]
    gif = _gif(kept, path.with_suffix(".gif"), period)
    return [gif, _mp4(kept, path.with_suffix(".mp4"), period)] if shutil.which("ffmpeg") else [gif]


def check_film(path: Path) -> None:
    """Refuse a file that `write_film` cannot write.

    Raises:
        ValueError: naming the file and what is accepted here.
    """
    if path.suffix not in FILMS:
        raise ValueError(f"--video is {path}; accepted: a name that ends in {', '.join(FILMS)}")
    opencv = importlib.util.find_spec("cv2") is not None
    if path.suffix == ".mp4" and not shutil.which("ffmpeg"):
        raise ValueError(
            f"--video {path} needs the program ffmpeg; accepted: that, or a name that ends in .webm or .gif"
        )
    if path.suffix == ".webm" and not opencv:
        raise ValueError(f"--video {path} needs OpenCV: pip install 'e2efly[video]'; accepted: that, or .gif")


def write_film(film: Iterable[Frame], path: Path, period: float) -> None:
    """Write pictures as one file. Its suffix decides the format: GIF, MP4 (H.264 by the program ffmpeg), WebM (VP8 by
    OpenCV), or PNG (only the last picture).

    Args:
        film: the frames, all of the same size.
        path: the file; see `check_film`.
        period: time between frames, s.

    Raises:
        OSError: when the file cannot be written.
    """
    match path.suffix:
        case ".png":
            *_, last = film
            Image.fromarray(last).save(path)
        case ".webm":
            _webm(film, path, period)
        case ".mp4":
            _mp4([np.asarray(frame) for frame in film], path, period)
        case _:
            _gif([np.asarray(frame) for frame in film], path, period)


def _gif(kept: list[Frame], path: Path, period: float) -> Path:
    palette = Image.fromarray(np.concatenate(kept[:: max(1, len(kept) // 8)])).quantize(
        128, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE
    )
    pages = [Image.fromarray(frame).quantize(palette=palette, dither=Image.Dither.NONE) for frame in kept]
    pages[0].save(path, save_all=True, append_images=pages[1:], duration=round(1000 * period), loop=0, optimize=False)
    return path


def _webm(film: Iterable[Frame], path: Path, period: float) -> None:
    import cv2

    writer = None
    for frame in film:
        if writer is None:
            code = cv2.VideoWriter.fourcc(*"VP80")
            writer = cv2.VideoWriter(str(path), code, 1 / period, (frame.shape[1], frame.shape[0]))
            if not writer.isOpened():
                raise OSError(f"OpenCV cannot write {path}")
        writer.write(np.ascontiguousarray(frame[..., ::-1]))
    if writer is not None:
        writer.release()


def _mp4(film: list[Frame], path: Path, period: float) -> Path:
    height, width, _ = film[0].shape
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}", "-r", f"{1 / period:g}", "-i", "-"]
    command = ["ffmpeg", "-y", "-loglevel", "error", *raw, "-pix_fmt", "yuv420p", str(path)]
    done = subprocess.run(command, input=b"".join(frame.tobytes() for frame in film), capture_output=True, check=False)
    if done.returncode:
        raise OSError(f"ffmpeg cannot write {path}: {done.stderr.decode(errors='replace').strip()}")
    return path
