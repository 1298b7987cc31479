"""`e2efly fly`: no JAX, so that it starts at once on a companion computer."""

import dataclasses
import sys
import time
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro

from e2efly.commands.fly_check import look, print_settings, refuse_in_flight
from e2efly.commands.fly_meta import record_meta
from e2efly.commands.options import parse as parse_options
from e2efly.commands.terminal import Terminal
from e2efly.flight.autopilots import check_link, open_autopilot
from e2efly.flight.bridge import Bridge
from e2efly.flight.commander.commander import Commander, CommandSource
from e2efly.flight.commander.sources import open_commands
from e2efly.flight.excitation import NAMES, ExcitationOptions, StepsOptions, excitation
from e2efly.flight.filter.filter import Filter, fastest
from e2efly.flight.flight_loop import LOWEST_RATE, Timing, fly, loop_rate
from e2efly.flight.log_record import Logs
from e2efly.flight.operator import Speaker, Stop
from e2efly.flight.pilot import throttle_map
from e2efly.flight.pilot.fence import check_course
from e2efly.flight.pilot.hovering import DEFAULT, hover_controller
from e2efly.flight.pose.neighbours import Neighbours
from e2efly.flight.pose.pose_source import AidedSource, drifts
from e2efly.flight.pose.sources import open_source
from e2efly.flight.process import raise_at_interrupt
from e2efly.flight.publish import Live, targets_of
from e2efly.flight.row import problems
from e2efly.flight.service import Service
from e2efly.flight.settings import FlightSettings
from e2efly.flight.settings import check as check_settings
from e2efly.flight.sight.sources import open_cameras
from e2efly.logs.telemetry import Telemetry
from e2efly.policy.loader import Policy, load_policy
from e2efly.policy.others import USUAL
from e2efly.policy.runtime import Envelope, Runtime, check
from e2efly.policy.worker import PolicyWorker
from e2efly.policy.zoo import FOLDER, policy_file
from e2efly.runs.rundir import run_of
from e2efly.tasks.route import Route, course_for, fields_of, goal_notes, route_of
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle
from e2efly.vehicles.vehicle_rules import check_quadrotor

SLOWEST = 0.5
"""Largest `--latency`, s: with more delay no gains hold a hover."""
NOWHERE = (
    "Nobody knows where the vehicle is: no fence holds it, the policy's flight ends by your mission switch, and the "
    "hover and the landing after it drift. Have the override switch at hand. It must not fly higher than the top of "
    "the fence (--flight.fence.high): a landing takes that for its height."
)
"""What `--pose imu` cannot promise."""

if TYPE_CHECKING:
    from e2efly.viewing.watch.beside import Shown


