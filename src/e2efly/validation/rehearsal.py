"""Whole flights through the real firmware: take-off, hover, policy, landing, with a pilot who only moves switches."""

import dataclasses
import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from e2efly.flight.log_record import Log
from e2efly.flight.pilot.fence import check_course
from e2efly.flight.pilot.flight_state import Mode, Reason
from e2efly.flight.pilot.hovering import hover_controller
from e2efly.flight.pose.pose_source import PoseSource
from e2efly.flight.pose.sources.imu_alone import ImuSource
from e2efly.flight.settings import Fence
from e2efly.flight.sight.image_source import ImageSource
from e2efly.policy.goal import Course, Outcome
from e2efly.policy.odometry import Odometry
from e2efly.policy.runtime import Acting, Runtime, RuntimeState, begin, judged
from e2efly.tasks.route import Route, course_for, route_of, usual_route
from e2efly.validation.bridge_session import REACH, FlightBench, FlownSession, Session, open_fence, rehearsal_settings
from e2efly.validation.firmware_program import Firmware
from e2efly.validation.gate_bench import gate_poses
from e2efly.validation.gate_pose import GateCamera
from e2efly.validation.plant import RigidState
from e2efly.validation.rig import Rig
from e2efly.validation.scenery import Scenery
from e2efly.validation.world import FlownBody, World
from e2efly.vehicles.vehicle import Vehicle

PARKED = 0.3
"""Largest distance of the parked vehicle from the start of the policy's course, m per axis."""
ASKEW = 0.05
"""Largest error of the heading at the start of a race, rad."""
REACH_IN_SIGHT = 100.0
"""Size of the fence about the origin, m, for the long worlds of policies that see."""
LAST_S = 0.25
"""Last part of a policy's flight that is used for its final speed, s. The poses show a touch this much later."""
HOVER = "geometric"
"""Hover controller of a rehearsal. `pid`, the bridge's default, does not foresee the motion over the latency. At 90 ms
it catches a race's last 10 m/s at 1.6 m only after the ground."""
TOUCH = 0.005
"""A vehicle that is less than this over the ground has touched it since the last control step, m."""
LINK_S = 0.01
"""Time that link and firmware on the rig take from a pose to the rate loop's setpoint, s. The delay of the poses is the
rest of the latency."""


@dataclass(frozen=True)
class Rehearsal:
    """The result of a whole flight."""

    modes: tuple[str, ...]
    """The modes in order."""
    reasons: tuple[str, ...]
    """The reason for each mode."""
    complete: bool
    """Whether it took off, hovered, gave the policy its whole time, landed and was disarmed, without intervention, and
    without touching the ground before the landing."""
    hover_error: float
    """Mean distance to the target in the hover before the policy, m."""
    done: bool
    """Whether the policy completed its task, or was still flying it when its time was over."""
    success: bool
    """The task's verdict at the end of the policy's flight. For a task without an end, the verdict on an episode of
    this length."""
    mean_error: float
    """The task's error over the second half of the policy's flight, m, or NaN."""
    final_error: float
    """The task's error at the end of the policy's flight, m, or NaN."""
    top_speed: float
    """Largest speed of the policy, m/s."""
    told: str
    """How the policy did, as text."""
    flown: FlownSession
    """The record of the flight."""


def whole_course(policy: Acting, vehicle: Vehicle, route: Route | None = None) -> Course:
    """The course of a policy in a rehearsal. Without a route, the usual one of its task, wherever it was trained."""
    usual = usual_route(policy.contract)
    return course_for(policy.contract, vehicle, route or dataclasses.replace(usual, outside=True, **usual.whole))


