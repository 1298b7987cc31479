"""`e2efly fly-report`: what happened in a flight, from its log."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.console import Console
from rich.table import Table

from e2efly.commands.terminal import Terminal, headed

UNFILTERED = "unfiltered_noise_rad_s"
LONGEST = 20
"""At most this many of the times at which the filter intervened are printed."""


@dataclass(frozen=True)
class FlyReport:
    """Draw a flight: tracks, response to commands, latency, timing, and the modes with the reason for each."""

    log: tyro.conf.Positional[Annotated[Path, tyro.conf.arg(metavar="FILE")]]
    """A flight log (.mcap), or a Betaflight blackbox log alone, whose rate loop is analysed."""
    out: Path | None = None
    """Folder for the figures. If omitted, LOG_report."""
    blackbox: Path | None = None
    """A Betaflight blackbox log of the same flight, to be drawn over it. Its rate loop is analysed (pid.png)."""
    bag1: Path | None = None
    """Also write a ROS 1 bag."""
    bag2: Path | None = None
    """Also write a ROS 2 bag."""


def run(options: FlyReport) -> int:
    """Draw a flight, print and write its summary, and export bags if requested.

    Raises:
        ValueError: for files that cannot be read, or that exist already.
    """
    from e2efly.config.storage import finite
    from e2efly.logs.bags import export_bag
    from e2efly.logs.flight_log import read_log
    from e2efly.logs.readers import BLACKBOX, format_of
    from e2efly.viewing.flight_data import summary
    from e2efly.viewing.flight_figures import draw, laid_over
    from e2efly.viewing.pid_analysis import analysis_of, pid_numbers

    console, out = Terminal(), options.out or options.log.with_name(f"{options.log.stem}_report")
    if format_of(options.log).name == BLACKBOX:
        return _report_blackbox(options, out, console)
    log = read_log(options.log)
    laid = laid_over(log, options.blackbox) if options.blackbox else None
    out.mkdir(parents=True, exist_ok=True)
    table = summary(log, *laid) if laid else summary(log)
    found = analysis_of(log, laid[0] if laid else None)
    table["pid"] = finite({"reason": found} if isinstance(found, str) else pid_numbers(found))
    _write(out, table)
    draw(log, out, laid)
    _print(console, table)
    console.print(_pid(table["pid"]))
    for bag, version in ((options.bag1, 1), (options.bag2, 2)):
        if bag:
            counts = export_bag(log, bag, version)
            console.print(f"ROS {version} bag: {bag} ({sum(counts.values())} messages of {len(counts)} topics)")
    console.print(f"Figures and summary.json: {out}")
    if table["align"]:
        console.print(f"To make the simulator answer as this vehicle did: {table['align']}")
    return 0


def _report_blackbox(options: FlyReport, out: Path, console: Console) -> int:
    """Analyse the rate loop of every session of a blackbox log that has no flight log."""
    from e2efly.config.storage import finite
    from e2efly.logs.blackbox import read_blackbox
    from e2efly.viewing.flight_figures import draw_blackbox

    for name in ("blackbox", "bag1", "bag2"):
        if (value := getattr(options, name)) is not None:
            raise ValueError(f"--{name} is {str(value)!r}; accepted: with a flight log (.mcap), not with a blackbox")
    rows = finite(draw_blackbox(options.log, read_blackbox(options.log, tuning=True), out))
    _write(out, {"file": str(options.log), "sessions": rows})
    for row in rows:
        console.print(f"{options.log}, session {row['session']}: {row['duration_s']:.1f} s", markup=False)
        for note in row["notes"]:
            console.print(note, style="dim", markup=False)
        console.print(_pid(row))
    console.print(f"Figures and summary.json: {out}")
    return 0


def _write(out: Path, table: dict[str, Any]) -> None:
    (out / "summary.json").write_text(json.dumps(table, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _pid(row: dict[str, Any]) -> Table | str:
    """The analysis of a rate loop as a table, or the reason why there is none."""
    if "reason" in row:
        return f"no PID analysis: {row['reason']}"
    table = headed("axis", "step response", "gyro above 80 Hz, filtered / unfiltered", "peak", "P / I / D / F")
    for axis, found in row["axes"].items():
        noise = " / ".join("-" if x is None else f"{x:.3g}" for x in (found[k] for k in ("noise_rad_s", UNFILTERED)))
        terms = " / ".join(f"{100 * x:.2g}" if x is not None else "-" for x in map(found["terms_rms"].get, "PIDF"))
        table.add_row(
            axis, _told(found["step_response"]), f"{noise} rad/s", f"{found['noise_peak_hz']:.0f} Hz", f"{terms} %"
        )
    return table


def _print(console: Console, table: dict[str, Any]) -> None:
    console.print(f"{table['file']}: {table['duration_s']:.1f} s, vehicle {table['vehicle'] or 'unknown'}")
    if table["cut_off"]:
        console.print("Cut off", style="bold", end=": ")
        console.print(f"{table['cut_off']}; what follows is what was written until then")
    modes = headed("mode", "from", "to", "error rms / max", "why")
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
    if table["filter"]:
        console.print(_filter(table["filter"]))
    for event in table["events"]:
        if event["level"] in ("warning", "error"):
            console.print(f"{event['time_s']:8.2f} s  {event['level']}: {event['text']}")


def _filter(found: dict[str, Any]) -> Table:
    """Where the filter intervened."""
    title = f"the filter changed {found['commands']} of {found['of']} commands of the policy"
    table = headed("for", "from", "to", "commands", "largest share")
    table.title, table.title_justify = title, "left"
    for row in found["stepped_in"][:LONGEST]:
        times = f"{row['start_s']:.2f} s", f"{row['end_s']:.2f} s"
        table.add_row(row["limit"], *times, str(row["commands"]), f"{row['largest_share']:.0%}")
    if (more := len(found["stepped_in"]) - LONGEST) > 0:
        table.caption = f"and {more} more (summary.json has them all)"
    return table


def _lines(table: dict[str, Any]) -> list[tuple[str, str]]:
    rows = []
    for source, responses in (
        ("", table["rate_response"]),
        (" (blackbox)", table.get("blackbox", {}).get("rate_response")),
    ):
        for axis, r in (responses or {}).items():
            rows.append((f"{axis} rate{source}", _told(r)))
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


def _told(r: dict[str, Any]) -> str:
    return r["reason"] or (
        f"delay {1e3 * r['delay_s']:.0f} ms, 63 % at {1e3 * r['rise_63_s']:.0f} ms, overshoot {r['overshoot']:.0%}"
    )


def _ms(spread: dict[str, float] | None, before: str = "") -> str:
    if not spread:
        return ""
    return f"{before}p50 {1e3 * spread['p50']:.2f}, p99 {1e3 * spread['p99']:.2f}, max {1e3 * spread['max']:.2f} ms"
