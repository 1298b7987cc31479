"""What a vehicle knows of the others of its world: their motion, and the fields by which a policy observes it.

The same code in training, where the others are rows of the batch, and in flight, where they are tracked poses.
"""

from dataclasses import dataclass
from typing import Any

from e2efly.control.vectors import Array, namespace
from e2efly.courses.origin import Origin
from e2efly.policy.observation import Field

FAR = 50.0
"""Distance at which another vehicle is shown that is not there, m."""
AHEAD = 1.0
"""Time within which the closest approach of two vehicles counts, s."""


@dataclass(frozen=True)
class Others:
    """The motion of k other vehicles, for each of n vehicles."""

    position: Array
    """(n, k, 3) world, m."""
    velocity: Array
    """(n, k, 3) world, m/s."""

    def offsets(self, body: Any) -> Array:
        """(n, 3 k) their positions minus the vehicle's, world, m, one after another."""
        return (self.position - body.position[:, None]).reshape(self.position.shape[0], -1)

    def motion(self, body: Any) -> Array:
        """(n, 3 k) their velocities minus the vehicle's, world, m/s, one after another."""
        return (self.velocity - body.velocity[:, None]).reshape(self.velocity.shape[0], -1)

    def seen_from(self, origin: Origin) -> "Others":
        """The same motion in the axes of a world that has this origin."""
        return Others(origin.seen(self.position), origin.seen_vectors(self.velocity))


def approach(offset: tuple[Array, ...], motion: tuple[Array, ...]) -> Array:
    """Squared distance at the closest approach within `AHEAD`, m^2, if both vehicles fly straight on.

    Args:
        offset: x, y, z of the other's position minus the vehicle's, m.
        motion: x, y, z of its velocity minus the vehicle's, m/s.
    """
    (x, y, z), (vx, vy, vz) = offset, motion
    when = (-(x * vx + y * vy + z * vz) / (vx * vx + vy * vy + vz * vz + 1e-9)).clip(0.0, AHEAD)
    return (x + when * vx) ** 2 + (y + when * vy) ** 2 + (z + when * vz) ** 2


def nobody(n: int, count: int, like: Array) -> Others:
    """No other vehicle: all are `FAR` above, at rest. The library is that of `like`."""
    zero = namespace(like).zeros((n, count, 3))
    return Others(zero + namespace(like).asarray([0.0, 0.0, FAR]), zero)


def others_fields(count: int) -> tuple[Field, Field]:
    """The fields of the observation for the `count` nearest other vehicles: `Others.offsets` and `Others.motion`."""
    where = f"positions of the {count} nearest other vehicles minus the vehicle's"
    motion = "velocities of the same others, minus the vehicle's"
    return (
        Field("others", 3 * count, "world", "m", 2.0, where),
        Field("others_velocity", 3 * count, "world", "m/s", 2.0, motion),
    )
