"""The step response of the rate loop, estimated from a flight: the response of the body rate to its command.

The flight does not need to contain a step. The impulse response h from the command x to the response y has a length of
`WINDOW` s and explains y best, min |y - h * x|^2 + ridge |h|^2. This is Wiener's deconvolution in the time domain
(Wiener 1949). Its normal equations are Toeplitz matrices of correlations. The running sum of h is the step response.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_toeplitz
from scipy.signal import correlate

WINDOW = 0.5
"""Length of the estimated response, s."""
SETTLED = 0.3
"""Time from which on the response counts as settled, s."""
RIDGE = 1e-3
"""Weight of the ridge, relative to the command's power."""
EXCITATION = 0.1
"""Root mean square of the command's changes within a second that an estimate needs, rad/s."""
EXPLAINED = 0.7
"""Fraction of the response's variance that the estimate must explain to be valid."""
SETTLES = (0.6, 1.5)
"""Range in which a valid estimate must settle. A loop with an integrator ends at 1."""
SLOWEST = 25.0
"""Lowest sampling rate of the response that an estimate needs, Hz."""
GAP, LOST = 0.1, 0.05
"""Length from which a time without a sample of the response is a gap, s, and the largest share of the time that may be
in gaps."""
_GRID = (0.001, 0.02)  # s: finest and coarsest step in time


@dataclass(frozen=True)
class StepResponse:
    """The response of one axis to a step of 1 rad/s, or the reason why there is none."""

    time: np.ndarray
    """(k,) time since the step, s."""
    response: np.ndarray
    """(k,) body rate, rad/s."""
    delay: float
    """Time until 10 % of the settled value, s. NaN if there is none."""
    rise: float
    """Time until 63 % of the settled value, s. For a first-order lag, this is its dead time plus its time constant."""
    overshoot: float
    """Largest value divided by the settled value, minus 1. 0: no overshoot."""
    gain: float
    """The settled value."""
    excitation: float
    """Root mean square of the command's changes within a second, rad/s."""
    explained: float
    """Fraction of the response's variance that the estimate explains."""
    reason: str
    """The reason why the numbers are not valid. Empty if they are valid."""


def step_response(
    command_time: np.ndarray,
    command: np.ndarray,
    response_time: np.ndarray,
    response: np.ndarray,
    intervals: list[tuple[float, float]] | None = None,
) -> StepResponse:
    """Estimate a step response.

    Args:
        command_time: (m,) times, s, increasing.
        command: (m,) commanded rates, rad/s, each held until the next.
        response_time: (n,) times, s, increasing, on the same clock.
        response: (n,) measured rates, rad/s.
        intervals: start and end times of the intervals in which the loop was closed, s. None: always.
    """
    x, y, step = _aligned(command_time, command, response_time, response, intervals or [(-np.inf, np.inf)])
    if len(x) * step < 4 * WINDOW:
        return _nothing(f"less than {4 * WINDOW:g} s of commands and response together", 0.0)
    if reason := _unusable(response_time[np.isfinite(response)], intervals or [(-np.inf, np.inf)]):
        return _nothing(reason, 0.0)
    excitation = float(np.std(x - _smooth(x, round(1.0 / step))))
    if excitation < EXCITATION:
        return _nothing(f"not enough excitation: {excitation:.2g} rad/s rms, needed {EXCITATION:g}", excitation)
    count = round(WINDOW / step)
    power = _correlation(x, x, count)
    power[0] *= 1 + RIDGE
    impulse = np.asarray(solve_toeplitz(power, _correlation(y, x, count)))
    rest = y - np.convolve(x, impulse)[: len(y)]
    explained = 1 - float(np.var(rest) / max(np.var(y), 1e-12))
    curve, time = np.cumsum(impulse), step * (np.arange(count) + 0.5)  # ones from 0 on: a step half a cell earlier
    gain = float(np.mean(curve[time >= SETTLED]))
    weak = f"the command explains {max(explained, 0):.0%} of the response, needed {EXPLAINED:.0%}"
    reason = "" if explained >= EXPLAINED else weak
    if not reason and not SETTLES[0] <= gain <= SETTLES[1]:  # an integrator ends at 1
        reason = f"settles at {gain:.2f} of the command, not at 1: too little motion, or not this loop's"
    delay, rise = (_reaches(time, curve, part * gain) for part in (0.1, 1 - np.exp(-1)))
    overshoot = max(float(curve.max() / gain) - 1, 0.0) if gain > 0 else float("nan")
    return StepResponse(time, curve, delay, rise, overshoot, gain, excitation, explained, reason)


