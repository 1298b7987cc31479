"""A flight controller's blackbox, laid into the log of the flight that it is of.

Our flight log has the commands, the poses and 50 samples of the gyroscope a second; the blackbox has gyroscope, motor
outputs and the rate loop's setpoint a thousand times a second. Together they show what neither shows alone.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from e2efly.deploy.log.blackbox import Blackbox, align
from e2efly.identification.readers import BLACKBOXES
from e2efly.identification.record import Record, Stream

RATE = 1000.0
"""Samples a second that are kept of a blackbox, Hz: means of those in between."""
UNEVEN = 0.003
"""A clock that is so far from even, s, is followed piece by piece."""
TRIED = np.arange(-0.05, 0.2, 5e-4)
"""Delays from a command to the setpoint that are tried, s; below none, as the clocks are matched by 50 Hz."""
DELAY_SIGMA = 1.5e-3
"""Standard deviation of a delay that is measured so, s: the clocks' match."""
ALIKE = 0.3
"""Largest share of the setpoint's variance that its commands may leave unexplained."""


def with_blackboxes(records: Sequence[Record]) -> list[Record]:
    """The flights, with the blackboxes of the same flights laid into them; other blackboxes stay flights of their own.

    Args:
        records: as read.
    """
    found = dict(enumerate(records))
    boxes = [i for i, r in found.items() if r.path.suffix.lower() in BLACKBOXES and r.has("body_rate")]
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
    """A flight with a blackbox in it; None: it is not of this flight."""
    told, gyro = box.streams["body_rate"], flight.streams["body_rate"]
    none = np.full((len(told.time), 4), np.nan)
    try:
        laid = align(gyro.time, gyro.values, Blackbox(told.time, told.values, none[:, :3], none, "", 1))
    except ValueError:
        return None
    time = _even(told.time, laid.time, np.linalg.norm(told.values, axis=1))
    every = max(round(told.rate / RATE), 1)
    streams = {name: stream for name, stream in flight.streams.items() if name not in ("body_rate", "motor")}
    for name in ("body_rate", "motor", "setpoint"):
        if name in box.streams and len(box.streams[name].time) == len(time):
            streams[name] = Stream(_means(time, every), _means(box.streams[name].values, every))
    note = f"{box.path.name} is laid over it: body rates, motor outputs and setpoints are the blackbox's"
    return replace(flight, streams=streams, notes=(*flight.notes, note))


def _even(own: np.ndarray, laid: np.ndarray, lively: np.ndarray) -> np.ndarray:
    """The times at which a blackbox was laid over a flight, as of a clock that runs evenly, if it does.

    Pieces of a flight show the offset of the clocks to a millisecond or two, a quiet one hardly: a straight line
    through all of them, by how lively they are, shows it better.
    """
    some = slice(None, None, max(len(own) // 2000, 1))
    width = max(len(own) // 50, 1)
    weight = np.sqrt(np.convolve(lively**2, np.ones(width) / width, "same"))[some]
    line, spread = np.array([1.0, 0.0]), np.inf
    for _ in range(3):  # what lies far from the line counts less
        line = np.polyfit(own[some], laid[some], 1, w=weight)
        off = laid[some] - np.polyval(line, own[some])
        spread = float(np.sqrt(np.average(off**2, weights=weight**2)))
        weight = weight * np.minimum(1.0, 2 * spread / np.maximum(np.abs(off), 1e-12))
    return laid if spread > UNEVEN else np.polyval(line, own)


def _means(values: np.ndarray, every: int) -> np.ndarray:
    count = len(values) // every * every
    return values[:count].reshape(-1, every, *values.shape[1:]).mean(1)


def setpoint_delay(record: Record) -> float | None:
    """From a command's sending until the rate loop was asked for it, s; None: the record does not show it.

    The delay by which the commands, held, explain the setpoints best.
    """
    if not record.has("command", "setpoint"):
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
    return float(TRIED[left <= least * (1 + 1e-6)].mean())  # slow samples show a range of them


def _held(command: Stream, time: np.ndarray) -> np.ndarray:
    """The body rates of the commands that were the newest at these times, (n, 3)."""
    return command.values[np.searchsorted(command.time, time, side="right") - 1, 1:]
