"""A policy in flight: what it sees, when it is called, what it commands. Pure, except for timing the network.

`begin` hands the vehicle over to the policy. `act` calls the policy once per period; it takes and returns the state.
"""

import dataclasses
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from e2efly.control import COMMAND_MODES
from e2efly.policy.contract import Contract
from e2efly.policy.goal import Course, Outcome
from e2efly.policy.observation import Field, Known, own_fields
from e2efly.policy.odometry import Odometry, tilt_of, yaw_of
from e2efly.policy.others import USUAL, Others
from e2efly.vehicles.vehicle import Vehicle

MODES = tuple(name for name, mode in COMMAND_MODES.items() if mode.controller is not None)
"""Command modes that are converted to collective thrust and body rates. No link takes rotor thrusts in flight:
docs/onboard.md says why of each autopilot."""
_ROUNDING = 1e-6
"""Rounding tolerance of the clock, in periods."""


@dataclass(frozen=True)
class Imu:
    """A measurement of the inertial sensors."""

    gyroscope: np.ndarray
    """(3,) angular velocity about body x, y, z, rad/s."""
    accelerometer: np.ndarray
    """(3,) specific force along body x, y, z, m/s^2; level at rest: 0, 0, 9.81."""


@dataclass(frozen=True)
class Envelope:
    """The states of the vehicle in which a policy may take over. Training rarely had states beyond these limits."""

    speed: float = 5.0
    """Largest speed, m/s."""
    tilt: float = 0.7853981633974483
    """Largest tilt, rad."""
    distance: float | None = None
    """Largest distance to the goal, m. If omitted, the distance at which an episode of the training ends. For a place
    that another program commands, at any time: 3 m."""
    start: float = 1.5
    """Largest distance to the start of a course that has its own heading, m."""
    heading: float = 0.35
    """Largest angle between the heading of the vehicle and the start heading of such a course, rad."""


class Acting(Protocol):
    """What flies by observations and actions: a policy (`e2efly.policy.loader.Policy`), or an object that acts
    as one.
    """

    @property
    def contract(self) -> Contract:
        """What it sees and commands."""
        ...

    def act(
        self, observation: np.ndarray, images: Sequence[np.ndarray] = (), memory: Any = None
    ) -> tuple[np.ndarray, Any]:
        """The action for an observation, (4,) in [-1, 1], and the memory for the next call. Memory None: there was
        none.
        """
        ...


@dataclass(frozen=True)
class Runtime:
    """A policy, and where it has to fly. Create it with `Runtime.of`."""

    policy: Acting
    course: Course
    envelope: Envelope
    period: float
    """Time between two calls of the policy, s."""
    placed: bool = True
    """Whether the motion that `act` is given tells where the vehicle is. If not, the task judges nothing, and is over
    when its time is over."""

    @staticmethod
    def of(
        policy: Acting,
        course: Course,
        vehicle: Vehicle,
        control_rate: float | None = None,
        *,
        envelope: Envelope | None = None,
        imu: bool = False,
        images: bool = False,
        others: bool = False,
        rotors: bool = False,
    ) -> "Runtime":
        """Check that the parts fit together.

        Args:
            policy: the loaded policy, or an object that acts as one.
            course: the course, from `e2efly.tasks.route.course_for`.
            vehicle: the vehicle that flies.
            control_rate: the rate at which the policy will be called, Hz. None: the rate of its training.
            envelope: the states in which the policy may take over.
            imu: whether `act` will be given IMU measurements.
            images: whether `act` will be given the images that the contract asks for.
            others: whether `act` will be given the other vehicles that the policy observes.
            rotors: whether what flies takes the commands of rotors, as a simulator does.

        Raises:
            ValueError: naming everything that does not fit, one item per line.
        """
        contract, envelope = policy.contract, envelope or Envelope()
        reasons = check(contract, vehicle, course.goal.fields, control_rate, imu=imu, images=images, rotors=rotors)
        if (count := getattr(course.goal, "neighbours", 0)) and not others:
            told = (getattr(contract, "others", None) or USUAL).told
            reasons += (
                f"the policy observes the {count} nearest other vehicles; accepted: with a pose source for each other "
                f"vehicle (fly --others), {told}",
            )
        for name, value in dataclasses.asdict(envelope).items():
            if value is not None and not value > 0:
                reasons += (f"envelope.{name} is {value}; accepted: more than 0",)
        if reasons:
            raise ValueError("\n".join(reasons))
        return Runtime(policy, course, envelope, 1 / contract.control_rate_hz)


