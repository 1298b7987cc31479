"""What to fly so that a log shows a vehicle's parameters: lines for the drag, doublets for the rest. No JAX."""

import numpy as np

DURATION = 30.0
"""Of all of it, s."""
PULSE = 0.12
"""One half of a doublet, s."""
RATES = (3.0, 3.0, 2.0)
"""Height of the doublets of body rate, rad/s."""
THRUST = 4.0
"""Height of those of thrust over mass, m/s^2."""
LEG = 3.0
"""Time of a straight line, s."""
_LINES = np.array([
    (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 0.3), (0, 0, -0.3), (0.8, 0.8, 0), (-0.8, -0.8, 0),
    (0.7, -0.7, 0.2), (-0.7, 0.7, -0.2),
])  # fmt: skip


def lines(time: float, speed: float) -> np.ndarray:
    """The velocity to fly at, world, m/s, (3,): there and back along the axes and the diagonals.

    Args:
        time: since the beginning, s.
        speed: of the fastest, m/s.
    """
    return speed * _LINES[int(time / LEG) % len(_LINES)]


def doublets(time: float) -> tuple[np.ndarray, float]:
    """What is added to the command: body rates, rad/s, (3,), and thrust over mass, m/s^2.

    Every second another one: roll, pitch, yaw, thrust; one way for `PULSE` seconds, and back for as long.
    """
    phase, which = time % 1.0, int(time) % 4
    sign = 1.0 if phase < PULSE else -1.0 if phase < 2 * PULSE else 0.0
    rates = np.zeros(3)
    if which < 3:
        rates[which] = sign * RATES[which]
    return rates, sign * THRUST if which == 3 else 0.0
