"""A policy in flight: what it sees, when it is asked, what it commands. Pure but for the clock around the network.

`begin` hands the vehicle over to the policy, `act` asks it once a period; the state goes in and comes out.
"""

import dataclasses
import math
import time
from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.deploy.contract import ACTION_SIZE, COMMANDS, Contract
from e2efly.deploy.fence import heading
from e2efly.deploy.goals import GatesGoal, Goal
from e2efly.deploy.odometry import Odometry
from e2efly.deploy.policy import Policy
from e2efly.observation import ACCELEROMETER, ATTITUDE, BODY_RATE, GYROSCOPE, VELOCITY
from e2efly.vehicles import Vehicle

MODES = tuple(mode for mode in COMMANDS if mode != "rotor_thrust")
"""Command modes that become collective thrust and body rates; a flight controller takes no rotor thrusts."""
GOAL_FIELDS = ("position_error", "reference", "gates")
"""Observation fields that a goal fills: positions minus the vehicle's."""
PAST_ACTIONS = "past_actions"
"""The observation field of the policy's last actions."""
_STATE_FIELDS = {f.name: f for f in (ATTITUDE, VELOCITY, BODY_RATE, GYROSCOPE, ACCELEROMETER)}
_IMU_FIELDS = (GYROSCOPE.name, ACCELEROMETER.name)
_ROUNDING = 1e-6
"""Of the clock, in periods."""


@dataclass(frozen=True)
class Imu:
    """A measurement of the inertial sensors."""

    gyroscope: np.ndarray
    """(3,) angular velocity about body x, y, z, rad/s."""
    accelerometer: np.ndarray
    """(3,) specific force along body x, y, z, m/s^2; level at rest: 0, 0, 9.81."""


@dataclass(frozen=True)
class Envelope:
    """In which state of the vehicle a policy may take over; beyond it lies what training rarely showed it."""

    speed: float = 5.0
    """Largest speed, m/s."""
    tilt: float = 0.7853981633974483
    """Largest tilt, rad."""
    distance: float | None = None
    """Largest distance to where the goal is, m; left out: where an episode of the training ends."""
    start: float = 1.5
    """Largest distance to where a race begins, m."""
    heading: float = 0.35
    """Largest angle between the heading and that with which a race begins, rad."""


@dataclass(frozen=True)
class Runtime:
    """A policy and where it is to fly. Make it with `Runtime.of`."""

    policy: Policy
    goal: Goal
    envelope: Envelope
    period: float
    """Seconds between two questions to the policy."""
    low: np.ndarray
    """(4,) command at action -1."""
    span: np.ndarray
    """(4,) from there to the command at action +1."""

    @staticmethod
    def of(
        policy: Policy,
        goal: Goal,
        vehicle: Vehicle,
        control_rate: float | None = None,
        *,
        envelope: Envelope | None = None,
        imu: bool = False,
    ) -> "Runtime":
        """Check that they fit together.

        Args:
            policy: as loaded.
            goal: as `goal_for` makes it.
            vehicle: that flies.
            control_rate: at which the policy will be asked, Hz; None: as it was trained.
            envelope: in which state it may take over.
            imu: whether `act` will be given measurements of an IMU.

        Raises:
            ValueError: naming all that does not fit, one a line.
        """
        contract, envelope = policy.contract, envelope or Envelope()
        reasons = check(contract, vehicle, control_rate, imu=imu)
        sizes = {field.name: field.size for field in contract.observation}
        if sizes.get(goal.field) != goal.size:
            reasons += (
                f"goal shows {goal.field!r} of size {goal.size}; accepted: a goal of the policy's task "
                f"{contract.task!r}, as its observation is {sizes}",
            )
        for name, value in dataclasses.asdict(envelope).items():
            if value is not None and not value > 0:
                reasons += (f"envelope.{name} is {value}; accepted: more than 0",)
        if reasons:
            raise ValueError("\n".join(reasons))
        low, high = np.array(contract.action.low), np.array(contract.action.high)
        return Runtime(policy, goal, envelope, 1 / contract.control_rate_hz, low, high - low)


@dataclass(frozen=True)
class RuntimeState:
    """What one question to the policy hands to the next."""

    goal: Any
    """The goal's own state."""
    odometry: Odometry
    """The motion that was last judged by the goal."""
    past_actions: np.ndarray
    """(k, 4) float32, the policy's last actions, newest first; of k as many as it sees."""
    memory: np.ndarray | None
    """(m,) float32, what the policy remembers; None: it was not yet asked."""
    began: float
    """When the policy took over, s on the monotonic clock."""
    slots: int
    """Periods since then that are over: acted or missed."""
    steps: int
    """Times that the policy has acted."""

    @property
    def missed(self) -> int:
        """Periods in which the policy was not asked."""
        return self.slots - self.steps


