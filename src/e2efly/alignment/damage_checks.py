"""Checks a flight for damage: impossible numbers, columns that were not measured, streams that stand still."""

from dataclasses import replace
from itertools import combinations

import numpy as np

from e2efly.alignment.unit_checks import factors, scaled
from e2efly.logs.recording import KINDS, Record, Stream, percent

LIMITS = {
    "position": 1e4, "velocity": 100.0, "quaternion": 1.01, "body_rate": 60.0, "specific_force": 300.0,
    "rotor_speed": 1e4, "motor": 1.05, "command": 300.0, "setpoint": 60.0, "voltage": 100.0,
}  # fmt: skip
"""Largest plausible absolute value in a quadrotor's log, in the stream's unit."""
LOST = 1e-3
"""Largest fraction of a stream that may be outside these limits. Such samples are left out."""
LEAST_VOLTS = 1.0
"""Lowest plausible voltage of a battery, V. Lower values mean that there is no sensor."""
FEW = 20
"""Number of samples below which a column may rest by chance."""
POSES = ("position", "velocity", "quaternion")
FROZEN_S, USUAL_RUNS = 0.2, 5
"""Time for which a stream that repeats its last sample in the air is frozen, s, and by how many times that exceeds how
long it usually repeats one: poses are often held until the next."""


def within_limits(record: Record) -> Record:
    """The record without single samples beyond all limits.

    Raises:
        ValueError: for a stream with many of them.
    """
    streams, notes = {}, list(record.notes)
    for name, stream in record.streams.items():
        bad = np.any(np.abs(stream.values) > LIMITS[name], axis=1)
        if name == "quaternion":
            bad |= np.abs(np.linalg.norm(stream.values, axis=1) - 1) > 0.02
        if name in ("motor", "rotor_speed"):
            bad |= np.any(stream.values < -0.05 * LIMITS[name], axis=1)
        if bad.mean() > LOST:
            unit = "" if KINDS[name].unit == "1" else f" {KINDS[name].unit}"
            worst = float(np.max(np.abs(stream.values)))
            other = next((u for u, f in factors(name).items() if f * worst <= LIMITS[name]), "")
            hint = scaled(name, factors(name)[other], stream.values.shape[1]) if other else ""
            hint = hint and f"; in {other}, they would be right: {hint}"
            raise ValueError(
                f"{record.path}: {name} is up to {worst:.4g}{unit}, and beyond what a quadrotor can do in "
                f"{percent(bad.mean())} of its samples; accepted: up to {LIMITS[name]:g}{unit} (are the units "
                f"right{hint}? Splines through gaps overshoot like this, too)"
            )
        if bad.any():
            notes.append(f"{int(bad.sum())} samples of {name} that no quadrotor reaches are left out")
        streams[name] = Stream(stream.time[~bad], stream.values[~bad])
    return replace(record, streams=streams, notes=tuple(notes))


def with_battery(record: Record) -> Record:
    """The record without invalid voltages. A flight controller without a voltage sensor reports 0 V."""
    if "voltage" not in record.streams:
        return record
    stream = record.streams["voltage"]
    there = stream.values[:, 0] > LEAST_VOLTS
    if there.all():
        return record
    streams = dict(record.streams)
    streams["voltage"] = Stream(stream.time[there], stream.values[there])
    if there.mean() < 0.5:
        del streams["voltage"]
        note = "the battery's voltage was not measured: 0 V"
    else:
        note = f"{int((~there).sum())} voltages of 0 V are left out"
    return replace(record, streams=streams, notes=(*record.notes, note))


def check_columns(record: Record) -> None:
    """Check that each column was measured by itself: it changes, and it is not another one.

    Raises:
        ValueError: naming the column.
    """
    for name in ("body_rate", "specific_force", "rotor_speed", "motor", "velocity", "quaternion"):
        if name not in record.streams or len(record.streams[name].time) < FEW:
            continue
        spread = np.ptp(record.streams[name].values, axis=0)
        if np.any(spread == 0):
            column = KINDS[name].names(len(spread))[int(np.argmin(spread))]
            raise ValueError(
                f"{record.path}: {column} of {name} never changes; accepted: what was measured in flight, or the log "
                f"--without {name}"
            )
    for name, stream in record.streams.items():
        own = KINDS[name].names(stream.values.shape[1])
        for i, k in combinations(range(len(own)), 2):
            if np.ptp(stream.values[:, i]) > 0 and np.array_equal(stream.values[:, i], stream.values[:, k]):
                raise ValueError(
                    f"{record.path}: {own[k]} of {name} is the same as {own[i]} throughout; accepted: each column from "
                    f"its own sensor (--columns {own[k]}=THEIRS), or the log --without {name}"
                )


def without_frozen(record: Record, flying: tuple[float, float]) -> Record:
    """The record without stretches in which a stream repeats its last sample in the air, between the two times, s.

    Raises:
        ValueError: for a stream that does so for most of the flight.
    """
    streams, seconds, shares = dict(record.streams), dict[str, float](), dict[str, float]()
    for name in POSES:
        if not record.has(name):
            continue
        stream = record.streams[name]
        begins = np.flatnonzero(np.append(True, np.any(np.diff(stream.values, axis=0) != 0, axis=1)))
        runs = np.diff(np.append(begins, len(stream.time)))
        first, last = stream.time[begins], stream.time[begins + runs - 1]
        long = (runs > USUAL_RUNS * np.median(runs)) & (
            np.minimum(last, flying[1]) - np.maximum(first, flying[0]) > FROZEN_S
        )
        lost = np.repeat(long, runs)
        lost[begins] = False
        if lost.any():
            streams[name] = Stream(stream.time[~lost], stream.values[~lost])
            seconds[name] = float(np.sum((last - first)[long]))
            inside = (stream.time >= flying[0]) & (stream.time <= flying[1])
            shares[name] = float(lost[inside].mean())
    if not seconds:
        return record
    repeats = f"{' and '.join(seconds)} repeat a sample for"
    if max(shares.values()) > 0.5:
        raise ValueError(
            f"{record.path}: {repeats} {percent(max(shares.values()))} of the flight; accepted: what was measured "
            f"throughout, or the log --without {' '.join(shares)}"
        )
    note = f"{repeats} {max(seconds.values()):.1f} s of the flight, which is left out of them"
    return replace(record, streams=streams, notes=(*record.notes, note))
