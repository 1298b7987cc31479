"""References to follow: every kind becomes one quintic spline, so that all of them share one compiled program.

A spline has uniform knots with position, velocity and acceleration (quintic Hermite pieces, twice continuously
differentiable). A circle of the tracking task differs from its spline by less than 0.01 mm, a 3 m/s lemniscate by
less than 0.1 mm.
"""

import csv
import math
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

Point = Array | tuple[float, float, float]
"""A point, m."""
KNOT_PERIOD = 0.5
"""Seconds between the knots of all references but a user's."""


@partial(jax.tree_util.register_dataclass, data_fields=["knots"], meta_fields=["period", "end"])
@dataclass(frozen=True)
class Spline:
    """Knots a vehicle: [:, :, 0] position, m; 1 velocity, m/s; 2 acceleration, m/s^2."""

    knots: Float[Array | np.ndarray, "n m 3 3"]
    period: float = KNOT_PERIOD
    """Seconds between knots."""
    end: float = math.inf
    """Seconds after which the position is held, where that is before the last knot."""

    def position(self, time: Float[Array, "n k"]) -> Float[Array, "n k 3"]:
        """Positions at the given times, s; held at the ends."""
        last = self.knots.shape[1] - 1
        u = jnp.clip(time, 0.0, min(self.end, last * self.period)) / self.period
        index = jnp.minimum(u.astype(jnp.int32), last - 1)
        s = (u - index)[..., None]
        rows, knots = jnp.arange(self.knots.shape[0])[:, None], jnp.asarray(self.knots)
        a, b = knots[rows, index], knots[rows, index + 1]
        h = self.period
        p0, v0, a0 = a[..., 0, :], a[..., 1, :] * h, a[..., 2, :] * (h * h / 2)
        p1, v1, a1 = b[..., 0, :], b[..., 1, :] * h, b[..., 2, :] * (h * h / 2)
        d = p1 - p0
        c3 = 10 * d - 6 * v0 - 4 * v1 - 3 * a0 + a1
        c4 = -15 * d + 8 * v0 + 7 * v1 + 3 * a0 - 2 * a1
        c5 = 6 * d - 3 * v0 - 3 * v1 - a0 + a1
        return p0 + s * (v0 + s * (a0 + s * (c3 + s * (c4 + s * c5))))


def knot_count(duration: float) -> int:
    """Knots that cover `duration` seconds."""
    return math.ceil(duration / KNOT_PERIOD) + 1


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Lissajous:
    """A level curve x = X sin(w t + p + d), y = Y sin(k (w t + p)): a circle or a figure of eight, by its numbers."""

    half_x: float | Array
    """X, m."""
    half_y: float | Array
    """Y, m."""
    ratio: float | Array
    """k: turns of y for one of x."""
    shift: float | Array
    """d, rad."""
    rate: float | Array
    """w, rad/s."""

    @staticmethod
    def circle(radius: float, rate: float) -> "Lissajous":
        """Radius in m, angular rate in rad/s, counter-clockwise."""
        return Lissajous(radius, radius, 1.0, math.pi / 2, rate)

    @staticmethod
    def lemniscate(half_length: float, speed: float) -> "Lissajous":
        """Gerono's figure of eight, x = A sin, y = A sin cos: A in m, top speed (in the middle) in m/s."""
        return Lissajous(half_length, half_length / 2, 2.0, 0.0, speed / (half_length * math.sqrt(2.0)))

    def spline(self, centre: Point, phase: Float[Array, " n"], m: int) -> Spline:
        """The curve about `centre` from each phase p, rad, as `m` knots."""
        angle = self.rate * KNOT_PERIOD * jnp.arange(m) + phase[:, None]
        x, y = angle + self.shift, self.ratio * angle
        wx, wy, zero = self.rate, self.ratio * self.rate, jnp.zeros_like(angle)
        p = jnp.stack([self.half_x * jnp.sin(x), self.half_y * jnp.sin(y), zero], axis=-1)
        v = jnp.stack([wx * self.half_x * jnp.cos(x), wy * self.half_y * jnp.cos(y), zero], axis=-1)
        a = -jnp.stack([wx**2 * self.half_x * jnp.sin(x), wy**2 * self.half_y * jnp.sin(y), zero], axis=-1)
        return Spline(jnp.stack([p + jnp.asarray(centre), v, a], axis=-2))


