"""The flight controller's accelerometer: whether it is good enough to fly with, and the scale of its numbers.

On the ground it must show gravity, upright. In the air, poses tell its scale: over some seconds, the force that it
measures is gravity plus the change of velocity.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from e2efly.flight.attitude import Attitude, level
from e2efly.vehicles.gravity import GRAVITY

COUNTS = (200.0, 9000.0)
"""Counts per gravity that controllers use: 256 to 8192, with a margin for their errors."""
UPRIGHT = 0.35
"""The largest angle between the force at rest and the body's z axis, rad."""
MEMORY_S, SMOOTH_S = 1.0, 0.1
"""Time over which the scale is learned, s, and over which the vertical velocity of noisy poses is smoothed, s. The
force is smoothed in the same way, or it would be ahead of the velocity."""
CALM, CALM_S = 2.5, 0.15
"""Nothing is learned from a force that differs from gravity by more than the first value, m/s^2, nor for the second, s,
after it. The poses are too late for it."""
RANGE = (0.85, 1.18)
"""Bounds of the scale."""


def standing_problem(counts: np.ndarray) -> str | None:
    """Why this cannot be the accelerometer of a vehicle that stands on the ground. None: it can. `counts` is (3,), as
    the controller reports them, body FLU, smoothed.
    """
    size = float(np.linalg.norm(counts))
    shown = [round(float(c)) for c in counts]
    if not COUNTS[0] <= size <= COUNTS[1]:  # true for NaN
        return f"it shows {shown}, {size:.0f} counts in all; accepted: {COUNTS[0]:.0f} to {COUNTS[1]:.0f} at rest"
    angle = math.acos(max(-1.0, min(1.0, float(counts[2]) / size)))
    if angle > UPRIGHT:
        return (
            f"it shows {shown}, {math.degrees(angle):.0f} deg from the body's z axis; accepted: "
            f"{math.degrees(UPRIGHT):.0f}, level and pointing up"
        )
    return None


@dataclass(frozen=True)
class Scale:
    """The factor that corrects the accelerometer's force, learned from poses in flight."""

    felt: float = GRAVITY
    """Vertical force that the accelerometer measured, smoothed over `MEMORY_S`, m/s^2."""
    flown: float = GRAVITY
    """Vertical force that the poses showed, m/s^2."""
    up: float = GRAVITY
    """The newest vertical forces, smoothed over `SMOOTH_S`, m/s^2."""
    wait: float = 0.0
    """For how long nothing is learned, s."""
    climb: float | None = None
    """Vertical velocity of the poses, smoothed, m/s. None: nothing is known of the time before, so the next measurement
    only begins the comparison."""

    @property
    def value(self) -> float:
        """The factor, within `RANGE`. 1 before anything was learned."""
        return min(max(self.flown / max(self.felt, 0.1), RANGE[0]), RANGE[1])


def learn(before: Scale, attitude: Attitude, force: np.ndarray, climb: float, dt: float) -> Scale:
    """Learn from a measurement in flight. `force` is (3,) specific force, body FLU, m/s^2, with the scale at rest.
    `climb` is the vertical velocity of the newest pose, m/s, and `dt` the time since the previous measurement, s.
    """
    up = level(attitude, force)[2]
    wait = CALM_S if abs(up * before.value - GRAVITY) > CALM else before.wait - dt
    if wait > 0:
        return replace(before, wait=wait, climb=None)
    if before.climb is None:
        return replace(before, up=up, climb=climb)
    share, smoothed = -math.expm1(-dt / MEMORY_S), -math.expm1(-dt / SMOOTH_S)
    climb = before.climb + (climb - before.climb) * smoothed
    up = before.up + (up - before.up) * smoothed
    return Scale(
        before.felt + share * (up - before.felt),
        before.flown + share * (GRAVITY - before.flown) + (climb - before.climb) / MEMORY_S,
        up,
        climb=climb,
    )
