"""How late a source's own velocity and body rate are, beyond its positions and attitudes. Pure.

A first-order low-pass of time constant T gives v with T dv/dt = v_true - v. Integrated: path - integral of v = T v. So
the path that the velocities add up to stays behind that of the positions by T times the velocity, exactly, whatever the
motion is. T follows by least squares from the motion of the last seconds. A delay T and a low-pass of a higher order
whose delay is T give the same to first order in T times the frequency. Both sides pass through the same high-pass
filter, so a drift fades. The path itself is a second regressor, for a velocity of a wrong scale. Rotations are treated
alike.

White noise of the velocity would make T smaller. It shows in the velocity's second differences, and is subtracted.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from e2efly.policy.odometry import Odometry

MEMORY_S = 3.0
"""How long motion is remembered, s. It fades with this time constant."""
FADE_S = 0.5
"""Time constant of the high-pass filter, s."""
LONGEST_STEP = 0.2
"""After a pause longer than this, paths are added up anew, s."""
SHORTEST_S = 0.8
"""The shortest time for which motion is watched, s."""
TELLING = np.array([0.08, 0.25])
"""The weakest motion that tells: root mean square of the high-passed velocity, m/s, and body rate, rad/s."""
ALIKE_S = 0.06
"""Errors that are closer together in time than this count as one, s."""
SURE_S = 0.001
"""The smallest standard deviation that is claimed, s."""
UNSURE_S, UNSURE_SHARE = 0.005, 0.15
"""The largest standard deviation of an answer: s, or if that is more, a share of it."""


@dataclass(frozen=True)
class MeasuredLag:
    """How late a quantity is."""

    seconds: float
    """Time constant, s."""
    deviation: float
    """Standard deviation of `seconds`, estimated from what the lag does not explain, s."""


@dataclass(frozen=True)
class LagWatch:
    """What was seen so far. First axis: velocity, body rate. Last axis: x, y, z, in the body for rotations."""

    time: float = -math.inf
    """Time of the newest odometry, s."""
    newest: np.ndarray = field(default_factory=lambda: np.zeros((2, 5, 3)))
    """(2, 5, 3) its velocity, m/s, and position, m, those of the odometry before, and the velocity before that; its
    body rate, rad/s, the angle turned so far, rad, and so on."""
    passed: np.ndarray = field(default_factory=lambda: np.zeros((2, 4, 3)))
    """(2, 4, 3) high-passed: what the path is ahead of that of the rates, the rate, the path. Last, not high-passed:
    the second difference of the rate."""
    span: float = 0.0
    """How long this has been watched, fading, s."""
    interval: float = 0.0
    """Mean time between two odometries, fading, s."""
    mean: np.ndarray = field(default_factory=lambda: np.zeros((2, 4, 3)))
    """(2, 4, 3) mean of `passed`, fading."""
    products: np.ndarray = field(default_factory=lambda: np.zeros((2, 4, 4)))
    """(2, 4, 4) integral over time of the products of each two of `passed`, about their means, fading."""


_REMEMBERED = np.array([[1.0], [1.0], [1.0], [0.0]])  # the second difference passes no filter


def moved(watch: LagWatch, odometry: Odometry, angle: np.ndarray) -> LagWatch:
    """The watch after another odometry. `angle` is (3,), what the attitudes have turned about the body's axes so far,
    rad (`PoseTrack.angle`).
    """
    newest = np.empty((2, 5, 3))  # filled part by part: many times faster than stacking
    newest[:, 2:] = watch.newest[:, :3]
    newest[0, 0], newest[0, 1], newest[1, 0], newest[1, 1] = (
        odometry.velocity, odometry.position, odometry.body_rate, angle
    )  # fmt: skip
    dt = odometry.time - watch.time
    if not 0 < dt <= LONGEST_STEP:
        newest[:, 2], newest[:, 4] = newest[:, 0], newest[:, 0]
        return replace(watch, time=odometry.time, newest=newest, passed=np.zeros((2, 4, 3)))
    kept, mid = math.exp(-dt / FADE_S), -0.5 * dt
    steps = np.array((
        (mid, 1.0, mid, -1.0, 0.0), (1.0, 0.0, -1.0, 0.0, 0.0), (0.0, 1.0, 0.0, -1.0, 0.0), (1.0, 0.0, -2.0, 0.0, 1.0),
    ))  # fmt: skip
    passed = kept * _REMEMBERED * watch.passed + steps @ newest
    before = math.exp(-dt / MEMORY_S) * watch.span
    span = before + dt
    off = passed - watch.mean
    products = (before / watch.span if watch.span else 0.0) * watch.products + (dt * before / span) * (
        off @ off.transpose(0, 2, 1)
    )
    interval = watch.interval + dt / span * (dt - watch.interval)
    return LagWatch(odometry.time, newest, passed, span, interval, watch.mean + (dt / span) * off, products)


def lags_of(watch: LagWatch) -> tuple[MeasuredLag | None, MeasuredLag | None]:
    """How late velocity and body rate are. None: the motion does not show it."""
    if watch.span < SHORTEST_S:
        return None, None
    velocity, body_rate = (
        _lag(products / watch.span, watch.interval, watch.span / ALIKE_S, float(telling))
        for products, telling in zip(watch.products, TELLING, strict=True)
    )
    return velocity, body_rate


def _lag(products: np.ndarray, interval: float, count: float, telling: float) -> MeasuredLag | None:
    """The lag from mean products, (4, 4), of about `count` errors. None: it is not shown."""
    (ahead, by_rate, by_path, _), (_, rate, cross, _), (_, _, path, _), (_, _, _, second) = products.tolist()
    noise = second / 6  # of white noise of variance 1, the second difference has variance 6
    rate, by_rate = rate - noise, by_rate + 0.5 * interval * noise  # the newest noise is in half a step of the path
    if rate < telling**2:
        return None
    alone = rate - cross**2 / path if path > 0 else rate  # what of the rate its path does not explain
    if alone < 0.2 * rate:
        return None
    seconds = (by_rate - (cross / path * by_path if path > 0 else 0.0)) / alone
    scale = (by_path - cross * seconds) / path if path > 0 else 0.0
    left = max(ahead - seconds * by_rate - scale * by_path, 0.0)
    deviation = max(math.sqrt(left / alone / max(count - 2, 1)), SURE_S)
    return MeasuredLag(float(seconds), deviation) if deviation <= max(UNSURE_S, UNSURE_SHARE * seconds) else None
