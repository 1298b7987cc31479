"""`e2efly identify`."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import tyro
from rich.console import Console
from rich.table import Table

from e2efly.commands.log_options import LogOptions, read_checked
from e2efly.commands.terminal import Terminal, headed
from e2efly.config.names import unknown
from e2efly.config.storage import finite, held, write_json
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.posterior import load_posterior
from e2efly.vehicles.vehicle import Vehicle
from e2efly.vehicles.vehicle_rules import check_level

if TYPE_CHECKING:
    from e2efly.alignment.estimates import Estimate
    from e2efly.alignment.found import Found
    from e2efly.alignment.prediction import Prediction
    from e2efly.logs.recording import Record

KINDS = ("parts", "pendulum", "stand", "flight", "step")
"""Kinds of sources, as the command line names them."""
AHEAD = (0.048, 0.1, 0.2, 0.4)
"""Prediction horizons for which the report gives the prediction errors, s."""


@dataclass(frozen=True)
class Identify:
    """Find a vehicle's parameters from measurements. Write a vehicle file with their standard deviations.

    Give each source as its kind, followed by its files: `e2efly identify parts my.toml flight a.csv b.csv`.
    """

    sources: tyro.conf.Positional[Annotated[tuple[str, ...], tyro.conf.arg(metavar="FILE ...")]]
    """parts FILE: a list of parts. pendulum FILE: periods of a bifilar pendulum. stand FILE: a record of a thrust
    stand. flight LOG...: flights. step LOG...: flights with steps of the body rate, for the delay and the rate loop
    only. LOG:BEGIN-END selects the part between two times, in s from the beginning of the log."""
    vehicle: str = "vis_r"
    """The base vehicle: a name or a .toml file. Parameters that the sources do not determine keep its values. The
    flight controller is assumed to have been tuned for it in the flights."""
    out: Path = Path("identified")
    """Folder for vehicle.toml, identified.json and the plots."""
    read: tyro.conf.OmitArgPrefixes[LogOptions] = LogOptions()
    mass: tuple[float, float] | None = None
    """Mass of the vehicle and standard deviation of the scale, kg. Flights only give thrust, inertia and drag relative
    to the mass."""


def run(options: Identify) -> int:
    """Read all sources and fuse their results. Write the vehicle file, the report and the plots.

    Raises:
        ValueError: naming the source, what is wrong with it and what is accepted. Nothing is written then. Also when
            another process writes to the folder.
    """
    with held(options.out):
        return _identify(options)


def _identify(options: Identify) -> int:
    from e2efly.alignment import parts, pendulum, stand, stand_file
    from e2efly.alignment.correlation import correlation
    from e2efly.alignment.estimates import fuse, weighed
    from e2efly.alignment.vehicle_file import merged, write_vehicle
    from e2efly.logs import csv_file

    began = time.perf_counter()
    files, console = files_of(options.sources), Terminal()
    known = {"flight": csv_file.COLUMNS, "step": csv_file.COLUMNS, "stand": tuple(stand_file.COLUMNS)}
    used = dict.fromkeys(name for kind, names in known.items() if files[kind] for name in names)
    if options.read.columns and not used:
        raise ValueError(f"--columns is {list(options.read.columns)}; accepted: with a source of {', '.join(known)}")
    base, reading = load_vehicle(options.vehicle), options.read.reading(used)
    check_level(base, "identify")
    said: list[Estimate] = []
    if options.mass:
        said.append(weighed(options.mass))
    for kind, estimates in (("parts", parts.estimates), ("pendulum", pendulum.estimates)):
        for path in files[kind]:
            said += estimates(path)
    for path in files["stand"]:
        said += stand.estimates(path, reading.columns, lambda note: console.print(note, style="dim"))
    found: dict[str, Found] = {}
    for kind in ("flight", "step"):
        if files[kind]:
            known = merged(base, fuse(said))
            records = read_checked(files[kind], reading, known, console)
            found[kind] = _flown(known, base, records, kind == "step", console)
            said += _with_mass(found[kind].estimates, said)
    fused = fuse(said)
    if "latency" in fused and float(fused["latency"].value) < 0:
        raise ValueError(
            f"{fused['latency'].source}: the vehicle answers {-1e3 * float(fused['latency'].value):.0f} ms before its "
            "commands; accepted: times of both by one clock"
        )
    from e2efly.alignment.prediction import judged

    outside = {kind: judged(each) for kind, each in found.items()}
    report = _report(options, base, fused, said, found, outside)
    file = options.out / "vehicle.toml"
    together = correlation(found.values(), fused, _mass_spread(said))
    write_vehicle(file, options.vehicle, base, fused, together)
    load_vehicle(file)
    write_json(options.out / "identified.json", report)
    console.print(_table(base, fused))
    for each in found.values():
        for line in _left_over(each):
            console.print(line, style="dim")
        for refusal in each.refusals:
            console.print(str(refusal), style="dim")
        _warn(each, console)
    if found and not any(e.name == "mass" for e in said):
        console.print(
            f"mass is the file's, {base.mass:g} kg: flights give thrust, inertia and drag over it. Weigh the vehicle "
            "(--mass KG SIGMA).",
            style="dim",
        )
    from e2efly.viewing.identified import plot_identified
    from e2efly.viewing.uncertainty import plot_posterior

    plots = plot_identified(options.out, base, fused, found, outside)
    try:
        posterior = load_posterior(file)
    except ValueError as error:  # a value may be too vague to be drawn from
        console.print(f"There is no posterior.png: {error}.", style="dim")
    else:
        plots.append(options.out / "posterior.png")
        plot_posterior(plots[-1], posterior)
    console.print(
        f"Vehicle: {file}. Report: {options.out / 'identified.json'}. Plots: {', '.join(p.name for p in plots)}"
    )
    console.print(f"Took {time.perf_counter() - began:.0f} s.", style="dim")
    return 0


def files_of(words: Sequence[str]) -> dict[str, list[Path]]:
    """The files of each kind of source.

    Raises:
        ValueError: for a file without a kind, for a kind without a file, and if there is no file at all.
    """
    files: dict[str, list[Path]] = {kind: [] for kind in KINDS}
    kind = ""
    for word in words:
        if word in KINDS:
            kind = word
        elif not kind:
            raise ValueError(f"sources: {unknown('source', word, KINDS)}; accepted: a kind, and then its files")
        else:
            files[kind].append(Path(word))
    if empty := [k for k in KINDS if k in words and not files[k]]:
        raise ValueError(f"sources: {empty[0]} has no file; accepted: {empty[0]} FILE")
    if not any(files.values()):
        raise ValueError(f"sources are missing; accepted: {' FILE, '.join(KINDS)} FILE, any of them")
    return files


def _flown(vehicle: Vehicle, believed: Vehicle, records: "Sequence[Record]", step: bool, console: Console) -> "Found":
    from e2efly.alignment.identification import identify
    from e2efly.simulation.device import prepare

    prepare("cpu")
    with console.status("fitting") as status:
        return identify(
            vehicle,
            records,
            believed=believed,
            step=step,
            told=lambda i, cost: status.update(f"fitting: iteration {i}, cost {cost:.1f}"),
        )


def _left_over(found: "Found") -> list[str]:
    """What each flight had besides the vehicle, and what the fit leaves over, in words."""
    from e2efly.alignment.found import nuisances
    from e2efly.alignment.model import UNITS
    from e2efly.logs.recording import KINDS

    lines = []
    for i, flight in enumerate(nuisances(found)):
        told = [
            f"{name} {value:.2g} {UNITS.get(name.split('_')[0], '')}".rstrip()
            for name, value in flight.items()
            if abs(value) > 1e-4
        ]
        lines.append(f"flight {i + 1}: {', '.join(told)}")
    units = {name: kind.unit for name, kind in KINDS.items()} | {"quaternion": "rad"}
    for part in found.parts:
        told = [
            f"{name.replace('_', ' ')} {value:.2g} {units.get(name, 'rad/s')}" for name, value in part.noise.items()
        ]
        lines.append(f"left over (rms): {', '.join(told)}")
    return lines


def _warn(found: "Found", console: Console) -> None:
    alarms = [each for each in found.misfits if each.alarming]
    if alarms:
        remedy = " Rotor speeds in the log, 200 times a second, tell forces, rotors and rate loop apart."
        console.print(
            f"The model lacks something that this vehicle has ({'; '.join(map(str, alarms))}). The standard deviations "
            f"are widened accordingly.{'' if found.model.driver == 'rotor_speed' else remedy}",
            style="yellow",
        )


def _with_mass(estimates: "list[Estimate]", said: "Sequence[Estimate]") -> "list[Estimate]":
    """Parameters that are proportional to the mass are not known more precisely than the mass."""
    from dataclasses import replace

    from e2efly.alignment.correlation import OVER_MASS

    off = _mass_spread(said)
    return [replace(e, sigma=np.hypot(e.sigma, np.abs(e.value) * off)) if e.name in OVER_MASS else e for e in estimates]


def _mass_spread(said: "Sequence[Estimate]") -> float:
    """Relative standard deviation of the mass; 0 if no source gives it."""
    return float(min((e.sigma / e.value for e in said if e.name == "mass"), default=0.0))


def _report(
    options: Identify,
    base: Vehicle,
    fused: "dict[str, Estimate]",
    said: "list[Estimate]",
    found: "dict[str, Found]",
    outside: "dict[str, Prediction]",
) -> dict[str, Any]:
    from e2efly.alignment.found import nuisances

    def entry(e: "Estimate") -> dict[str, Any]:
        return {"value": e.value.tolist(), "sigma": e.sigma.tolist(), "source": e.source}

    report: dict[str, Any] = {
        "vehicle": options.vehicle,
        "parameters": {
            name: entry(e) | {"before": np.asarray(getattr(base, name)).tolist()} for name, e in fused.items()
        },
        "sources": [{"parameter": e.name, **entry(e)} for e in said],
    }
    for kind, each in found.items():
        held_out, ahead = outside[kind], [x for x in AHEAD if x <= each.windows.length]
        covariance = each.fit.covariance
        spread = np.sqrt(np.diag(covariance))
        report[kind] = {
            "driven_by": each.model.driver,
            "seconds": each.windows.count * each.windows.length,
            "unknowns": [
                {"name": u.name, "found": float(x), "sigma": float(s)}
                for u, x, s in zip(each.model.unknowns, each.fit.p, each.sigma, strict=True)
            ],
            "correlation": (covariance / np.outer(spread, spread)).round(3).tolist(),
            "nuisances": nuisances(each),
            "structures": {
                label: dict(zip((u.name for u in each.model.unknowns), map(float, other), strict=True))
                for label, other in each.structures.items()
            },
            "noise": {name: value for part in each.parts for name, value in part.noise.items()},
            "misfit": [
                {"sensor": m.sensor, "share": m.share, "pull": m.pull, "alarming": m.alarming} for m in each.misfits
            ],
            "response": None
            if each.response is None
            else [
                {"name": u.name, "found": float(x), "sigma": float(off)}
                for u, x, off in zip(each.response.unknowns, each.response.p, each.response.sigma, strict=True)
            ],
            "iterations": each.fit.iterations,
            "refused": [str(refusal) for refusal in each.refusals],
            "held_out": {
                name: {
                    "seconds": ahead,
                    "before": finite(held_out.at(held_out.before[name], ahead).tolist()),
                    "after": finite(held_out.at(held_out.after[name], ahead).tolist()),
                }
                for name in held_out.before
            },
        }
    return report


def _table(base: Vehicle, fused: "dict[str, Estimate]") -> Table:
    from e2efly.logs.recording import percent

    table = headed("parameter", "file", "identified", "sigma", "source")
    for name, e in fused.items():
        own = np.broadcast_to(np.asarray(getattr(base, name), float), np.atleast_1d(e.value).shape)  # None: NaN
        for i, (before, value, sigma) in enumerate(
            zip(own.flat, np.atleast_1d(e.value).flat, np.atleast_1d(e.sigma).flat, strict=True)
        ):
            if np.isfinite(value):
                label = name if own.size == 1 else f"{name}[{i}]"
                table.add_row(
                    label,
                    f"{before:.4g}" if np.isfinite(before) else "none",
                    f"{value:.4g}",
                    percent(sigma / abs(value)) if value else f"{sigma:.2g}",
                    e.source,
                )
    return table
