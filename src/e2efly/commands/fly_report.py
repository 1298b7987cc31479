"""`e2efly fly-report`: what happened in a flight, from its log."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from e2efly.commands.terminal import Terminal
from e2efly.deploy.blackbox import Alignment, Blackbox, align, read_blackbox
from e2efly.deploy.flight_log import FlightLog, read_log


def fly_report_command(
    path: Path,
    out: Path | None = None,
    blackbox: Path | None = None,
    bag1: Path | None = None,
    bag2: Path | None = None,
) -> int:
    """Draw a flight, print and write its summary, export bags where asked; exit status 0.

    Args:
        path: the flight log.
        out: folder for figures and summary.json; None: beside the log, named after it.
        blackbox: the flight controller's blackbox log of the same flight, laid over the figures.
        bag1: a ROS 1 bag to write.
        bag2: a ROS 2 bag to write.

    Raises:
        ValueError: for files that cannot be read or that exist already.
    """
    from e2efly.deploy.bags import export_bag
    from e2efly.view.flight_log import summary

    log = read_log(path)
    laid = _laid_over(log, blackbox) if blackbox else None
    out = out or path.with_name(f"{path.stem}_report")
    out.mkdir(parents=True, exist_ok=True)
    table = summary(log, *laid) if laid else summary(log)
    (out / "summary.json").write_text(json.dumps(table, indent=1, allow_nan=False) + "\n", encoding="utf-8")
    draw(log, out, laid)
    console = Terminal()
    _print(console, table)
    for bag, version in ((bag1, 1), (bag2, 2)):
        if bag:
            counts = export_bag(log, bag, version)
            console.print(f"ROS {version} bag: {bag} ({sum(counts.values())} messages of {len(counts)} topics)")
    console.print(f"Figures and summary.json: {out}")
    return 0


def draw(log: FlightLog, out: Path, laid: tuple[Blackbox, Alignment] | None = None) -> list[Path]:
    """Draw the figures of a flight for which anything was recorded into a folder; their paths."""
    from e2efly.view import flight_health as health
    from e2efly.view import flight_report as report
    from e2efly.view.flight_log import blackbox_responses, responses

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
    return paths


def _laid_over(log: FlightLog, path: Path) -> tuple[Blackbox, Alignment]:
    """The session of a blackbox log that is of this flight, and where it lies.

    Raises:
        ValueError: where none is.
    """
    from e2efly.view.flight_log import gyro

    time, rate, _ = gyro(log)
    found: list[tuple[Blackbox, Alignment]] = []
    reasons: list[str] = []
    for session in read_blackbox(path):
        try:
            found.append((session, align(time, rate, session)))
        except ValueError as error:
            reasons.append(str(error))
    if not found:
        raise ValueError(f"{path}: no session is of the flight of {log.path}: {'; '.join(reasons)}")
    return max(found, key=lambda pair: pair[1].correlation * pair[1].overlap)


def _print(console: Console, table: dict[str, Any]) -> None:
    console.print(f"{table['file']}: {table['duration_s']:.1f} s, vehicle {table['vehicle'] or 'unknown'}")
    if table["cut_off"]:
        console.print("Cut off", style="bold", end=": ")
        console.print(f"{table['cut_off']}; what follows is what was written until then")
    modes = Table("mode", "from", "to", "error rms / max", "why", box=None, header_style="bold", pad_edge=False)
    for row in table["modes"]:
        error = table["error_m"].get(row["mode"])
        told = f"{100 * error['rms']:.1f} / {100 * error['max']:.1f} cm" if error else "-"
        modes.add_row(row["mode"], f"{row['start_s']:.2f} s", f"{row['end_s']:.2f} s", told, "; ".join(row["reasons"]))
    if table["modes"]:
        console.print(modes)
    figures = Table(box=None, show_header=False, pad_edge=False)
    for name, text in _lines(table):
        figures.add_row(name, text)
    console.print(figures)
    for event in table["events"]:
        if event["level"] in ("warning", "error"):
            console.print(f"{event['time_s']:8.2f} s  {event['level']}: {event['text']}")


def _lines(table: dict[str, Any]) -> list[tuple[str, str]]:
    rows = []
    for source, responses in (
        ("", table["rate_response"]),
        (" (blackbox)", table.get("blackbox", {}).get("rate_response")),
    ):
        for axis, r in (responses or {}).items():
            told = r["reason"] or (
                f"delay {1e3 * r['delay_s']:.0f} ms, 63 % at {1e3 * r['rise_63_s']:.0f} ms, "
                f"overshoot {r['overshoot']:.0%}"
            )
            rows.append((f"{axis} rate{source}", told))
    loop = table["loop"]
    rows.append(
        (
            "control loop",
            f"{loop['rounds']} rounds, {loop['deadlines_missed']} deadlines missed{_ms(loop['lateness_s'], ', late ')}",
        )
    )
    rows.append(("policy inference", _ms(table["inference_s"]) or "not recorded"))
    rows.append(("odometry age", _ms(table["odometry_age_s"]) or "not recorded"))
    link = table["link"]
    counts = [f"{link[key]} {key}" for key in ("requests", "timeouts", "errors", "reconnects") if link[key] is not None]
    if counts:
        rows.append(("link", ", ".join(counts) + _ms(link["round_trip_s"], ", round trip ")))
    if voltage := table["battery"]["voltage_v"]:
        rows.append(("battery", f"{voltage['first']:.2f} to {voltage['last']:.2f} V, lowest {voltage['min']:.2f} V"))
    return rows


def _ms(spread: dict[str, float] | None, before: str = "") -> str:
    if not spread:
        return ""
    return f"{before}p50 {1e3 * spread['p50']:.2f}, p99 {1e3 * spread['p99']:.2f}, max {1e3 * spread['max']:.2f} ms"
