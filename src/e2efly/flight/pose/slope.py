"""How fast a measured quantity changes: a line fitted with exponential forgetting. Pure.

The line minimises the sum of exp(-rate * age) * |value - line|^2 over all samples so far. It is exact for motion with
constant speed, whatever the sample times, and needs no start values. Its transfer function is s * rate^2 / (s +
rate)^2: a derivative followed by a critically damped second-order low-pass filter. Let w be the rate and T the interval
of regular samples:

- delay: 2 / w (a constant acceleration a gives an error of -2 a / w);
- noise: white noise of standard deviation 1 in the value becomes sqrt(2 (1 - b)^3 / (1 + b)^3) / T with b = exp(-w T),
  about sqrt(w^3 T) / 2, in the slope.

Both follow from the moments of the exponential weights: E[age] = 1 / w, E[age^2] = 2 / w^2, E[age^3] = 6 / w^3.
"""

import math
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Slope:
    """Weighted moments of the samples so far."""

    first: float
    """Time of the first sample, s."""
    last: float
    """Time of the last sample, s."""
    count: int
    """Number of samples."""
    weight: float
    """Sum of the weights."""
    mean_time: float
    """Weighted mean of the times, s."""
    mean: np.ndarray
    """(n,) weighted mean of the values, u."""
    variance: float
    """Weighted sum of squared deviations of the times, s^2."""
    covariance: np.ndarray
    """(n,) weighted sum of the products of deviations of times and values, u*s."""


def start_slope(time: float, value: np.ndarray) -> Slope:
    """The fit after its first sample: `value` of shape (n,) at `time`, s."""
    return Slope(time, time, 1, 1.0, time, value, 0.0, np.zeros_like(value))


def follow_slope(fit: Slope, rate: float, time: float, value: np.ndarray) -> Slope:
    """Add one sample to the fit. `rate` is how fast samples are forgotten, 1/s. `value` is the new value, (n,), u. It
    was true at `time`, s, which must be later than `fit.last`.
    """
    kept = math.exp(-rate * (time - fit.last))
    weight = kept * fit.weight + 1
    ahead, off = time - fit.mean_time, value - fit.mean
    share = kept * fit.weight / weight
    return Slope(
        first=fit.first,
        last=time,
        count=fit.count + 1,
        weight=weight,
        mean_time=fit.mean_time + ahead / weight,
        mean=fit.mean + off / weight,
        variance=kept * fit.variance + share * ahead**2,
        covariance=kept * fit.covariance + share * ahead * off,
    )


def slope(fit: Slope) -> np.ndarray:
    """(n,) rate of change of the value, u/s. It needs at least two samples."""
    return fit.covariance / fit.variance


def settled(fit: Slope, rate: float) -> bool:
    """Whether the noise of the slope is near its final level: at least three samples over at least twice the time
    constant.
    """
    return fit.count >= 3 and fit.last - fit.first >= 2 / rate
