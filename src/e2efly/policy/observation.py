"""What a policy observes, field by field, in the words of the contract. Imports no JAX."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Field:
    """A part of the observation vector."""

    name: str
    """Name of the field."""
    size: int
    """Number of values."""
    frame: str
    """`world` (ENU), `body` (FLU), `world_body` (a rotation from body to world) or `none`."""
    unit: str
    """Unit of each value."""
    scale: float
    """The value, in that unit, that the network gets as 1."""
    description: str
    """How to compute it."""


ATTITUDE = Field("attitude", 4, "world_body", "1", 1.0, "unit quaternion wxyz, body to world")
VELOCITY = Field("velocity", 3, "world", "m/s", 2.0, "velocity of the centre of mass")
BODY_RATE = Field("body_rate", 3, "body", "rad/s", 4.0, "angular velocity about body x, y, z")
GYROSCOPE = Field("gyroscope", 3, "body", "rad/s", 4.0, "measured angular velocity")
ACCELEROMETER = Field("accelerometer", 3, "body", "m/s^2", 10.0, "measured specific force (level at rest: 0, 0, 9.81)")


PAST_ACTIONS = "past_actions"
"""Name of the field with the policy's own last outputs."""


def past_actions(count: int) -> Field:
    """The field with the policy's last outputs."""
    return Field(PAST_ACTIONS, 4 * count, "none", "1", 1.0, "the policy's last outputs in [-1, 1], newest first")
