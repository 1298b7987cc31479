"""The figures of a flight log about hardware and software: control loop, link, battery, throttle, blackbox."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from e2efly.config.drawing import INK, ORANGE
from e2efly.logs.blackbox import Blackbox, LogClock
from e2efly.logs.flight_log import FlightLog
from e2efly.viewing.flight_axes import XYZ, bands, empty, liveliest, note
from e2efly.viewing.flight_data import AXES, gyro, in_flight, intervals
from e2efly.viewing.style import BLUE, CYCLE, GREEN, GREY, PURPLE, SKY, VERMILLION, figure, say

LAG = 0.04
"""Time from a sent throttle to the measured thrust, s: the middle of the 35 to 45 ms that Betaflight
quadrotors show."""


def plot_loop(log: FlightLog, path: str | Path) -> None:
    """Timing of the control loop: histograms of its times, and lateness and missed deadlines over the flight."""
    timing, inference = log["timing"], log["policy"].numbers("inference_s")
    period, work, late = (timing.numbers(name) for name in ("period_s", "work_s", "lateness_s"))
    missed = timing.numbers("deadline_missed") > 0
    notes = [f"{len(timing)} rounds, {int(missed.sum())} missed deadlines. Dashed: p99"]
    with figure(path, "Control loop", 6.4, notes) as fig:
        axes = fig.subplots(2, 3).ravel()
        for ax, x, label, color in (
            (axes[0], period, "period (ms)", BLUE),
            (axes[1], work, "work a round (ms)", GREEN),
            (axes[2], late, "lateness (ms)", ORANGE),
            (axes[3], inference, "policy inference (ms)", PURPLE),
        ):
            _histogram(ax, 1e3 * x[np.isfinite(x)], color)
            ax.set_xlabel(label)
        axes[0].set_ylabel("rounds")
        axes[3].set_ylabel("steps")
        over, load = axes[4], axes[5]
        over.plot(timing.time, 1e3 * late, color=ORANGE, linewidth=0.9, label="lateness")
        over.plot(timing.time[missed], 1e3 * late[missed], "x", color=VERMILLION, markersize=6, label="deadline missed")
        over.set_ylabel("lateness (ms)")
        if len(timing):
            over.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderpad=0.1)
        spent = timing.numbers("cpu_load")  # recorded once per second
        load.plot(timing.time[np.isfinite(spent)], 100 * spent[np.isfinite(spent)], color=BLUE, label="companion")
        load.plot(log["status"].time, 100 * log["status"].numbers("cpu_load"), color=VERMILLION, label="controller")
        load.set_ylabel("processor load (%)")
        load.set_ylim(0, max(105.0, load.get_ylim()[1]))
        load.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderpad=0.1)
        for ax in (over, load):
            ax.set_xlabel("time (s)")
            ax.set_xlim(0, max(log.duration, 0.1))
            empty(ax)


def _histogram(ax: Axes, x: np.ndarray, color: str) -> None:
    """A histogram with a logarithmic count, which shows even one late cycle in ten thousand, and its quantiles."""
    if not len(x):
        say(ax, "not recorded")
        return
    low, high = float(x.min()), float(x.max())
    margin = max(0.03 * (high - low), 1e-3 * max(abs(high), 1e-3))
    ax.hist(x, bins=np.linspace(low - margin, high + margin, 50).tolist(), color=color, log=True)
    median, p99 = (float(np.quantile(x, q)) for q in (0.5, 0.99))
    ax.axvline(p99, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
    ax.set_title(f"median {median:.3g}, p99 {p99:.3g}, max {high:.3g} ms", fontsize=9)


def plot_health(log: FlightLog, path: str | Path) -> None:
    """Battery, age of the odometry, and the link to the flight controller over the flight."""
    modes = intervals(log)
    battery, link, motion = log["battery"], log["link"], log["odometry"]
    with figure(path, "Battery, odometry and link", 7.0, note(log)) as fig:
        axes = fig.subplots(3, 2, sharex=True).ravel()
        lines: tuple[tuple[Axes, str, list[tuple[Any, str, float, str]]], ...] = (
            (axes[0], "battery (V)", [(battery, "voltage", 1, BLUE)]),
            (axes[1], "current (A)", [(battery, "current", 1, VERMILLION)]),
            (axes[2], "odometry age (ms)", [(motion, "age", 1e3, BLUE)]),
            (axes[3], "link round trip (ms)", [(link, "round_trip", 1e3, GREEN)]),
            (axes[4], "requests a second", []),
            (
                axes[5],
                "link faults so far",
                [(link, "timeouts", 1, ORANGE), (link, "errors", 1, VERMILLION), (link, "reconnects", 1, PURPLE)],
            ),
        )
        for ax, label, columns in lines:
            for series, name, scale, color in columns:
                values = scale * series.numbers(name)
                few = {"marker": "o", "markersize": 3} if len(series) < 30 else {}
                ax.plot(series.time, values, color=color, linewidth=1.2, label=name.replace("_", " "), **few)
            if ax is axes[4] and len(link) > 1:
                middle = (link.time[1:] + link.time[:-1]) / 2
                ax.plot(middle, np.diff(link.numbers("requests")) / np.diff(link.time), color=GREEN, linewidth=1.2)
            ax.set_ylabel(label)
            bands(ax, modes, log.duration)
            empty(ax)
            if len(columns) > 1 and len(columns[0][0]):
                ax.legend(loc="upper left", ncols=len(columns))
        for ax in axes[2:]:
            ax.set_ylim(0, 1.05 * ax.get_ylim()[1])
        for ax in axes[-2:]:
            ax.set_xlabel("time (s)")


def plot_throttle(log: FlightLog, path: str | Path) -> None:
    """Throttle against the specific force that follows it, a fit for each third of the flight, and the adaptive map."""
    throttle, force = _throttle_points(log)
    adaptive = log["throttle_map"]
    notes = [
        f"specific force along body z against the throttle sent {1e3 * LAG:.0f} ms before; curves: a u + b u² fitted"
    ]
    with figure(path, "Throttle map", 4.6, notes) as fig:
        grid = fig.add_gridspec(2, 2, width_ratios=[1.25, 1])
        points, scale, rest = (fig.add_subplot(g) for g in (grid[:, 0], grid[0, 1], grid[1, 1]))
        parts = [p for p in np.array_split(np.arange(len(throttle)), 3) if len(p) > 20]
        for part, color, name in zip(parts, (SKY, ORANGE, PURPLE), ("first", "second", "last"), strict=False):
            u, f = throttle[part], force[part]
            points.plot(u, f, ".", color=color, markersize=2.5, alpha=0.35)
            a, b = np.linalg.lstsq(np.stack([u, u**2], axis=1), f, rcond=None)[0]
            curve = np.linspace(u.min(), u.max(), 50)
            label = f"{name} third: {a:.1f} u {'+' if b >= 0 else '-'} {abs(b):.1f} u²"
            points.plot(curve, a * curve + b * curve**2, color=color, linewidth=2.2, label=label)
        points.set_xlabel("throttle u")
        points.set_ylabel("specific force along body z (m/s²)")
        if parts:
            points.legend(loc="upper left")
        else:
            say(points, "not recorded")
        scale.plot(adaptive.time, adaptive.numbers("scale"), color=BLUE)
        scale.set_ylabel("adaptive scale\n(m/s²)")
        rest.plot(adaptive.time, adaptive.numbers("residual"), color=GREY, linewidth=0.8)
        rest.set_ylabel("residual\n(m/s²)")
        rest.set_xlabel("time (s)")
        scale.tick_params(labelbottom=False)
        for ax in (scale, rest):
            bands(ax, intervals(log), log.duration)
            empty(ax)


def _throttle_points(log: FlightLog) -> tuple[np.ndarray, np.ndarray]:
    """Throttle and the specific force `LAG` later, in flight, in order of time."""
    sticks, imu = log["sticks"], log["imu"]
    throttle, force = sticks.numbers("throttle"), imu.numbers("specific_force", 3)[:, 2]
    flown = in_flight(log) or intervals(log)
    inside = np.zeros(len(imu), bool)
    for i in flown:
        inside |= (imu.time - LAG >= i.start) & (imu.time <= i.end)
    if len(sticks) < 2 or not inside.any():
        return np.zeros(0), np.zeros(0)
    sent = np.interp(imu.time - LAG, sticks.time, throttle)
    good = inside & np.isfinite(sent) & np.isfinite(force) & (sent > 0.02)
    return sent[good], force[good]


def plot_blackbox(log: FlightLog, blackbox: Blackbox, alignment: LogClock, path: str | Path) -> None:
    """The flight controller's blackbox over the flight log: the rates of both, its setpoint, and its motors."""
    commands = log["command"]
    time, measured, source = gyro(log)
    start = liveliest(commands.time, commands.numbers("body_rate", 3), 1.5)
    notes = [
        f"aligned by the gyro: correlation {alignment.correlation:.3f} over {alignment.overlap:.1f} s, "
        f"blackbox starts at {alignment.time[0]:.3f} s; {blackbox.firmware}"
    ]
    with figure(path, "Blackbox over the flight log", 8.6, notes) as fig:
        axes = fig.subplots(4, 2, sharex="col", width_ratios=[1.7, 1])
        for i in range(3):
            for ax in axes[i]:
                ax.plot(alignment.time, blackbox.setpoint[:, i], color=GREY, linewidth=1.0, label="blackbox setpoint")
                ax.plot(alignment.time, blackbox.gyro[:, i], color=XYZ[i], linewidth=1.0, label="blackbox gyro")
                ax.plot(time, measured[:, i], color=INK, linewidth=1.0, linestyle=(0, (3, 2)), label=source)
                empty(ax)
            axes[i][0].set_ylabel(f"{AXES[i]} rate (rad/s)")
            window = blackbox.gyro[(alignment.time >= start) & (alignment.time <= start + 1.5), i]
            if len(window):
                margin = 0.2 * max(float(np.ptp(window)), 0.1)
                axes[i][1].set_ylim(window.min() - margin, window.max() + margin)
        axes[0][0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3, borderpad=0.1)
        for ax in axes[3]:
            for k, name in enumerate(("rear right", "front right", "rear left", "front left")):
                ax.plot(alignment.time, blackbox.motor[:, k], color=CYCLE[k], linewidth=0.8, label=name)
            ax.set_ylim(-0.05, 1.05)
            ax.set_xlabel("time (s)")
        axes[3][0].set_ylabel("motor output")
        axes[3][0].legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=4, borderpad=0.1)
        axes[0][0].set_xlim(0, max(log.duration, 0.1))
        axes[0][1].set_xlim(start, start + 1.5)
