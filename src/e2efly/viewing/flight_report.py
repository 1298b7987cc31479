"""The figures of a flight log: each function takes the log and writes one PNG file, 1200 pixels wide."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from e2efly.config.drawing import INK
from e2efly.control import Quat
from e2efly.logs.flight_log import FlightLog
from e2efly.viewing.flight_axes import XYZ, bands, colors, empty, liveliest, mode_handles, note, stepped_in_marks
from e2efly.viewing.flight_data import AXES, Interval, errors, gyro, intervals
from e2efly.viewing.rate_response import StepResponse
from e2efly.viewing.style import GREY, PALE, figure, in_space, say

_CHANGES = 15  # largest number of mode changes that are listed, the first mode included
_DASHED: dict[str, Any] = {"linewidth": 1.1, "linestyle": (0, (4, 2))}


def plot_tracks(log: FlightLog, path: str | Path) -> None:
    """The flight path in 3D and from above, coloured by mode, with the setpoint."""
    modes = intervals(log)
    color = colors(modes)
    time, position = log["odometry"].time, log["odometry"].numbers("position", 3)
    setpoint = log["command"].numbers("setpoint", 3)
    pieces = [(i.mode, position[(time >= i.start) & (time <= i.end)]) for i in modes]
    with figure(path, "Track", 5.0, note(log), free=True) as fig:
        solid: Any = fig.add_axes((-0.01, 0.06, 0.54, 0.84), projection="3d", computed_zorder=False)
        plan = fig.add_axes((0.64, 0.18, 0.345, 0.66))
        whole = np.concatenate([position, setpoint, np.zeros((0, 3))])
        whole = whole[np.isfinite(whole).all(axis=1)]
        if not len(whole):
            solid.set_axis_off()
            say(plan, "not recorded")
            return
        low, high = whole.min(axis=0), whole.max(axis=0)
        low[2], high[2] = min(low[2], 0.0), max(high[2], low[2] + 0.5)
        half = np.maximum((high - low) / 2, 0.5) * 1.08
        low[:2], high[:2] = ((low + high) / 2 - half)[:2], ((low + high) / 2 + half)[:2]
        for mode, points in pieces:
            segments = np.stack([points[:-1], points[1:]], axis=1) if len(points) > 1 else np.zeros((0, 2, 3))
            shadow = Line3DCollection(segments * [1, 1, 0] + [0, 0, low[2]], colors=PALE, linewidths=0.9, zorder=1)
            solid.add_collection3d(shadow, autolim=False)
            lines = Line3DCollection(segments, colors=color[mode], linewidths=1.6, zorder=3)
            solid.add_collection3d(lines, autolim=False)
            plan.add_collection(LineCollection(list(segments[..., :2]), colors=color[mode], linewidths=1.5, zorder=3))
        solid.plot(*setpoint.T, color=INK, zorder=2, **_DASHED)
        plan.plot(*setpoint.T[:2], color=INK, zorder=2, **_DASHED)
        in_space(solid, (5, 5, 3))
        solid.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
        solid.set_box_aspect(high - low, zoom=1.04)
        solid.view_init(elev=26, azim=-58)
        plan.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x (m)", ylabel="y (m)", title="From above")
        plan.set_aspect("equal", adjustable="box")
        handles = mode_handles(color, filled=False)
        if np.isfinite(setpoint).any():
            handles.append(Line2D([], [], color=INK, label="setpoint", **_DASHED))
        fig.legend(handles=handles, loc="lower center", ncols=len(handles))


def plot_motion(log: FlightLog, path: str | Path) -> None:
    """Position, velocity, tilt and error over time. Each change of mode has a number; its reasons are listed above."""
    modes = intervals(log)
    motion, commands = log["odometry"], log["command"]
    position, velocity = motion.numbers("position", 3), motion.numbers("velocity", 3)
    setpoint = commands.numbers("setpoint", 3)
    lines = [f"{k}   {_change(modes, k)}" for k in range(1, len(modes))]
    lines = (
        [*lines[:14], f"and {len(lines) - 14} more changes (summary.json has them all)"] if len(lines) > 15 else lines
    )
    with figure(path, "Motion", 8.6 + 0.21 * len(lines), [*note(log), *lines]) as fig:
        axes = fig.subplots(4, 1, sharex=True, height_ratios=[1.5, 1.2, 0.8, 0.8])
        place, speed, angle, error = axes
        for i, (name, c) in enumerate(zip("xyz", XYZ, strict=True)):
            place.plot(motion.time, position[:, i], color=c, label=name)
            place.plot(commands.time, setpoint[:, i], color=c, drawstyle="steps-post", **_DASHED)
            speed.plot(motion.time, velocity[:, i], color=c, label=name)
        place.plot([], [], color=GREY, label="setpoint", **_DASHED)
        angle.plot(motion.time, np.degrees(Quat.of(motion.numbers("quaternion", 4)).tilt()), color=INK)
        error.plot(*errors(log), color=INK)
        labels = ("position (m)", "velocity (m/s)", "tilt (deg)", "distance to\nsetpoint (m)")
        for ax, label in zip(axes, labels, strict=True):
            ax.set_ylabel(label)
            bands(ax, modes, log.duration)
            empty(ax)
        for ax in (angle, error):
            ax.set_ylim(bottom=0)
        for ax in (place, speed):
            ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, borderpad=0.1)
        error.set_xlabel("time (s)")
        _numbers(place, modes, log.duration)
        marks = stepped_in_marks(place, log)
        fig.align_ylabels(axes)
        handles = [*mode_handles(colors(modes), filled=True), *marks]
        if handles:
            fig.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def plot_rates(log: FlightLog, path: str | Path) -> None:
    """Commanded and measured body rates: the whole flight, and the two seconds with the largest commands."""
    modes = intervals(log)
    commands = log["command"]
    asked = commands.numbers("body_rate", 3)
    time, measured, source = gyro(log)
    start = liveliest(commands.time, asked, 2.0)
    notes = [f"grey: commanded; colour: measured ({source}). Right: the 2 s in which the commands change most"]
    with figure(path, "Body rates", 7.4, notes) as fig:
        axes = fig.subplots(3, 2, sharex="col", width_ratios=[1.7, 1])
        for i, (left, right) in enumerate(axes):
            for ax in (left, right):
                ax.plot(commands.time, asked[:, i], color=GREY, drawstyle="steps-post", linewidth=1.1)
                ax.plot(time, measured[:, i], color=XYZ[i], linewidth=1.0 if ax is left else 1.6, alpha=0.9)
                empty(ax)
            left.set_ylabel(f"{AXES[i]} rate (rad/s)")
            bands(left, modes, log.duration)
            window = np.concatenate(
                [x[(t >= start) & (t <= start + 2), i] for t, x in ((commands.time, asked), (time, measured))]
            )
            window = window[np.isfinite(window)]
            if len(window):
                margin = 0.08 * max(float(np.ptp(window)), 0.1)
                right.set_ylim(window.min() - margin, window.max() + margin)
        axes[-1][0].set_xlabel("time (s)")
        axes[-1][1].set_xlabel("time (s)")
        axes[-1][1].set_xlim(start, start + 2)
        axes[-1][1].xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))


def plot_response(by_source: dict[str, dict[str, StepResponse]], path: str | Path) -> None:
    """Step responses by axis, from the flight log and, if there is one, from the blackbox.

    Args:
        by_source: the estimates, by source and by axis.
        path: the PNG file.
    """
    notes = [
        "estimated from the flight. Told and marked: delay until 10 %, time until 63 % of the settled value; overshoot"
    ]
    with figure(path, "Rate loop: response to a step", 4.3 + 0.2 * len(by_source), notes) as fig:
        axes = fig.subplots(1, 3, sharey=True)
        for i, (ax, axis) in enumerate(zip(axes, AXES, strict=True)):
            draw_response(ax, {source: found[axis] for source, found in by_source.items()}, axis, i)
        axes[0].set_ylabel("rate / rate commanded")
        low, high = axes[0].get_ylim()
        axes[0].set_ylim(max(low, -0.5), min(max(high, 1.2), 2.2))


def draw_response(ax: Axes, by_source: dict[str, StepResponse], axis: str, color: int) -> None:
    """Draw the step responses of one axis into axes, in its colour, and tell their numbers in the title."""
    ax.axhline(1.0, color=GREY, linewidth=0.9)
    texts = []
    for (source, r), style in zip(by_source.items(), ("-", (0, (5, 1.5))), strict=False):
        painted = XYZ[color] if style == "-" else INK
        texts.append(f"{source}: {_told(r)}")
        if len(r.time):
            shown = (0, (1, 1.5)) if r.reason else style
            ax.plot(1e3 * r.time, r.response, color=painted, linestyle=shown, label=source)
        if len(r.time) and not r.reason:
            ends = np.array([(r.delay, 0.1 * r.gain), (r.rise, (1 - np.exp(-1)) * r.gain)]).T
            ax.plot(1e3 * ends[0], ends[1], "o", color=painted, markersize=5, markeredgecolor="white")
    ax.set_title("\n".join([axis, *texts]), fontsize=9, linespacing=1.4)
    ax.set_xlabel("time since the step (ms)")
    ax.set_xlim(0, 500)
    if len(by_source) > 1 and any(len(r.time) for r in by_source.values()):
        ax.legend(loc="lower right")


def _told(r: StepResponse) -> str:
    if not r.reason:
        return f"{1e3 * r.delay:.0f} ms, {1e3 * r.rise:.0f} ms, {max(r.overshoot, 0):.0%}"
    return "not to be believed" if len(r.time) else r.reason.partition(":")[0]


def _change(modes: list[Interval], k: int) -> str:
    reasons = "; ".join(modes[k].reasons) or "no reason given"
    text = f"{modes[k].start:.2f} s  {modes[k - 1].mode or 'start'} → {modes[k].mode}:  {reasons}"
    return text if len(text) <= 150 else text[:149] + "…"


def _numbers(ax: Axes, modes: list[Interval], duration: float) -> None:
    """Draw a number at each change of mode, inside the axes at the top. Numbers that are too close are moved apart."""
    room, last = 0.025 * max(duration, 1e-6), -1e9
    for k, interval in enumerate(modes[1:_CHANGES], 1):
        at = last = max(interval.start, last + room)
        ax.annotate(
            str(k), (at, 1.0), (3, -3), xycoords=("data", "axes fraction"), textcoords="offset points",
            ha="left", va="top", size=9, weight="bold", color=INK,
        )  # fmt: skip
