"""All figures of a flight, from its log."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.logs.blackbox import Blackbox, LogClock, align, read_blackbox
from e2efly.logs.flight_log import FlightLog
from e2efly.viewing import flight_health as health
from e2efly.viewing import flight_report as report
from e2efly.viewing.flight_data import blackbox_responses, gyro, responses
from e2efly.viewing.pid_analysis import PidAnalysis, analysis_of, pid_analysis, pid_numbers
from e2efly.viewing.pid_plot import plot_pid


def draw(log: FlightLog, out: Path, laid: tuple[Blackbox, LogClock] | None = None) -> list[Path]:
    """Draw the figures of a flight for which data was recorded, into a folder. Returns their paths."""
    estimates = {"log": responses(log)} | ({"blackbox": blackbox_responses(laid[0])} if laid else {})
    figures: dict[str, tuple[tuple[str, ...], Callable[[Path], None]]] = {
        "track": (("odometry",), lambda path: report.plot_tracks(log, path)),
        "motion": (("odometry", "mode"), lambda path: report.plot_motion(log, path)),
        "rates": (("command",), lambda path: report.plot_rates(log, path)),
        "response": (("command",), lambda path: report.plot_response(estimates, path)),
        "loop": (("timing", "policy", "status"), lambda path: health.plot_loop(log, path)),
        "health": (("battery", "link", "odometry"), lambda path: health.plot_health(log, path)),
        "throttle": (("sticks", "throttle_map"), lambda path: health.plot_throttle(log, path)),
    }
    paths = []
    for name, (channels, plot) in figures.items():
        if any(channel in log.series for channel in channels):
            paths.append(out / f"{name}.png")
            plot(paths[-1])
    if laid:
        paths.append(out / "blackbox.png")
        health.plot_blackbox(log, *laid, paths[-1])
    if isinstance(found := analysis_of(log, laid[0] if laid else None), PidAnalysis):
        paths.append(out / "pid.png")
        plot_pid(found, paths[-1], f"blackbox of {log.path.name}")
    return paths


def draw_blackbox(path: Path, sessions: list[Blackbox], out: Path) -> list[dict[str, Any]]:
    """Draw the analysis of each session of a blackbox log into a folder, as pid_N.png. Returns the numbers of each, or
    why there are none.

    Raises:
        ValueError: when no session can be analysed, with the reasons.
    """
    rows: list[dict[str, Any]] = []
    found: list[tuple[int, PidAnalysis]] = []
    for box in sessions:
        row: dict[str, Any] = {"session": box.session, "duration_s": float(np.ptp(box.time)), "notes": list(box.notes)}
        try:
            analysis = pid_analysis(box, f"{path}, session {box.session}")
        except ValueError as error:
            rows.append(row | {"reason": str(error)})
            continue
        found.append((box.session, analysis))
        rows.append(row | pid_numbers(analysis))
    if not found:
        raise ValueError("; ".join(row["reason"] for row in rows))
    out.mkdir(parents=True, exist_ok=True)
    for session, analysis in found:
        plot_pid(analysis, out / f"pid_{session}.png", f"{path.name}, session {session}")
    return rows


def laid_over(log: FlightLog, path: Path) -> tuple[Blackbox, LogClock]:
    """The session of a blackbox log that belongs to this flight, and its alignment in time.

    Raises:
        ValueError: when no session belongs to this flight.
    """
    time, rate, _ = gyro(log)
    found: list[tuple[Blackbox, LogClock]] = []
    reasons: list[str] = []
    for session in read_blackbox(path, tuning=True):
        try:
            found.append((session, align(time, rate, session)))
        except ValueError as error:
            reasons.append(str(error))
    if not found:
        raise ValueError(f"{path}: no session is of the flight of {log.path}: {'; '.join(reasons)}")
    return max(found, key=lambda pair: pair[1].correlation * pair[1].overlap)
