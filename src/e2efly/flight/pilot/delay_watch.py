"""The delay of the odometry, found by comparing its rotation with that of the flight controller's gyro. Pure.

A constant delay of a source cannot be seen in its messages, because the shortest delay counts as zero. But the gyro
measures each rotation at once, so the same rotation is searched for in the odometry's attitude some time later. Any
rotation is suitable: the vehicle turned by hand before arming, or the first wobble of a take-off. If the vehicle stands
still or is carried without rotation, no delay is given.

Its errors in 100 synthetic measurements each (`tests/flight/test_delay_watch.py`): delays from 0 to 0.3 s, attitudes at
100 Hz with 1 mrad of noise and a drift, a gyro at 50 Hz with a bias and 0.03 rad/s of noise, dated within 5 ms:

| motion | delays found | standard deviation | largest error |
| --- | --- | --- | --- |
| turned by hand, up to 0.4 rad at 0.5 to 1.5 Hz | 100 | 0.4 ms | 0.9 ms |
| the same, attitudes at 30 Hz with 5 mrad of noise | 100 | 0.6 ms | 1.9 ms |
| the same, 0.3 rad/s of vibration in the gyro | 100 | 2.5 ms | 5.7 ms |
| turned gently, up to 0.15 rad at 0.3 to 1 Hz | 100 | 1.5 ms | 6.1 ms |
| the first 1.3 s of a flight, 0.03 rad at 0.8 to 3 Hz | 100 | 2.7 ms | 11.6 ms |

On the rig with real firmware, while the pilot moved the hover point, 22 ms were measured for a delay of 20 ms, and 79
ms for 80 ms, with standard deviations of 4 and 9 ms. In a calm take-off the vehicle turns by less than 0.01 rad/s,
which is too little: turn the vehicle by hand.

The delay of the gyro's own filters, some milliseconds, makes the measured delay smaller by as much. The mean error of
the times of the gyro's readings shifts the measured delay by as much.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from e2efly.flight.pose.tracking import rotation_between
from e2efly.policy.odometry import Odometry

WINDOW_S = 3.5
"""How long motion is remembered, s."""
SHORTEST_S = 1.0
"""The shortest time for which the odometry is watched, s."""
SOONEST, LATEST = -0.05, 0.4
"""The range of delays that is searched, s."""
GRID_S = 0.01
"""Time step of the comparison of both motions, s."""
APART_S = 0.004
"""Attitudes that are closer together in time are left out, s."""
SMOOTHING = np.hanning(23)[1:-1] / np.hanning(23).sum()
"""Weights for smoothing both motions, `GRID_S` apart."""
LIKE = 0.7
"""The smallest likeness of the two motions that is accepted, 0 to 1."""
ANOTHER = 0.9
"""If the likeness at a second delay is more than this share of the best one, the answer is ambiguous: the motion was
periodic."""
UNSURE_S = 0.015
"""The largest standard deviation of an answer, s."""


@dataclass(frozen=True)
class MeasuredDelay:
    """The delay of the odometry."""

    seconds: float
    """Time from the motion to the time stamp that the odometry gives for it, s."""
    deviation: float
    """Standard deviation of `seconds`, estimated from the remaining differences of the two motions, s."""


@dataclass(frozen=True)
class DelayWatch:
    """The motion within the last `WINDOW_S`."""

    rates: tuple[tuple[float, np.ndarray], ...] = ()
    """Times, s, and body rates (3,) of the gyro, rad/s."""
    angles: tuple[tuple[float, np.ndarray], ...] = ()
    """Times, s, and the angles (3,) by which the odometry has turned about the body's axes so far, rad."""
    attitude: np.ndarray | None = None
    """(4,) newest attitude of the odometry."""


def felt(watch: DelayWatch, time: float, body_rate: tuple[float, float, float]) -> DelayWatch:
    """The watch after a reading of the gyro. `time` is when the reading was true, s. For a reply, this is the middle
    between the request and its arrival. `body_rate` is body FLU, rad/s. A wrong scale or a bias does no harm.
    """
    if watch.rates and time <= watch.rates[-1][0]:
        return watch
    return replace(watch, rates=(*_recent(watch.rates, time), (time, np.array(body_rate, float))))