@dataclass(frozen=True)
class Decision:
    """What the policy saw and wants."""

    observation: np.ndarray
    """(o,) float32, as `contract.observation` says."""
    action: np.ndarray
    """(4,) float32 in [-1, 1]."""
    command: np.ndarray
    """(4,) in `contract.action.units`."""
    mode: str
    """The command mode."""
    position: np.ndarray
    """(3,) where the goal is, world, m."""
    late_s: float
    """By how much the question came after it was due, s."""
    inference_s: float
    """What the network and its checks took, s."""


def check(
    contract: Contract, vehicle: Vehicle, control_rate: float | None = None, *, imu: bool = False
) -> tuple[str, ...]:
    """Why a policy cannot fly here; empty: it can.

    Args:
        contract: of the policy.
        vehicle: that flies.
        control_rate: at which the policy will be asked, Hz; None: as it was trained.
        imu: whether there are measurements of an IMU.
    """
    reasons = []
    if vehicle.hash != contract.vehicle_hash:
        reasons.append(
            f"vehicle {vehicle.name!r} has hash {vehicle.hash}; accepted: {contract.vehicle_hash}, that of "
            f"{contract.vehicle!r} as the policy was trained on it: load that one, or train the policy again"
        )
    rate = contract.control_rate_hz
    if control_rate is not None and not abs(control_rate - rate) <= 1e-6 * rate:
        reasons.append(f"control_rate is {control_rate} Hz; accepted: {rate:g} Hz, at which the policy was trained")
    if contract.action.mode not in MODES:
        reasons.append(
            f"action.mode of the policy is {contract.action.mode!r}; accepted: {' or '.join(map(repr, MODES))}, "
            "which become collective thrust and body rates"
        )
    for image in contract.images:
        reasons.append(
            f"image {image.name!r} ({image.sees}, {image.height} rows, {image.width} columns): there is no camera; "
            "accepted: a policy without images (from Python, `Policy.act` takes them)"
        )
    known = (*GOAL_FIELDS, *_STATE_FIELDS, PAST_ACTIONS)
    for field in contract.observation:
        same = _STATE_FIELDS.get(field.name)
        if field.name not in known:
            reasons.append(
                f"observation field {field.name!r}: nothing on board says it; accepted: {', '.join(sorted(known))}"
            )
        elif same and (field.size, field.frame, field.unit) != (same.size, same.frame, same.unit):
            reasons.append(
                f"observation field {field.name!r} has size {field.size}, frame {field.frame!r} and unit "
                f"{field.unit!r}; accepted: {same.size}, {same.frame!r} and {same.unit!r}"
            )
        elif field.name in GOAL_FIELDS and (field.frame, field.unit) != ("world", "m"):
            reasons.append(
                f"observation field {field.name!r} has frame {field.frame!r} and unit {field.unit!r}; accepted: "
                "'world' and 'm'"
            )
        elif field.name == PAST_ACTIONS and field.size % ACTION_SIZE:
            reasons.append(f"observation field {field.name!r} has size {field.size}; accepted: a multiple of 4")
        elif field.name in _IMU_FIELDS and not imu:
            reasons.append(f"observation field {field.name!r}: there is no IMU; accepted: a policy without, or an IMU")
    shown = [field.name for field in contract.observation if field.name in GOAL_FIELDS]
    if len(shown) != 1:
        reasons.append(f"observation shows the goals {shown}; accepted: one of {', '.join(GOAL_FIELDS)}")
    return tuple(reasons)


def begin(runtime: Runtime, odometry: Odometry, now: float) -> RuntimeState:
    """Hand over to the policy: the goal starts, and it is shown hovering actions as its last ones, as in training.

    Args:
        runtime: the policy and its goal.
        odometry: the newest motion.
        now: s on the monotonic clock; the first action is due at once.
    """
    contract = runtime.policy.contract
    past = contract.slices.get(PAST_ACTIONS, slice(0, 0))
    count = (past.stop - past.start) // ACTION_SIZE
    actions = np.tile(np.asarray(contract.hover_action, np.float32), (count, 1))
    return RuntimeState(runtime.goal.start(odometry, now), odometry, actions, None, began=now, slots=0, steps=0)


