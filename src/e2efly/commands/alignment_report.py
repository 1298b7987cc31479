"""`e2efly alignment-report`: the four stages of an alignment on one page."""

import dataclasses
import datetime
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import tyro

from e2efly import __version__
from e2efly.commands.log_options import LogOptions, read_checked
from e2efly.commands.terminal import Terminal
from e2efly.config import NoiseConfig
from e2efly.config.storage import make_folder, read_json, write_atomically
from e2efly.logs.recording import percent
from e2efly.runs import presets
from e2efly.tasks import TASKS
from e2efly.vehicles.loading import load_vehicle, vehicle_file
from e2efly.vehicles.posterior import ADDED, load_posterior
from e2efly.vehicles.vehicle import quantities, terms

if TYPE_CHECKING:
    from e2efly.alignment.sensor_noise import SensorNoise
    from e2efly.viewing.alignment_page import PageSection, PageTable

IDENTIFIED, ALIGNED = "identified.json", "align.json"
"""The files by which the folders of `e2efly identify` and `e2efly align` are known."""
PICTURES = {
    "parameters.png": "What was identified, over the file that it began from, with 90 % intervals.",
    "flight_prediction.png": "Flights that the fit did not see: errors of the file before and after.",
    "flight_fit.png": "The liveliest of them, measured and simulated.",
    "flight_residuals.png": "What the fit leaves over, over the noise of each sensor.",
    "step_prediction.png": "Steps that the fit did not see: errors of the file before and after.",
    "step_fit.png": "The liveliest of them, measured and simulated.",
    "step_residuals.png": "What the fit to steps leaves over, over the noise of each sensor.",
    "steps.png": "Response to steps: commanded, measured, simulated before and after.",
    "replay.png": "The flight's commands, replayed through the simulator.",
    "errors.png": "Errors of the simulator where the fit did not look.",
    "policy.png": "The policy in flight and in simulation, from the same start.",
    "posterior.png": "What the identification leaves open: the distribution of training.",
}
"""Pictures of the other commands, and what they show."""
NOISE = tuple(f.name for f in dataclasses.fields(NoiseConfig))
"""The sensors whose noise the options `--env.noise` set."""
OF_IDENTIFY = tuple(name for name in PICTURES if name.startswith(("parameters", "flight", "step_")))
OF_ALIGN = ("steps.png", "replay.png", "errors.png", "policy.png")


