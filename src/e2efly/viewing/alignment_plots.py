"""Plots of an alignment: the commands, the vehicle's response, and the simulator's response before and after it."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes

from e2efly.alignment.alignment import LEAD_S, Alignment, clearest
from e2efly.alignment.replay import SIGNALS, Stretches, stretches, thrust_is_told
from e2efly.alignment.windows import REACH, STEP
from e2efly.config.drawing import INK
from e2efly.logs.recording import Record
from e2efly.simulation.physics.rotation import yaw_pitch_roll
from e2efly.viewing.style import BLUE, GREY, PALE, VERMILLION, figure, legend_of, say

STEPPED = ("thrust (m/s²)", "roll rate (rad/s)", "pitch rate (rad/s)", "yaw rate (rad/s)")
"""Labels by channel of a command."""
ROW_S, ROW_COUNT = 1.0, 5
"""Length of the sections of the replay, s, and the number of consecutive sections that are shown."""
ASKED: dict[str, Any] = {"color": GREY, "linewidth": 1.2, "drawstyle": "steps-post", "label": "commanded"}
MEASURED: dict[str, Any] = {"color": INK, "linewidth": 2.2, "alpha": 0.75, "label": "measured"}
BEFORE: dict[str, Any] = {"color": VERMILLION, "linewidth": 1.4, "linestyle": (0, (4, 2)), "label": "simulator, before"}
AFTER: dict[str, Any] = {"color": BLUE, "linewidth": 1.6, "label": "simulator, aligned"}
_ANGLES = ("roll (deg)", "pitch (deg)", "yaw (deg)")


def plot_alignment(folder: Path, alignment: Alignment, records: Sequence[Record]) -> list[Path]:
    """Draw all figures and return their files."""
    paths = [folder / f"{name}.png" for name in ("steps", "replay", "errors")]
    plot_steps(paths[0], alignment, records[0])
    plot_replay(paths[1], alignment, records[0])
    plot_errors(paths[2], alignment)
    return paths


def both(alignment: Alignment, flown: Stretches) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Replays with the vehicle of the file and with the aligned vehicle."""
    return alignment.replayed(flown, aligned=False), alignment.replayed(flown, aligned=True)


def plot_steps(path: Path, alignment: Alignment, record: Record) -> None:
    """The paper's figure: a step of each body rate and of the thrust, and the responses to it."""
    notes = [
        f"The clearest step of each command in {record.path.name}. The simulator starts as measured, at the left edge."
    ]
    with figure(path, "Response to steps", 6.0, notes) as fig:
        for place, channel in enumerate((1, 2, 3, 0), 1):
            ax = fig.add_subplot(2, 2, place)
            ax.set_ylabel(STEPPED[channel])
            if place > 2:
                ax.set_xlabel("time since the step (ms)")
            _draw_step(ax, alignment, clearest(record, channel), channel)
        legend_of(fig.axes[0], fig)


def _draw_step(ax: Axes, alignment: Alignment, flown: Stretches, channel: int) -> None:
    stream, axis = ("body_rate", channel - 1) if channel else ("specific_force", 2)
    if stream not in flown.measured or (not channel and not thrust_is_told(flown)):
        say(ax, "not in the log")
        return
    t, there = 1e3 * (flown.time - LEAD_S), flown.there[stream][0]
    old, new = both(alignment, flown)
    ax.plot(t, flown.command[0, :, channel], **ASKED)
    ax.plot(t[there], flown.measured[stream][0, there, axis], **_measured(stream))
    ax.plot(t, old[stream][0, :, axis], **BEFORE)
    ax.plot(t, new[stream][0, :, axis], **AFTER)
    ax.set_xlim(t[0], t[-1])


def _measured(stream: str) -> dict[str, Any]:
    """Line style of a measurement. Accelerometer data is noisy, so a thin line keeps the others visible."""
    return MEASURED | ({"linewidth": 1.3, "alpha": 0.8} if stream == "specific_force" else {})


def plot_replay(path: Path, alignment: Alignment, record: Record) -> None:
    """The seconds of a flight with the most motion, replayed in sections that each start from the measured state."""
    flown = _liveliest(record)
    old, new = both(alignment, flown)
    notes = [
        f"{len(flown.begin)} s of {record.path.name}, replayed by the commands that were sent. Every second the "
        "simulator starts anew as measured."
    ]
    with figure(path, "Replay of the flight", 9.0, notes) as fig:
        grid = fig.add_gridspec(4, 3)
        rows = [
            (grid[i, column], stream, i, label)
            for column, stream, labels in (
                (0, "body_rate", STEPPED[1:]),
                (1, "quaternion", _ANGLES),
                (2, "velocity", ("velocity x (m/s)", "velocity y (m/s)", "velocity z (m/s)")),
            )
            for i, label in enumerate(labels)
        ]
        for cell, stream, axis, label in [*rows, (grid[3, :], "specific_force", 2, STEPPED[0])]:
            ax = fig.add_subplot(cell)
            ax.set_ylabel(label)
            if axis == 2:
                ax.set_xlabel("time in the flight (s)")
            _draw_stretches(ax, flown, (old, new), stream, axis)
        legend_of(fig.axes[0], fig)