@dataclass(frozen=True)
class Fly:
    """Fly a quadrotor with Betaflight, PX4 or ArduCopter, or a Crazyflie. The pilot decides: see docs/flying.md."""

    policy: tyro.conf.Positional[Annotated[Path | None, tyro.conf.arg(metavar="[POLICY]")]] = None
    """A policy.onnx, a run directory, or a task (the zoo's policy). In place of a policy, `excitation` flies the
    manoeuvres that identification needs, and `steps` those that alignment needs. If omitted: take-off, hover and
    landing only.
    `e2efly fly POLICY --help-all` also lists the options of the policy's goal."""
    link: str = "/dev/ttyACM0"
    """Connection to the flight controller: /dev/ttyACM0, serial:/dev/ttyS1?baud=921600 or tcp:HOST:PORT (Betaflight).
    mavlink:udp:HOST:PORT, mavlink:udpout:HOST:PORT or mavlink:/dev/ttyACM0: PX4 or ArduCopter (docs/mavlink.md).
    radio://0/80/2M/E7E7E7E7E7 or crazyflie:udp:HOST:PORT: a Crazyflie (docs/crazyflie.md). Or your own autopilot,
    path/to/file.py:Name[:...]."""
    pose: str = "udp:9870"
    """Pose source: udp:PORT, tcp:HOST:PORT, mocap:TYPE:HOST:BODY, ros1:/topic, ros2:/topic, gates:EYE.toml@IMAGE, or
    your own source, path/to/file.py:Name[:...]. imu: none, for a policy that is told neither place nor velocity
    (docs/eyes.md)."""
    others: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Pose source of each other vehicle, for policies that observe others, such as those of `swap`. One that is not
    seen for a second ends the policy's flight."""
    image: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Source of each image that the policy's contract asks for, for policies with cameras: image_0=realsense:[SERIAL],
    v4l2:/dev/videoN?fov=AxB, ros1:/topic, ros2:/topic, hil:HOST:PORT, shm:NAME (shared memory that another program
    writes), aigp:HOST:PORT (JPEG in datagrams), mask:...@URI (a mask made from one of these), or your own source,
    path/to/file.py:Name[:...]. See docs/image-sources.md."""
    commands: str | None = None
    """Source of commands from another program, which flies in place of a policy: udp:PORT, ros1:/topic, ros2:/topic, or
    your own source, path/to/file.py:Name[:...]."""
    vehicle: str | None = None
    """A shipped vehicle or a .toml file. If omitted, the policy's vehicle."""
    check: bool = False
    """Only check, and send no stick commands. Print every relevant setting, its value and the required value, and the
    lines that correct them."""
    log: Path | None = None
    """Flight log to write. If omitted, flights/DATE.mcap."""
    live: tyro.conf.UseAppendAction[tuple[str, ...]] = ()
    """Where to publish the flight live: foxglove[:[HOST:]PORT], ros1[:/PREFIX], ros2[:/PREFIX], mcap:FILE.mcap or
    bag:FILE.bag. May be repeated. See docs/telemetry.md."""
    watch: int | None = None
    """Port on 127.0.0.1 for a web page that shows the vehicle in flight. A separate process serves it. See
    docs/watch.md."""
    throttle_map: Path | None = None
    """Throttle map that an earlier flight learned (.throttle.json)."""
    watchdog: bool = True
    """Let a separate process hold the link, and land the vehicle if this process dies; do not fly without it."""
    guard: Literal["switch", "filter"] = "switch"
    """What keeps a policy inside the fence. switch: ends the policy's flight just before the vehicle could no longer
    stop inside. filter: changes the policy's commands only as much as stopping inside requires, and lets it fly on.
    See docs/flying.md."""
    hover: str = DEFAULT
    """Controller for take-off, hover and landing: pid, geometric, indi (needs the rotor speeds), mpc (needs
    e2efly[mpc]), or your own controller, path/to/file.py:Name. See docs/flying.md."""
    latency: float | None = None
    """Delay from the vehicle's motion to its rate loop, s. It sets the hover gains. If omitted, the vehicle file's
    value."""
    goal: tyro.conf.Suppress[Route | None] = None
    """Where the policy flies to."""
    flight: FlightSettings = FlightSettings()
    """Heights, speeds, time-outs, fence, channels."""
    envelope: Envelope = Envelope()
    """State of the vehicle in which the policy may take over."""
    excitation: ExcitationOptions = ExcitationOptions()
    """Manoeuvres that `excitation` flies."""
    steps: StepsOptions = StepsOptions()
    """Steps that `steps` flies."""


def parse(arguments: list[str]) -> Fly:
    """The options of the command. If the arguments name a policy, the goal has the options of that policy's task."""
    options = Fly
    if route := next(filter(None, map(_route, arguments)), None):
        goal = [("goal", route, dataclasses.field(default=route()))]
        options = dataclasses.make_dataclass("Fly", goal, bases=(Fly,), frozen=True, namespace={"__doc__": Fly.__doc__})
    return parse_options(options, "fly", arguments)


def _route(argument: str) -> type[Route] | None:
    """The options of a policy's task. None: the argument names no policy that can be flown."""
    if argument.startswith("-"):
        return None
    with suppress(ValueError, OSError):
        if policy_file(argument).is_file():  # a link's device, read, would never end
            return route_of(load_policy(argument).contract)
    return None