def _unusable(time: np.ndarray, intervals: list[tuple[float, float]]) -> str:
    """Why the samples of a response do not show it. Empty: they do."""
    pauses = np.diff(time)[_within(time[:-1], intervals)]
    rate = 1 / float(np.median(pauses))
    if rate < SLOWEST:
        return f"too slow: {rate:.0f} samples a second, needed {SLOWEST:g}"
    gaps = pauses[pauses > GAP]
    lost = float(gaps.sum() / pauses.sum())
    return f"gaps: {lost:.0%} of the time without samples, accepted up to {LOST:.0%}" if lost > LOST else ""


def _nothing(reason: str, excitation: float) -> StepResponse:
    nan = float("nan")
    return StepResponse(np.zeros(0), np.zeros(0), nan, nan, nan, nan, excitation, nan, reason)


def _aligned(
    t_x: np.ndarray, x: np.ndarray, t_y: np.ndarray, y: np.ndarray, intervals: list[tuple[float, float]]
) -> tuple[np.ndarray, np.ndarray, float]:
    """Command and response on one grid, without their means and zero outside the intervals, and the grid step, s."""
    t_x, x = t_x[np.isfinite(x)], x[np.isfinite(x)]
    t_y, y = t_y[np.isfinite(y)], y[np.isfinite(y)]
    if len(t_x) < 2 or len(t_y) < 2:
        return np.zeros(0), np.zeros(0), _GRID[1]
    step = float(np.clip(np.median(np.diff(t_y)) / 4, *_GRID))
    time = np.arange(max(t_x[0], t_y[0]), min(t_x[-1], t_y[-1]), step)
    time = time[_within(time, intervals)]
    area = np.concatenate([[0.0], np.cumsum(x[:-1] * np.diff(t_x))])  # of what is held: its mean about a grid point
    held = (np.interp(time + step / 2, t_x, area) - np.interp(time - step / 2, t_x, area)) / step  # loses no time
    seen = np.interp(time, t_y, y)
    return (held - held.mean(), seen - seen.mean(), step) if len(time) else (held, seen, step)


def _within(time: np.ndarray, intervals: list[tuple[float, float]]) -> np.ndarray:
    inside = np.zeros(len(time), bool)
    for start, end in intervals:
        inside |= (time >= start) & (time <= end)
    return inside


def _correlation(a: np.ndarray, b: np.ndarray, count: int) -> np.ndarray:
    """Sum over n of a[n + k] b[n] for k = 0 ... count - 1."""
    return correlate(a, b, method="fft")[len(b) - 1 :][:count]


def _smooth(x: np.ndarray, width: int) -> np.ndarray:
    """Moving mean over `width` samples."""
    total = np.cumsum(np.concatenate([[0.0], x]))
    i = np.arange(len(x))
    low, high = np.maximum(i - width // 2, 0), np.minimum(i + width // 2 + 1, len(x))
    return (total[high] - total[low]) / (high - low)


def _reaches(time: np.ndarray, curve: np.ndarray, level: float) -> float:
    """The first time at which the curve reaches a level, interpolated between samples. NaN if it does not reach it."""
    above = np.flatnonzero(curve >= level)
    if len(above) == 0 or level <= 0:
        return float("nan")
    i = int(above[0])
    if i == 0:
        return float(time[0])
    return float(time[i - 1] + (level - curve[i - 1]) / (curve[i] - curve[i - 1]) * (time[i] - time[i - 1]))
