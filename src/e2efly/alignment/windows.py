"""A flight on a uniform time grid, cut into windows. Each window is simulated from its own start."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from e2efly.logs.recording import Record, Stream

STEP = 0.004
"""Time between two points of the grid, s. It is short enough for the physics to be accurate (docs/physics.md)."""
LENGTH = 0.4
"""Length of a window, s: long enough to show lag, delay and rate loop, short enough not to diverge."""
LENGTHS = {"motor": 0.1, "motor_and_rate": 1.0}
"""Length of a window when motor outputs drive the simulation, s. Without a controller, the simulated vehicle turns away
from the real one within tenths of a second. With motor_and_rate it does not, because it turns with the measured
rates."""
REACH = 0.252
"""Time before a window for which its commands are stored, s. This is the largest delay that can be found."""
MEASURED = ("body_rate", "specific_force", "rotor_speed", "velocity", "quaternion", "position")
"""Streams with which a simulated window is compared."""
GAP = 3.0
"""Number of periods of a stream without a sample that counts as a gap."""


@dataclass(frozen=True)
class Windows:
    """n windows with m steps each, from one or several flights. NumPy arrays, float64."""

    flight: np.ndarray
    """(n,) number of the flight of each window."""
    when: np.ndarray
    """(n,) start of each window, as a fraction of its flight, 0 to 1."""
    begin: np.ndarray
    """(n,) start of each window, s of its record's clock."""
    driven: np.ndarray
    """(n, past + m + 1, k) integral over time of the stream that drives the vehicle: commands (k is 4), motor outputs
    or rotor speeds (one for each rotor). With motor_and_rate, the body rates are appended."""
    measured: dict[str, np.ndarray]
    """Measurements by stream, (n, m + 1, k). Zero where nothing was measured."""
    there: dict[str, np.ndarray]
    """By stream, (n, m + 1): 1 where something was measured, else 0."""
    start: dict[str, np.ndarray]
    """By stream, (n, k): the value at the start of each window, interpolated between samples."""

    @property
    def count(self) -> int:
        """Number of windows."""
        return len(self.flight)

    @property
    def length(self) -> float:
        """Length of each window, s."""
        return self.steps * STEP

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
    """Number of steps before the start of a window for which its commands are stored."""
    return round(REACH / STEP)


def cut(record: Record, driver: str, flight: int = 0, volts: float | None = None, length: float = 0.0) -> Windows:
    """Consecutive windows of a flight. Windows in which the driving stream has a gap are left out.

    Motor outputs are scaled to `volts`, V, if given. A length of 0 s is the one that suits the driver (`Model.driver`).
    """
    m, past = round((length or LENGTHS.get(driver, LENGTH)) / STEP), past_steps()
    names = [name for name in MEASURED if record.has(name)]
    driving = _driving(record, driver, volts)
    spans = [(s.time[0], s.time[-1]) for s in (record.streams["body_rate"], driving)]
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
    for lost, again in zip(driving.time[:-1][gaps], driving.time[1:][gaps], strict=True):
        torn |= (grid[inner[:, -1]] > lost) & (before[rows[:, 0]] < again)
    begin = grid[inner[:, 0]]
    windows = Windows(np.full(n, flight), np.arange(n) / max(n, 1), begin, driven[rows], measured, there, start)
    whole = windows.some(~torn & (there["body_rate"].mean(1) > 0.2))
    if driver == "motor_and_rate":  # an input of the simulation cannot be compared with its result
        del whole.measured["body_rate"], whole.there["body_rate"]
    return whole


def _driving(record: Record, driver: str, volts: float | None) -> Stream:
    """The stream that drives the simulation, (n, k)."""
    if driver not in ("motor", "motor_and_rate"):
        return record.streams[driver]
    stream = record.streams["motor"]

    def at(name: str) -> np.ndarray:
        other = record.streams[name]
        return np.stack([np.interp(stream.time, other.time, column) for column in other.values.T], -1)

    values = stream.values if volts is None else stream.values * at("voltage") / volts
    return Stream(stream.time, values if driver == "motor" else np.concatenate([values, at("body_rate")], 1))


def join(parts: Sequence[Windows]) -> Windows:
    """The windows of several flights together, with every stream that any of the flights has."""
    names = [name for name in MEASURED if any(name in part.measured for part in parts)]

    def nothing(part: Windows, *size: int) -> np.ndarray:
        return np.zeros((part.count, part.steps + 1, *size))

    measured, there, start = {}, {}, {}
    for name in names:
        size = next(part.measured[name].shape[-1] for part in parts if name in part.measured)
        measured[name] = np.concatenate([part.measured.get(name, nothing(part, size)) for part in parts])
        there[name] = np.concatenate([part.there.get(name, nothing(part)) for part in parts])
        unknown = np.full((1, size), np.nan)
        start[name] = np.concatenate([part.start.get(name, unknown.repeat(part.count, 0)) for part in parts])
    flight, when, begin, driven = (
        np.concatenate([getattr(p, name) for p in parts]) for name in ("flight", "when", "begin", "driven")
    )
    return Windows(flight, when, begin, driven, measured, there, start)


def integral(stream: Stream, grid: np.ndarray, held: bool) -> np.ndarray:
    """Integral of a stream over time, from the start of the grid. With `held`, each sample holds until the next one.
    Otherwise the values are interpolated linearly.
    """
    t, x = stream.time, stream.values
    pieces = x[:-1] if held else (x[:-1] + x[1:]) / 2
    total = np.concatenate([np.zeros((1, x.shape[1])), np.cumsum(pieces * np.diff(t)[:, None], 0)])
    end = max(grid[-1], t[-1]) + 1.0
    t, total = np.append(t, end), np.concatenate([total, total[-1:] + x[-1:] * (end - t[-1])])
    found = np.stack([np.interp(grid, t, column) for column in total.T], -1)
    return found - found[:1]


def on_grid(stream: Stream, grid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """A stream interpolated on the grid, and the points of the grid at which a sample is close enough to be used."""
    t = stream.time
    values = np.stack([np.interp(grid, t, column) for column in stream.values.T], -1)
    after = np.clip(np.searchsorted(t, grid), 1, len(t) - 1)
    apart = t[after] - t[after - 1]
    nearest = np.minimum(np.abs(grid - t[after - 1]), np.abs(grid - t[after]))
    period = 1 / stream.rate
    # for a stream slower than the grid, only the points next to a sample count; for a faster stream, all points
    good = (nearest <= max(STEP / 2 + 1e-9, period / 2 if period <= 1.5 * STEP else 0)) & (apart < GAP * period + 1e-9)
    return values, good
