"""Functions for verdicts.

They use the library of their arrays, NumPy or JAX, so that flight and training judge alike.
"""

from typing import Any

from e2efly.control.vectors import Array, Quat, namespace
from e2efly.policy.goal import Shape


def distance(a: Array, b: Array) -> Array:
    """(n,) distance between points (n, 3), m."""
    return namespace(a, b).linalg.norm(a - b, axis=-1)


def offsets(targets: Array, body: Any) -> Array:
    """(n, 3 k) targets (n, k, 3) minus the vehicle's position, world, m, one target after another."""
    return (targets - body.position[:, None]).reshape(targets.shape[0], -1)


def touches_ground(shape: Shape, body: Any) -> Array:
    """Whether the feet, `feet_height` below the centre of mass, are at or under the ground z = 0."""
    return body.position[:, 2] <= shape.feet_height


def held_longer(held: Array, well: Array, period: float | Array) -> Array:
    """Time for which a condition has held, (n,) s: one control step more if it holds, otherwise 0."""
    return namespace(held, well).where(well, held + period, 0.0)


def upright(body: Any, tilt: float | Array) -> Array:
    """Whether the vehicle is tilted by less than `tilt`, rad."""
    return Quat.of(body.quaternion).z_axis().z > namespace(body.quaternion).cos(tilt)
