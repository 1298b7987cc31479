"""Streams of a flight at common times, so that they can be compared."""

import numpy as np
from scipy.signal import lfilter

from e2efly.control import Quat
from e2efly.logs.recording import Record, Stream

GRID = 0.005
"""Time between two points at which gyroscope and attitude are compared, s."""
EDGE = 9
"""Points at either end that are left out, where there is nothing to average over."""


def common_times(record: Record, *names: str, step: float = GRID) -> np.ndarray:
    """Times at which all of these streams were recorded, (n,) s. Empty if there are none."""
    streams = [record.streams[name] for name in names]
    return np.arange(max(s.time[0] for s in streams), min(s.time[-1] for s in streams), step)


def at_times(stream: Stream, time: np.ndarray) -> np.ndarray:
    """The values of a stream at some times, (n, k), interpolated linearly."""
    return np.stack([np.interp(time, stream.time, column) for column in stream.values.T], -1)


def attitudes(stream: Stream, time: np.ndarray) -> np.ndarray:
    """Unit quaternions at some times, (n, 4), which do not change their sign from one to the next."""
    q = at_times(Stream(stream.time, continuous(stream.values)), time)
    return q / np.maximum(np.linalg.norm(q, axis=1, keepdims=True), 1e-9)


def rates(record: Record) -> tuple[np.ndarray, np.ndarray]:
    """Body rates from the gyroscope and from the derivative of the attitude, smoothed, on one grid, (n, 3) rad/s."""
    time = common_times(record, "body_rate", "quaternion")
    if len(time) < 3 * EDGE:
        return np.zeros((0, 3)), np.zeros((0, 3))
    q = smooth(attitudes(record.streams["quaternion"], time))
    inner = slice(EDGE, -EDGE)
    return smooth(at_times(record.streams["body_rate"], time))[inner], turning(q, GRID)[inner]


def turning(q: np.ndarray, step: float) -> np.ndarray:
    """Body rates of attitudes (n, 4) that follow each other by `step` s, (n, 3) rad/s: twice the vector part of the
    conjugate times the derivative.
    """
    w, x, y, z = q.T
    dw, dx, dy, dz = np.gradient(q, step, axis=0).T
    return 2 * np.stack(
        [w * dx - x * dw - y * dz + z * dy, w * dy + x * dz - y * dw - z * dx, w * dz - x * dy + y * dx - z * dw], -1
    )


def turns(pose: Stream) -> Stream:
    """The body rates by which attitudes go over into each other, rad/s, each in the middle between two of them."""
    before, after = Quat.of(pose.values[:-1]), Quat.of(pose.values[1:])
    away, passed = before.conjugate().compose(after).stack(), np.diff(pose.time)
    return Stream(pose.time[:-1] + passed / 2, 2 * away[:, 1:] * np.sign(away[:, :1]) / passed[:, None])


def runs(there: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First and last index of each run of truth in (n,) booleans."""
    edges = np.diff(np.concatenate([[0], there.astype(int), [0]]))
    return np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1


def lagged(values: np.ndarray, constant: float, step: float) -> np.ndarray:
    """Values, (..., t), after a first-order lag, s, on a grid of a step, s, beginning at rest."""
    kept = np.exp(-step / max(constant, 1e-6))
    begin = kept * values[..., :1]
    return np.asarray(lfilter([1 - kept], [1, -kept], values, zi=begin)[0])


def continuous(q: np.ndarray) -> np.ndarray:
    """The same attitudes as quaternions that do not change their sign from one to the next."""
    flips = np.where(np.sum(q[1:] * q[:-1], axis=1) < 0, -1.0, 1.0)
    return q * np.concatenate([[1.0], np.cumprod(flips)])[:, None]


def smooth(x: np.ndarray, width: int = 9) -> np.ndarray:
    """Columns averaged over `width` points by Hann's window, which is zero at its ends; fewer stay as they are."""
    kernel = np.hanning(width)[1:-1]
    if len(x) < len(kernel):
        return x
    kernel /= kernel.sum()
    return np.stack([np.convolve(column, kernel, "same") for column in x.T], -1)


def pearson(a: np.ndarray, b: np.ndarray) -> float:
    """Pearson's correlation. 0 if one of the two is constant."""
    return float(correlations(a[:, None], b[:, None])[0])


def correlations(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Pearson's correlation of each column of one with that of the other, (k,). 0 where one of the two is constant."""
    a, b = a - a.mean(0), b - b.mean(0)
    size = np.sqrt(np.sum(a**2, 0) * np.sum(b**2, 0))
    return np.asarray(np.sum(a * b, 0) / np.where(size > 0, size, np.inf))