@dataclass(frozen=True)
class _Prepared:
    """What is to fly, checked as far as it can be without a link, poses or images."""

    vehicle: str
    """The vehicle: a name or a .toml file."""
    body: Vehicle
    hover: Any
    """The controller for take-off, hover and landing."""
    filter: Filter | None
    """What `--guard filter` keeps inside the fence."""
    policy: Path | None
    """The policy's file. None: no policy flies, or the manoeuvres of identification do."""
    goal: Route | None
    """Where the policy flies to. None: the usual course of its task."""
    loaded: Policy | None
    runtime: Runtime | None
    """What acts in mode POLICY. None: nothing, or another program."""
    known: throttle_map.ThrottleMap | None
    """The throttle map that an earlier flight learned."""

    @property
    def contract(self) -> Any:
        return self.runtime.policy.contract if self.runtime else None


def _in_place(options: Fly) -> str:
    """The name of what flies in place of a policy. Empty: a policy, or nothing."""
    return str(options.policy) if str(options.policy) in NAMES else ""


def _chosen(options: Fly, console: Terminal) -> tuple[Path | None, Route | None]:
    """The file of the policy, and where it flies. The options may need the zoo's policy of another task."""
    if options.policy is None:
        return None, options.goal
    file = policy_file(options.policy, options.vehicle)
    other = options.goal.instead if options.goal else None
    if other is None or file.parent.parent != FOLDER:
        return file, options.goal
    name = f"{file.parent.name}/{other}"
    console.print(f"{name} flies in place of {file.parent.name}/{file.stem}, as the options of the goal require.")
    file = policy_file(name)
    return file, route_of(load_policy(file).contract)(**vars(options.goal))


def _prepared(options: Fly, console: Terminal) -> _Prepared:
    """Check the options, and load what they name."""
    settings = options.flight
    check_settings(settings)
    if options.latency is not None and not 0 <= options.latency <= SLOWEST:
        raise ValueError(f"--latency is {options.latency}; accepted: 0 to {SLOWEST:g} s")
    excited = _in_place(options)
    policy, goal = (None, None) if excited else _chosen(options, console)
    loaded = None if policy is None else load_policy(policy)
    if options.commands is not None and options.policy is not None:
        accepted = "one of them: either a policy flies, or another program"
        raise ValueError(
            f"--commands is {options.commands!r}, and POLICY {str(options.policy)!r}; accepted: {accepted}"
        )
    if loaded is None and options.vehicle is None:
        raise ValueError("--vehicle is left out; accepted: a vehicle's name or .toml file, as no policy names one")
    if loaded is not None and loaded.contract.vehicle_ranges is not None and options.vehicle is None:
        raise ValueError(
            f"--vehicle is left out; accepted: a name or .toml file, as the policy flies any vehicle within the ranges "
            f"of {loaded.contract.vehicle!r}"
        )
    fence = settings.fence
    if options.guard == "switch" and (known := fence.solids or fence.scene):
        name = "solids" if fence.solids else "scene"
        raise ValueError(f"flight.fence.{name} is {known!r} and --guard is 'switch'; accepted: with --guard filter")
    flies = options.vehicle or _own_vehicle(policy, loaded)
    body = load_vehicle(flies)
    check_quadrotor(body, "fly")
    hover = hover_controller(options.hover, body, body.latency if options.latency is None else options.latency)
    filter = None
    if options.guard == "filter":
        filter, why = fastest(Filter.of(body, settings.fence, options.latency))
        if why is not None:
            console.print(f"The filter runs in Python, which takes several times as long: {why}.", markup=False)
    runtime = None
    if loaded is not None:
        if reasons := check(loaded.contract, body, fields_of(loaded.contract), imu=True, images=True):
            raise ValueError("\n".join(reasons))
        course = course_for(loaded.contract, body, goal)
        said = (*loaded.contract.differences(body), f"The course needs {course.needs}.")
        for line in (*said, *goal_notes(loaded.contract, goal)):
            console.print(line, style="dim")
        runtime = Runtime.of(
            loaded, course, body, envelope=options.envelope, imu=True, images=True, others=bool(options.others)
        )
    if excited:
        acts, course = excitation(body, settings, getattr(options, excited), options.latency)
        runtime = Runtime.of(acts, course, body, envelope=options.envelope)
    saved = options.throttle_map
    known = throttle_map.from_json(_read(saved, "--throttle-map"), body) if saved else None
    if options.image and loaded is None:
        raise ValueError(f"--image is {options.image[0]!r}; accepted: none, as no policy sees it")
    return _Prepared(flies, body, hover, filter, policy, goal, loaded, runtime, known)


