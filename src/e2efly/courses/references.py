"""References to follow. Every kind becomes one quintic spline, so that all of them share one compiled program.

A spline has uniform knots with position, velocity and acceleration (quintic Hermite pieces, twice continuously
differentiable). A circle of the tracking task differs from its spline by less than 0.01 mm, a 3 m/s lemniscate by less
than 0.1 mm. The arithmetic uses the library of its arrays: NumPy or JAX (also during tracing).
"""

import csv
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config.domain import Domain, Extent
from e2efly.config.tables import LARGEST, shown

KNOT_PERIOD = 0.5
"""Time between the knots of all references except the user's own, s."""
POINTS = 10
"""Number of reference points that the policy observes."""
SPACING = 0.1
"""Time between these points, s. The first is the point to be at now."""
LONGEST = 3600.0
"""Longest reference, s. Its knots are computed beforehand."""
_CLOSEST = 1e-3
"""Shortest time between the rows of a file, s."""


@dataclass(frozen=True)
class Spline:
    """The knots of each vehicle: [:, :, 0] position, m; 1 velocity, m/s; 2 acceleration, m/s^2."""

    knots: Any
    """(n, m, 3, 3), a NumPy or JAX array."""
    period: float = KNOT_PERIOD
    """Time between knots, s."""
    end: float = math.inf
    """Time after which the position is held, s, if it is before the last knot."""

    @property
    def duration(self) -> float:
        """Time after which the position is held, s."""
        return min(self.end, (self.knots.shape[1] - 1) * self.period)

    @property
    def domain(self) -> "Domain":
        """Its top speed and acceleration at a knot."""
        speed, acceleration = (np.linalg.norm(self.knots[:, :, i], axis=-1).max() for i in (1, 2))
        return motion_domain(float(speed), float(acceleration))

    def position(self, time: Any) -> Any:
        """Positions (n, k, 3) at the times (n, k), s, in the arrays' own library. Positions are held at the ends."""
        xp = time.__array_namespace__()
        index, s = self.piece(time)
        rows, knots = xp.arange(self.knots.shape[0])[:, None], xp.asarray(self.knots)
        c0, c1, c2, c3, c4, c5 = _quintic(knots[rows, index], knots[rows, index + 1], self.period)
        s = s[..., None]
        return c0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))))

    def piece(self, time: Any) -> tuple[Any, Any]:
        """Index of the piece at each time, s, and the part of this piece that has passed, in [0, 1]."""
        xp = time.__array_namespace__()
        u = xp.clip(time, 0.0, self.duration) / self.period
        index = xp.minimum(u.astype(xp.int32), self.knots.shape[1] - 2)
        return index, u - index


def motion_domain(speed: float, acceleration: float) -> Domain:
    """The domain of references up to a speed, m/s, and an acceleration, m/s^2. Slower ones belong to it."""
    return (
        Extent("reference_speed", "m/s", 0.0, round(speed, 4)),
        Extent("reference_acceleration", "m/s^2", 0.0, round(acceleration, 4)),
    )


def _quintic(a: Any, b: Any, h: float) -> tuple[Any, ...]:
    """Coefficients of s^0 to s^5 between knots a and b (..., 3, 3), h seconds apart, s in [0, 1]; each (..., 3)."""
    p0, v0, a0 = a[..., 0, :], a[..., 1, :] * h, a[..., 2, :] * (h * h / 2)
    p1, v1, a1 = b[..., 0, :], b[..., 1, :] * h, b[..., 2, :] * (h * h / 2)
    d = p1 - p0
    c3 = 10 * d - 6 * v0 - 4 * v1 - 3 * a0 + a1
    c4 = -15 * d + 8 * v0 + 7 * v1 + 3 * a0 - 2 * a1
    c5 = 6 * d - 3 * v0 - 3 * v1 - a0 + a1
    return p0, v0, a0, c3, c4, c5


def knot_count(duration: float) -> int:
    """Knots that cover `duration` seconds."""
    return math.ceil(duration / KNOT_PERIOD) + 1


