"""The turn of the backup manoeuvre in steps, with the effect of the vehicle's lags on each step."""

from typing import NamedTuple

from e2efly.flight.filter.forecast import Response, lag, turning

STEPS = (0.02, 0.03, 0.04, 0.05, 0.07, 0.09, 0.1)
"""Steps of the turn, s. They are shorter at the beginning, where the turn is fastest."""
SEEN = (1, 3, 4, 5, 6)
"""Indices of the steps after which the position is compared with the limits."""


class TurnStep(NamedTuple):
    """A step of the turn: its length and the effect of the lags on it."""

    h: float
    """Length, s."""
    end: float
    """Time at its end since the beginning of the turn, s."""
    loop: tuple[float, float, float, float]
    """Step of the rate loop: `turning`."""
    kept: float
    """The share of the error of the rotors' speed that remains after the step, ..."""
    mean: float
    """... its mean over the step ..."""
    square: float
    """... and the mean of its square."""
    free: float
    """The share of the free rotation that is still to come in the middle of the step."""
    seen: bool
    """Whether the position after the step is compared with the limits."""


def steps_of(r: Response) -> tuple[TurnStep, ...]:
    """The steps for a vehicle."""
    gain, steps, at = min(r.gain[:2]), [], 0.0
    for i, h in enumerate(STEPS):
        a, _, c, _ = turning(gain, r.motor_time, at + h / 2)
        at += h
        free = min(max(a + r.motor_time * c, 0.0), 1.0)  # for a rate of 1, with the rotors at rest
        steps.append(
            TurnStep(
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
