"""Brings the poses of a flight onto the clock of its gyroscope: an offset, and a rate."""

from dataclasses import replace

import numpy as np

from e2efly.alignment.comparison import (
    GRID,
    at_times,
    attitudes,
    common_times,
    correlations,
    pearson,
    rates,
    smooth,
    turning,
)
from e2efly.alignment.damage_checks import POSES
from e2efly.alignment.unit_checks import AGREE
from e2efly.logs.blackbox import vertex
from e2efly.logs.recording import Record, Stream

DRIFT, UNEVEN = 0.02, 0.04
"""`DRIFT`: constant change of the offset between two clocks during a flight from which on it is corrected, s. `UNEVEN`:
largest deviation from a constant change, s."""
CLEAR = 3.0
"""How many times the deviation from a constant change it has to be itself."""
FASTEST = 0.02
"""Largest difference of two clocks' rates that is looked for."""
REACH_S = 0.2
"""Largest offset that is looked for, s."""
MOVING = 0.05
"""Standard deviation of body rates that shows an offset, rad/s."""
LIVELY = 0.5
"""Share of the liveliest part's motion from which on a part is used."""
PARTS = 7
"""Parts of a flight, each a third long, in which the offset is found."""
COARSE = 0.02
"""Time between two points at which the rate of a clock is looked for, s."""


def with_clock_rate(record: Record) -> Record:
    """The flight with the poses' clock as fast as the gyroscope's, where its rate shows by far.

    The amounts of the body rates are compared, which do not depend on any axes: frames are checked later.

    Raises:
        ValueError: for poses and a gyroscope that have no common time.
    """
    if not record.has("body_rate", "quaternion"):
        return record
    time = common_times(record, "body_rate", "quaternion", step=COARSE)
    spans = {name: record.streams[name].time[[0, -1]] for name in ("body_rate", "quaternion")}
    if len(time) * COARSE < 0.3 * min(np.ptp(span) for span in spans.values()):
        (a, b), (c, d) = spans.values()
        raise ValueError(
            f"{record.path}: body_rate is from {a:.6g} to {b:.6g} s and quaternion from {c:.6g} to {d:.6g} s; "
            "accepted: times by one clock, or the log --without quaternion"
        )
    length = len(time) * COARSE
    if FASTEST * length < 2 * DRIFT:
        return record
    start = time[0]
    told = np.linalg.norm(smooth(at_times(record.streams["body_rate"], time), 7), axis=1)
    true = np.linalg.norm(turning(smooth(attitudes(record.streams["quaternion"], time), 7), COARSE), axis=1)
    if min(told.std(), true.std()) < MOVING:
        return record
    reach = round(REACH_S / COARSE)

    def agreement(rate: float) -> float:
        seen = np.interp(start + (time - start) * (1 + rate), time, true)
        n = int(len(time) / (1 + FASTEST)) - 2 * reach
        return max(pearson(told[reach : reach + n], seen[k : k + n]) for k in range(2 * reach + 1))

    candidates = np.arange(-FASTEST, FASTEST + 1e-9, 0.5 * DRIFT / length)
    found = [agreement(rate) for rate in candidates]
    usual, best = agreement(0.0), int(np.argmax(found))
    if abs(candidates[best]) * length < 2 * DRIFT or found[best] < AGREE or 1 - found[best] > 0.6 * (1 - usual):
        return record
    return _by_clock(record, start, float(candidates[best]), 0.0)


def on_one_clock(record: Record, part: Record) -> Record:
    """The flight with the poses moved by the offset of their clock, and by its drift, if that is constant. Both are
    found in a part of it: in the air.

    Raises:
        ValueError: for clocks that run apart in another way.
    """
    if not record.has("body_rate", "quaternion"):
        return record
    start, end = part.span
    length = (end - start) / 3
    parts = [part.during(a, a + length) for a in np.linspace(start, end - length, PARTS)]
    motion = np.array([np.std(rates(third)[0]) if third.has("body_rate", "quaternion") else 0.0 for third in parts])
    lively = motion > LIVELY * np.max(motion)  # where it hardly turns, noise moves the offset
    lags = [
        (sum(third.span) / 2, lag)
        for third, much in zip(parts, lively, strict=True)
        if much and (lag := _behind(third)) is not None
    ]
    whole = _behind(part)
    if len(lags) > 2:
        at, late = np.array(lags).T
        slope, middle = (float(x) for x in np.polyfit(at - start, late, 1))
        uneven = float(np.max(np.abs(late - np.polyval((slope, middle), at - start))))
        if uneven > UNEVEN:
            raise ValueError(
                f"{record.path}: the poses are {1e3 * late.min():.0f} to {1e3 * late.max():.0f} ms behind the "
                "gyroscope, and their clocks do not run apart evenly; accepted: clocks that differ by an offset and a "
                "rate, or a part of the log (LOG:BEGIN-END)"
            )
        if abs(slope) * (end - start) > max(DRIFT, CLEAR * uneven):
            return _by_clock(record, start, slope, middle)
    if whole is None:  # the age of the poses is then not known either
        return replace(record, pose_age=None)
    if abs(whole) < 1e-3:
        return record
    age = None if record.pose_age is None else record.pose_age + whole
    note = f"poses are moved by {-1e3 * whole:.0f} ms onto the gyroscope's clock"
    return replace(_moved(record, record.span[0], 0.0, whole), notes=(*record.notes, note), pose_age=age)


def _by_clock(record: Record, start: float, rate: float, late: float) -> Record:
    note = (
        f"the poses' clock is {100 * abs(rate):.2g} % {'fast' if rate > 0 else 'slow'} against the gyroscope's; their "
        "times are corrected"
    )
    age = None if record.pose_age is None else record.pose_age + late
    return replace(_moved(record, start, rate, late), notes=(*record.notes, note), pose_age=age)


def _moved(record: Record, start: float, rate: float, late: float) -> Record:
    """With the times of the poses, which are late by `late` at `start`, s, and then by `rate` more, s/s."""
    poses = {
        k: Stream(start + (s.time - start - late) / (1 + rate), s.values)
        for k, s in record.streams.items()
        if k in POSES
    }
    return replace(record, streams={**record.streams, **poses})


def _behind(record: Record) -> float | None:
    """Time by which the poses lag behind the gyroscope, s. None if the two show no common motion.

    Where their axes do not agree, the amounts of their body rates are compared.
    """
    if not record.has("body_rate", "quaternion"):
        return None
    told, true = rates(record)
    if len(told) < 100 or np.std(true) < MOVING:
        return None
    reach = round(REACH_S / GRID)
    for a, b in ((told, true), tuple(np.linalg.norm(x, axis=1, keepdims=True) for x in (told, true))):
        scores = np.array([
            np.mean(correlations(a[max(-k, 0) : len(a) - max(k, 0)], b[max(k, 0) : len(b) - max(-k, 0)]))
            for k in range(-reach, reach + 1)
        ])  # fmt: skip
        i = int(np.argmax(scores))
        if scores[i] >= AGREE:
            return (i - reach + float(vertex(scores, i))) * GRID
    return None