def rehearse(
    firmware: Firmware,
    policy: Acting,
    vehicle: Vehicle,
    *,
    seed: int = 0,
    log: Log | None = None,
    scenery: Scenery | None = None,
    route: Route | None = None,
    fence: Fence | None = None,
    wrap: Callable[[ImageSource], ImageSource] = lambda camera: camera,
    gates: GateCamera | None = None,
    placed: bool = True,
) -> Rehearsal:
    """Fly one whole flight. The vehicle is that of the world and of the bridge.

    `scenery` is the world that a policy sees. `wrap` puts a wrapper between each camera and the bridge. Without a
    `route` the course is the usual one, without a `fence` the fence is far away. With `gates` there is no motion
    capture: the poses come from the gates of the course, as this camera sees them, and from the firmware's IMU. If not
    `placed`, there is no source of poses but that IMU.

    Raises:
        ValueError: for a course that the fence does not hold, or one without gates.
    """
    course = whole_course(policy, vehicle, route)
    course = course if scenery is None else scenery.on(course)
    if fence is not None:
        check_course(fence, course)
    with tempfile.TemporaryDirectory(prefix="e2efly-") as temporary:
        latency = max(policy.contract.latency_of(vehicle) - LINK_S, 0.0)
        with Rig(firmware, Path(temporary), vehicle, latency=latency, seed=seed) as rig:
            sources = [] if scenery is None else scenery.sources(lambda: RigidState.of(rig.state), course.origin)
            cameras = [wrap(source) for source in sources]
            poses: PoseSource | None = None if gates is None else gate_poses(rig, gates, course, seed)
            poses = poses if placed else ImuSource()
            flight = whole_flight(rig, policy, course, seed, log, cameras, fence, poses)
    return flight if scenery is None else _unhurt(flight, scenery, course, vehicle.radius)


def _unhurt(flight: Rehearsal, scenery: Scenery, course: Course, radius: float) -> Rehearsal:
    """The flight, without success if it came too near to the obstacles of its world."""
    flown = flight.flown
    where = flown.where(Mode.POLICY)
    near = scenery.nearest([flown.position[i] for i in where], [flown.time[i] for i in where], course.origin)
    if near > radius:
        return flight
    told = f"{flight.told}, hit something"
    return dataclasses.replace(flight, success=False, told=told)


def whole_flight(
    rig: FlightBench, policy: Acting, course: Course, seed: int, log: Log | None, cameras: Sequence[ImageSource],
    fence: Fence | None, source: PoseSource | None = None,
) -> Rehearsal:  # fmt: skip
    """One whole flight on a bench, from the ground to the ground; see `rehearse`. The latency is the bench's, and so
    are the poses, unless there is another source of them.
    """
    rig.state = parked(rig.world, course, seed)
    rig.sleep(0.5)
    height = course.origin.points(course.start)[2] - rig.world.vehicle.feet_height
    wide = open_fence(rig.world.vehicle, REACH_IN_SIGHT if cameras else REACH)
    settings = rehearsal_settings(height, fence=fence or wide)
    hover = hover_controller(HOVER, rig.world.vehicle, rig.latency + LINK_S)
    autopilot = rig.autopilot(settings, hover, aids=source is not None)
    session = Session(
        rig, settings, policy=policy, course=course, log=log, autopilot=autopilot, source=source, cameras=cameras,
        hover=hover,
    )  # fmt: skip
    try:
        up = session.take_off(3.0)
        rig.set(mission="policy")
        bridge, worker = session.bridge, session.worker
        assert worker is not None
        begun = session.fly(0.5, session.in_mode(Mode.POLICY))
        end = rig.now() + route_of(policy.contract).longest_s
        verdicts: dict[float, tuple[float, Outcome]] = {}
        spectator = None if worker.runtime.placed else Spectator.of(worker.runtime, rig)
        ended = worker.last
        while begun and rig.now() < end and bridge.flight.mode is Mode.POLICY:
            session.step()
            ended = worker.last if spectator is None else spectator.watch(rig)
            if ended is not None and ended.outcome is not None:
                verdicts[ended.judged] = (ended.judged, ended.outcome)
            if spectator is not None and ended is not None and (ended.done or ended.failure):
                break  # the pilot sees it
        done = Reason.POLICY_DONE in bridge.flight.reasons or bridge.flight.mode is Mode.POLICY
        if not course.goal.lands:
            rig.set(mission="hover")
            session.fly(3.0)
        landed = session.land()
        flight = _report(course, session.flown, up, begun, done, landed, list(verdicts.values()), ended)
        if course.goal.lands or not _touched(session.flown, rig.world.vehicle.feet_height):
            return flight
        return dataclasses.replace(flight, complete=False, told=f"{flight.told}, touched the ground")
    finally:
        session.close()