def due(runtime: Runtime, state: RuntimeState) -> float:
    """When the policy is next to be asked, s on the monotonic clock: on a grid from `begin`, without drift."""
    return state.began + state.slots * runtime.period


def act(
    runtime: Runtime, state: RuntimeState, odometry: Odometry, now: float, imu: Imu | None = None
) -> tuple[RuntimeState, Decision]:
    """Ask the policy once.

    Args:
        runtime: the policy and its goal.
        state: from `begin` or the last `act`.
        odometry: the newest motion.
        now: s on the monotonic clock; at or after `due`. Whole periods that have passed since count as missed.
        imu: the newest measurement, for a policy that sees it.

    Raises:
        ValueError: whatever goes wrong, naming the field where there is one: a non-finite observation or action, an
            attitude that is no unit quaternion, no IMU, an error of the network. Nothing is to be commanded then.
    """
    goal = runtime.goal.advance(state.goal, state.odometry, odometry, now)
    targets = runtime.goal.targets(goal, now)
    observation = observe(runtime, targets, state.past_actions, odometry, imu)
    started = time.perf_counter()
    try:
        action, memory = runtime.policy.act(observation, memory=state.memory)
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
        command=runtime.low + (action.astype(np.float64) + 1) / 2 * runtime.span,  # `contract.action.mapping`
        mode=runtime.policy.contract.action.mode,
        position=targets[0],
        late_s=late,
        inference_s=spent,
    )
    return RuntimeState(goal, odometry, past, memory, state.began, state.slots + over + 1, state.steps + 1), decision


def observe(
    runtime: Runtime, targets: np.ndarray, past_actions: np.ndarray, odometry: Odometry, imu: Imu | None = None
) -> np.ndarray:
    """The observation, float32 (o,), as the training's environment makes it.

    Args:
        runtime: the policy and its goal.
        targets: (k, 3) of the goal, world, m.
        past_actions: (k, 4) newest first.
        odometry: the motion.
        imu: for a policy that sees it.

    Raises:
        ValueError: when the policy sees an IMU and there is none.
    """
    contract = runtime.policy.contract
    slices, row = contract.slices, np.empty(contract.observation_size, np.float32)
    row[slices[runtime.goal.field]] = (targets - odometry.position).ravel()
    for name, part in slices.items():
        if name == ATTITUDE.name:
            row[part] = odometry.quaternion
        elif name == VELOCITY.name:
            row[part] = odometry.velocity
        elif name == BODY_RATE.name:
            row[part] = odometry.body_rate
        elif name == PAST_ACTIONS:
            row[part] = past_actions.ravel()
        elif name in _IMU_FIELDS:
            if imu is None:
                raise ValueError(f"observation field {name!r}: there is no measurement of an IMU; accepted: an `Imu`")
            row[part] = imu.gyroscope if name == GYROSCOPE.name else imu.accelerometer
    return row


def outside(runtime: Runtime, odometry: Odometry, now: float, state: RuntimeState | None = None) -> tuple[str, ...]:
    """Why the policy should not fly from this state of the vehicle; empty: it may.

    Args:
        runtime: the policy, its goal and its envelope.
        odometry: the newest motion.
        now: s on the monotonic clock.
        state: of a flight that has begun; None: as if the policy took over now.
    """
    envelope, goal = runtime.envelope, runtime.goal
    where = goal.position(goal.start(odometry, now) if state is None else state.goal, now)
    _, x, y, _ = odometry.quaternion
    limits = (
        ("speed", float(np.linalg.norm(odometry.velocity)), envelope.speed, "m/s"),
        ("tilt", math.acos(min(max(1 - 2 * float(x * x + y * y), -1.0), 1.0)), envelope.tilt, "rad"),
        (
            "distance",
            float(np.linalg.norm(odometry.position - where)),
            goal.fence if envelope.distance is None else envelope.distance,
            "m from the goal",
        ),
    )
    if isinstance(goal, GatesGoal) and state is None:
        gates = goal.gates
        off = math.remainder(heading(odometry.quaternion) - float(gates.start_yaw), math.tau)
        limits += (
            ("distance", float(np.linalg.norm(odometry.position - gates.start)), envelope.start, "m from the start"),
            ("heading", abs(off), envelope.heading, f"rad from the start's, {math.degrees(gates.start_yaw):.0f} deg"),
        )
    return tuple(
        f"{name} is {value:.3g} {unit}; accepted: at most {limit:.3g}"
        for name, value, limit, unit in limits
        if not value <= limit  # true for NaN
    )