def turned(watch: DelayWatch, odometry: Odometry) -> DelayWatch:
    """The watch after another odometry. Only its time and attitude are used."""
    if watch.attitude is None:
        return replace(watch, angles=((odometry.time, np.zeros(3)),), attitude=odometry.quaternion)
    before, angle = watch.angles[-1]
    if odometry.time - before < APART_S:
        return watch
    angle = angle + rotation_between(watch.attitude, odometry.quaternion)
    angles = (*_recent(watch.angles, odometry.time), (odometry.time, angle))
    return replace(watch, angles=angles, attitude=odometry.quaternion)


def delay_of(watch: DelayWatch) -> MeasuredDelay | None:
    """The delay of the odometry. None: the motion does not show it. This takes a fraction of a millisecond."""
    if len(watch.rates) < 2 or len(watch.angles) < 2:
        return None
    half = (len(SMOOTHING) // 2 + 1) * GRID_S
    begin = max(watch.angles[0][0] + half, watch.rates[0][0] + LATEST + half)
    end = min(watch.angles[-1][0] - half, watch.rates[-1][0] + SOONEST - half)
    if end - begin < SHORTEST_S:
        return None
    count = int((end - begin) / GRID_S)
    lags = round((LATEST - SOONEST) / GRID_S) + 1
    edges = begin + GRID_S * (np.arange(count + len(SMOOTHING)) - len(SMOOTHING) / 2)
    seen = _smooth(np.diff(_at(watch.angles, edges), axis=0) / GRID_S)
    instants = begin - LATEST + GRID_S * (np.arange(count + lags + len(SMOOTHING) - 2) - (len(SMOOTHING) - 1) / 2)
    gyro = np.lib.stride_tricks.sliding_window_view(_smooth(_at(watch.rates, instants)), count, axis=0)  # (lags, 3, n)
    seen, gyro = (seen - seen.mean(0)).T, gyro - gyro.mean(-1, keepdims=True)
    power = np.sqrt((gyro**2).sum((1, 2)) * (seen**2).sum()) + 1e-9
    likeness = (gyro * seen).sum((1, 2)) / power
    best = int(likeness.argmax())
    peaks = np.flatnonzero((likeness[1:-1] >= likeness[:-2]) & (likeness[1:-1] > likeness[2:])) + 1
    if likeness[best] < LIKE or best not in peaks or (likeness[peaks] > ANOTHER * likeness[best]).sum() > 1:
        return None
    a, b, c = likeness[best - 1 : best + 2]
    off = 0.5 * (a - c) / (a - 2 * b + c)
    felt = gyro[best]
    gain = float((felt * seen).sum() / (felt**2).sum())
    left, slope = seen - gain * felt, np.gradient(felt, GRID_S, axis=-1)
    alike = len(SMOOTHING)  # smoothing makes neighbours alike: this many of them count as one
    deviation = math.sqrt(alike * float((left**2).mean()) / float((slope**2).sum())) / max(gain, 1e-9)
    if deviation > UNSURE_S:
        return None
    return MeasuredDelay(LATEST - GRID_S * (best + float(off)), deviation)


def delay_problem(delay: MeasuredDelay | None, accepted: float) -> str | None:
    """The reason, in words, why nobody should fly with poses that are so late. None: they are not late, or the delay is
    unknown. `accepted` is the largest accepted delay, s.
    """
    if delay is None or delay.seconds - 2 * delay.deviation <= accepted:
        return None
    return (
        f"poses are {delay.seconds:.3f} s late by the controller's gyro (within {2 * delay.deviation:.3f} s); "
        f"accepted: {accepted:.3f} s; tell the source's delay by --latency, or mend it"
    )


def _recent(row: tuple[tuple[float, np.ndarray], ...], now: float) -> tuple[tuple[float, np.ndarray], ...]:
    """The entries that are not too old. Only the oldest one or two are removed."""
    gone = sum(time < now - WINDOW_S for time, _ in row[:2])
    return row[gone:]


def _at(row: tuple[tuple[float, np.ndarray], ...], times: np.ndarray) -> np.ndarray:
    """(n, 3) the values at these times."""
    known, values = np.array([time for time, _ in row]), np.array([value for _, value in row])
    return np.stack([np.interp(times, known, column) for column in values.T], axis=1)


def _smooth(values: np.ndarray) -> np.ndarray:
    return np.stack([np.convolve(column, SMOOTHING, "valid") for column in values.T], axis=1)