def polynomial(
    key: PRNGKeyArray, centre: Point, reach: float | Array, speed: float | Array, n: int, m: int, every: int = 4
) -> Spline:
    """Random and smooth: minimum-jerk-like pieces of `every` knot periods between random points of a box.

    The way points lie uniformly within `reach` of the centre, an axis. Their velocities are the mean slope to their
    neighbours, the average speed of each vehicle's path being uniform between 0 and `speed`, m/s.
    """
    points_key, speed_key = jax.random.split(key)
    count = math.ceil((m - 1) / every) + 1
    points = reach * jax.random.uniform(points_key, (n, count + 2, 3), minval=-1.0, maxval=1.0)
    period = every * KNOT_PERIOD
    slope = jnp.diff(points, axis=1) / period
    # shrink about the centre so that no piece is faster, on average, than the speed drawn for this vehicle
    drawn = speed * jax.random.uniform(speed_key, (n, 1, 1))
    shrink = jnp.minimum(1.0, drawn / jnp.max(jnp.linalg.norm(slope, axis=-1), axis=1)[:, None, None])
    points, slope = points * shrink, slope * shrink
    velocity = (slope[:, 1:] + slope[:, :-1]) / 2
    coarse = jnp.stack([points[:, 1:-1], velocity, jnp.zeros_like(velocity)], axis=-2)
    return Spline(_refine(coarse, period, every, m).at[:, :, 0].add(jnp.asarray(centre)))


def _refine(coarse: Float[Array, "n c 3 3"], period: float, every: int, m: int) -> Float[Array, "n m 3 3"]:
    """Quintic pieces over `every` knot periods, sampled with their derivatives at each knot: the same curve."""
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


def read_csv(path: str | Path) -> np.ndarray:
    """Read a reference: columns t, x, y, z with a header line, seconds and metres, t rising from any value.

    Returns:
        (rows, 4), t from zero.

    Raises:
        ValueError: naming the file, the line and what is accepted.
    """
    accepted = "accepted: a header 't,x,y,z', then at least 3 rows of finite numbers, t rising (s, m)"
    try:
        with Path(path).open(newline="", encoding="utf-8") as file:
            lines = list(csv.reader(file))
    except (OSError, UnicodeDecodeError) as error:
        raise ValueError(f"reference {str(path)!r} cannot be read: {error}") from None
    if not lines or [cell.strip().lower() for cell in lines[0]] != ["t", "x", "y", "z"]:
        raise ValueError(f"reference {path}, line 1: {lines[0] if lines else 'empty'}; {accepted}")
    rows = []
    for number, cells in enumerate(lines[1:], start=2):
        try:
            row = [float(cell) for cell in cells]
        except ValueError:
            row = []
        if len(row) != 4 or not all(map(math.isfinite, row)) or (rows and row[0] <= rows[-1][0]):
            raise ValueError(f"reference {path}, line {number}: {cells}; {accepted}")
        rows.append(row)
    if len(rows) < 3:
        raise ValueError(f"reference {path}: {len(rows)} rows; {accepted}")
    table = np.array(rows)
    table[:, 0] -= table[0, 0]
    return table


def through_points(table: np.ndarray) -> Spline:
    """The natural cubic spline through the rows t, x, y, z, of one vehicle; held after the last row.

    Its knots are as close as the closest rows (0.02 to 0.5 s apart), so that no point is smoothed away.
    """
    from scipy.interpolate import CubicSpline  # only a user's own reference needs it

    spline = CubicSpline(table[:, 0], table[:, 1:], bc_type="natural")
    end = float(table[-1, 0])
    period = float(np.clip(np.min(np.diff(table[:, 0])), 0.02, KNOT_PERIOD))
    t = period * np.arange(math.ceil(end / period) + 1)
    return Spline(np.stack([spline(t, order) for order in range(3)], axis=1)[None], period, end)
