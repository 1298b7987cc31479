"""What a vehicle knows of the others of its world: their motion, and the fields by which a policy observes it.

The same code in training, where the others are rows of the batch, and in flight, where they are tracked poses.
"""

import math
from dataclasses import dataclass
from typing import Any

from e2efly.control.vectors import Array, namespace
from e2efly.courses.origin import Origin
from e2efly.policy.observation import OTHERS, Company, Field

FAR = 50.0
"""Distance at which another vehicle is shown that is not there, m."""


USUAL = Company(0, (), 0.1, math.inf, 5.0)
"""What is asked where no contract says it."""


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


def nobody(position: Array, count: int) -> Others:
    """`count` vehicles that are not there, for vehicles at positions (n, 3), m: all are `FAR` above, at rest."""
    xp = namespace(position)
    zero = xp.zeros((position.shape[0], count, 3))
    return Others(position[:, None] + xp.asarray([0.0, 0.0, FAR]) + zero, zero)


def others_fields(count: int) -> tuple[Field, Field]:
    """The fields of the observation for the `count` nearest other vehicles: `Others.offsets` and `Others.motion`."""
    where = f"positions of the {count} nearest other vehicles minus the vehicle's"
    motion = "velocities of the same others, minus the vehicle's"
    return (
        Field(OTHERS, 3 * count, "world", "m", 2.0, where),
        Field("others_velocity", 3 * count, "world", "m/s", 2.0, motion),
    )


def company_of(count: int, range_m: float, speed_m_s: float) -> Company:
    """What a policy needs that observes `others_fields` of the `count` nearest others."""
    fields = tuple(field.name for field in others_fields(count))
    return Company(count, fields, USUAL.max_age_s, round(range_m, 3), speed_m_s)