@dataclass(frozen=True)
class AlignmentReport:
    """Show the four stages of an alignment on one page: identification, latency, randomisation, noise.

    The page is one HTML file with its pictures inside. A browser shows it offline.
    """

    folders: tyro.conf.Positional[Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FOLDER [FOLDER ...]")]]
    """Folders that `e2efly identify`, `e2efly align` and `e2efly tune` wrote."""
    hover: Path | None = None
    """A log of a flight with 3 s of hover or more, which shows the noise of the sensors."""
    vehicle: str | None = None
    """The vehicle whose randomisation is shown: a name or a .toml file. If omitted, the file that was identified."""
    task: str = "hover"
    """The task with whose noise the measured noise is compared."""
    preset: str = presets.ROBUST
    """The preset of this task."""
    read: tyro.conf.OmitArgPrefixes[LogOptions] = LogOptions()
    out: Path = Path("alignment_report")
    """Folder for report.html and noise.png."""


def run(options: AlignmentReport) -> int:
    """Read what the other commands wrote, measure the noise, and write the page.

    Raises:
        ValueError: naming the folder, the log or the option, what is wrong with it and what is accepted. Nothing is
            written then.
    """
    from e2efly.viewing.alignment_page import alignment_page

    console = Terminal()
    identified, aligned = _found(options.folders)
    vehicle = options.vehicle or (str(identified[-1][0] / "vehicle.toml") if identified else None)
    shown = vehicle or next((report["vehicle"] for _, report in aligned), "vis_r")
    load_vehicle(shown)
    stages = [_identification(identified), _latency(aligned, identified), _randomisation(vehicle)]
    stages.append(_noise(options, shown, console))  # the only one that writes
    about = [
        f"e2efly {__version__}, {datetime.datetime.now(datetime.UTC):%Y-%m-%d}",
        f"From {', '.join(map(str, options.folders))}{f' and {options.hover}' if options.hover else ''}.",
    ]
    text = alignment_page(f"Alignment of {shown}", about, stages)
    make_folder(options.out)
    write_atomically(options.out / "report.html", text.encode())
    for i, stage in enumerate(stages, 1):
        told = stage.missing or f"{len(stage.tables)} tables, {len(stage.pictures)} pictures"
        console.print(f"{i}. {stage.title}: {told}", style="dim" if stage.missing else "", markup=False)
    console.print(f"Page: {options.out / 'report.html'}")
    return 0


Reports = list[tuple[Path, dict[str, Any]]]
"""Folders with what is in their JSON files."""


def _found(folders: Sequence[Path]) -> tuple[Reports, Reports]:
    """The identifications and the alignments in these folders, and one level below."""
    found: dict[str, Reports] = {IDENTIFIED: [], ALIGNED: []}
    for folder in folders:
        inner = sorted(path for path in folder.iterdir() if path.is_dir()) if folder.is_dir() else []
        before = sum(map(len, found.values()))
        for place in (folder, *inner):
            for name, reports in found.items():
                if (place / name).is_file():
                    reports.append((place, read_json(place / name)))
        if sum(map(len, found.values())) == before:
            raise ValueError(
                f"{folder}: has neither {IDENTIFIED} nor {ALIGNED}; accepted: a folder that e2efly identify, align or "
                "tune wrote"
            )
    return found[IDENTIFIED], found[ALIGNED]


def _pictures(folder: Path, names: Sequence[str]) -> tuple[tuple[Path, str], ...]:
    return tuple((folder / name, PICTURES[name]) for name in names if (folder / name).is_file())


Shown = Callable[[Path, dict[str, Any]], "PageSection"]


def _joined(title: str, file: str, reports: Reports, shown: Shown) -> "PageSection":
    """What all reports of a kind show, as one stage.

    Raises:
        ValueError: for a report that is not as the command writes it.
    """
    from e2efly.viewing.alignment_page import PageSection

    stages = []
    for folder, report in reports:
        try:
            stages.append(shown(folder, report))
        except (KeyError, TypeError, AttributeError) as error:
            why = f"{type(error).__name__} {error}"
            raise ValueError(
                f"{folder / file}: is not as this version of e2efly writes it ({why}); accepted: run the command again"
            ) from None
    return PageSection(
        title,
        tuple(text for stage in stages for text in stage.said),
        tuple(table for stage in stages for table in stage.tables),
        tuple(picture for stage in stages for picture in stage.pictures),
    )


def _identification(reports: Reports) -> "PageSection":
    from e2efly.viewing.alignment_page import PageSection

    title = "System identification"
    if not reports:
        return PageSection(
            title, missing="No identification was given. e2efly identify parts FILE stand FILE flight LOG"
        )
    return _joined(title, IDENTIFIED, reports, _identified)


def _identified(folder: Path, report: dict[str, Any]) -> "PageSection":
    from e2efly.viewing.alignment_page import PageSection, PageTable

    units = {f.name: f.metadata["unit"] for f in (*quantities(), *terms())}
    rows = [
        (label, _number(before), f"{_number(value)} ± {_number(sigma)}", units[name], each["source"])
        for name, each in report["parameters"].items()
        for label, before, value, sigma in _entries(name, each)
    ]
    head = ("parameter", "file", "identified", "unit", "source")
    tables = [PageTable(f"{folder}: by {report['vehicle']}, with standard deviations", head, tuple(rows))]
    said: list[str] = []
    for kind in ("flight", "step"):
        if kind in report:
            told, table = _flown(kind, report[kind])
            said += told
            tables.append(table)
    return PageSection("", tuple(said), tuple(tables), _pictures(folder, OF_IDENTIFY))


def _entries(name: str, each: Mapping[str, Any]) -> list[tuple[str, float, float, float]]:
    """Name, value before, value and standard deviation of every number of a parameter that was identified."""
    value, sigma = (np.atleast_1d(np.array(each[key], float)) for key in ("value", "sigma"))
    before = np.broadcast_to(np.array(each["before"], float), value.shape)
    return [
        (name if value.size == 1 else f"{name}[{i}]", float(before[i]), float(value[i]), float(sigma[i]))
        for i in range(value.size)
        if np.isfinite(value[i])
    ]


def _flown(kind: str, report: Mapping[str, Any]) -> "tuple[list[str], PageTable]":
    """What a fit to flights says about itself, and its errors where it did not look."""
    from e2efly.viewing.alignment_page import PageTable

    said = [f"The fit used {report['seconds']:.0f} s of {kind} logs, driven by {report['driven_by']}."]
    said += [f"Refused: {reason}" for reason in report["refused"]]
    if alarms := [f"{m['sensor']} {100 * m['share']:.0f} %" for m in report["misfit"] if m["alarming"]]:
        said.append(
            f"The model lacks something that this vehicle has: it leaves a part of the motion unexplained "
            f"({', '.join(alarms)}). The standard deviations are widened accordingly."
        )
    ahead = sorted({seconds for each in report["held_out"].values() for seconds in each["seconds"]})
    errors = {name: _errors(each) for name, each in report["held_out"].items()}
    rows = tuple((name.replace("_", " "), *(told.get(s, "") for s in ahead)) for name, told in errors.items())
    title = "Errors of the file where the fit did not look, before and after (rms)"
    return said, PageTable(title, ("stream", *(f"{seconds:g} s ahead" for seconds in ahead)), rows)


def _errors(each: Mapping[str, Any]) -> dict[float, str]:
    """The errors of a stream by how far ahead, where they were measured."""
    return {
        seconds: f"{_number(before)} → {_number(after)}"
        for seconds, before, after in zip(each["seconds"], each["before"], each["after"], strict=True)
        if before is not None and after is not None
    }


def _latency(reports: Reports, identified: Reports) -> "PageSection":
    from e2efly.viewing.alignment_page import PageSection

    title = "Latency and rate loop"
    if not reports:
        known = [each["parameters"]["latency"] for _, each in identified if "latency" in each["parameters"]]
        told = f"The identification found {1e3 * known[-1]['value']:.1f} ms. " if known else ""
        return PageSection(title, missing=f"{told}No alignment was given. e2efly fly steps, then e2efly align LOG")
    return _joined(title, ALIGNED, reports, _aligned)


def _aligned(folder: Path, report: dict[str, Any]) -> "PageSection":
    from e2efly.viewing.alignment_page import PageSection, PageTable

    def table(title: str, numbers: Mapping[str, Mapping[str, Any]]) -> PageTable:
        rows = tuple((name, _number(e["before"]), _number(e["aligned"]), e["unit"]) for name, e in numbers.items())
        return PageTable(title, ("of", "before", "aligned", "unit"), rows)

    found = tuple(
        (r["name"], _number(r["before"]), f"{_number(r['after'])} ± {_number(r['sigma'])}", r["unit"])
        for r in report["parameters"]
    )
    held_out = report["held_out"]
    errors = {name: {**each, "aligned": each["after"]} for name, each in held_out["rms"].items()}
    tables = [
        PageTable(f"{folder}: by {report['vehicle']}", ("parameter", "before", "aligned", "unit"), found),
        table(f"Errors over {held_out['length_s']:g} s where the fit did not look (rms)", errors),
    ]
    if flown := report["policy"]:
        title = f"Closed loop of {flown['task']} over {flown['compared_s']:.1f} s: simulator less flight (rms)"
        tables.append(table(title, flown["rms_difference"]))
    said = [f"The delay is measured from the {report['delay_from']}."]
    said += [f"Refused: {reason}" for reason in report["refused"]]
    return PageSection("", tuple(said), tuple(tables), _pictures(folder, OF_ALIGN))


def _randomisation(vehicle: str | None) -> "PageSection":
    from e2efly.viewing.alignment_page import PageSection, PageTable

    title = "Domain randomisation"
    if vehicle is None:
        return PageSection(title, missing="It is drawn from an identification, and none was given.")
    try:
        posterior = load_posterior(vehicle)
    except ValueError as error:
        return PageSection(title, missing=f"{error}")
    units = {f.name: f.metadata["unit"] for f in (*quantities(), *terms())}
    rows = tuple(
        (entry.name, f"{_number(sigma)} {units[entry.field]}" if entry.field in ADDED else percent(sigma))
        for entry, sigma in zip(posterior.entries, posterior.sigma.values(), strict=True)
    )
    said = (
        "Each episode of training draws another vehicle from this distribution, with the correlations of the errors: "
        f"e2efly train race --vehicle {vehicle} --preset identified",
    )
    table = PageTable("What is drawn", ("parameter", "standard deviation"), rows)
    return PageSection(title, said, (table,), _pictures(vehicle_file(vehicle).parent, ("posterior.png",)))


def _noise(options: AlignmentReport, vehicle: str, console: Terminal) -> "PageSection":
    from e2efly.alignment.sensor_noise import MEASURED, hover_of, measured_noise
    from e2efly.viewing.alignment_page import PageSection, PageTable
    from e2efly.viewing.noise_plot import plot_noise

    title = "Sensor noise"
    if options.hover is None:
        return PageSection(title, missing="No log of a hover was given: --hover LOG")
    env = presets.preset(options.task, TASKS.find(options.task).best, options.preset).env
    (record, *_) = read_checked([options.hover], options.read.reading(), load_vehicle(vehicle), console, hovers=True)
    hover = hover_of(record)
    found = measured_noise(hover)
    if not found:
        raise ValueError(f"--hover is {options.hover}, which has too few samples; accepted: 10 a second or more")
    trained = {name: float(getattr(env.noise, name)) for name in MEASURED if hasattr(env.noise, name)}
    if env.imu.observed:  # as a density
        trained |= {e.name: env.imu.accel_noise * e.rate**0.5 for e in found if e.name == "specific_force"}
    make_folder(options.out)
    plot_noise(options.out / "noise.png", found, trained)
    rows = tuple(
        (
            each.name.replace("_", " "), f"{each.rate:.0f} Hz", " ".join(map(_number, each.sigma)), MEASURED[each.name],
            *_trained(each, trained.get(each.name)), f"{each.memory:.2f}",
            "" if each.bias is None else " ".join(map(_number, each.bias)),
        )
        for each in found
    )  # fmt: skip
    head = ("sensor", "rate", "measured x, y, z", "unit", "training", "", "memory", "bias x, y, z")
    table = PageTable(f"Standard deviation of a sample, over {hover.duration:.1f} s of hover", head, rows)
    said = [
        f"Measured in {options.hover}; the training is {options.task} under the preset {options.preset}.",
        "The memory is the correlation of a sample's noise with that of the next. White noise, as in training, has 0.",
    ]
    if larger := [e for e in found if e.name in NOISE and max(e.sigma) > trained[e.name]]:
        told = " ".join(f"--env.noise.{e.name.replace('_', '-')} {max(e.sigma):.2g}" for e in larger)
        said.append(f"To train with the noise that is larger than the training's: {told}")
    return PageSection(title, tuple(said), (table,), ((options.out / "noise.png", "Spectra of the noise, by axis."),))


def _trained(noise: "SensorNoise", sigma: float | None) -> tuple[str, str]:
    """The noise of the training, and whether it covers what was measured."""
    if sigma is None:
        return "", "not observed"
    return _number(sigma), "covers it" if sigma >= max(noise.sigma) else "is smaller"


def _number(x: float) -> str:
    return f"{x:.3g}" if np.isfinite(x) else "none"
