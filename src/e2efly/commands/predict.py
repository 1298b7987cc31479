"""`e2efly predict`."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import tyro
from rich.table import Table

from e2efly.commands.log_options import LogOptions, read_checked
from e2efly.commands.terminal import Terminal, headed
from e2efly.config.storage import make_folder, write_json
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle_rules import check_quadrotor

if TYPE_CHECKING:
    from e2efly.alignment.open_loop import Forecast


@dataclass(frozen=True)
class Predict:
    """How well a vehicle file predicts flights: errors of position, velocity, attitude and body rate up to 3 s ahead.

    Every half second, the simulation starts as measured, and then follows the log's commands, motor outputs or rotor
    speeds in open loop. The errors stand beside those of two predictions without a vehicle: the measured velocity
    stays (hold), and a point mass with the flight's mean thrust along the measured attitude (hover thrust).
    """

    logs: tyro.conf.Positional[Annotated[tuple[Path, ...], tyro.conf.arg(metavar="LOG ...")]]
    """Flight logs of any kind that `e2efly identify` reads. LOG:BEGIN-END selects the part between two times, in s from
    the beginning of the log."""
    vehicle: str = "vis_r"
    """The vehicle to judge: a name or a .toml file."""
    believed: str = ""
    """The vehicle that the flight controller was tuned for, if it is not the same: a name or a .toml file."""
    volts: float | None = None
    """Battery voltage for which the thrust of the file holds, V. Motor outputs are scaled by it. If omitted, the file's
    `nominal_voltage`, or else the typical voltage of each flight."""
    json: Path | None = None
    """Write the errors of each flight to this file."""
    out: Path = Path("predicted")
    """Folder for the plot."""
    read: tyro.conf.OmitArgPrefixes[LogOptions] = LogOptions()


def run(options: Predict) -> int:
    """Predict each flight, print the errors, write the plot and the report.

    Raises:
        ValueError: naming the log or the option, what is wrong with it and what is accepted. Nothing is written then.
    """
    from e2efly.alignment.identification import driver_of, typical_volts
    from e2efly.alignment.model import NUISANCES, Model
    from e2efly.alignment.open_loop import forecast
    from e2efly.simulation.device import prepare
    from e2efly.viewing.forecast_plot import plot_forecasts

    began, console = time.perf_counter(), Terminal()
    if not options.logs:
        raise ValueError("logs are missing; accepted: one flight log or more")
    if options.volts is not None and not 0 < options.volts < np.inf:
        raise ValueError(f"--volts is {options.volts}; accepted: above 0 V")
    vehicle = load_vehicle(options.vehicle)
    check_quadrotor(vehicle, "predict")
    believed = load_vehicle(options.believed) if options.believed else None
    given = vehicle.nominal_voltage if options.volts is None else options.volts
    records = read_checked(options.logs, options.read.reading(), vehicle, console)
    prepare("cpu")
    found = []
    for record in records:
        driver = driver_of([record])
        # motor outputs are behind the rate loop, and behind the latency that leads to it
        flew = replace(vehicle, latency=0.0) if driver.startswith("motor") else vehicle
        model = Model.of(flew, driver, believed)
        volts = typical_volts([record])
        volts = volts if volts is None or given is None else float(given)
        with console.status(f"predicting {record.path.name}"):
            p, q = np.zeros(len(model.unknowns)), np.zeros(len(NUISANCES))
            found.append(forecast(model, p, q, record, volts))
        _say(found[-1], console)
    if len(found) > 1:
        console.print(f"mean of {len(found)} flights", style="bold")
        console.print(_table(*together(found)))
    make_folder(options.out, "the folder of the plot")
    plot_forecasts(options.out / "prediction.png", *together(found), f"{options.vehicle}, {len(found)} flights")
    if options.json:
        write_json(options.json, {"vehicle": options.vehicle, "flights": [_report(each) for each in found]})
        console.print(f"Report: {options.json}")
    console.print(f"Plot: {options.out / 'prediction.png'}")
    console.print(f"Took {time.perf_counter() - began:.0f} s.", style="dim")
    return 0


Errors = dict[str, dict[str, np.ndarray]]
"""Mean errors by stream and prediction, (times,)."""


def together(found: "Sequence[Forecast]") -> tuple[tuple[float, ...], Errors]:
    """How far ahead all flights are predicted, s, and the mean errors over those that have them."""
    ahead = min((each.ahead for each in found), key=len)
    means = [each.mean() for each in found]
    names = {stream: list(dict.fromkeys(n for m in means for n in m.get(stream, ()))) for m in means for stream in m}
    return ahead, {
        stream: {
            name: np.mean([m[stream][name][: len(ahead)] for m in means if name in m.get(stream, ())], 0)
            for name in labels
        }
        for stream, labels in names.items()
    }


def _say(each: "Forecast", console: Terminal) -> None:
    from e2efly.alignment.open_loop import OWN_S

    how = f"driven by {each.driver.replace('_', ' ')}"
    if each.own:
        tilt = np.degrees(np.hypot(each.own["tilt_x"], each.own["tilt_y"]))
        share = 100 * np.expm1(each.own["flight_thrust"])
        how += (
            f"; its first {OWN_S:g} s show {share:+.1f} % thrust and a tilt of {tilt:.1f} degrees; the rest is judged"
        )
    else:
        how += f"; without its own thrust and tilt, which positions of more than {OWN_S:g} s show"
    console.print(f"{each.record.path.name}: {how}", markup=False)
    console.print(_table(each.ahead, each.mean()))


def _table(ahead: Sequence[float], errors: Errors) -> Table:
    from e2efly.alignment.open_loop import STREAMS

    table = headed("mean error", "predicted by", *(f"{t:g} s" for t in ahead))
    for stream, sizes in errors.items():
        for i, (name, size) in enumerate(sizes.items()):
            table.add_row("" if i else f"{stream} ({STREAMS[stream]})", name, *(f"{x:.3f}" for x in size))
    return table


def _report(each: "Forecast") -> dict[str, Any]:
    from e2efly.alignment.open_loop import OWN_S, STREAMS

    return {
        "log": str(each.record.path),
        "notes": list(each.record.notes),
        "driven_by": each.driver,
        "predictions": int(np.sum(each.begin >= OWN_S)) if each.own else len(each.begin),
        "own": each.own,
        "seconds": list(each.ahead),
        "mean_error": {
            stream: {"unit": STREAMS[stream]}
            | {name: [x if np.isfinite(x) else None for x in size.tolist()] for name, size in sizes.items()}
            for stream, sizes in each.mean().items()
        },
    }
