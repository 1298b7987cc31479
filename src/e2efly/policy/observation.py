"""What a policy observes: the words of a field, and the table of the fields that a vehicle knows of itself.

The training's environment, the runtime in flight and the export to C read this table. A task adds fields of its own
(`e2efly.policy.goal.Goal.observation`). Imports no JAX.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

from e2efly.control.vectors import Array


@dataclass(frozen=True)
class Field:
    """A part of the observation vector."""

    name: str
    """Name of the field."""
    size: int
    """Number of values."""
    frame: str
    """`world` (ENU), `body` (FLU), `world_body` (a rotation from body to world) or `none`. The network turns vectors of
    the world into the body frame, and a rotation into the world's up axis in the body frame, unless it is of RAPTOR's
    form."""
    unit: str
    """Unit of each value."""
    scale: float
    """The value, in that unit, that the network gets as 1."""
    description: str
    """How to compute it."""


@dataclass(frozen=True)
class Company:
    """What a policy needs to know of the other vehicles: how many, what of them, how late and how far."""

    count: int
    """Number of the nearest others that it observes."""
    fields: tuple[str, ...]
    """Names of the observation fields that show them."""
    max_age_s: float
    """Largest age of another's pose, s. Until then it is taken to have flown on with its velocity."""
    range_m: float
    """Distance up to which they must be seen, m: the size of the worlds of the training."""
    speed_m_s: float
    """Largest speed of another, m/s: how fast one that is not seen may come nearer."""

    @property
    def told(self) -> str:
        """What a source of their poses must give, in words."""
        near = "" if math.isinf(self.range_m) else f"seen up to {self.range_m:.3g} m, "
        return f"{near}at most {self.max_age_s:g} s old"


ATTITUDE = Field("attitude", 4, "world_body", "1", 1.0, "unit quaternion wxyz, body to world")
VELOCITY = Field("velocity", 3, "world", "m/s", 2.0, "velocity of the centre of mass")
BODY_RATE = Field("body_rate", 3, "body", "rad/s", 4.0, "angular velocity about body x, y, z")
GYROSCOPE = Field("gyroscope", 3, "body", "rad/s", 4.0, "measured angular velocity")
ACCELEROMETER = Field("accelerometer", 3, "body", "m/s^2", 10.0, "measured specific force (level at rest: 0, 0, 9.81)")


OTHERS = "others"
"""Name of the field with the positions of other vehicles."""
PAST_ACTIONS = "past_actions"
"""Name of the field with the policy's own last outputs."""


def past_actions(count: int, size: int = 4) -> Field:
    """The field with the policy's last outputs, of `size` numbers each."""
    return Field(PAST_ACTIONS, size * count, "none", "1", 1.0, "the policy's last outputs in [-1, 1], newest first")


@dataclass(frozen=True)
class Known:
    """What a vehicle knows of itself, or what each of n vehicles knows: JAX arrays in training, NumPy in flight."""

    motion: Any
    """`position` (*n, 3) world, m; `velocity` (*n, 3) world, m/s; `quaternion` (*n, 4) wxyz, body to world; `body_rate`
    (*n, 3) body, rad/s. They are as old and as noisy as the vehicle is shown them."""
    imu: Any
    """`gyroscope` (*n, 3) body, rad/s; `accelerometer` (*n, 3) body, m/s^2. None: there is no IMU."""
    past_actions: Array
    """(*n, k, c) the last actions, newest first."""


@dataclass(frozen=True)
class Own:
    """A field that is the same for every task."""

    field: Field
    value: Callable[[Known], Array]
    """Computes it, (*n, size). It computes in the library of its arrays (`e2efly.control.vectors.namespace`)."""
    source: Literal["motion", "imu", "past_actions"] = "motion"
    """What it needs. A field of the motion is always on, one of the IMU if the IMU is observed."""


OWN = (
    Own(ATTITUDE, lambda known: known.motion.quaternion),
    Own(VELOCITY, lambda known: known.motion.velocity),
    Own(BODY_RATE, lambda known: known.motion.body_rate),
    Own(GYROSCOPE, lambda known: known.imu.gyroscope, "imu"),
    Own(ACCELEROMETER, lambda known: known.imu.accelerometer, "imu"),
    Own(past_actions(1), lambda known: known.past_actions.reshape(*known.past_actions.shape[:-2], -1), PAST_ACTIONS),
)
"""The table, in the order of the observation, in which they follow the task's own fields. An entry is all that a field
needs. A policy that was exported before an entry was added goes on without it, in the simulator and in flight."""


INERTIAL = {ATTITUDE.name, GYROSCOPE.name, ACCELEROMETER.name, PAST_ACTIONS}
"""Names of the fields that a flight controller alone tells, without a source of poses."""


def own_fields(*, imu: bool, actions: int, size: int = 4) -> tuple[Own, ...]:
    """The rows of the table that there are with or without an IMU, and with a number of past actions of `size` numbers
    each.
    """
    there = {"motion": True, "imu": imu, PAST_ACTIONS: actions > 0}
    rows = (row for row in OWN if there[row.source])
    return tuple(
        dataclasses.replace(row, field=past_actions(actions, size)) if row.source == PAST_ACTIONS else row
        for row in rows
    )
