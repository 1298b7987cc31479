"""What `e2efly fly` shows before a flight: the controller's settings, and with `--check` all that it receives."""

import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table
from rich.text import Text

from e2efly.commands.terminal import headed
from e2efly.flight.attitude import attitude_of
from e2efly.flight.bridge import Bridge
from e2efly.flight.commander.commander import Commander
from e2efly.flight.pilot.estimate import StateEstimate
from e2efly.flight.pilot.flight_state import Mission
from e2efly.flight.pilot.refusals import take_off_refusals
from e2efly.flight.pilot.sensing import sensed
from e2efly.flight.pose.pose_source import PoseSource
from e2efly.flight.process import printable
from e2efly.flight.row import Row, command_lines, problems
from e2efly.flight.sight.image_source import ImageSource
from e2efly.flight.sight.picture import blocks, colours, sheet, write_png
from e2efly.flight.sight.quality import SeenImages
from e2efly.flight.sight.samples import read_samples
from e2efly.policy.contract import Contract
from e2efly.policy.odometry import Sample

WIDEST = 10_000
"""The longest line of a table into a file or a pipe."""
LOOK_S, MOVED_S = 1.5, 6.0
"""How long `--check` watches poses and receiver, s, and how long at most while the vehicle is moved by hand and lags or
age are not measured yet."""
CARRIED = 0.1, 0.2
"""The vehicle counts as moved above this speed, m/s, or body rate, rad/s."""
STATUS_S, STATUSES = 1.0, 3
"""Time, s, and number of messages in which the controller may report whether it is armed, before a bridge begins."""
POSITIONS = {Mission.LAND: "low", Mission.HOVER: "middle", Mission.POLICY: "high"}
"""The positions of the mission switch."""
PICTURES = Path("flights")
"""Folder in which `--check` puts pictures of the input images of the network."""


def print_settings(console: Console, rows: tuple[Row, ...]) -> None:
    """Print each setting of the controller: its value and the required value. Below follow whole lines that can be
    pasted into the controller's command line, which ignores what begins with `#`.
    """
    table = headed("", "setting", "is", "needed")
    for row in rows:
        mark = Text("ok", "green") if row.good else Text("no", "bold red")
        mark = mark if row.told else Text("look", "yellow")
        table.add_row(mark, *map(_cell, (row.setting, row.value, row.needed)))
    print_table(console, table)
    unknown = [row for row in rows if not row.told]
    for heading, lines in (
        ("# no: type these lines into the controller's command line", command_lines(r for r in rows if not r.good)),
        (
            "# look: `get NAME` shows what these are; type the lines of those that should be as needed",
            command_lines(unknown),
        ),
    ):
        for line in (heading, *lines, "save") if lines else ():
            console.print(line, markup=False, highlight=False, soft_wrap=True)


