"""`e2efly hil`: hardware in the loop."""

import dataclasses
import math
import os
import socket
import time
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from e2efly.commands.hil_options import Hil
from e2efly.commands.hil_rehearsal import check_rehearsal, rehearse
from e2efly.commands.policies import Asked, asked_of
from e2efly.commands.terminal import Terminal
from e2efly.config.storage import write_json
from e2efly.courses.origin import Origin
from e2efly.flight.pilot.fence import check_course
from e2efly.flight.process import be_punctual, raise_at_interrupt
from e2efly.flight.settings import Fence, check_fence
from e2efly.tasks.route import course_for, route_of
from e2efly.validation.processes import flags
from e2efly.vehicles.loading import load_vehicle

if TYPE_CHECKING:
    from e2efly.flight.child import Child
    from e2efly.flight.sight.outputs import Output
    from e2efly.validation.scenery import Scenery
    from e2efly.validation.virtual_world import Node

_ROW = "six numbers, room_x,room_y,room_z,x,y,z"
PRIORITY = 4
"""Real-time priority of the rendering: lower than the bridge's."""
FASTEST = 240.0
"""Largest rate of images, Hz."""


def parse(arguments: list[str]) -> Asked:
    """The options of `hil`. The defaults of `--task` come from the policy's run or contract.

    Raises:
        ValueError: for unknown names, and for a policy that does not exist.
    """
    return asked_of(Hil, "hil", arguments)


def run(asked: Asked) -> int:
    """Render until the time is over.

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
        if not o.scene_materials:
            raise ValueError("--no-scene-materials is given; accepted: only with --scene")
    if o.rate is not None and not 1 <= o.rate <= FASTEST:
        raise ValueError(f"--rate is {o.rate}; accepted: 1 to {FASTEST:g} Hz")
    if o.seconds is not None and not o.seconds > 0:
        raise ValueError(f"--seconds is {o.seconds}; accepted: more than 0")
    origin = Origin(o.origin, o.origin_yaw) if o.points is None else _measured(o.points)
    fence = _fence(o)
    if o.rehearse:
        return rehearse(o, asked.task, origin, fence)
    from e2efly.flight.child import Child
    from e2efly.flight.pose.sources import open_source
    from e2efly.flight.sight.outputs import give, outputs
    from e2efly.flight.sight.recorder import Recorder
    from e2efly.flight.sight.shared import SharedImages
    from e2efly.simulation.device import compute_at_once, prepare
    from e2efly.validation.candidate import candidate
    from e2efly.validation.scenery import Scenery
    from e2efly.validation.virtual_world import Node

    raise_at_interrupt()
    compute_at_once()
    prepare("cpu")
    found = candidate(o.policy, o.vehicle, task=asked.task)
    for note in found.notes:
        console.print(note, style="dim")
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
    route = dataclasses.replace(
        route_of(found.policy.contract).drawn(scenery.course, o.track),
        origin=origin.position, origin_yaw=origin.yaw, outside=bool(found.outside),
    )  # fmt: skip
    course = course_for(found.policy.contract, body, route)
    if fence is not None:
        check_course(fence, course)
    goal = flags("goal", route) + ([] if fence is None else flags("flight.fence", fence))
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
        console.print(f"The course needs {course.needs}.")
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


def _fence(o: Hil) -> Fence | None:
    """The fence that the options give. None: they give none."""
    if o.fence_low is None and o.fence_high is None:
        return None
    fence = Fence(o.fence_low or Fence().low, o.fence_high or Fence().high)
    check_fence(fence)
    return fence


def _where(o: Hil, scenery: "Scenery", task: str, radius: float, console: Terminal) -> "Scenery":
    """The scenery in the world that the options name, with ground below its course."""
    from e2efly.validation.scene_files import SceneFile, ground_of

    if o.scene is None:
        ground_of(scenery, f"the world of task {task}", radius)
        return scenery
    scenery = SceneFile(o.scene, o.scene_unit, o.scene_up, o.scene_materials, o.beside).put(scenery)
    ground = ground_of(scenery, f"scene {o.scene}", radius)
    console.print(f"Scene {o.scene}: the ground is {ground.depth:.2f} m below the start.")
    if math.isfinite(ground.ends):
        console.print(f"It has no ground under the way to the first goal from {ground.ends:.1f} m on.")
    return scenery


def _watch(node: "Node", o: Hil, other_world: bool, stack: ExitStack, console: Terminal) -> None:
    """Show each pose of the scene on a page, besides what is reported already, and the world if it is the policy's."""
    from e2efly.viewing.watch.beside import Shown

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
    from e2efly.viewing.latencies import plot_latencies

    if len(node.times) < 2:
        return
    folder.mkdir(parents=True, exist_ok=True)
    late, rate = np.array(node.latencies), (len(node.times) - 1) / (node.times[-1] - node.times[0])
    plot_latencies(late, rate, folder / "latency.png")
    p50, p99 = np.quantile(late, (0.5, 0.99))
    numbers = {"images": len(late), "rate_hz": rate, "p50_s": p50, "p99_s": p99, "max_s": late.max()}
    write_json(folder / "latency.json", {name: float(x) if name != "images" else x for name, x in numbers.items()})


def _memory(image: str, outputs: "list[Output]") -> str:
    """Name of the shared memory of an image: the given name, or a name that belongs to this process."""
    return next((output.where for output in outputs if output.kind == "shm"), f"hil-{os.getpid()}-{image}")


def _reached(host: str) -> str:
    """The address at which other computers reach this one, as far as it is known."""
    return socket.gethostname() if host in ("0.0.0.0", "::") else host


def _measured(path: Path) -> Origin:
    """The origin from measured points."""
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