@dataclass(frozen=True)
class RuntimeState:
    """The state that one call of the policy passes to the next."""

    task: Any
    """State of the task."""
    outcome: Outcome | None
    """Outcome of the last step. None: there was no step."""
    failure: str
    """The reason why the task can no longer be completed. Empty while it can."""
    odometry: Odometry
    """The motion that was last judged, in the task's world."""
    past_actions: np.ndarray
    """(k, 4) float32, the policy's last actions, newest first, where k is the number that it sees."""
    recurrent: Any
    """For a policy, (m,) float32: its recurrent state. For another object that acts, its memory. None: not yet
    called."""
    began: float
    """When the policy took over, s on the monotonic clock."""
    slots: int
    """Number of periods that are over since then: acted or missed."""
    steps: int
    """Number of times that the policy has acted."""

    judged: float = 0.0
    """When the outcome was judged, s since the policy took over."""
    done: bool = False
    """Whether the task is over, but not because of a failure in flight."""


@dataclass(frozen=True)
class Decision:
    """What the policy saw and what it commands."""

    observation: np.ndarray
    """(o,) float32, as `contract.observation` says."""
    action: np.ndarray
    """(4,) float32 in [-1, 1]."""
    command: np.ndarray
    """(4,) in `contract.action.units`."""
    mode: str
    """The command mode."""
    position: np.ndarray | None
    """(3,) position of the goal, world, m. None: there is no such place."""
    late_s: float
    """Delay of the call after it was due, s."""
    inference_s: float
    """Duration of the network and its checks, s."""


def check(
    contract: Contract,
    vehicle: Vehicle,
    shown: Sequence[Field],
    control_rate: float | None = None,
    *,
    imu: bool = False,
    images: bool = False,
    rotors: bool = False,
) -> tuple[str, ...]:
    """The reasons why a policy cannot fly here. Empty: it can. `shown` has the task's own fields of the observation.
    `control_rate` is the rate at which the policy will be called, Hz. None: the rate of its training. `imu` and
    `images` tell whether IMU measurements and the images that the contract asks for are available, and `rotors` whether
    what flies takes the commands of rotors.
    """
    reasons = list(contract.refusals(vehicle, control_rate))
    if contract.action.mode not in MODES and not rotors:
        reasons.append(
            f"action.mode of the policy is {contract.action.mode!r}; accepted: {' or '.join(map(repr, MODES))}, "
            "which become collective thrust and body rates. No link takes commands of rotors in flight; on board, they "
            "fly by `e2efly export --raptor` (PX4) or `--c`"
        )
    for image in contract.images if not images else ():
        reasons.append(f"{image.lacking}; accepted: a policy without images (from Python, `Policy.act` takes them)")
    own = own_fields(imu=True, actions=max(contract.past_actions, 1), size=contract.action.size)
    known = {field.name: field for field in (*shown, *(row.field for row in own))}
    sensed = {row.field.name for row in own if row.source == "imu"}
    for field in contract.observation:
        same = known.get(field.name)
        if same is None:
            accepted = ", ".join(sorted(known))
            reasons.append(f"observation field {field.name!r}: nothing on board says it; accepted: {accepted}")
        elif (field.size, field.frame, field.unit) != (same.size, same.frame, same.unit):
            reasons.append(
                f"observation field {field.name!r} has size {field.size}, frame {field.frame!r} and unit "
                f"{field.unit!r}; accepted: {same.size}, {same.frame!r} and {same.unit!r}"
            )
        elif field.name in sensed and not imu:
            reasons.append(f"observation field {field.name!r}: there is no IMU; accepted: a policy without, or an IMU")
    seen = {field.name for field in contract.observation}
    if lacking := [field.name for field in shown if field.name not in seen]:
        reasons.append(
            f"observation shows {', '.join(sorted(seen))}; accepted: with {', '.join(lacking)}, as its task is "
            f"{contract.task!r}"
        )
    return tuple(reasons)


