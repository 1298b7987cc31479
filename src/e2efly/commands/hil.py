"""`e2efly hil`: hardware in the loop."""

import dataclasses
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import tyro

from e2efly.commands.hil_rehearsal import check_rehearsal, rehearse
from e2efly.courses.origin import Origin
from e2efly.process import be_punctual, raise_at_interrupt
from e2efly.storage import write_json
from e2efly.tasks.route import route_of
from e2efly.terminal import Terminal
from e2efly.validation.room import Victim, flags
from e2efly.vehicles import load_vehicle

if TYPE_CHECKING:
    from e2efly.deploy.policy.contract import Contract
    from e2efly.validation.hil import Node

_ROW = "six numbers, room_x,room_y,room_z,x,y,z"
PRIORITY = 4
"""Real-time priority of the rendering: below the bridge's."""
FASTEST = 240.0
"""Largest rate of images, Hz."""


@dataclass(frozen=True)
class Hil:
    """Put a real vehicle into a virtual world: images of it, rendered at the poses that a motion capture system sees.

    Fly the policy beside it with `e2efly fly POLICY --image NAME=shm:...`, which reads the images. See docs/hil.md.
    """

    policy: tyro.conf.Positional[Path]
    """Whose cameras and world are rendered: a policy.onnx, a run directory, or a task of the zoo."""
    pose: str = "udp:9870"
    """Pose source, as of `e2efly fly`."""
    image: tuple[str, ...] = ()
    """Where each image goes, image_0=shm:NAME."""
    vehicle: str | None = None
    """A shipped vehicle or a .toml file; left out: the policy's."""
    seed: int = 0
    """Of the world."""
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the origin of the world lies in the room, m; as --goal.origin of `e2efly fly`."""
    origin_yaw: float = 0.0
    """By how much its x axis is turned from the room's about up, rad."""
    points: Path | None = None
    """In place of both: a CSV file with a row room_x,room_y,room_z,x,y,z for each point measured in the room, m."""
    rate: float | None = None
    """Images per second; the contract's when left out."""
    seconds: float | None = None
    """End after so long; left out: at Ctrl-C."""
    track: Path = Path("flights") / "hil-track.toml"
    """Where to write the gates of a drawn race, for --goal.track of `e2efly fly`; other tasks write nothing."""
    json: Path | None = None
    """Write at the end what was measured to this file."""
    rehearse: bool = False
    """Fly it first without hardware: a simulated motion capture system, this command, `e2efly fly` and the real
    firmware as processes, in real time. The options below are its own."""
    laps: int = 1
    """Flights of the rehearsal, each in another world, from --seed on."""
    kill: Victim | None = None
    """Kill one of the processes in each flight while the policy flies, to see what happens then."""
    pose_delay: float = 0.004
    """How late the poses of the rehearsal come, s: what cameras and network of your room take."""
    out: Path | None = None
    """Folder of the rehearsal's report; left out: a new one in the folder `rehearsals`."""