def run(options: Fly) -> int:
    """Fly, or with `check` print what prevents a flight.

    Returns:
        0. With `check`, 1 when something forbids a take-off.

    Raises:
        ValueError: naming the option or setting, its value and what is accepted.
        OSError: when the link, the pose source or the log cannot be opened.
    """
    raise_at_interrupt()  # its link and its log are closed in order
    console, settings, excited = Terminal(), options.flight, _in_place(options)
    plan = _prepared(options, console)
    body, hover, contract = plan.body, plan.hover, plan.contract
    targets = targets_of(options.live)
    cameras = [] if plan.loaded is None else open_cameras(options.image, plan.loaded.contract)
    check_link(options.link)  # a wrong text is refused here rather than by the watchdog
    with ExitStack() as stack:
        for camera in cameras:
            stack.callback(camera.close)
        live = Live(() if options.check else targets, contract.images if contract else ())
        stack.callback(live.close)
        source = open_source(options.pose)
        stack.callback(source.close)
        runtime = plan.runtime
        if runtime is not None and not excited:
            if drifts(source):
                console.print(NOWHERE, style="bold")
            check_course(settings.fence.height if drifts(source) else settings.fence, runtime.course)
            runtime = dataclasses.replace(runtime, placed=not drifts(source))
        others = [stack.enter_context(closing(open_source(uri))) for uri in options.others]
        needs = (contract.others if contract else None) or USUAL
        commands = None if options.commands is None else open_commands(options.commands)
        if commands is not None:
            stack.callback(commands.close)
        autopilot, watchdog = open_autopilot(
            options.link, body, settings, (options.hover, hover), watched=options.watchdog and not options.check,
            excited=bool(excited), aids=isinstance(source, AidedSource),
        )  # fmt: skip
        stack.callback(autopilot.close)
        rows = autopilot.check(body, settings, contract)
        print_settings(console, rows)
        worker = _worker(runtime, commands, body, options)
        if worker is not None:
            stack.callback(worker.close)
        bridge = Bridge(
            autopilot, source, body, settings, worker=worker, latency=options.latency,
            settings_problems=problems(rows), throttle_map=plan.known, cameras=cameras,
            filter=plan.filter, hover=hover,
            neighbours=Neighbours(others, settings.odometry_timeout, needs) if others else None,
        )  # fmt: skip
        source.read(time.monotonic())  # what came while the controller was asked is old
        if options.check:
            return look(bridge, source, console, rows, plan.policy, contract)
        refuse_in_flight(bridge)
        service = Service()
        stack.callback(service.close)
        stop = Stop()
        stack.callback(stop.restore)
        path = options.log or Path("flights") / time.strftime("%Y-%m-%d_%H-%M-%S.mcap")
        telemetry = stack.enter_context(Telemetry(path))
        shown = _shown(options, plan.vehicle)
        if shown is not None:
            stack.callback(shown.close)
        log = Logs((telemetry, *([live] if targets else []), *([] if shown is None else [shown])))
        bridge.log = log
        record_meta(log, bridge, body, contract.to_json() if contract else "", rows, _flies(options, plan))
        rate = loop_rate(contract.control_rate_hz) if contract else LOWEST_RATE
        say = Speaker(sys.stdout)
        stack.callback(say.close)
        live.say = say

        def again() -> bool:
            return _identify_again(bridge, body, contract, say)

        for line in live.describe():
            say(f"live {line}")
        if shown is not None:
            say(f"watch it at {shown.page.address}")
        say(f"{rate:g} Hz, log {path}. Ctrl-C lands.")
        timing = fly(
            bridge, rate, log=log, live=live, watchdog=watchdog, say=say,
            stop=stop, identify_again=again, service=service,
        )  # fmt: skip
        telemetry.close()
        live.close()
        _tell(say, timing, telemetry, live)
        path.with_suffix(".throttle.json").write_text(throttle_map.as_json(bridge.map), encoding="utf-8")
        if excited == "steps":
            say(f"Next: e2efly align {path} --vehicle {options.vehicle}")
        elif excited:
            say(f"Next: e2efly identify flight {path} --vehicle {options.vehicle} --mass KG SIGMA")
        learned = f"factor {bridge.map.scale:.2f}, {path.with_suffix('.throttle.json')}"
        say(f"Next: e2efly fly-report {path}; throttle map: {learned}")
        return 0


