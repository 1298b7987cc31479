"""The alarm: does a fit leave over what is not noise, and how far may that pull the parameters?

What is left over counts as slow if it lasts: the mean squares of residuals are replaced by products of their means over
consecutive spans of 20 ms. White noise and the vibration of rotors have none. Slow residuals that grow with the motion
are missing structure: in each window they are n^2 + (b x)^2, with the motion x that the sensor shows there. b is the
share of the motion that the model does not explain; n, of gusts and slow disturbances, is in calm flight, too.

A structure that the model lacks is explained in part by its parameters, which are then wrong. If that part is as large
as the part that is left over, a parameter is off by up to s sqrt(sum of (b x)^2 / noise^2), with s its standard
deviation by white noise of this sensor alone (the inequality of Cauchy and Schwarz on the normal equations). This root
is the pull.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import nnls

SPAN = 5
"""Steps of the windows' grid over which residuals are averaged: 20 ms, more than a turn of a rotor."""
BINS = 6
"""Most groups of windows of similar motion, of three windows or more."""
TRIMMED = 8
"""One window out of this many is left out of a group's mean at each end: gusts and outliers are in few windows."""
SHOWN = 2.0
"""Standard deviations by which b^2 must be above zero."""
SHARE = 0.01
"""Share of the motion up to which what is left over counts for nothing: no model of a vehicle is better."""
ALARM = 10.0
"""Pull from which on the model lacks something."""
PULLED: dict[str, float] = dict.fromkeys(("thrust_map", "drag_linear", "drag_quadratic", "latency"), 3.0)
"""Standard deviation of a parameter over its largest pull; `PULLED_ELSE` for all others. Measured on eight vehicles of
hidden structure (`benchmarks/identify.py --plant structure --bare`, seeds 0 to 3 and 6 to 9): a lag that is not the
same up and down, or an integral part, looks like another lag or gain, more than like another thrust."""
PULLED_ELSE = 6.0


@dataclass(frozen=True)
class LeftOver:
    """What a fit leaves over of a sensor's motion."""

    sensor: str
    share: float
    """Of the motion, that the model does not explain."""
    pull: float
    """How far it may pull a parameter, in standard deviations by the sensor's white noise."""
    off: np.ndarray
    """(u,) the same in the unit of each parameter."""

    @property
    def alarming(self) -> bool:
        """Whether the model lacks something that the vehicle has."""
        return self.pull > ALARM

    def __str__(self) -> str:
        return (
            f"{self.sensor.replace('_', ' ')}: the model leaves {100 * self.share:.0f} % of its motion unexplained, "
            f"which may pull a parameter {self.pull:.0f} times as far as its noise"
        )


def left_over(
    sensor: str,
    left: np.ndarray,
    measured: np.ndarray,
    there: np.ndarray,
    noise: float,
    white: np.ndarray,
    span: int = SPAN,
) -> LeftOver:
    """What is left over of a sensor.

    Args:
        sensor: its name.
        left: (n, m, k) residuals in each of n windows, in the sensor's unit.
        measured: (n, m, j) what it measured, whose mean square over the components is the motion.
        there: (n, m) 1 where something was measured, else 0.
        noise: the spread with which the fit weighs the residuals, in the sensor's unit.
        white: (u,) standard deviation of each parameter by white noise of this sensor alone.
        span: number of consecutive points that are averaged.
    """
    slow, moved, rows = _slow(left, there, span), _motion(measured, there), there.sum(1) * left.shape[-1]
    known = np.isfinite(slow)
    slow, moved, rows = slow[known], moved[known], rows[known]
    groups = np.array_split(np.argsort(moved), min(BINS, len(moved) // 3) or 1)
    if len(groups) < 2:
        return LeftOver(sensor, 0.0, 0.0, 0 * white)
    trimmed = [np.sort(slow[i])[len(i) // TRIMMED : len(i) - len(i) // TRIMMED] for i in groups]
    off = np.array([np.std(slow[i]) / len(i) ** 0.5 for i in groups]) + (1e-3 * noise) ** 2
    table = np.stack([np.ones(len(groups)), [np.median(moved[i]) for i in groups]], -1) / off[:, None]
    (_, share), _ = nnls(table, np.array([x.mean() for x in trimmed]) / off)
    if share < SHOWN * np.sqrt(np.linalg.pinv(table.T @ table)[1, 1]):
        return LeftOver(sensor, 0.0, 0.0, 0 * white)
    pull = float(np.sqrt(max(share - SHARE**2, 0.0) * np.sum(moved * rows)) / noise)
    return LeftOver(sensor, float(np.sqrt(share)), pull, pull * white)


def _slow(left: np.ndarray, there: np.ndarray, span: int) -> np.ndarray:
    """Mean product of consecutive means over `span` points in each window, (n,). NaN where there are none."""
    n, spans = len(left), left.shape[1] // span
    count = there[:, : spans * span].reshape(n, spans, span).sum(2)
    total = (left * there[..., None])[:, : spans * span].reshape(n, spans, span, -1).sum(2)
    mean, both = total / np.maximum(count, 1)[..., None], (count[:, 1:] > 0) & (count[:, :-1] > 0)
    with np.errstate(invalid="ignore"):
        return np.asarray(np.sum(np.mean(mean[:, 1:] * mean[:, :-1], -1) * both, 1) / both.sum(1))


def _motion(values: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Mean square of the motion in each window, (n,): about the window's mean, where something was measured."""
    mask = there[..., None]
    count = np.maximum(mask.sum(1, keepdims=True), 1)
    mean = np.sum(values * mask, 1, keepdims=True) / count
    return np.asarray(np.mean(np.sum((values - mean) ** 2 * mask, 1) / count[:, 0], 1))


def widened(misfits: Sequence[LeftOver], sigma: np.ndarray, fields: Sequence[str]) -> np.ndarray:
    """Standard deviations of parameters, (u,), as wide as what is left over demands. `fields` are the fields of the
    vehicle file that the parameters change, (u,).
    """
    off = np.sqrt(sum((each.off**2 for each in misfits), np.zeros(len(sigma))))
    return np.asarray(np.hypot(sigma, off * [PULLED.get(field, PULLED_ELSE) for field in fields]))


def white_by(inverse: np.ndarray, curvature: np.ndarray) -> np.ndarray:
    """Standard deviations of a fit, (u,), by white noise of one sensor alone: of the inverse of the whole curvature,
    (u, u), and of the sensor's own, (u, u).
    """
    return np.asarray(np.sqrt(np.maximum(np.einsum("ij,jk,ki->i", inverse, curvature, inverse), 0.0)))
