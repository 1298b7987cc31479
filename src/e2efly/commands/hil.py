"""`e2efly hil`: hardware in the loop."""

import dataclasses
import math
import os
import socket
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import tyro

from e2efly.commands.hil_rehearsal import check_rehearsal, rehearse
from e2efly.commands.policies import Asked, asked_of
from e2efly.config import TaskConfig
from e2efly.courses.origin import Origin
from e2efly.process import be_punctual, raise_at_interrupt
from e2efly.storage import write_json
from e2efly.tasks.route import route_of
from e2efly.terminal import Terminal
from e2efly.validation.room import Victim, flags
from e2efly.vehicles import load_vehicle

if TYPE_CHECKING:
    from e2efly.deploy.child import Child
    from e2efly.deploy.sight.give import Output
    from e2efly.validation.hil import Node
    from e2efly.validation.scenery import Scenery

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
    image: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Where each image goes, as often as wanted: image_0=shm:NAME, tcp:PORT (tcp:PORT:exact: not rounded to mm),
    ros1:/topic, ros2:/topic."""
    host: str = "127.0.0.1"
    """Address on which tcp is served; 0.0.0.0: to every computer of the network."""
    vehicle: str | None = None
    """A shipped vehicle or a .toml file; left out: the policy's."""
    seed: int = 0
    """Of the world."""
    task: TaskConfig = TaskConfig()
    """The world, in place of what the policy's run or contract says: options of its task, as `train` has them
    (--task.track my.toml, --task.speed 4 5, --task.clutter.obstacles 8)."""
    scene: str | None = None
    """Show this in place of the task's world: a scan or model (.glb, .gltf, .obj, .ply, .stl), a scene file (.toml),
    or warehouse, garage, terrain. The course stays the task's."""
    scene_unit: float | None = None
    """Length of the unit of a scan's file, m (0.001: mm); 1 when left out."""
    scene_up: Literal["y", "z"] | None = None
    """Axis of a scan's file that points up; as its format has it when left out."""
    beside: bool = False
    """Show what stands in the task's world (gates, trees, a pad) beside the scene."""
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
    watch: int | None = None
    """Port of a page of 127.0.0.1 that shows the vehicle in the scene, by a process of its own. See docs/watch.md."""
    record: Path | None = None
    """A new .mcap file with the images, their poses, latencies and virtual collisions."""
    report: Path | None = None
    """Folder for a histogram of the latencies, latency.png, and their numbers, latency.json."""
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
    link_delay: float | None = None
    """How late what the bridge sends reaches the vehicle in the rehearsal, s: its radio. Left out: so late that the
    whole is the vehicle's latency; 0 for a bridge on board."""
    out: Path | None = None
    """Folder of the rehearsal's report; left out: a new one in the folder `rehearsals`."""


def parse(arguments: list[str]) -> Asked:
    """The options of `hil`; the defaults of `--task` are what the policy's run or contract says.

    Raises:
        ValueError: for unknown names, and for a policy that is not there.
    """
    return asked_of(Hil, "hil", arguments)


def run(asked: Asked) -> int:
    """Render until the time is out.

    Raises:
        ValueError: naming the option, its value and what is accepted.
        OSError: when the shared memory cannot be written.
    """
    o, console = asked.options, Terminal()
    check_rehearsal(o)
    if o.scene is None:
        for option in ("scene_unit", "scene_up", "beside"):
            if value := getattr(o, option):
                raise ValueError(f"--{option.replace('_', '-')} is {value}; accepted: only with --scene")
    if o.rate is not None and not 1 <= o.rate <= FASTEST:
        raise ValueError(f"--rate is {o.rate}; accepted: 1 to {FASTEST:g} Hz")
    if o.seconds is not None and not o.seconds > 0:
        raise ValueError(f"--seconds is {o.seconds}; accepted: more than 0")
    origin = Origin(o.origin, o.origin_yaw) if o.points is None else _measured(o.points)
    if o.rehearse:
        return rehearse(o, asked.task, origin)
    from e2efly.deploy.child import Child
    from e2efly.deploy.pose.sources import open_source
    from e2efly.deploy.sight.give import give, outputs
    from e2efly.deploy.sight.record import Recorder
    from e2efly.deploy.sight.shared import SharedImages
    from e2efly.device import compute_at_once, prepare
    from e2efly.evaluation import candidate
    from e2efly.validation.hil import Node
    from e2efly.validation.scenery import Scenery

    raise_at_interrupt()
    compute_at_once()
    prepare("cpu")
    found = candidate(o.policy, o.vehicle, task=asked.task)
    images = found.policy.contract.images
    if not images:
        raise ValueError(f"policy {o.policy} sees nothing; accepted: a policy with images")
    chosen, body = outputs(o.image, found.policy.contract), load_vehicle(found.vehicle)
    names = [_memory(image.name, chosen[image.name]) for image in images]
    suite = next(iter(found.task.criteria().values()))
    with console.status("drawing the world"):
        scenery = Scenery.draw(found.environment(suite), o.seed)
    assert scenery is not None
    scenery = _where(o, scenery, found.policy.contract.task, float(body.radius), console)
    goal = flags("goal", dataclasses.replace(
        route_of(found.policy.contract).drawn(scenery.course, o.track), origin=origin.position, origin_yaw=origin.yaw,
    ))  # fmt: skip
    with ExitStack() as stack:
        source = open_source(o.pose)
        stack.callback(source.close)
        published, givers, given = list[SharedImages](), dict[str, Child](), list[str]()
        for image, name in zip(images, names, strict=True):
            published.append(SharedImages(name, image.shape))
            stack.callback(published[-1].close)
            for output in chosen[image.name]:
                where = f"{output.kind}:{output.where}"
                if output.kind == "shm":
                    given.append(f"--image {image.name}={where}")
                    continue
                givers[f"{image.name}={where}"] = child = give(image, name, output, o.host)
                stack.callback(child.close)
                seen = f"hil:{_reached(o.host)}:{output.where}" if output.kind == "tcp" else where
                given.append(f"--image {image.name}={seen}")
            if all(output.kind != "shm" for output in chosen[image.name]):
                stack.callback(published[-1].path.unlink, missing_ok=True)  # nobody else knows the name
        rate = o.rate or images[0].rate_hz
        node = Node(scenery, source, published, origin, rate, float(body.radius))
        if o.record is not None:
            recorder = Recorder(o.record, images, names)
            stack.callback(recorder.close)
            givers[f"--record {o.record}"], node.tell = recorder.child, recorder.tell
        if o.watch is not None:
            _watch(node, o, bool(asked.task), stack, console)
        node.warm()
        be_punctual(PRIORITY)
        source.read(time.monotonic())  # what came while it compiled is old
        console.print(f"{rate:g} Hz, poses from {source.describe()}. Fly it with:")
        console.print(f"  {' '.join([*goal, *given])}")
        try:
            _loop(node, o.seconds, console, givers)
        except KeyboardInterrupt:
            console.print("Ended.")
        _tell(node, console)
        if o.report is not None:
            _report(node, o.report)
        if o.json:
            measured = {"began": node.began, "pose_to_image_s": node.latencies, "collisions": node.collisions}
            write_json(o.json, measured)
    return 0


