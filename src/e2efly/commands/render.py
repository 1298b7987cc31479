"""`e2efly render`: what sensors see of a world, as pictures and as a video of a flight."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from e2efly.commands.terminal import Terminal
from e2efly.config import CameraConfig
from e2efly.courses.references import read_csv, through_points
from e2efly.device import prepare

PERIOD = 0.05
"""Seconds between the frames of a video."""
PICTURE, PANEL = 640, 256
"""Columns of a picture and of a panel of the video."""
_TILE = 16
"""Rows and columns are multiples of it: the ray caster's tiles."""


@dataclass(frozen=True)
class Request:
    """What to render."""

    scene: str
    camera: str
    width: int | None
    height: int | None
    position: tuple[float, float, float] | None
    yaw: float | None
    pitch: float
    time: float
    seed: int
    flight: Path | None
    out: Path | None


def render_command(request: Request) -> int:
    """Write the pictures, the contact sheet and the video; exit status 0."""
    for name, value in (("width", request.width), ("height", request.height)):
        if value is not None and not 8 <= value <= 4096:
            raise ValueError(f"--{name} is {value}; accepted: 8 to 4096 pixels")
    for name in ("position", "yaw", "pitch", "time"):
        value = getattr(request, name)
        if value is not None and not np.all(np.isfinite(value)):
            raise ValueError(f"--{name} is {value}; accepted: finite numbers")
    prepare()
    from e2efly.env import random_key
    from e2efly.scenes.camera import PRESETS
    from e2efly.view.cloud import write_cloud
    from e2efly.view.images import look_around, write_pictures
    from e2efly.view.places import find_place
    from e2efly.view.sheet import write_sheet
    from e2efly.view.video import frames, write_video

    console = Terminal()
    place = find_place(request.scene, random_key(request.seed))
    out = request.out or Path("runs/render") / Path(request.scene).stem
    _make(out)
    with console.status("Planning a flight"):
        tour = _tour(request, place)
    camera = sized(PRESETS[request.camera], PICTURE, request.width, request.height)
    position, quaternion = viewpoint(request, tour)
    where = f"{request.scene}, seed {request.seed}, {request.camera} at ({', '.join(f'{x:.1f}' for x in position)}) m"
    with console.status("Drawing pictures"):
        sight = look_around(camera, place.scene, request.time, position, quaternion)
        lidar = look_around(PRESETS["lidar"], place.scene, request.time, position, quaternion)
        write_pictures(sight, out, where)
        write_cloud(lidar, out / "lidar.png", f"{request.scene}, seed {request.seed}")
        title = f"What sensors see: {Path(request.scene).stem}"
        write_sheet(sight, lidar, place, tour, random_key(request.seed), out / "sheet.png", title, where)
    small = sized(PRESETS[request.camera], PANEL, request.width, request.height)
    film = frames(small, place.scene, tour, PANEL if camera.projection == "pinhole" else 3 * PANEL)
    written = write_video(
        track(film, "Filming", total=len(tour.time), console=console, transient=True), out / "flight", PERIOD
    )
    console.print(f"Pictures: {out} (sheet.png has all of them)")
    console.print(f"Video: {', '.join(map(str, written))}, {tour.time[-1]:.1f} s of flight")
    return 0


def sized(camera: CameraConfig, columns: int, width: int | None, height: int | None) -> CameraConfig:
    """The camera with so many columns, or `width`; square pixels where `height` is left out. A LiDAR keeps its rays."""
    if camera.projection == "spherical":
        return dataclasses.replace(camera, width=width or camera.width, height=height or camera.height)
    width = width or columns
    square = width * math.tan(camera.fov[1] / 2) / math.tan(camera.fov[0] / 2)
    return dataclasses.replace(camera, width=width, height=height or max(_TILE * round(square / _TILE), _TILE))


def viewpoint(request: Request, tour: Any) -> tuple[np.ndarray, np.ndarray]:
    """Where the pictures are taken: as asked for, or on the flight after a tenth of it. Level but for `--pitch`."""
    i = len(tour.time) // 10
    w, x, y, z = tour.quaternion[i]
    heading = math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    yaw = heading if request.yaw is None else math.radians(request.yaw)
    pitch = math.radians(request.pitch)
    cy, sy, cp, sp = math.cos(yaw / 2), math.sin(yaw / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    position = tour.position[i] if request.position is None else np.asarray(request.position)
    return position, np.array([cy * cp, -sy * sp, cy * sp, sy * cp])


def _tour(request: Request, place: Any) -> Any:
    from e2efly.view.tour import Tour, plan

    if request.flight is None:
        return plan(place.clearance, place.route, place.straight, PERIOD)
    spline = through_points(read_csv(request.flight))
    return Tour.of(spline.position(np.arange(0.0, spline.duration, PERIOD)[None])[0], PERIOD)


def _make(out: Path) -> None:
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(f"cannot make --out {out}: {error.strerror}") from error
