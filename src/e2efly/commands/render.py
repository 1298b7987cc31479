"""`e2efly render`: pictures of what sensors see of a world, a video of a flight, or a video of a policy's flight."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import tyro

from e2efly.commands.terminal import Terminal, counted, doing
from e2efly.config.names import unknown
from e2efly.config.storage import make_folder
from e2efly.control import Quat
from e2efly.courses.references import read_csv, through_points
from e2efly.policy.zoo import beside, is_policy, names, policy_file
from e2efly.simulation.device import prepare

PERIOD = 0.05
"""Seconds between the frames of a video."""
PICTURE, PANEL = 640, 256
"""Columns of a picture and of a panel of the video."""


@dataclass(frozen=True)
class Render:
    """Draw what sensors see of a world: pictures, a contact sheet with every noise, and a video of a flight.

    For a policy: a GIF of the policy in flight, with the images of its cameras beside it, as
    `e2efly watch --video` draws it.
    """

    scene: tyro.conf.Positional[Annotated[str, tyro.conf.arg(metavar="SCENE|POLICY")]]
    """forest, clutter, room, corridor, garage, terrain, warehouse, a race track, or a scene file (.toml, .glb, .obj,
    .ply, .stl). Or a policy: a run directory, a policy.onnx, or a name of the zoo (hover, any/hover)."""
    camera: Literal["d435i", "fpv", "down", "lidar"] = "d435i"
    """The sensor of the pictures and the video: a RealSense (d435i), an FPV camera, a downward camera, or a LiDAR."""
    width: int | None = None
    """Columns of its image. If omitted, 640 (256 in the video)."""
    height: int | None = None
    """Rows of its image. If omitted, the number that gives square pixels."""
    position: tuple[float, float, float] | None = None
    """Position from which the pictures are taken, world frame, m. If omitted, the position after a tenth of the
    flight."""
    yaw: float | None = None
    """Heading for the pictures, degrees. If omitted, the flight's heading."""
    pitch: float = 0.0
    """Downward pitch for the pictures, degrees."""
    time: float = 0.0
    """Time at which the pictures are taken, s. It determines where moving objects are."""
    scene_unit: float = 1.0
    """Length unit of a mesh's file, m (0.001: mm)."""
    scene_up: Literal["y", "z"] | None = None
    """Axis of a mesh's file that points up. If omitted, the one that the file's format defines."""
    scene_materials: bool = True
    """Use a mesh's colours, materials and textures. Without them every object has the colour of its class, and their
    files may be missing."""
    seed: int = 0
    """Seed of a random world and of the noise."""
    flight: Path | None = None
    """A .csv file with columns t, x, y, z (s, m) to fly in the video. If omitted, a flight that avoids all solids."""
    out: Path | None = None
    """Folder for the files. If omitted, runs/render/SCENE."""


def run(options: Render) -> int:
    """Write the pictures, the contact sheet and the video."""
    for name, value in (("width", options.width), ("height", options.height)):
        if value is not None and not 8 <= value <= 4096:
            raise ValueError(f"--{name} is {value}; accepted: 8 to 4096 pixels")
    for name in ("position", "yaw", "pitch", "time"):
        value = getattr(options, name)
        if value is not None and not np.all(np.isfinite(value)):
            raise ValueError(f"--{name} is {value}; accepted: finite numbers")
    if is_policy(options.scene):
        return _policy(options)
    prepare()
    from e2efly.environment import random_key
    from e2efly.simulation.scenes.camera import PRESETS
    from e2efly.viewing.cloud import write_cloud
    from e2efly.viewing.image_plots import look_around, sized, write_pictures
    from e2efly.viewing.places import find_place, place_names
    from e2efly.viewing.sheet import write_sheet
    from e2efly.viewing.video import exposure_of, frames, write_video

    console = Terminal()
    if options.scene not in place_names() and not Path(options.scene).suffix:
        known = unknown("scene or policy", options.scene, [*place_names(), *names()])
        raise ValueError(f"{known}, a run directory, or the path of a scene file or a policy.onnx")
    with doing(console, "Drawing a world"):
        place = find_place(
            options.scene, random_key(options.seed), options.scene_unit, options.scene_up, options.scene_materials
        )
    out = options.out or Path("runs/render") / Path(options.scene).stem
    make_folder(out)
    with doing(console, "Planning a flight"):
        tour = _tour(options, place)
    camera = sized(PRESETS[options.camera], PICTURE, options.width, options.height)
    position, quaternion = viewpoint(options, tour)
    where = f"{options.scene}, seed {options.seed}, {options.camera} at ({', '.join(f'{x:.1f}' for x in position)}) m"
    small = sized(PRESETS[options.camera], PANEL, options.width, options.height)
    with doing(console, "Drawing pictures"):
        exposed = exposure_of(small, place.scene, tour)
        where += f", exposed x {exposed:.1f}" if exposed > 1 else ""
        sight = look_around(camera, place.scene, options.time, position, quaternion, exposed=exposed)
        lidar = look_around(PRESETS["lidar"], place.scene, options.time, position, quaternion)
        write_pictures(sight, out, where)
        write_cloud(lidar, out / "lidar.png", f"{options.scene}, seed {options.seed}")
    title = f"What sensors see: {Path(options.scene).stem}"
    with doing(console, "Drawing every noise"):
        write_sheet(sight, lidar, place, tour, random_key(options.seed), out / "sheet.png", title, where)
    film = frames(small, place.scene, tour, PANEL if camera.projection == "pinhole" else 3 * PANEL, exposed)
    written = write_video(counted(console, "Filming", film, len(tour.time)), out / "flight", PERIOD)
    console.print(f"Pictures: {out} (sheet.png has all of them)")
    console.print(f"Video: {', '.join(map(str, written))}, {tour.time[-1]:.1f} s of flight")
    return 0


def _policy(options: Render) -> int:
    """A video of a policy in flight, with the images of its cameras."""
    from e2efly.commands.watch import WatchOptions, run

    out = options.out or Path("runs/render") / beside(policy_file(options.scene)).name
    make_folder(out)
    return run(WatchOptions(what=(options.scene,), seed=options.seed, video=out / "flight.gif"))


def viewpoint(options: Render, tour: Any) -> tuple[np.ndarray, np.ndarray]:
    """The viewpoint of the pictures: as requested, or on the flight after a tenth of it. Level except for `--pitch`."""
    i = len(tour.time) // 10
    yaw = float(Quat.of(tour.quaternion[i]).yaw()) if options.yaw is None else math.radians(options.yaw)
    pitch = math.radians(options.pitch)
    position = tour.position[i] if options.position is None else np.asarray(options.position)
    return position, Quat.of_euler(*np.array([0.0, pitch, yaw])).stack()


def _tour(options: Render, place: Any) -> Any:
    from e2efly.viewing.tour import Tour, plan

    if options.flight is None:
        return plan(place.clearance, place.route, place.straight, PERIOD)
    spline = through_points(read_csv(options.flight))
    return Tour.of(spline.position(np.arange(0.0, spline.duration, PERIOD)[None])[0], PERIOD)
