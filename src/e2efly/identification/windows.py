"""A flight on an even grid of times, cut into windows that are simulated each from a start of its own."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from e2efly.identification.record import KINDS, Record, Stream

STEP = 0.004
"""Time between two points of the grid, s: no longer than the physics is exact with (docs/physics.md)."""
LENGTH = 0.4
"""Length of a window, s: long enough to see lag, delay and rate loop at work, short enough not to diverge."""
REACH = 0.252
"""How far back the commands of a window are kept, s: the largest delay that can be found."""
MEASURED = ("body_rate", "specific_force", "rotor_speed", "velocity", "quaternion", "position")
"""Streams that a simulated window is compared with."""
GAP = 3.0
"""Periods of a stream without a sample that count as a gap."""


@dataclass(frozen=True)
class Windows:
    """n windows of m steps each, of one or several flights; NumPy arrays, float64."""

    flight: np.ndarray
    """(n,) which flight each is of."""
    when: np.ndarray
    """(n,) start of each, as a share of its flight, 0 to 1."""
    begin: np.ndarray
    """(n,) start of each, s of its record's clock."""
    driven: np.ndarray
    """(n, past + m + 1, 4) integral over time of what drives the vehicle: commands, motor outputs or rotor speeds."""
    measured: dict[str, np.ndarray]
    """By stream, (n, m + 1, k); zero where nothing was measured."""
    there: dict[str, np.ndarray]
    """By stream, (n, m + 1): 1 where something was."""
    start: dict[str, np.ndarray]
    """By stream, (n, k): between its samples, at the start of each."""

    @property
    def count(self) -> int:
        """How many windows."""
        return len(self.flight)

    @property
    def steps(self) -> int:
        """Steps of a window."""
        return next(iter(self.there.values())).shape[1] - 1

    def some(self, which: np.ndarray) -> "Windows":
        """Some of the windows."""

        def cut(table: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
            return {name: x[which] for name, x in table.items()}

        return Windows(
            self.flight[which], self.when[which], self.begin[which], self.driven[which],
            cut(self.measured), cut(self.there), cut(self.start),
        )  # fmt: skip


def past_steps() -> int:
    """Steps before its start of which a window knows the commands."""
    return round(REACH / STEP)


def cut(record: Record, driver: str, flight: int = 0) -> Windows:
    """Windows of a flight, one after the other; windows in which the driving stream has a gap are left out.

    Args:
        record: the flight.
        driver: the stream that drives: command, motor or rotor_speed.
        flight: its number.
    """
    m, past = round(LENGTH / STEP), past_steps()
    names = [name for name in MEASURED if record.has(name)]
    driving = record.streams[driver]
    spans = [(record.streams[name].time[0], record.streams[name].time[-1]) for name in ("body_rate", driver)]
    first, last = max(s[0] for s in spans), min(s[1] for s in spans)
    n = max(int((last - first - REACH) / (m * STEP)), 0)
    grid = first + STEP * (past + np.arange(n * m + 1))
    before = first + STEP * np.arange(n * m + 1 + past)
    driven = integral(driving, before, held=driver == "command")
    rows = np.arange(n)[:, None] * m + np.arange(m + 1 + past)
    inner = np.arange(n)[:, None] * m + np.arange(m + 1)
    measured, there, start = {}, {}, {}
    for name in names:
        values, good = on_grid(record.streams[name], grid)
        start[name] = values[inner[:, 0]]
        measured[name], there[name] = np.where(good[:, None], values, 0.0)[inner], good[inner].astype(float)
    longest = max(GAP / driving.rate, 0.05) if driver != "command" else np.inf
    gaps = np.diff(driving.time) > longest
    torn = np.zeros(n, bool)
    for start, end in zip(driving.time[:-1][gaps], driving.time[1:][gaps], strict=True):
        torn |= (grid[inner[:, -1]] > start) & (before[rows[:, 0]] < end)
    begin = grid[inner[:, 0]]
    windows = Windows(np.full(n, flight), np.arange(n) / max(n, 1), begin, driven[rows], measured, there, start)
    return windows.some(~torn & (there["body_rate"].mean(1) > 0.2))


def join(parts: Sequence[Windows]) -> Windows:
    """Windows of several flights together, with the streams that any of them has."""
    names = [name for name in MEASURED if any(name in part.measured for part in parts)]

    def nothing(part: Windows, *size: int) -> np.ndarray:
        return np.zeros((part.count, part.steps + 1, *size))

    measured, there, start = {}, {}, {}
    for name in names:
        size = len(KINDS[name].columns)
        measured[name] = np.concatenate([part.measured.get(name, nothing(part, size)) for part in parts])
        there[name] = np.concatenate([part.there.get(name, nothing(part)) for part in parts])
        unknown = np.full((1, size), np.nan)
        start[name] = np.concatenate([part.start.get(name, unknown.repeat(part.count, 0)) for part in parts])
    flight, when, begin, driven = (
        np.concatenate([getattr(p, name) for p in parts]) for name in ("flight", "when", "begin", "driven")
    )
    return Windows(flight, when, begin, driven, measured, there, start)


def integral(stream: Stream, grid: np.ndarray, held: bool) -> np.ndarray:
    """Integral over time, from the grid's start, of a stream whose samples hold until the next, or go over evenly."""
    t, x = stream.time, stream.values
    pieces = x[:-1] if held else (x[:-1] + x[1:]) / 2
    total = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(pieces * np.diff(t)[:, None], 0)])
    end = max(grid[-1], t[-1]) + 1.0
    t, total = np.append(t, end), np.concatenate([total, total[-1:] + x[-1:] * (end - t[-1])])
    found = np.stack([np.interp(grid, t, column) for column in total.T], -1)
    return found - found[:1]


def on_grid(stream: Stream, grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A stream between its samples, and where there is a sample close enough to be believed."""
    t = stream.time
    values = np.stack([np.interp(grid, t, column) for column in stream.values.T], -1)
    after = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
    apart = t[after] - t[after - 1]
    nearest = np.minimum(np.abs(grid - t[after - 1]), np.abs(grid - t[after]))
    period = 1 / stream.rate
    # of a stream slower than the grid, the points next to a sample count; of a faster one, all
    good = (nearest <= max(STEP / 2 + 1e-9, period / 2 if period <= 1.5 * STEP else 0)) & (apart < GAP * period + 1e-9)
    return values, good
