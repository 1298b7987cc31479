"""Whether the odometry's heading is the vehicle's own: a tilt must push it the way it is seen to go.

Nothing on the ground shows a wrong heading, and a hover controller that is led by one pushes to the wrong side, ever
harder. In the air the horizontal acceleration that goes with the tilt is compared with the one that is flown: turned
by the heading's error they are alike. Wind and gusts, which push without a tilt, are not alike.
"""

import math
from dataclasses import dataclass, replace

from e2efly.deploy.odometry import Odometry
from e2efly.vehicles.vehicle import GRAVITY

SMOOTHING_S = 0.15
"""Over which velocities become accelerations, s."""
STEADY_S = 2.0
"""What stays for longer is wind, or a tilted sensor, s."""
MEMORY_S = 0.7
"""Over which accelerations are compared, s."""
PUSH = 0.3
"""With less acceleration nothing can be told, m/s^2, root mean square."""
COHERENCE = 0.93
"""How alike what is flown is to what is pushed, 0 to 1, for the error to be believed ..."""
RATIO = (0.7, 1.5)
"""... and how large, beside it."""
LONGEST_STEP = 0.1
"""Between two odometries; after a longer pause the comparison begins anew, s."""


@dataclass(frozen=True)
class HeadingWatch:
    """What has been seen so far; horizontal vectors are complex numbers, x + iy, world."""

    time: float = -math.inf
    """Of the newest odometry, s."""
    velocity: complex = 0j
    """Smoothed, m/s."""
    push: complex = 0j
    """Acceleration that goes with the tilt, smoothed, m/s^2."""
    steady: tuple[complex, complex] = (0j, 0j)
    """What stays of the push and of the flown acceleration, m/s^2."""
    cross: complex = 0j
    """Mean of the flown acceleration times the conjugate push."""
    power: tuple[float, float] = (0.0, 0.0)
    """Mean squares of the push and of the flown acceleration."""

    @property
    def error(self) -> float | None:
        """The heading seen minus the true one, rad, -pi to pi; None: it cannot be told now."""
        push, flown = self.power
        if push < PUSH**2:
            return None
        likeness, ratio = abs(self.cross) / math.sqrt(push * flown + 1e-12), math.sqrt(flown / push)
        if likeness < COHERENCE or not RATIO[0] <= ratio <= RATIO[1]:
            return None
        return -math.atan2(self.cross.imag, self.cross.real)


def watched(before: HeadingWatch, odometry: Odometry) -> HeadingWatch:
    """The watch after another odometry, in flight.

    Args:
        before: the watch so far.
        odometry: checked.
    """
    w, x, y, z = (float(q) for q in odometry.quaternion)
    velocity = complex(*(float(v) for v in odometry.velocity[:2]))
    up = max(1 - 2 * (x * x + y * y), 0.5)
    push = GRAVITY / up * complex(2 * (x * z + w * y), 2 * (y * z - w * x))
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
    return replace(
        before, time=odometry.time, velocity=smooth, push=push, steady=(a, b),
        cross=cross + kept * (f * p.conjugate() - cross),
        power=(pp + kept * (abs(p) ** 2 - pp), ff + kept * (abs(f) ** 2 - ff)),
    )  # fmt: skip
