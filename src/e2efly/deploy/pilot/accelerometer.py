"""The flight controller's accelerometer: whether it can be flown by, and what its numbers are worth.

On the ground it must show gravity, upright. In the air poses tell its scale: over seconds the force that it feels is
gravity and what the velocity has changed by.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from e2efly.deploy.attitude import Attitude
from e2efly.vehicles.vehicle import GRAVITY

COUNTS = (200.0, 9000.0)
"""Counts per gravity that controllers use: 256 to 8192, with their errors."""
UPRIGHT = 0.35
"""Largest angle between the force at rest and the body's z axis, rad."""
MEMORY_S = 1.0
"""Over which the scale is learned, s."""
RANGE = (0.85, 1.18)
"""Bounds of the scale."""


def standing_problem(counts: np.ndarray) -> str | None:
    """Why this is no accelerometer of a vehicle that stands; None: it may be one.

    Args:
        counts: (3,) as the controller tells them, body FLU, smoothed.
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
    """The factor that makes the accelerometer's force the true one, as poses in flight show it."""

    felt: float = GRAVITY
    """Vertical force that it felt, smoothed over `MEMORY_S`, m/s^2."""
    flown: float = GRAVITY
    """The one that the poses showed, m/s^2."""
    climb: float | None = None
    """Vertical velocity of the newest pose, m/s."""

    @property
    def value(self) -> float:
        """The factor, within `RANGE`; 1 before anything was learned."""
        return min(max(self.flown / max(self.felt, 0.1), RANGE[0]), RANGE[1])


def learn(before: Scale, attitude: Attitude, force: np.ndarray, climb: float, dt: float) -> Scale:
    """Learn from a measurement in flight.

    Args:
        before: so far.
        attitude: the flight controller's.
        force: (3,) specific force, body FLU, m/s^2, by the scale at rest.
        climb: vertical velocity by the newest pose, m/s.
        dt: since the measurement before, s.
    """
    share = -math.expm1(-dt / MEMORY_S)
    up = float(level(attitude, force)[2])
    changed = 0.0 if before.climb is None else climb - before.climb
    return Scale(
        before.felt + share * (up - before.felt),
        before.flown + share * (GRAVITY - before.flown) + changed / MEMORY_S,
        climb,
    )


def level(attitude: Attitude, vector: Sequence[float] | np.ndarray) -> np.ndarray:
    """(3,) a vector of the body, FLU, in axes that are level and look along the heading."""
    fx, fy, fz = (float(v) for v in vector)
    cr, sr = math.cos(attitude.roll), math.sin(attitude.roll)
    cp, sp = math.cos(attitude.pitch), math.sin(attitude.pitch)
    lifted = sr * fy + cr * fz
    return np.array([cp * fx + sp * lifted, cr * fy - sr * fz, cp * lifted - sp * fx])
