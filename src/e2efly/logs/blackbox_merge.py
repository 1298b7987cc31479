"""A flight controller's blackbox, merged into the flight log of the same flight.

The flight log of e2efly has the commands, the poses and 50 gyroscope samples per second. The blackbox has the
gyroscope, the motor outputs and the setpoint of the rate loop a thousand times per second, and may have the speeds of
the rotors. Together they show more than each alone.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from e2efly.logs.blackbox import Blackbox, align
from e2efly.logs.readers import BLACKBOX
from e2efly.logs.recording import Record, Stream, listed

RATE = 1000.0
"""Sampling rate to which a blackbox is reduced by averaging, Hz."""
UNEVEN = 0.003
"""If a clock deviates from an even one by more than this, s, it is followed piece by piece."""
TRIED = np.arange(-0.05, 0.2, 5e-4)
"""Delays from a command to the setpoint that are tried, s. They include negative ones, because the clocks are matched
with 50 Hz data."""
DELAY_SIGMA = 1.5e-3
"""Standard deviation of a delay that is measured in this way, s. It comes from the matching of the clocks."""
OVER, BESIDES = ("body_rate", "motor", "setpoint"), ("rotor_speed", "specific_force", "voltage")
"""Streams of a blackbox that replace those of the flight log, and those that are taken if the flight log has none."""
ALIKE = 0.3
"""Largest fraction of the setpoint's variance that the commands may leave unexplained."""


def with_blackboxes(records: Sequence[Record]) -> list[Record]:
    """The flights, with the blackboxes of the same flights merged into them. Other blackboxes stay separate."""
    found = dict(enumerate(records))
    boxes = [i for i, r in found.items() if r.kind == BLACKBOX and r.has("body_rate")]
    flights = [i for i, r in found.items() if i not in boxes and r.has("body_rate", "command")]
    for box in boxes:
        laid = ((i, _laid(found[i], found[box])) for i in flights)
        first = next(((i, record) for i, record in laid if record is not None), None)
        if first is not None:
            i, record = first
            found[i] = record
            flights.remove(i)
            del found[box]
    return list(found.values())


def _laid(flight: Record, box: Record) -> Record | None:
    """A flight with a blackbox merged into it. None: the blackbox does not belong to this flight."""
    told, gyro = box.streams["body_rate"], flight.streams["body_rate"]
    none = np.full((len(told.time), 4), np.nan)
    try:
        laid = align(gyro.time, gyro.values, Blackbox(told.time, told.values, none[:, :3], none, "", 1))
    except ValueError:
        return None
    time = _even(told.time, laid.time, np.linalg.norm(told.values, axis=1))
    every = max(round(told.rate / RATE), 1)
    streams = {name: stream for name, stream in flight.streams.items() if name not in ("body_rate", "motor")}
    taken = [name for name in (*OVER, *BESIDES) if name in box.streams and name not in {*streams} - {*OVER}]
    for name in taken:
        stream = box.streams[name]
        at = np.interp(stream.time, told.time, time)
        streams[name] = Stream(_means(at, every), _means(stream.values, every))
    left = [name for name in BESIDES if name in box.streams and name not in taken]
    besides = f"; its {listed(left)} is not used, as the flight log has its own" if left else ""
    note = f"{box.path.name} is laid over it: {listed(taken)} from the blackbox{besides}"
    notes = (f"{box.path.name}: {each}" for each in box.notes)
    return replace(flight, streams=streams, notes=(*flight.notes, *notes, note))


def _even(own: np.ndarray, laid: np.ndarray, lively: np.ndarray) -> np.ndarray:
    """The times of a blackbox on the clock of the flight, corrected to an evenly running clock, if the clock runs
    evenly.

    A single piece of a flight shows the offset of the clocks to within a millisecond or two; a piece without much
    motion hardly shows it. A straight line through all pieces, weighted by their motion, is more accurate.
    """
    some = slice(None, None, max(len(own) // 2000, 1))
    width = max(len(own) // 50, 1)
    weight = np.sqrt(np.convolve(lively**2, np.ones(width) / width, "same"))[some]
    line, spread = np.array([1.0, 0.0]), np.inf
    for _ in range(3):  # points far from the line get less weight
        line = np.polyfit(own[some], laid[some], 1, w=weight)
        off = laid[some] - np.polyval(line, own[some])
        spread = float(np.sqrt(np.average(off**2, weights=weight**2)))
        weight = weight * np.minimum(1.0, 2 * spread / np.maximum(np.abs(off), 1e-12))
    return laid if spread > UNEVEN else np.polyval(line, own)


def _means(values: np.ndarray, every: int) -> np.ndarray:
    count = len(values) // every * every
    return values[:count].reshape(-1, every, *values.shape[1:]).mean(1)


def setpoint_delay(record: Record) -> float | None:
    """The time from the sending of a command until it is the setpoint of the rate loop, s. None: the record does not
    show it, as where its commands are only the setpoints.

    It is the delay at which the commands, each held until the next, explain the setpoints best.
    """
    if not record.has("command", "setpoint") or not np.ptp(record.streams["command"].values[:, 0]):
        return None
    command, setpoint = record.streams["command"], record.streams["setpoint"]
    first, last = command.time[0] + TRIED[-1], command.time[-1] + TRIED[0]
    inside = setpoint.during(first, last)
    if len(inside.time) < 2:
        return None
    left = np.array([np.mean((_held(command, inside.time - late) - inside.values) ** 2) for late in TRIED])
    least = float(left.min())
    if least > ALIKE * float(np.mean(np.var(inside.values, axis=0))):
        return None
    return float(TRIED[left <= least * (1 + 1e-6)].mean())  # with slow samples, a range of delays fits


def _held(command: Stream, time: np.ndarray) -> np.ndarray:
    """The body rates of the newest command at each of these times, (n, 3)."""
    return command.values[np.searchsorted(command.time, time, side="right") - 1, 1:]