def begin(runtime: Runtime, odometry: Odometry, now: float) -> RuntimeState:
    """Hand over to the policy. The task starts. The policy is shown hover actions as its past actions, as in training.
    `now` is the time on the monotonic clock, s. The first action is due at once.
    """
    contract = runtime.policy.contract
    actions = np.tile(np.asarray(contract.hover_action, np.float32), (contract.past_actions, 1))
    start, local = runtime.course.memory, odometry.seen_from(runtime.course.origin)
    return RuntimeState(start, None, "", local, actions, None, began=now, slots=0, steps=0)


def due(runtime: Runtime, state: RuntimeState) -> float:
    """When the policy must be called next, s on the monotonic clock. The times lie on a grid from `begin`, without
    drift.
    """
    return state.began + state.slots * runtime.period


def act(
    runtime: Runtime,
    state: RuntimeState,
    odometry: Odometry,
    now: float,
    imu: Imu | None = None,
    *,
    seen: Odometry | None = None,
    images: Sequence[np.ndarray] = (),
    others: Others | None = None,
) -> tuple[RuntimeState, Decision]:
    """Call the policy once.

    Args:
        runtime: the policy and its course.
        state: from `begin` or the last `act`.
        odometry: the newest motion.
        now: the time on the monotonic clock, s, at or after `due`. Whole periods since `due` count as missed.
        imu: the newest measurement, for a policy that sees an IMU.
        seen: the motion that the policy sees, for a simulation that judges by the true motion but shows it with an
            error. None: `odometry`.
        images: the newest image of each camera, in the contract's order.
        others: the nearest other vehicles, for a goal that has `neighbours`, in the axes of the odometry. None: as
            last known.

    Raises:
        ValueError: for every problem, naming the field if there is one: a non-finite observation or action, an
            attitude that is not a unit quaternion, a missing IMU, or an error of the network. The caller must then
            command nothing.
    """
    course, local = runtime.course, odometry.seen_from(runtime.course.origin)
    state = judged(runtime, state, local, now)
    local = local if seen is None else seen.seen_from(course.origin)
    elapsed, body = np.array([now - state.began]), local.batch
    if others is not None:
        state = dataclasses.replace(state, task=course.goal.among(state.task, others.seen_from(course.origin)))
    shown = np.asarray(course.goal.observe(state.task, elapsed, body))[0]
    observation = observe(runtime, shown, state.past_actions, local, imu)
    started = time.perf_counter()
    try:
        action, recurrent = runtime.policy.act(observation, images, memory=state.recurrent)
    except ValueError:
        raise
    except Exception as error:  # ONNX Runtime's errors share no other base
        raise ValueError(f"the policy failed: {error}") from error
    spent = time.perf_counter() - started
    past = state.past_actions
    if len(past):
        past = np.concatenate([action[None], past[:-1]])
    late = now - due(runtime, state)
    over = max(math.floor(late / runtime.period + _ROUNDING), 0)
    decision = Decision(
        observation=observation,
        action=action,
        command=runtime.policy.contract.action.command(action),
        mode=runtime.policy.contract.action.mode,
        position=course.origin.points(np.asarray(course.goal.goal(state.task, elapsed))[0]) if runtime.placed else None,
        late_s=late,
        inference_s=spent,
    )
    slots, steps = state.slots + over + 1, state.steps + 1
    return dataclasses.replace(state, past_actions=past, recurrent=recurrent, slots=slots, steps=steps), decision


