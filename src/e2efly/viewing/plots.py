"""Plots of runs and flights: each function takes data and writes one PNG file, 1200 pixels wide."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import FormatStrFormatter, LogLocator, MaxNLocator, NullFormatter

from e2efly.config import TaskConfig
from e2efly.config.drawing import INK
from e2efly.config.env import FILE
from e2efly.config.run import LEARNED
from e2efly.control import COMMAND_MODES
from e2efly.control.modes import rotor_names
from e2efly.environment.episodes import Episodes, wilson
from e2efly.runs.rundir import least_success
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle
from e2efly.viewing.flights import Flights, fly
from e2efly.viewing.space import plot_flights
from e2efly.viewing.style import BLUE, CYCLE, GREEN, GREY, PURPLE, VERMILLION, figure, say

Rows = list[dict[str, float]]
NEARLY = 0.8
"""Fraction of a bound from which on the bound is drawn."""

_STEPS = "environment steps (million)"
_DASHED: dict[str, Any] = {"linewidth": 1.2, "linestyle": (0, (4, 2))}

__all__ = ["Flights", "fly", "limits", "plot_errors", "plot_flights", "plot_learning", "plot_time"]


def plot_learning(
    rows: Rows,
    path: str | Path,
    title: str,
    best_update: int | None = None,
    criterion: float = LEARNED,
    vehicles: str = FILE,
) -> None:
    """Draw the learning curves of a run.

    Args:
        rows: rows of metrics.csv, as `RunDirectory.rows` reads them: one per update, some with an evaluation.
        path: the PNG file.
        title: title of the figure.
        best_update: the update whose policy was shipped. It is marked in every panel. None: no mark.
        criterion: success rate. The first evaluation that reaches it is marked.
        vehicles: the name of what flew in the evaluations.
    """
    evaluated = [row for row in rows if "seconds" in row]
    best = next((row for row in evaluated if row["update"] == best_update), None)
    note = [] if best is None else [f"dashed: update {best['update']:.0f}, whose policy was shipped"]
    learned = next((row for row in evaluated if least_success(row) >= criterion), None)
    if learned is not None:
        steps = f"{learned['steps'] / 1e6:.2f} million steps"
        note.append(f"dotted: {100 * criterion:g} % first reached, after {learned['seconds']:.1f} s and {steps}")
    with figure(path, title, 8.8, note) as fig:
        grid = fig.add_gridspec(3, 2, height_ratios=[1.0, 1.0, 1.2])
        clocks = (("seconds", 1.0, "time since process start, compilation included (s)"), ("steps", 1e-6, _STEPS))
        first = None
        for column, (clock, scale, label) in enumerate(clocks):
            above = fig.add_subplot(grid[0, column])
            below = fig.add_subplot(grid[1, column], sharex=above, sharey=first)
            first = first or below
            _success(above, evaluated, clock, scale)
            above.set_ylabel(f"success, {vehicles} (%)")
            above.tick_params(labelbottom=False)
            _curve(below, rows, clock, scale, "reward", INK)
            below.set_ylabel("mean training reward\nof a step")
            below.set_xlabel(label)
            for ax in (above, below):
                _mark(ax, best, clock, scale)
            if learned is not None:
                above.axvline(scale * learned[clock], color=GREEN, linewidth=1.2, linestyle=":", zorder=1.5)
            above.set_xlim(left=0.0)
        terms = fig.add_subplot(grid[2, :])
        _terms(terms, rows)
        _mark(terms, best, "steps", 1e-6)


def _curve(ax: Axes, rows: Rows, x: str, scale: float, y: str, color: str, **style: Any) -> None:
    """Draw one column over another, from the rows that have both. If there are few, with dots."""
    points = np.array([(scale * row[x], row[y]) for row in rows if x in row and y in row]).reshape(-1, 2)
    if len(points) == 0:
        say(ax, "nothing measured yet")
        return
    ax.plot(*points.T, color=color, marker="o" if len(points) < 40 else "", markersize=3.5, **style)


def _success(ax: Axes, rows: Rows, x: str, scale: float) -> None:
    keys = list(dict.fromkeys(k for row in rows for k in row if k.startswith("eval/") and k.endswith("/success")))
    percent = [{**row, **{key: 100 * row[key] for key in keys if key in row}} for row in rows]
    for key, color in zip(keys, CYCLE, strict=False):
        _curve(ax, percent, x, scale, key, color, label=key.split("/")[1])
    if keys:
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=len(keys), borderpad=0.1)
    else:
        say(ax, "no evaluation yet")
    ax.set_ylim(-4, 104)
    ax.set_yticks([0, 25, 50, 75, 100])


def _mark(ax: Axes, best: dict[str, float] | None, x: str, scale: float) -> None:
    if best is not None:
        ax.axvline(scale * best[x], color=GREY, zorder=1.5, **_DASHED)


def _terms(ax: Axes, rows: Rows) -> None:
    """Draw the weighted terms of the reward, on an axis that is linear around zero and logarithmic farther out."""
    keys = list(dict.fromkeys(key for row in rows for key in row if key.startswith("reward/")))
    ax.set_xlabel(_STEPS)
    ax.set_ylabel("mean weighted term\nof a step")
    if not keys:
        say(ax, "no reward terms yet")
        return
    size = {key: max(abs(row[key]) for row in rows if key in row) for key in keys}
    keys.sort(key=lambda key: -size[key])
    for i, key in enumerate(keys):
        dashes = ("-", (0, (5, 2)), (0, (1, 1.5)))[i // len(CYCLE) % 3]
        color = CYCLE[i % len(CYCLE)]
        _curve(ax, rows, "steps", 1e-6, key, color, label=key.removeprefix("reward/"), linestyle=dashes)
    if (largest := max(size.values())) > 0:
        ax.set_yscale("symlog", linthresh=10.0 ** np.floor(np.log10(largest) - 2), linscale=0.6)
        ax.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    ax.axhline(0.0, color=GREY, linewidth=0.8, zorder=1)
    ax.set_xlim(left=0.0)
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=8, borderpad=0.1)


def plot_time(flights: Flights, index: int, path: str | Path, title: str, vehicle: Vehicle | None = None) -> None:
    """Draw one episode over time: position and velocity, attitude, command, body rates and rotor speeds.

    Args:
        flights: the episodes.
        index: index of the episode.
        path: the PNG file.
        title: title of the figure.
        vehicle: the vehicle. Its largest body rates, thrust and rotor speed are drawn where they are nearly reached.
            None: no limits are drawn.
    """
    steps, mode = int(flights.length[index]), COMMAND_MODES[flights.command_mode]
    time, command = flights.time[:steps], flights.command[:steps, index]
    asked = time - (flights.time[0] if len(flights.time) else 0.0)
    end = f"{time[-1]:.2f} s" if steps else "0 s"
    ending = f"episode {index}: {flights.ending(index)}, {end}"
    note = f"{ending}; commands are drawn when the policy gives them, its latency before they act"
    bound = f"dotted: the bounds of {vehicle.name}, where a curve comes near them" if vehicle is not None else ""
    with figure(path, title, 9.6, [note, *([bound] if bound else [])]) as fig:
        axes = fig.subplots(4, 2, sharex=True).ravel()
        place, speed, attitude, thrust, roll, pitch, yaw, rotor = axes
        colors = (BLUE, VERMILLION, GREEN)
        for i, (name, color) in enumerate(zip("xyz", colors, strict=True)):
            place.plot(time, flights.position[:steps, index, i], color=color, label=name)
            place.plot(time, flights.goal[:steps, index, i], color=color, drawstyle="steps-post", **_DASHED)
            speed.plot(time, flights.velocity[:steps, index, i], color=color, label=name)
        place.plot([], [], color=GREY, label="goal", **_DASHED)
        attitude.plot(time, np.degrees(flights.tilt[:steps, index]), color=BLUE, label="tilt")
        attitude.plot(time, np.degrees(np.unwrap(flights.yaw[:steps, index])), color=VERMILLION, label="yaw")
        for i, (ax, color) in enumerate(zip((roll, pitch, yaw), colors, strict=True)):
            name = ("roll", "pitch", "yaw")[i]
            if f"{name}_rate" in mode.fields:
                wanted = command[:, mode.fields.index(f"{name}_rate")]
                ax.plot(asked, wanted, color=GREY, linewidth=1.0, drawstyle="steps-post", label="commanded")
            ax.plot(time, flights.body_rate[:steps, index, i], color=color, label="actual")
            ax.set_ylabel(f"{name} rate (rad/s)")
        _command(thrust, asked, command, flights.command_mode)
        for i, name in enumerate(rotor_names(flights.rotor_speed.shape[-1])):
            color, style = (BLUE, VERMILLION, GREEN, PURPLE)[i % 4], ("-", "--", ":", "-.")[i // 4]
            curve = flights.rotor_speed[:steps, index, i]
            rotor.plot(time, curve, color=color, linestyle=style, linewidth=1.2, label=name.replace("_", " "))
        if vehicle is not None:
            for ax, top in zip((roll, pitch, yaw), np.broadcast_to(vehicle.body_rate_max, 3), strict=True):
                _bound(ax, float(top), both=True)
            _bound(rotor, float(vehicle.full_rotor_speed))
            if mode.fields[0] == "collective_thrust":
                _bound(thrust, vehicle.thrust_to_weight)
        for ax, label in ((place, "position (m)"), (speed, "velocity (m/s)"), (attitude, "angle (deg)")):
            ax.set_ylabel(label)
        rotor.set_ylabel("rotor speed (rad/s)")
        for ax in axes:
            ax.legend(loc="lower right", bbox_to_anchor=(1.0, 0.98), ncols=4, borderpad=0.1, handlelength=1.6)
            ax.set_xlim(0.0, max(float(time[-1]) if steps else 0.0, 0.1))
            ax.margins(y=0.08)
        attitude.yaxis.set_major_locator(MaxNLocator(6, steps=[1, 1.5, 3, 4.5, 9, 10]))
        for ax in axes[-2:]:
            ax.set_xlabel("time (s)")


def _bound(ax: Axes, top: float, both: bool = False) -> None:
    """Draw a dotted line at the largest value that the vehicle can reach (and at its negative with `both`), if a curve
    comes close to it.
    """
    values = np.concatenate([np.asarray(line.get_ydata(), float) for line in ax.get_lines()])
    for sign in (1.0, -1.0) if both else (1.0,):
        if np.nanmax(sign * values, initial=0.0) > NEARLY * top:
            ax.axhline(sign * top, color=INK, linewidth=1.2, linestyle=":")


def _command(ax: Axes, time: Float[np.ndarray, " t"], command: Float[np.ndarray, "t c"], name: str) -> None:
    """Draw the collective thrust relative to gravity, if the mode has one. Otherwise all numbers of the command."""
    mode = COMMAND_MODES[name].of(command.shape[-1])
    if mode.fields[0] == "collective_thrust":
        ax.axhline(1.0, color=GREY, label="hover: 1 g", **_DASHED)
        ax.plot(time, command[:, 0] / GRAVITY, color=BLUE, drawstyle="steps-post", label="commanded")
        ax.set_ylabel("thrust / mass (g)")
        return
    for i, (field, color) in enumerate(zip(mode.fields, CYCLE, strict=False)):
        ax.plot(time, command[:, i], color=color, drawstyle="steps-post", label=field.replace("_", " "))
    ax.set_ylabel(f"command ({', '.join(dict.fromkeys(mode.units))})")


def limits(suites: Mapping[str, TaskConfig]) -> dict[str, dict[str, float]]:
    """The largest error, m, with which an episode still succeeds, by criterion and by field of `Episodes`."""
    return {name: found for name, config in suites.items() if (found := config.limits())}


_PANELS = (
    ("final_error", "distance to the goal at the end (m)"),
    ("mean_error", "mean distance to the goal (m)"),
    ("duration", "duration (s)"),
    ("top_speed", "top speed (m/s)"),
    ("top_rate", "top body rate (rad/s)"),
    ("roughness", "mean change of the action a step"),
)


def plot_errors(
    episodes: Mapping[str, Episodes],
    path: str | Path,
    title: str,
    limits: Mapping[str, Mapping[str, float]] | None = None,
) -> None:
    """Draw the distributions of errors, durations, speeds and roughness over many episodes.

    Args:
        episodes: episodes by criterion.
        path: the PNG file.
        title: title of the figure. The success rate of each criterion and its 95 % interval (Wilson) are added to it.
        limits: limits by criterion and field of `Episodes`, drawn as vertical lines. See `limits`.
    """
    notes = [_rate(name, np.asarray(e.success)) for name, e in episodes.items()]
    colors = dict(zip(episodes, CYCLE * len(episodes), strict=False))
    panels = [panel for panel in _PANELS if _varies(episodes, panel[0])] or list(_PANELS)
    below = len(panels) > 3
    with figure(path, title, 6.6 if below else 4.2, notes) as fig:
        grid = fig.subplots(1 + below, min(len(panels), 3), sharey=True, squeeze=False).ravel()
        for ax in grid[len(panels) :]:
            ax.set_axis_off()
        for ax, (field, label) in zip(grid, panels, strict=False):
            values = {name: _finite(getattr(e, field), field) for name, e in episodes.items()}
            lines = {name: limit[field] for name, limit in (limits or {}).items() if field in limit and name in colors}
            _distributions(ax, values, lines, colors, field.endswith("error"))
            ax.set_xlabel(label)
            if ax.get_subplotspec().is_first_col():
                ax.set_ylabel("episodes at or below (%)")
        handles: list[Line2D | Patch] = [Line2D([], [], color=color, label=name) for name, color in colors.items()]
        handles.append(Patch(facecolor=GREY, alpha=0.3, label="histogram (scaled to its peak)"))
        if limits:
            handles.append(Line2D([], [], color=INK, label="limit of success", **_DASHED))
        fig.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def _varies(episodes: Mapping[str, Episodes], field: str) -> bool:
    """Whether a field has more than one value over all episodes. A constant has no distribution to draw."""
    whole = np.concatenate([np.zeros(0), *(_finite(getattr(e, field), field) for e in episodes.values())])
    return bool(np.ptp(whole) > 1e-6 * np.abs(whole).max()) if len(whole) else False


def _rate(name: str, success: np.ndarray) -> str:
    k, n = int(success.sum()), len(success)
    low, high = wilson(k, n)
    rate = f"{100 * k / n:.1f} %" if n else "none"
    return f"{name}: {rate} of {n} episodes succeed (95 % interval {100 * low:.1f} to {100 * high:.1f} %)"


def _finite(values: Any, field: str) -> np.ndarray:
    """Sorted finite values. A mean error of exactly zero is left out: that episode ended before errors counted."""
    array = np.sort(np.asarray(values, np.float64))
    array = array[np.isfinite(array)]
    return array[array > 0] if field == "mean_error" else array


def _distributions(
    ax: Axes, values: Mapping[str, np.ndarray], lines: Mapping[str, float], colors: Mapping[str, str], logarithmic: bool
) -> None:
    """Draw empirical distribution functions over pale histograms, on a logarithmic axis if allowed and useful."""
    ax.set_ylim(0, 104)
    ax.set_yticks([0, 25, 50, 75, 100])
    whole = np.concatenate([np.zeros(0), *values.values()])
    if len(whole) == 0:
        say(ax, "no episodes")
        return
    edge = np.array([whole.min(), whole.max(), *lines.values()])
    low, high = float(edge.min()), float(edge.max())
    if logarithmic and low > 0 and high > 10 * low:
        ax.set_xscale("log")
        low, high = low / 1.25, high * 1.25
        ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 100 * low else (1.0,)))
        ax.xaxis.set_major_formatter(FormatStrFormatter("%g"))
        ax.xaxis.set_minor_formatter(NullFormatter())
        bins = np.geomspace(low, high, 41)
    else:
        margin = 0.04 * (high - low) or max(0.05 * abs(high), 1e-3)
        low, high = low - margin, high + margin
        ax.xaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 2.5, 5, 10]))
        bins = np.linspace(low, high, 41)
    ax.set_xlim(low, high)
    for name, column in values.items():
        if len(column) == 0:
            continue
        counts, _ = np.histogram(column, bins)
        if counts.max():
            ax.stairs(60 * counts / counts.max(), bins, fill=True, color=colors[name], alpha=0.25)
        share = 100 * np.arange(1, len(column) + 1) / len(column)
        ends = np.concatenate([[low], column, [high]]), np.concatenate([[0.0], share, [100.0]])
        ax.plot(*ends, color=colors[name], drawstyle="steps-post")
    for name, x in lines.items():
        ax.axvline(x, color=colors[name] if len(values) > 1 else INK, **_DASHED)