def look(
    bridge: Bridge,
    source: PoseSource,
    console: Console,
    rows: tuple[Row, ...],
    policy: Path | None = None,
    contract: Contract | None = None,
) -> int:
    """Watch poses, images, receiver and attitude for a while, and say what forbids a take-off. Sends no stick commands.

    Args:
        bridge: the bridge that would fly.
        source: the source of its poses.
        console: where the table is printed.
        rows: the controller's settings.
        policy: the file of the policy, beside which images from its training may lie. None: there is no policy.
        contract: the contract of the policy.

    Returns:
        1 when a setting, missing poses or a sensing that the policy was not trained for forbid a take-off, else 0.
    """
    bridge.look(time.monotonic())  # the first step takes long, and what comes meanwhile may be too much for one reading
    source.read(time.monotonic())
    start, poses, refused = time.monotonic(), list[Sample](), source.refused
    times: list[set[float]] = [set() for _ in bridge.cameras]
    while (now := time.monotonic()) < start + LOOK_S or (now < start + MOVED_S and _tells_more(bridge)):
        poses += bridge.look(now)
        for taken, seen in zip(times, bridge.seen, strict=True):
            taken |= {seen.frame.time} if seen.frame is not None else set()
        time.sleep(0.005)
    table = Table(box=None, show_header=False, pad_edge=False)
    _add_poses(table, bridge, source, poses, source.refused - refused)
    if bridge.odometry is not None:
        add_sensing(table, bridge.estimate, contract)
    add_images(table, bridge, [len(taken) / (now - start) for taken in times], policy)
    if (others := bridge.neighbours) is not None:
        here = None if bridge.odometry is None else bridge.odometry.position
        good = f"{len(others.sources)} seen; needed: {others.needs.told}"
        table.add_row("others", _cell(others.problem(now, here, begins=True) or good))
    if isinstance(bridge.worker, Commander):
        table.add_row("commands", _cell(_commands(bridge.worker, bridge)))
    pilot = bridge.inputs.pilot
    heard = "not heard"
    if pilot is not None:
        sticks = ", ".join(f"{name} {getattr(pilot, name):+.2f}" for name in ("roll", "pitch", "throttle", "yaw"))
        heard = f"mission {POSITIONS[pilot.mission]} ({pilot.mission}); {sticks}"
    table.add_row("receiver", heard)
    table.add_row("battery", f"{bridge.inputs.voltage:.2f} V per cell" if bridge.inputs.voltage else "unknown")
    error = bridge.inputs.attitude_error
    unknown = "not compared: no poses" if bridge.odometry is None else "not heard"
    table.add_row("attitude", unknown if error is None else f"controller and poses differ by {error:.3f} rad")
    print_table(console, table)
    refusals = take_off_refusals(bridge.settings, bridge.flight, bridge.inputs)
    console.print("What stands against a take-off now:" if refusals else "Nothing stands against a take-off.")
    for refusal in refusals:
        console.print(f"  - {printable(refusal)}")
    return 1 if problems(rows) or bridge.odometry is None or bridge.inputs.sensing_problem else 0


def _tells_more(bridge: Bridge) -> bool:
    """Whether the vehicle is moved, and something of the sensing is not measured yet."""
    o = bridge.odometry
    if o is None or all(part.seconds is not None for part in sensed(bridge.estimate)):
        return False
    return any(float(np.linalg.norm(x)) > most for x, most in zip((o.velocity, o.body_rate), CARRIED, strict=True))


def refuse_in_flight(bridge: Bridge) -> None:
    """Refuse to begin when the controller would obey at once: the first frame of a bridge closes the throttle.

    A bridge that a service manager restarts while the vehicle flies must not take it over. Sends no stick commands.

    Args:
        bridge: the bridge that is about to begin.

    Raises:
        ValueError: when the controller is armed and its override is on.
    """
    end, before = time.monotonic() + STATUS_S, bridge.autopilot.statuses
    while (now := time.monotonic()) < end and bridge.autopilot.statuses < before + STATUSES:
        bridge.look(now)
        time.sleep(0.005)
    if bridge.inputs.armed and bridge.inputs.override:
        raise ValueError(
            "the controller is armed and its override is on, so that the first frame, which closes the throttle, would "
            "stop the motors; accepted: disarmed, or override low. If a watchdog is landing the vehicle, let it"
        )


def _add_poses(table: Table, bridge: Bridge, source: PoseSource, poses: list[Sample], refused: int) -> None:
    o = bridge.odometry
    if o is None:
        table.add_row("poses", _cell(f"none good from {source.describe()}: {bridge.inputs.odometry_problem}"))
        return
    place, at = o.position.round(3).tolist(), attitude_of(*o.quaternion.tolist())
    age = sum(s.received - (s.stamp or s.received) for s in poses) / max(len(poses), 1)
    pace = bridge.estimate.pace
    said = f"{pace.rate:.0f} Hz from {source.describe()}, refused {refused}"
    table.add_row("poses", _cell(f"{said}; the newest was up to {1e3 * pace.oldest:.0f} ms old"))
    table.add_row("", _cell(f"position {place} m, roll {at.roll:+.2f}, pitch {at.pitch:+.2f} rad"))
    if poses and poses[-1].stamp is not None:
        table.add_row("", f"arrival after stamp {1e3 * age:.1f} ms (where both clocks are one)")