def judged(runtime: Runtime, state: RuntimeState, odometry: Odometry, now: float) -> RuntimeState:
    """Let the task judge what the vehicle has done since the last call of the policy. `state` is from `begin` or the
    last `act`. The odometry is the newest, in the task's world. `now` is in s on the monotonic clock.
    """
    if state.steps == 0:
        return dataclasses.replace(state, odometry=odometry)
    course, elapsed = runtime.course, now - state.began
    timed_out = elapsed >= course.duration - 1e-3 * runtime.period
    if not runtime.placed:
        return dataclasses.replace(state, odometry=odometry, judged=elapsed, done=bool(timed_out))
    task, outcome = course.goal.advance(
        state.task, state.odometry.batch, odometry.batch, np.array([elapsed]), np.array([timed_out])
    )
    done = course.goal.done(outcome) or timed_out
    failed = bool(outcome.terminated[0]) and not done
    failure = state.failure or (course.goal.failure(state.task, outcome) if failed else "")
    return dataclasses.replace(
        state, task=task, outcome=outcome, failure=failure, odometry=odometry, judged=elapsed, done=done and not failure
    )


def observe(
    runtime: Runtime, shown: np.ndarray, past_actions: np.ndarray, odometry: Odometry, imu: Imu | None = None
) -> np.ndarray:
    """The observation, float32 (o,), as the training environment makes it. `shown` has the task's own fields, (k,), in
    their order, and `past_actions` is (a, 4), newest first. The odometry is in the task's world.

    Raises:
        ValueError: when the policy sees an IMU and there is none.
    """
    contract = runtime.policy.contract
    slices, row = contract.slices, np.empty(contract.observation_size, np.float32)
    at = 0
    for field in runtime.course.goal.fields:
        row[slices[field.name]] = shown[at : at + field.size]
        at += field.size
    known = Known(odometry, imu, past_actions)
    for own in contract.own:
        name = own.field.name
        if own.source == "imu" and imu is None:
            raise ValueError(f"observation field {name!r}: there is no measurement of an IMU; accepted: an `Imu`")
        row[slices[name]] = own.value(known)
    return row


def outside(runtime: Runtime, odometry: Odometry, now: float, state: RuntimeState | None = None) -> tuple[str, ...]:
    """The reasons why the policy should not fly from this state of the vehicle. Empty: it may. `now` is in s on the
    monotonic clock. `state` is that of a flight that has begun. None: as if the policy took over now.
    """
    envelope, course = runtime.envelope, runtime.course
    local = odometry.seen_from(course.origin)
    task, elapsed = (course.memory, 0.0) if state is None else (state.task, now - state.began)
    where = np.asarray(course.goal.goal(task, np.array([elapsed])))[0]
    fence = np.max(course.goal.fence(task)) if envelope.distance is None else envelope.distance
    limits = (
        ("speed", float(np.linalg.norm(local.velocity)), envelope.speed, "m/s"),
        ("tilt", tilt_of(local.quaternion), envelope.tilt, "rad"),
    )
    if not runtime.placed:
        return beyond(limits)
    limits += (("distance", float(np.linalg.norm(local.position - where)), fence, "m from the goal"),)
    if course.heading is not None and state is None:
        off = math.remainder(yaw_of(local.quaternion) - course.heading, math.tau)
        told = math.degrees(course.heading + course.origin.yaw)
        limits += (
            ("distance", float(np.linalg.norm(local.position - course.start)), envelope.start, "m from the start"),
            ("heading", abs(off), envelope.heading, f"rad from the start's, {told:.0f} deg"),
        )
    return beyond(limits)


def beyond(limits: Sequence[tuple[str, float, float, str]]) -> tuple[str, ...]:
    """The values beyond their limits, in words. Each is given as (name, value, limit, unit)."""
    return tuple(
        f"{name} is {value:.3g} {unit}; accepted: at most {limit:.3g}"
        for name, value, limit, unit in limits
        if not value <= limit  # true for NaN
    )