def _liveliest(record: Record) -> Stretches:
    """Consecutive sections in which the commanded body rates change most."""
    sent, rates = record.streams["command"], record.streams["body_rate"]
    first = max(sent.time[0], rates.time[0]) + REACH
    last = min(sent.time[-1], rates.time[-1])
    count = min(int((last - first) / ROW_S), ROW_COUNT)
    starts = np.arange(first, last - count * ROW_S + 1e-9, 0.25)

    def lively(start: float) -> float:
        within = sent.during(start, start + count * ROW_S).values[:, 1:]
        return float(np.var(within, axis=0).sum()) if len(within) else 0.0

    return stretches(record, max(starts, key=lively) + ROW_S * np.arange(count), ROW_S)


def _draw_stretches(
    ax: Axes, flown: Stretches, seen: tuple[dict[str, np.ndarray], dict[str, np.ndarray]], stream: str, axis: int
) -> None:
    told = stream in ("body_rate", "quaternion") or thrust_is_told(flown)
    if stream not in flown.measured or not told:
        say(ax, "not in the log")
        return
    measured = _shown(flown.measured[stream], stream)[..., axis]
    for k, start in enumerate(flown.begin):
        t, there = start + flown.time, flown.there[stream][k]
        labelled: dict[str, Any] = {} if k == 0 else {"label": None}
        if stream == "body_rate" or stream == "specific_force":
            channel = axis + 1 if stream == "body_rate" else 0
            ax.plot(t, flown.command[k, :, channel], **(ASKED | labelled))
        ax.plot(t[there], measured[k, there], **(_measured(stream) | labelled))
        for replayed, style in zip(seen, (BEFORE, AFTER), strict=True):
            line = _shown(replayed[stream], stream)[k, :, axis]
            if stream == "quaternion":  # angles that differ by a full turn are the same
                line = line - 360 * np.round((line[0] - measured[k, 0]) / 360)
            ax.plot(t, line, **(style | labelled))
        ax.axvline(start, color=PALE, linewidth=0.8, zorder=0)
    ax.set_xlim(flown.begin[0], flown.begin[-1] + flown.time[-1])


def _shown(values: np.ndarray, stream: str) -> np.ndarray:
    """Values as they are drawn. An attitude becomes its angles, deg, without jumps of a full turn."""
    if stream != "quaternion":
        return values
    angles = np.asarray(yaw_pitch_roll(jnp.asarray(values)))[..., ::-1]
    return np.degrees(np.unwrap(angles, axis=1))


def plot_errors(path: Path, alignment: Alignment) -> None:
    """The remaining errors in the sections that the fit did not see."""
    names = list(alignment.before)
    found = alignment.found
    count, length = int(found.held_out.sum()), found.windows.steps * STEP
    notes = [f"Root mean square over {count} stretches of {length:g} s that the fit did not see, over that of the file"]
    with figure(path, "Error of the simulator, before and after", 1.3 + 0.42 * len(names), notes) as fig:
        ax = fig.add_subplot()
        ax.axvline(100, color=GREY, linewidth=1)
        for y, name in zip(range(len(names))[::-1], names, strict=True):
            before, after = alignment.before[name], alignment.after[name]
            share = 100 * after / before
            ax.plot([100, share], [y, y], color=PALE, linewidth=3, zorder=1)
            ax.plot(100, y, "o", color=VERMILLION, markersize=7, label="before" if not y else None)
            ax.plot(share, y, "o", color=BLUE, markersize=8, label="aligned" if not y else None)
            unit = SIGNALS[name].replace("^2", "²")
            told = f"{before:.3g} → {after:.3g} {unit}"
            ax.text(1.01, y, told, transform=ax.get_yaxis_transform(), va="center", fontsize=9)
        ax.set_yticks(range(len(names))[::-1], [name.replace("_", " ") for name in names])
        ax.set_xlim(left=0)
        ax.set_ylim(-0.6, len(names) - 0.4)
        ax.set_xlabel("error over the error before (%)")
        ax.grid(axis="y", visible=False)
        ax.legend(loc="lower left")