@dataclass(frozen=True)
class Lissajous:
    """A horizontal curve x = X sin(w t + p + d), y = Y sin(k (w t + p)): a circle or a figure of eight, by its numbers.

    The numbers may be arrays of shape ().
    """

    half_x: Any
    """X, m."""
    half_y: Any
    """Y, m."""
    ratio: Any
    """k: number of turns of y per turn of x."""
    shift: Any
    """d, rad."""
    rate: Any
    """w, rad/s."""

    @staticmethod
    def circle(radius: float, rate: float) -> "Lissajous":
        """A circle, from its radius in m and its angular rate in rad/s, counter-clockwise."""
        return Lissajous(radius, radius, 1.0, math.pi / 2, rate)

    @staticmethod
    def lemniscate(half_length: float, speed: float) -> "Lissajous":
        """Gerono's figure of eight, x = A sin, y = A sin cos, from A in m and the top speed (in the middle) in m/s."""
        return Lissajous(half_length, half_length / 2, 2.0, 0.0, speed / (half_length * math.sqrt(2.0)))

    def phase(self, centre: Any, start: Any) -> Any:
        """The phases p in [-pi, pi], (n,), rad, of the curves about `centre` (3,), m, with these first knots. `centre`,
        (3,), m, is that of all curves. `start` is (n, 3, 3), the first knot of each: position, m; velocity, m/s;
        acceleration, m/s^2.
        """
        xp = start.__array_namespace__()
        away = (start[:, 0] - xp.asarray(centre)) / self.half_x
        still = self.rate == 0  # without rate, the velocity gives no phase, but for a circle the other axis does
        turning = start[:, 1, 0] / (self.half_x * xp.where(still, 1.0, self.rate))
        angle = xp.atan2(away[:, 0], xp.where(still, -away[:, 1], turning)) - self.shift
        return xp.atan2(xp.sin(angle), xp.cos(angle))

    @property
    def domain(self) -> Domain:
        """Its top speed and acceleration."""
        return self.spline(np.zeros(3), np.linspace(-np.pi, np.pi, 361), 1).domain

    def spline(self, centre: Any, phase: Any, m: int) -> Spline:
        """The curve about `centre` (3,), m, from each phase p (n,), rad, as `m` knots in the library of the phases."""
        xp = phase.__array_namespace__()
        angle = self.rate * KNOT_PERIOD * xp.arange(m) + phase[:, None]
        x, y = angle + self.shift, self.ratio * angle
        wx, wy, zero = self.rate, self.ratio * self.rate, xp.zeros_like(angle)
        p = xp.stack([self.half_x * xp.sin(x), self.half_y * xp.sin(y), zero], axis=-1)
        v = xp.stack([wx * self.half_x * xp.cos(x), wy * self.half_y * xp.cos(y), zero], axis=-1)
        a = -xp.stack([wx**2 * self.half_x * xp.sin(x), wy**2 * self.half_y * xp.sin(y), zero], axis=-1)
        return Spline(xp.stack([p + xp.asarray(centre), v, a], axis=-2))


def read_csv(path: str | Path) -> np.ndarray:
    """Read a reference: columns t, x, y, z with a header line, in seconds and metres. t rises from any value.

    Returns:
        (rows, 4) with t from zero.

    Raises:
        ValueError: naming the file, the line and what is accepted.
    """
    accepted = (
        "accepted: a header 't,x,y,z', then at least 3 rows of finite numbers (s, m), t rising by at least "
        f"{_CLOSEST:g} s and over at most {LONGEST:g} s, x, y, z at most {LARGEST:g} in size"
    )
    try:
        with Path(path).open(newline="", encoding="utf-8-sig") as file:
            lines = list(csv.reader(file))
    except (OSError, ValueError, csv.Error) as error:
        raise ValueError(f"reference {str(path)!r} cannot be read: {error}") from None
    if not lines or [cell.strip().lower() for cell in lines[0]] != ["t", "x", "y", "z"]:
        raise ValueError(f"reference {path}, line 1: {shown(lines[0]) if lines else 'empty'}; {accepted}")
    rows = []
    for number, cells in enumerate(lines[1:], start=2):
        try:
            row = [float(cell) for cell in cells]
        except ValueError:
            row = []
        good = len(row) == 4 and math.isfinite(row[0]) and all(abs(x) <= LARGEST for x in row[1:])  # false for NaN
        if good and rows:
            good = row[0] - rows[-1][0] >= _CLOSEST and row[0] - rows[0][0] <= LONGEST
        if not good:
            raise ValueError(f"reference {path}, line {number}: {shown(cells)}; {accepted}")
        rows.append(row)
    if len(rows) < 3:
        raise ValueError(f"reference {path}: {len(rows)} rows; {accepted}")
    table = np.array(rows)
    table[:, 0] -= table[0, 0]
    return table


def through_points(table: np.ndarray) -> Spline:
    """The natural cubic spline through the rows t, x, y, z, for one vehicle. After the last row the position is held.

    Its knots are as close as the closest rows (0.02 to 0.5 s apart), so that no point is smoothed away.
    """
    from scipy.interpolate import CubicSpline  # only a user's own reference needs it

    spline = CubicSpline(table[:, 0], table[:, 1:], bc_type="natural")
    end = float(table[-1, 0])
    period = float(np.clip(np.min(np.diff(table[:, 0])), 0.02, KNOT_PERIOD))
    t = period * np.arange(math.ceil(end / period) + 1)
    return Spline(np.stack([spline(t, order) for order in range(3)], axis=1)[None], period, end)