def _tell(say: Speaker, timing: Timing, telemetry: Telemetry, live: Live) -> None:
    """Tell how punctual a flight was, and what its log and its listeners did not get."""
    late = sorted(timing.lateness)
    p99 = 1e3 * late[int(0.99 * (len(late) - 1))] if late else 0.0
    say(f"{timing.rounds} control steps, late by {p99:.1f} ms (p99), {timing.missed} missed.")
    for problem, count in telemetry.problems.items():
        say(f"log: {problem} ({count} times)")
    if telemetry.missing:
        say(f"log: {telemetry.missing}")
    for problem in live.problems:
        say(f"live {problem}")


def _shown(options: Fly, vehicle: str) -> "Shown | None":
    """The page of `--watch`."""
    if options.watch is None:
        return None
    from e2efly.viewing.watch.beside import Shown

    return Shown(options.watch, "--vehicle", vehicle)


def _worker(
    runtime: Runtime | None, commands: CommandSource | None, body: Vehicle, options: Fly
) -> PolicyWorker | Commander | None:
    """What flies in mode POLICY. None: nothing does."""
    settings = options.flight
    if commands is not None:
        return Commander(commands, body, settings, envelope=options.envelope, latency=options.latency)
    return None if runtime is None else PolicyWorker(runtime, settings.policy_timeout)


def _own_vehicle(policy: Path | None, loaded: Policy | None) -> str:
    """The vehicle of a policy: the copy in its run, if it belongs to a run, otherwise the vehicle that its contract
    names.
    """
    run = run_of(policy) if policy is not None else None
    if run is not None and (run.path / "config.json").is_file():
        return run.config().env.vehicle
    return loaded.contract.vehicle if loaded else ""


def _read(path: Path, option: str) -> str:
    try:
        return path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise OSError(f"{option} {path}: {error.strerror}") from None


def _identify_again(bridge: Bridge, body: Vehicle, contract: Any, say: Speaker) -> bool:
    """After a new connection, nothing that was read before is valid. Returns whether it could be read anew."""
    try:
        bridge.autopilot.identify(1.0)
    except (ValueError, TimeoutError) as error:
        bridge.settings_problems = (f"read anew: {error}",)
        return False
    bridge.settings_problems = problems(bridge.autopilot.check(body, bridge.settings, contract))
    say("the controller was connected anew; its settings were read again")
    return True


def _flies(options: Fly, plan: _Prepared) -> dict[str, Any]:
    """What flies, for the log: controller of the hover, file of the policy, and where it flies to."""
    policy = None if plan.policy is None else str(plan.policy.resolve())
    return {"hover": options.hover, "policy": policy, "goal": None if plan.goal is None else vars(plan.goal)}
