"""The alarm: is what a fit leaves over more than noise, and does it grow with the motion?

Noise does not grow with the motion; missing structure does. In each window the mean square of the residuals is
n^2 + (b x)^2, with the motion x that the sensor shows there: b is the share of the motion that the model does not
explain, n what is left over in calm flight. n may hold structure, too, if a flight has no calm. From one sample to the
next, a vehicle moves smoothly, and white noise w does not. Filtered noise and vibration are larger than w. So the noise
is taken to lie in the middle between the two, at the root of n w.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

BINS = 6
"""Most groups of windows of similar motion. In each the median counts: gusts and outliers are in few windows."""
CALM = 2.0
"""Motion over white noise, both squared, up to which a window is calm."""
SHARE = 0.01
"""Share of the motion up to which what is left over counts as noise: no model of a vehicle is better."""
NORMAL = 0.6745
"""Median of the absolute values of a standard normal distribution."""
ALARM = 1.7
"""Growth of the residuals from which on the model lacks something."""
WRONG = 2.0
"""Standard deviation of a parameter, in those from before the flights, over the unexplained share of the motion."""


@dataclass(frozen=True)
class LeftOver:
    """What a fit leaves over of a sensor's motion."""

    sensor: str
    share: float
    """Of the motion, that the model does not explain."""
    growth: float
    """Residuals in lively windows over the noise, 1 or more."""

    @property
    def alarming(self) -> bool:
        """Whether the model lacks something that the vehicle has."""
        return self.growth > ALARM

    def __str__(self) -> str:
        return (
            f"{self.sensor.replace('_', ' ')}: the model leaves {100 * self.share:.0f} % of its motion unexplained, "
            f"{self.growth:.1f} times its noise"
        )


def misfit(sensor: str, square: np.ndarray, motion: np.ndarray, white: float) -> LeftOver:
    """What is left over of a sensor.

    Args:
        sensor: its name.
        square: (n,) mean square of the residuals in each window. NaN where nothing was measured.
        motion: (n,) root mean square of the motion that was measured in each window, in the sensor's unit.
        white: its white noise, in its unit.
    """
    known = np.isfinite(square) & np.isfinite(motion)
    square, motion = square[known], motion[known]
    # where nothing but noise moves a sensor, its motion and what is left over are the same noise
    order = np.argsort(motion)
    calm, lively = np.split(order, [np.searchsorted(motion[order] ** 2, CALM * white**2)])
    bins = [calm] * (len(calm) > 2) + np.array_split(lively, min(BINS, len(lively) // 3) or 1)
    if len(lively) < 3 or len(bins) < 2:
        return LeftOver(sensor, 0.0, 1.0)
    left = np.array([np.median(square[i]) for i in bins])
    moved = np.array([np.median(motion[i]) for i in bins]) ** 2
    table = np.stack([np.ones(len(bins)), moved], -1)
    (noise, share), _ = nnls(table / left[:, None], np.ones(len(bins)))  # relative errors count alike
    tolerated = SHARE**2 * moved[-1]
    most, least = noise + tolerated, min(white**2, noise) + tolerated
    growth = np.sqrt((noise + share * moved[-1]) / np.sqrt(most * least))
    return LeftOver(sensor, float(np.sqrt(share)), max(float(growth), 1.0))


def white_noise(values: np.ndarray) -> float:
    """Standard deviation of the white noise of samples, (n, k), at equal times: by their third differences, in which
    smooth motion cancels.
    """
    rough = np.abs(np.diff(values, 3, axis=0))
    return float(np.median(rough) / (NORMAL * 20**0.5)) if len(rough) else 0.0


def motion(values: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Root mean square of the motion in each window, (n,), of values, (n, m, k): about their mean, where something was
    measured, (n, m).
    """
    mask = there[..., None]
    count = np.maximum(mask.sum(1, keepdims=True), 1)
    mean = np.sum(values * mask, 1, keepdims=True) / count
    return np.asarray(np.sqrt(np.mean(np.sum((values - mean) ** 2 * mask, 1) / count[:, 0], 1)))


def mean_square(left: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Mean square of residuals, (n, rows), in each window, (n,). NaN where nothing was measured."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(np.sum((left * there) ** 2, 1) / there.sum(1))


def widened(misfits: Sequence[LeftOver], sigma: np.ndarray, prior: np.ndarray) -> np.ndarray:
    """Standard deviations, (u,), as wide as what is left over demands. They are what they were unless something is
    missing in the model. `prior` has those from before the flights.

    A wrong model is wrong by about the share of the motion that it does not explain, however many samples there are.
    """
    alarms = [each for each in misfits if each.alarming]
    if not alarms:
        return sigma
    growth, share = max(each.growth for each in alarms), max(each.share for each in alarms)
    return np.asarray(np.hypot(growth * sigma, WRONG * share * prior))
