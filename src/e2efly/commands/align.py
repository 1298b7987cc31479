"""`e2efly align`."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import tyro
from rich.table import Table

from e2efly.storage import write_json
from e2efly.terminal import Terminal
from e2efly.vehicles import Vehicle, load_vehicle

if TYPE_CHECKING:
    from e2efly.identification.align import Alignment
    from e2efly.identification.record import Record


@dataclass(frozen=True)
class Align:
    """Make the simulator answer to commands as the vehicle did: fit delay and rate loop to flights, show both.

    The commands that were really sent are replayed through the simulator, and its response is laid over the measured
    one, before and after.
    """

    logs: tyro.conf.Positional[tuple[Path, ...]]
    """Flights with commands (thrust over mass and body rates) and body rates: our .mcap, CSV, Betaflight's blackbox."""
    vehicle: str = "vis_r"
    """A vehicle's name or a .toml file: what is aligned. All but delay and rate loop stays as it is there."""
    out: Path = Path("aligned")
    """Folder of vehicle.toml, align.json and the plots."""
    pose_delay: float | None = None
    """How late the poses are when a command is made from them, s: it is a part of the vehicle's latency that commands and
    body rates do not show. Left out: what the logs tell, as our .mcap does, and else 0."""
    columns: tuple[str, ...] = ()
    """Names of a CSV log's columns for ours: OURS=THEIRS or OURS=THEIRS*FACTOR, as wx=gyro_x*0.01745."""


def run(options: Align) -> int:
    """Fit, write the vehicle file, the report and the plots.

    Raises:
        ValueError: naming the log, what is wrong with it and what is accepted. Nothing is written then.
    """
    from e2efly.device import prepare
    from e2efly.identification.align import align, refused
    from e2efly.identification.checks import checked
    from e2efly.identification.csv_file import column_map
    from e2efly.identification.flight import driver_of
    from e2efly.identification.readers import read_flights
    from e2efly.identification.vehicle_file import write_vehicle
    from e2efly.view.alignment import plot_alignment

    began, console = time.perf_counter(), Terminal()
    if not options.logs:
        raise ValueError("logs are missing; accepted: one flight log or more")
    if options.pose_delay is not None and not 0 <= options.pose_delay <= 1:
        raise ValueError(f"--pose-delay is {options.pose_delay}; accepted: 0 to 1 s")
    vehicle, columns = load_vehicle(options.vehicle), column_map(options.columns)
    read = [record for path in options.logs for record in read_flights(path, columns)]
    driver_of(read, step=True)
    records = checked(read, vehicle)
    for record in records:
        console.print(f"{record.path.name}: {record.duration:.1f} s")
        for note in record.notes:
            console.print(f"  {note}", style="dim")
    pose_delay, how = _pose_delay(options, read, records)
    console.print(how, style="dim")
    prepare("cpu")
    with console.status("fitting") as status:
        found = align(
            vehicle,
            records,
            pose_delay,
            told=lambda i, cost: status.update(f"fitting: iteration {i}, cost {cost:.1f}"),
        )
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / "vehicle.toml"
    write_vehicle(file, options.vehicle, vehicle, {e.name: e for e in found.estimates})
    load_vehicle(file)
    write_json(options.out / "align.json", _report(options, vehicle, found, records))
    console.print(_parameters(vehicle, found))
    console.print(_errors(found))
    for refusal in found.refusals:
        console.print(refused(refusal), style="dim")
    if found.after["roll_rate"] + found.after["pitch_rate"] > found.before["roll_rate"] + found.before["pitch_rate"]:
        console.print("The error of roll and pitch rate did not fall: keep the file that you have.", style="bold")
    plots = plot_alignment(options.out, found, records)
    console.print(f"Vehicle: {file}. Report: {options.out / 'align.json'}. Plots: {', '.join(p.name for p in plots)}")
    console.print(f"Took {time.perf_counter() - began:.0f} s.", style="dim")
    return 0


