"""Whether the odometry's heading is that of the vehicle: a tilt must accelerate the vehicle in the direction that is
seen.

Nothing on the ground shows a wrong heading. A hover controller with a wrong heading pushes to the wrong side, harder
and harder. In the air, two horizontal accelerations are compared. The first follows from the flight controller's roll
and pitch, turned by the odometry's heading. The second follows from the odometry's velocity. Turned by the heading's
error, the two are alike, whether the source's axes are turned or the body's. Wind and gusts, which push without a tilt,
are seldom alike, and not for long.
"""

import cmath
import math
from dataclasses import dataclass, replace

from e2efly.flight.attitude import Attitude
from e2efly.policy.odometry import Odometry, yaw_of
from e2efly.vehicles.gravity import GRAVITY

SMOOTHING_S = 0.15
"""Time over which velocities are differentiated to accelerations, s."""
STEADY_S = 2.0
"""A difference that lasts longer than this is wind or a tilted sensor, s."""
MEMORY_S = 0.7
"""Time over which accelerations are compared, s."""
PUSH = 0.3
"""With less acceleration than this, the heading cannot be determined, m/s^2, root mean square."""
COHERENCE = 0.93
"""How alike the seen and the expected acceleration must be for the error to be trusted, 0 to 1, ..."""
RATIO = (0.7, 1.5)
"""... and the allowed range of their ratio."""
SMALL, LASTING_S = 0.35, 0.12
"""An error above the first value, rad, is trusted only after the second, s, because a growing gust can look like one
for a moment."""
LONGEST_STEP = 0.1
"""The longest time between two odometries, s. After a longer pause the comparison starts again."""


@dataclass(frozen=True)
class HeadingWatch:
    """What has been observed so far. Horizontal vectors are complex numbers, x + iy, world."""

    time: float = -math.inf
    """Time of the newest odometry, s."""
    velocity: complex = 0j
    """Velocity, smoothed, m/s."""
    push: complex = 0j
    """Expected acceleration from the tilt (the push), smoothed, m/s^2."""
    steady: tuple[complex, complex] = (0j, 0j)
    """Lasting parts of the push and of the flown acceleration, m/s^2."""
    cross: complex = 0j
    """Mean of the flown acceleration times the complex conjugate of the push."""
    power: tuple[float, float] = (0.0, 0.0)
    """Mean squares of the push and of the flown acceleration."""

    lasting: float = 0.0
    """How long the error has been large, s."""

    @property
    def error(self) -> float | None:
        """The seen heading minus the true heading, rad, -pi to pi. None: it cannot be determined now."""
        error = self._error
        return None if error is not None and abs(error) > SMALL and self.lasting < LASTING_S else error

    @property
    def _error(self) -> float | None:
        push, flown = self.power
        if push < PUSH**2:
            return None
        likeness, ratio = abs(self.cross) / math.sqrt(push * flown + 1e-12), math.sqrt(flown / push)
        if likeness < COHERENCE or not RATIO[0] <= ratio <= RATIO[1]:
            return None
        return -math.atan2(self.cross.imag, self.cross.real)


def watched(before: HeadingWatch, odometry: Odometry, attitude: Attitude) -> HeadingWatch:
    """The watch after another odometry, in flight. The odometry has passed the checks. Only roll and pitch of the
    controller's attitude are used.
    """
    velocity = complex(*(float(v) for v in odometry.velocity[:2]))
    roll, pitch = attitude.roll, attitude.pitch
    up = max(math.cos(roll) * math.cos(pitch), 0.5)
    leans = complex(math.cos(roll) * math.sin(pitch), -math.sin(roll))
    push = GRAVITY / up * leans * cmath.exp(1j * yaw_of(odometry.quaternion))
    dt = odometry.time - before.time
    if not 0 <= dt <= LONGEST_STEP:
        return HeadingWatch(time=odometry.time, velocity=velocity, push=push)
    fast, slow, kept = (1 - math.exp(-dt / span) for span in (SMOOTHING_S, STEADY_S, MEMORY_S))
    smooth = before.velocity + fast * (velocity - before.velocity)
    flown = (velocity - smooth) / SMOOTHING_S
    push = before.push + fast * (push - before.push)
    a, b = (old + slow * (new - old) for old, new in zip(before.steady, (push, flown), strict=True))
    p, f = push - a, flown - b
    (pp, ff), cross = before.power, before.cross
    after = replace(
        before, time=odometry.time, velocity=smooth, push=push, steady=(a, b),
        cross=cross + kept * (f * p.conjugate() - cross),
        power=(pp + kept * (abs(p) ** 2 - pp), ff + kept * (abs(f) ** 2 - ff)),
    )  # fmt: skip
    error = after._error
    large = error is not None and abs(error) > SMALL
    return replace(after, lasting=before.lasting + dt if large else 0.0)