def run(options: Hil) -> int:
    """Render until the time is out.

    Raises:
        ValueError: naming the option, its value and what is accepted.
        OSError: when the shared memory cannot be written.
    """
    o, console = options, Terminal()
    check_rehearsal(o)
    if o.rate is not None and not 1 <= o.rate <= FASTEST:
        raise ValueError(f"--rate is {o.rate}; accepted: 1 to {FASTEST:g} Hz")
    if o.seconds is not None and not o.seconds > 0:
        raise ValueError(f"--seconds is {o.seconds}; accepted: more than 0")
    origin = Origin(o.origin, o.origin_yaw) if o.points is None else _measured(o.points)
    if o.rehearse:
        return rehearse(o, origin)
    from e2efly.deploy.pose.sources import open_source
    from e2efly.deploy.sight.shared import SharedImages
    from e2efly.device import compute_at_once, prepare
    from e2efly.evaluation import candidate
    from e2efly.validation.hil import Node
    from e2efly.validation.scenery import Scenery

    raise_at_interrupt()
    compute_at_once()
    prepare("cpu")
    found = candidate(o.policy, o.vehicle)
    images = found.policy.contract.images
    if not images:
        raise ValueError(f"policy {o.policy} sees nothing; accepted: a policy with images")
    names, body = _names(o.image, found.policy.contract), load_vehicle(found.vehicle)
    suite = next(iter(found.task.criteria().values()))
    with console.status("drawing the world"):
        scenery = Scenery.draw(found.environment(suite), o.seed)
    assert scenery is not None
    goal = flags("goal", dataclasses.replace(
        route_of(found.policy.contract).drawn(scenery.course, o.track), origin=origin.position, origin_yaw=origin.yaw,
    ))  # fmt: skip
    with ExitStack() as stack:
        source = open_source(o.pose)
        stack.callback(source.close)
        outputs = [SharedImages(name, image.shape) for name, image in zip(names, images, strict=True)]
        for output in outputs:
            stack.callback(output.close)
        rate = o.rate or images[0].rate_hz
        node = Node(scenery, source, outputs, origin, rate, float(body.radius))
        node.warm()
        be_punctual(PRIORITY)
        given = [f"--image {image.name}=shm:{name}" for image, name in zip(images, names, strict=True)]
        console.print(f"{rate:g} Hz, poses from {source.describe()}. Fly it with:")
        console.print(f"  {' '.join([*goal, *given])}")
        try:
            _loop(node, o.seconds, console)
        except KeyboardInterrupt:
            console.print("Ended.")
        _tell(node, console)
        if o.json:
            measured = {"began": node.began, "pose_to_image_s": node.latencies, "collisions": node.collisions}
            write_json(o.json, measured)
    return 0


def _loop(node: "Node", seconds: float | None, console: Terminal) -> None:
    end, told = time.monotonic() + (seconds or float("inf")), None
    while (now := time.monotonic()) < end:
        said = node.step(now, time.monotonic)
        if said is not None and said != told:
            console.print(said)
            told = said
        time.sleep(0.001)


def _tell(node: "Node", console: Terminal) -> None:
    if not node.latencies:
        console.print("No image was published.")
        return
    ms = 1e3 * np.array(node.latencies)
    middle, late = np.quantile(ms, (0.5, 0.99))
    console.print(
        f"{len(ms)} images; from the newest pose to the image {middle:.1f} ms (median), {late:.1f} ms (p99), "
        f"{ms.max():.1f} ms at most; {node.collisions} virtual collisions."
    )


def _names(texts: tuple[str, ...], contract: "Contract") -> list[str]:
    """The shared memory of each image."""
    from e2efly.deploy.sight.sources import by_image

    chosen, names = by_image(texts, contract), list[str]()
    for image in contract.images:
        if image.name not in chosen:
            raise ValueError(f"--image lacks {image.name}; accepted: --image {image.name}=shm:NAME")
        kind, _, name = chosen[image.name].partition(":")
        if kind != "shm" or not name or name in names:
            said = f"--image is {image.name}={chosen[image.name]}"
            raise ValueError(f"{said}; accepted: {image.name}=shm:NAME, another name for each image")
        names.append(name)
    return names


def _measured(path: Path) -> Origin:
    """The origin by measured points.

    Raises:
        ValueError: naming the file and what is wrong with it.
    """
    try:
        rows = np.loadtxt(path, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise ValueError(f"--points {path}: {error}; accepted: rows of {_ROW}") from None
    if rows.shape[1:] != (6,):
        raise ValueError(f"--points {path}: has rows of {rows.shape[1]} numbers; accepted: {_ROW}")
    try:
        return Origin.fitted(rows[:, :3], rows[:, 3:])
    except ValueError as error:
        raise ValueError(f"--points {path}: {error}") from None
