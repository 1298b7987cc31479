"""Random references, and splines and curves as pytrees whose numbers are leaves of the compiled programs."""

import math

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.courses.references import KNOT_PERIOD, Lissajous, Spline

Point = Array | tuple[float, float, float]
"""A point, m."""

jax.tree_util.register_dataclass(Spline, data_fields=["knots"], meta_fields=["period", "end"])
jax.tree_util.register_dataclass(Lissajous, data_fields=list(Lissajous.__dataclass_fields__), meta_fields=[])


def polynomial(
    key: PRNGKeyArray, centre: Point, reach: float | Array, speed: float | Array, n: int, m: int, every: int = 4
) -> Spline:
    """A random smooth reference: minimum-jerk-like pieces of `every` knot periods between random points of a box.

    The points lie uniformly within `reach` of the centre per axis. Their velocities are the mean slope to their
    neighbours. The average speed of each vehicle's path is uniform between 0 and `speed`, m/s.
    """
    points_key, speed_key = jax.random.split(key)
    count = math.ceil((m - 1) / every) + 1
    points = reach * jax.random.uniform(points_key, (n, count + 2, 3), minval=-1.0, maxval=1.0)
    period = every * KNOT_PERIOD
    slope = jnp.diff(points, axis=1) / period
    # shrink the path about its centre so that no piece is faster, on average, than the speed drawn for this vehicle
    drawn = speed * jax.random.uniform(speed_key, (n, 1, 1))
    shrink = jnp.minimum(1.0, drawn / jnp.max(jnp.linalg.norm(slope, axis=-1), axis=1)[:, None, None])
    points, slope = points * shrink, slope * shrink
    velocity = (slope[:, 1:] + slope[:, :-1]) / 2
    coarse = jnp.stack([points[:, 1:-1], velocity, jnp.zeros_like(velocity)], axis=-2)
    return Spline(_refine(coarse, period, every, m).at[:, :, 0].add(jnp.asarray(centre)))


def _refine(coarse: Float[Array, "n c 3 3"], period: float, every: int, m: int) -> Float[Array, "n m 3 3"]:
    """Sample quintic pieces over `every` knot periods, with their derivatives, at each knot.

    The curve stays the same.
    """
    s = np.arange(m) / every
    index = np.minimum(s.astype(int), coarse.shape[1] - 2)
    basis = np.stack([_basis(order, s - index) / period**order for order in range(3)])  # (order, 6, m)
    scale = np.array([1.0, period, period**2])
    ends = jnp.concatenate([coarse[:, index], coarse[:, index + 1]], axis=2) * np.tile(scale, 2)[:, None]
    return jnp.einsum("oem,nmed->nmod", jnp.asarray(basis, coarse.dtype), ends)


def _basis(order: int, s: np.ndarray) -> np.ndarray:
    """The `order`-th derivative of the six quintic Hermite basis functions (p0, v0, a0, p1, v1, a1) at s, (6, m)."""
    coefficients = np.array(
        [
            [-6, 15, -10, 0, 0, 1],
            [-3, 8, -6, 0, 1, 0],
            [-0.5, 1.5, -1.5, 0.5, 0, 0],
            [6, -15, 10, 0, 0, 0],
            [-3, 7, -4, 0, 0, 0],
            [0.5, -1, 0.5, 0, 0, 0],
        ]
    )
    return np.stack([np.polyval(np.polyder(np.poly1d(row), order), s) for row in coefficients])