def _pose_delay(options: Align, read: "list[Record]", records: "list[Record]") -> tuple[float, str]:
    """How late the poses were when they were flown by, s, and from where that is known, in words."""
    from e2efly.identification.checks import poses_behind

    if options.pose_delay is not None:
        return options.pose_delay, f"The poses are taken to be {1e3 * options.pose_delay:.0f} ms late (--pose-delay)."
    known = []
    for log, record in zip(read, records, strict=True):
        if log.path.suffix.lower() == ".mcap":
            behind, age = poses_behind(log.during(*record.span)), _age(log.path)
            if behind is not None and np.isfinite(age):
                known.append(max(behind, 0.0) + age)
    if known:
        late = float(np.median(known))
        return late, f"The poses are {1e3 * late:.0f} ms late by the log: behind its gyroscope, and until their use."
    return 0.0, (
        "The log does not say how late the poses were when they were flown by: latency is the delay from command to "
        "response alone. Add it by --pose-delay."
    )


def _age(path: Path) -> float:
    """Age of the odometry when it was used, s; NaN where none was recorded."""
    from e2efly.deploy.log.flight_log import read_log

    age = read_log(path)["odometry"].numbers("age")
    return float(np.nanmedian(age)) if np.isfinite(age).any() else float("nan")


def _rows(vehicle: Vehicle, found: "Alignment") -> list[dict[str, Any]]:
    """Parameters before and after."""
    own, late, sigma = found.delay
    rows: list[dict[str, Any]] = []
    if np.isfinite(late):
        rows.append({"name": "delay from command to response", "unit": "s", "before": own, "after": late, "sigma": sigma})
    for estimate in found.estimates:
        before = np.atleast_1d(np.asarray(getattr(vehicle, estimate.name), float))
        for i, (was, value, off) in enumerate(
            zip(before, np.atleast_1d(estimate.value), np.atleast_1d(estimate.sigma), strict=True)
        ):
            if np.isfinite(value):
                name, unit = (f"rate_gain[{i}]", "1/s") if before.size > 1 else (estimate.name, "s")
                rows.append(
                    {"name": name, "unit": unit, "before": float(was), "after": float(value), "sigma": float(off)}
                )
    return rows


def _report(options: Align, vehicle: Vehicle, found: "Alignment", records: "list[Record]") -> dict[str, Any]:
    from e2efly.identification.align import refused
    from e2efly.identification.replay import SIGNALS
    from e2efly.identification.windows import LENGTH

    return {
        "vehicle": options.vehicle,
        "logs": [{"file": str(r.path), "seconds": r.duration, "notes": list(r.notes)} for r in records],
        "pose_delay_s": found.pose_delay,
        "parameters": _rows(vehicle, found),
        "refused": [refused(r) for r in found.refusals],
        "held_out": {
            "seconds": float(found.found.held_out.sum() * LENGTH),
            "length_s": LENGTH,
            "rms": {
                name: {"unit": SIGNALS[name], "before": before, "after": found.after[name]}
                for name, before in found.before.items()
            },
        },
    }


def _parameters(vehicle: Vehicle, found: "Alignment") -> Table:
    table = Table("parameter", "before", "aligned", "sigma", box=None, header_style="bold", pad_edge=False)
    for row in _rows(vehicle, found):
        factor, unit = (1e3, "ms") if row["unit"] == "s" else (1.0, row["unit"])
        told = [f"{factor * row[key]:.{digits}g} {unit}" for key, digits in (("before", 4), ("after", 4), ("sigma", 2))]
        table.add_row(row["name"], *told)
    return table


def _errors(found: "Alignment") -> Table:
    from e2efly.identification.replay import SIGNALS

    table = Table(
        "error where the fit did not look (rms)", "before", "aligned", box=None, header_style="bold", pad_edge=False
    )
    for name, before in found.before.items():
        table.add_row(name.replace("_", " "), f"{before:.3g} {SIGNALS[name]}", f"{found.after[name]:.3g} {SIGNALS[name]}")
    return table