def _where(o: Hil, scenery: "Scenery", task: str, radius: float, console: Terminal) -> "Scenery":
    """The scenery in the world that the options name, with ground below its course.

    Raises:
        ValueError: naming the world, what is wrong with it and what is accepted.
    """
    from e2efly.validation.scene_files import SceneFile, ground_of

    if o.scene is None:
        ground_of(scenery, f"the world of task {task}", radius)
        return scenery
    scenery = SceneFile(o.scene, o.scene_unit, o.scene_up, o.beside).put(scenery)
    ground = ground_of(scenery, f"scene {o.scene}", radius)
    console.print(f"Scene {o.scene}: the ground is {ground.depth:.2f} m below the start.")
    if math.isfinite(ground.ends):
        console.print(f"It has no ground under the way to the first goal from {ground.ends:.1f} m on.")
    return scenery


def _watch(node: "Node", o: Hil, other_world: bool, stack: ExitStack, console: Terminal) -> None:
    """Show each pose of the scene on a page, beside what is told already; and the world, where that is the policy's."""
    from e2efly.watch.beside import Shown

    same = not other_world and o.scene is None
    world = ["--world", str(o.policy), "--seed", str(o.seed)] if same else []
    shown, tell = Shown(o.watch or 0, *world, *(["--vehicle", o.vehicle] if o.vehicle else [])), node.tell
    stack.callback(shown.close)
    console.print(f"watch it at {shown.page.address}")

    def both(topic: str, message: dict[str, Any]) -> None:
        tell(topic, message)
        if topic == "shown":
            shown.show(message["time"], message["scene_position"], message["scene_quaternion"])

    node.tell = both


def _loop(node: "Node", seconds: float | None, console: Terminal, givers: dict[str, "Child"]) -> None:
    end, told = time.monotonic() + (seconds or float("inf")), None
    while (now := time.monotonic()) < end:
        said = node.step(now, time.monotonic)
        if said is not None and said != told:
            console.print(said)
            node.tell("event", {"time": now, "text": said})
            told = said
        for name in [name for name, giver in givers.items() if giver.lines() is not None and giver.ended]:
            console.print(f"{name}: {givers.pop(name).ended}; the others go on")
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


def _report(node: "Node", folder: Path) -> None:
    """The latencies as a picture and as JSON."""
    from e2efly.view.latency import plot_latencies

    if len(node.times) < 2:
        return
    folder.mkdir(parents=True, exist_ok=True)
    late, rate = np.array(node.latencies), (len(node.times) - 1) / (node.times[-1] - node.times[0])
    plot_latencies(late, rate, folder / "latency.png")
    p50, p99 = np.quantile(late, (0.5, 0.99))
    numbers = {"images": len(late), "rate_hz": rate, "p50_s": p50, "p99_s": p99, "max_s": late.max()}
    write_json(folder / "latency.json", {name: float(x) if name != "images" else x for name, x in numbers.items()})


def _memory(image: str, outputs: "list[Output]") -> str:
    """Name of the shared memory of an image: the one that was given, or one of this process."""
    return next((output.where for output in outputs if output.kind == "shm"), f"hil-{os.getpid()}-{image}")


def _reached(host: str) -> str:
    """The address by which others reach this computer, as far as it is known."""
    return socket.gethostname() if host in ("0.0.0.0", "::") else host


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