def add_sensing(table: Table, estimate: StateEstimate, contract: Contract | None) -> None:
    """Lags, age and holes of the poses as measured, beside what the training of a policy covered."""
    for part in sensed(estimate):
        covered = None if contract is None else part.covered(contract.sensing)
        mark = "no: " if contract is not None and part.problem(contract.sensing) else ""
        trained = "" if covered is None else f"; the policy is for up to {1e3 * covered:.0f} ms"
        table.add_row(part.name.replace("_", " "), f"{mark}{part.said}{trained}")
    if contract is not None:
        if contract.sensing is None:
            table.add_row("", "which lags, ages and holes its training covered, the policy's file does not state")
        states, delay = map(_milliseconds, (contract.observation_latency_range_s, contract.latency_range_s))
        table.add_row("", f"the policy was trained with states {states} old, and {delay} from observation to command")


def _milliseconds(span: Sequence[float]) -> str:
    """A range of times, s, in words."""
    low, high = (f"{1e3 * x:.0f}" for x in span)
    return f"{low} ms" if low == high else f"{low} to {high} ms"


def add_images(table: Table, bridge: Bridge, rates: list[float], policy: Path | None) -> None:
    """What each camera of a policy shows, and how the camera of its training was mounted."""
    now = time.monotonic()
    for camera, seen, rate in zip(bridge.cameras, bridge.seen, rates, strict=True):
        table.add_row("image", _cell(_image(camera, seen, now, rate)))
        table.add_row("", _cell(f"trained with a camera: {seen.camera.mount}"))
        if seen.frame is not None:
            pixels, path = colours(seen.frame.image, seen.camera), PICTURES / f"check_{seen.camera.name}.png"
            trained = None if policy is None else read_samples(policy, seen.camera)
            shown = [] if trained is None else [colours(image, seen.camera) for image in trained]
            write_png(path, sheet(pixels, shown))
            table.add_row("", blocks(sheet(pixels, shown[:1])))
            beside = "; beside it, what it was shown in training" if shown else "; of its training no images are kept"
            table.add_row("", _cell(f"what the network is shown{beside}; larger: {path}"))


def _image(camera: ImageSource, seen: SeenImages, now: float, rate: float) -> str:
    """What a camera shows, in words."""
    said = seen.problem(now)
    if said is not None or seen.frame is None:
        return f"not to be flown by, from {camera.describe()}: {said}"
    image, age = seen.frame.image, 1e3 * (now - seen.frame.time)
    values = f"values {image.min():.2f} to {image.max():.2f}, mean {image.mean():.2f}"
    ages = _milliseconds(seen.camera.latency_range_s)
    trained = f"{age:.0f} ms old (trained with {ages}), {rate:.0f} Hz ({seen.camera.rate_hz:g})"
    note = f"; {camera.problem}" if camera.problem else ""
    return f"{seen.camera.name} from {camera.describe()}: {values}; {trained}{note}"


def _commands(commander: Commander, bridge: Bridge) -> str:
    """What a commander sends, in words."""
    stream, now, where = commander.stream, time.monotonic(), commander.source.describe()
    counted = f"{stream.taken} accepted, {stream.refused} refused, from {where}"
    if bridge.odometry is not None and (problem := commander.readiness(bridge.odometry, now)):
        return f"{counted}; it could not take over now: {problem}"
    mode = f"; the newest: {stream.command.mode}, {1e3 * stream.age(now):.0f} ms old" if stream.command else ""
    return f"{counted}{mode}"


def print_table(console: Console, table: Table) -> None:
    """Print a table. Into a file or a pipe its lines are whole, however long they are."""
    if not console.is_terminal:
        table.width = Measurement.get(console, console.options.update(width=WIDEST), table).maximum
    console.print(table, soft_wrap=True)


def _cell(text: str) -> Text:
    """Text for a table cell. It may come from outside, such as a craft name: escape sequences are removed."""
    return Text(printable(text))