@dataclass
class Spectator:
    """Judges a policy that nobody tells where it is, by its true motion."""

    runtime: Runtime
    state: RuntimeState

    @staticmethod
    def of(runtime: Runtime, rig: FlightBench) -> "Spectator":
        """At the moment when the policy takes over."""
        runtime = dataclasses.replace(runtime, placed=True)
        begun = begin(runtime, _truth(rig), rig.now())
        return Spectator(runtime, dataclasses.replace(begun, steps=1))

    def watch(self, rig: FlightBench) -> RuntimeState:
        """The verdict after another control step."""
        local = _truth(rig).seen_from(self.runtime.course.origin)
        self.state = judged(self.runtime, self.state, local, rig.now())
        return self.state


def _truth(rig: FlightBench) -> Odometry:
    return RigidState.of(rig.state).odometry(rig.now())


def parked(world: World, course: Course, seed: int) -> FlownBody:
    """Where a whole flight begins: on the ground near the start of the policy's course."""
    random = np.random.default_rng(seed)
    x, y = course.origin.points(course.start)[:2] + random.uniform(-PARKED, PARKED, 2)
    return world.at_rest(x, y, _heading(course, random))


def _touched(flown: FlownSession, feet: float) -> bool:
    """Whether the vehicle touched the ground between take-off and landing."""
    rows = zip(flown.mode, flown.position, strict=True)
    return any(mode in (Mode.HOVER, Mode.POLICY) and at[2] < feet + TOUCH for mode, at in rows)


def _report(
    course: Course,
    flown: FlownSession,
    up: bool,
    begun: bool,
    done: bool,
    landed: bool,
    judged: list[tuple[float, Outcome]],
    ended: RuntimeState | None,
) -> Rehearsal:
    errors = np.array([float(outcome.error[0]) for _, outcome in judged])
    arrivals = tuple(time for time, outcome in judged if outcome.arrived[0])
    speeds = [float(np.linalg.norm(flown.velocity[i])) for i in flown.where(Mode.POLICY)]
    mean = float(errors[len(errors) // 2 :].mean()) if len(errors) else math.nan
    final = float(errors[-1]) if len(errors) else math.nan
    times = np.array(flown.time)[flown.where(Mode.POLICY)]
    speed = max((v for at, v in zip(times, speeds, strict=True) if at >= times[-1] - LAST_S), default=math.nan)
    return Rehearsal(
        modes=tuple(mode for _, mode, _ in flown.changes),
        reasons=tuple("; ".join(reasons) for _, _, reasons in flown.changes),
        complete=up and begun and done and landed,
        hover_error=_hover_error(flown),
        done=done,
        success=ended is not None and _success(course, ended),
        mean_error=mean,
        final_error=final,
        top_speed=max(speeds, default=0.0),
        told=course.goal.told(arrivals, mean, final, speed) if judged else "none",
        flown=flown,
    )


def _success(course: Course, ended: RuntimeState) -> bool:
    """The verdict at the end. For a task without an end, the verdict as if its time were over now."""
    if ended.outcome is None or ended.outcome.terminated[0]:
        return ended.outcome is not None and bool(ended.outcome.success[0])
    now, body = np.array([ended.judged]), ended.odometry.batch
    _, outcome = course.goal.advance(ended.task, body, body, now, np.array([True]))
    return bool(outcome.success[0])


def _heading(course: Course, random: np.random.Generator) -> float:
    """Heading in which the vehicle is put down, rad: random, unless the course has one."""
    if course.heading is None:
        return random.uniform(-np.pi, np.pi)
    return course.heading + course.origin.yaw + random.uniform(-ASKEW, ASKEW)


def _hover_error(flown: FlownSession) -> float:
    """Mean error over the last second of the hover before the policy, m."""
    end = next((at for at, mode, _ in flown.changes if mode == Mode.POLICY), flown.time[-1])
    rows = zip(flown.time, flown.mode, flown.position, flown.goal, strict=True)
    last = [(p, g) for at, mode, p, g in rows if mode == Mode.HOVER and end - 1.0 <= at < end]
    errors = [float(np.linalg.norm(p - g)) for p, g in last if g is not None]
    return float(np.mean(errors)) if errors else math.nan
