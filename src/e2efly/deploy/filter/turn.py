"""The turn of the backup manoeuvre in steps, with what the vehicle's lags make of each."""

from typing import NamedTuple

from e2efly.deploy.filter.body import Response, lag, turning

STEPS = (0.02, 0.03, 0.04, 0.05, 0.07, 0.09, 0.1)
"""Steps of the turn, s: it is quickest at its begin."""
SEEN = (1, 3, 4, 5, 6)
"""After these of them the position is compared with the limits."""
TURN = sum(STEPS)
"""Length of the turn, s."""


class Step(NamedTuple):
    """A step of the turn: its length and what the lags make of it."""

    h: float
    """s."""
    end: float
    """Since the begin of the turn, s."""
    loop: tuple[float, float, float, float]
    """Of the rate loop: `turning`."""
    kept: float
    """Of the error of the rotors' speed, after the step, ..."""
    mean: float
    """... on average ..."""
    square: float
    """... and of its square, on average."""
    free: float
    """In its middle, the share of the turn that goes on by itself which is still to come."""
    seen: bool
    """Whether the position after it is compared with the limits."""


def steps_of(r: Response) -> tuple[Step, ...]:
    """The steps for a vehicle."""
    gain, steps, at = min(r.gain[:2]), [], 0.0
    for i, h in enumerate(STEPS):
        a, _, c, _ = turning(gain, r.motor_time, at + h / 2)
        at += h
        free = min(max(a + r.motor_time * c, 0.0), 1.0)  # of a rate of one, with rotors at rest
        steps.append(
            Step(
                h,
                at,
                turning(gain, r.motor_time, h),
                *lag(r.motor_time, h),
                lag(r.motor_time / 2, h)[1],
                free,
                i in SEEN,
            )
        )
    return tuple(steps)
