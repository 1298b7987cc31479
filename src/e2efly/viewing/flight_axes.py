"""Shared parts of the figures of a flight: colours of modes, bands behind plots over time, texts in empty plots."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from e2efly.config.drawing import INK, ORANGE
from e2efly.logs.flight_log import FlightLog
from e2efly.viewing.flight_data import Interval
from e2efly.viewing.style import BLUE, GREEN, GREY, PALE, PURPLE, SKY, VERMILLION, say

MODE_COLOR = {
    "INIT": GREY, "TAKEOFF": ORANGE, "HOVER": BLUE, "POLICY": VERMILLION, "LAND": GREEN, "DONE": PALE,
    "DISARMED": PALE,
}  # fmt: skip
"""Colours of the modes. Other modes get purple, then sky."""
XYZ = (BLUE, VERMILLION, GREEN)


def colors(modes: list[Interval]) -> dict[str, str]:
    """A colour for every mode of a flight."""
    others = [mode for mode in dict.fromkeys(i.mode for i in modes) if mode.upper() not in MODE_COLOR]
    return {i.mode: MODE_COLOR.get(i.mode.upper()) or (PURPLE, SKY)[others.index(i.mode) % 2] for i in modes}


def note(log: FlightLog) -> list[str]:
    """The line under a title: file, duration, vehicle, and why the log ends early."""
    text = f"{log.path.name}, {log.duration:.1f} s"
    if vehicle := log.meta.get("vehicle"):
        text += f", {vehicle}"
    return [f"{text}; {log.cut_off}" if log.cut_off else text]


def bands(ax: Axes, modes: list[Interval], duration: float) -> None:
    """The modes as pale bands behind a plot over time."""
    color = colors(modes)
    for i in modes:
        if i.mode:
            ax.axvspan(i.start, i.end, color=color[i.mode], alpha=0.10, linewidth=0, zorder=0)
    for i in modes[1:]:
        ax.axvline(i.start, color=GREY, linewidth=0.7, zorder=1)
    ax.set_xlim(0, max(duration, 0.1))


def mode_handles(color: dict[str, str], filled: bool) -> list[Any]:
    """Entries of a legend for the modes: bands where `filled`, else lines."""
    if filled:
        return [Patch(facecolor=c, alpha=0.3, label=mode) for mode, c in color.items() if mode]
    return [Line2D([], [], color=c, label=mode) for mode, c in color.items() if mode]


def stepped_in_marks(ax: Axes, log: FlightLog) -> list[Any]:
    """Marks along the lower edge of a plot over time where the filter changed a command; their entry of a legend."""
    time = log["filter"].time
    if not len(time):
        return []
    edge = ax.get_xaxis_transform()
    line = ax.plot(time, np.full(len(time), 0.02), "|", color=INK, markersize=7, transform=edge, label="filter")
    return list(line)


def empty(ax: Axes) -> None:
    """Write a text into the axes if no line has a finite value."""
    if not any(np.isfinite(np.asarray(line.get_ydata(), float)).any() for line in ax.get_lines()):
        say(ax, "not recorded")


def liveliest(time: np.ndarray, x: np.ndarray, length: float) -> float:
    """Start of the interval of `length` s in which x (n, 3) varies most."""
    if len(time) < 2:
        return 0.0
    starts = np.arange(time[0], max(time[-1] - length, time[0]) + 1e-9, length / 4)
    x = np.nan_to_num(x)
    variances = [float(np.var(x[(time >= s) & (time < s + length)], axis=0).sum()) for s in starts]
    return float(starts[int(np.nanargmax(variances))]) if np.isfinite(variances).any() else 0.0
