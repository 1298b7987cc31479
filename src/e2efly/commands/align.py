"""`e2efly align`."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import tyro
from rich.table import Table

from e2efly.commands.log_options import LogOptions, show_notes
from e2efly.commands.terminal import Terminal, headed
from e2efly.config.storage import write_json
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle
from e2efly.vehicles.vehicle_rules import check_quadrotor

if TYPE_CHECKING:
    from e2efly.alignment.alignment import Alignment
    from e2efly.logs.recording import Record
    from e2efly.validation.closed_loop import ClosedLoop

THRUST = 0.03
"""Relative difference of the thrust above which it is reported."""


@dataclass(frozen=True)
class Align:
    """Make the simulator respond to commands as the vehicle did: fit delay, rate loop and motor lag to flights.

    The commands of the flights are replayed through the simulator. The plots show the simulated response over the
    measured one, before and after the fit.
    """

    logs: tyro.conf.Positional[Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FILE [FILE ...]")]]
    """Logs with commands (thrust over mass and body rates) and body rates: our .mcap, CSV, or a Betaflight blackbox
    log. A blackbox beside our .mcap of the same flight is laid over it. LOG:BEGIN-END selects the part between two
    times, in s from the beginning of the log."""
    vehicle: str = "vis_r"
    """The vehicle to align: a name or a .toml file. Everything except delay, rate loop and motor lag stays as it
    is."""
    out: Path = Path("aligned")
    """Folder for vehicle.toml, align.json and the plots."""
    pose_delay: float | None = None
    """Age of the poses when a command is made from them, s. Commands and body rates do not show this part of the
    vehicle's latency. If omitted, the value in the logs (our .mcap has it), otherwise 0."""
    policy: Path | None = None
    """The policy that flew in one of the logs, our .mcap: a policy.onnx, a run directory, or a task (the zoo's policy).
    The simulator flies it from the same start, and policy.png shows both. If omitted, the policy that the log names, if
    its file is still there."""
    read: tyro.conf.OmitArgPrefixes[LogOptions] = LogOptions()


def run(options: Align) -> int:
    """Fit, write the vehicle file, the report and the plots.

    Raises:
        ValueError: naming the log, what is wrong with it and what is accepted. Nothing is written then.
    """
    from e2efly.alignment.alignment import align, lag_refused, refused
    from e2efly.alignment.checks import checked
    from e2efly.alignment.identification import driver_of
    from e2efly.alignment.vehicle_file import merged, write_vehicle
    from e2efly.logs.blackbox_merge import with_blackboxes
    from e2efly.logs.readers import read_part
    from e2efly.simulation.device import prepare
    from e2efly.viewing.alignment_plots import plot_alignment
    from e2efly.viewing.closed_loop_plot import plot_closed_loop

    began, console = time.perf_counter(), Terminal()
    if not options.logs:
        raise ValueError("logs are missing; accepted: one flight log or more")
    if options.pose_delay is not None and not 0 <= options.pose_delay <= 1:
        raise ValueError(f"--pose-delay is {options.pose_delay}; accepted: 0 to 1 s")
    vehicle, reading = load_vehicle(options.vehicle), options.read.reading()
    check_quadrotor(vehicle, "align")
    read = with_blackboxes([record for path in options.logs for record in read_part(path, reading)])
    show_notes(read, console)
    driver_of(read, step=True)
    records = checked(read, vehicle)
    show_notes(records, console, read)
    for record in records:
        console.print(f"{record.path.name}: {record.duration:.1f} s")
    pose_delay, how, known = pose_delay_of(options.pose_delay, records)
    console.print(how, style="dim" if known else "bold")
    prepare("cpu")
    with console.status("fitting") as status:
        found = align(
            vehicle, records, pose_delay, told=lambda i, cost: status.update(f"fitting: iteration {i}, cost {cost:.1f}")
        )
    estimates = {e.name: e for e in found.estimates}
    loop = _closed_loop(options, console, records, vehicle, merged(vehicle, estimates), found)
    options.out.mkdir(parents=True, exist_ok=True)
    file = options.out / "vehicle.toml"
    write_vehicle(file, options.vehicle, vehicle, estimates)
    load_vehicle(file)
    write_json(options.out / "align.json", _report(options, vehicle, found, records, loop))
    console.print(_parameters(vehicle, found))
    console.print(_errors(found))
    for reason in (*map(refused, found.refusals), lag_refused(found.response)):
        if reason:
            console.print(reason, style="dim")
    if found.after["roll_rate"] + found.after["pitch_rate"] > found.before["roll_rate"] + found.before["pitch_rate"]:
        console.print("The error of roll and pitch rate did not fall: keep the file that you have.", style="bold")
    if found.early:
        console.print(
            f"The response seemed to come {1e3 * found.early:.0f} ms before the command; the delay is held at none. "
            "The vehicle is quicker than motor_time_constant and rate loop of the file allow.",
            style="bold",
        )
    if abs(found.thrust - 1) > THRUST:
        console.print(
            f"The vehicle gave {found.thrust:.2f} of the simulator's thrust: weigh it, and identify its thrust "
            "(e2efly identify flight LOG --mass KG SIGMA).",
            style="bold",
        )
    plots = plot_alignment(options.out, found, records)
    if loop is not None:
        console.print(_loop_table(loop))
        plots.append(options.out / "policy.png")
        plot_closed_loop(plots[-1], loop)
    console.print(f"Vehicle: {file}. Report: {options.out / 'align.json'}. Plots: {', '.join(p.name for p in plots)}")
    console.print(f"Took {time.perf_counter() - began:.0f} s.", style="dim")
    return 0


def _closed_loop(
    options: Align, console: Terminal, records: "list[Record]", vehicle: Vehicle, aligned: Vehicle, found: "Alignment"
) -> "ClosedLoop | None":
    """The simulator's flight by the policy of the first log in which one flew. None: none did, or its file is gone.

    Raises:
        ValueError: naming --policy, if no log is of this policy's flight, or if the simulator cannot fly it.
    """
    from e2efly.logs.flight_log import read_log
    from e2efly.logs.readers import OURS
    from e2efly.policy.zoo import policy_file
    from e2efly.validation.closed_loop import closed_loop, policy_of

    given = None if options.policy is None else policy_file(options.policy, options.vehicle)
    logs = [(read_log(record.path), record) for record in records if record.kind == OURS]
    flew = [(log, record, policy) for log, record in logs if (policy := policy_of(log, given)) is not None]
    if not flew and options.policy is not None:
        raise ValueError(f"--policy is {str(options.policy)!r}; accepted: the policy that flew in one of the logs")
    if not flew:
        return None
    log, record, policy = flew[0]
    try:
        return closed_loop(log, record, *policy, {"before": vehicle, "aligned": aligned}, found.pose_delay)
    except ValueError as error:
        if options.policy is not None:
            raise
        console.print(f"The policy's closed loop is left out: {error}", style="bold", markup=False)
        return None


def pose_delay_of(given: float | None, records: "list[Record]") -> tuple[float, str, bool]:
    """The age of the poses when the vehicle flew by them, s; the origin of this value, in words; whether it is known.

    In our logs this age has two parts: the delay behind the gyroscope, which the pose source does not tell, and the age
    of the poses when they are used. The delay of the gyroscope itself cancels, because it appears with the opposite
    sign in the delay from command to response.

    Args:
        given: the value from the user, s.
        records: the flights, checked, with the poses on the gyroscope's clock.
    """
    if given is not None:
        return given, f"The poses are taken to be {1e3 * given:.0f} ms late (--pose-delay).", True
    known = [max(record.pose_age, 0.0) for record in records if record.pose_age is not None]
    if known:
        late = float(np.median(known))
        told = f"The poses are {1e3 * late:.0f} ms late by the log: behind its gyroscope, and until their use."
        return late, told, True
    told = (
        "The log does not say how late the poses were when they were flown by: latency becomes the delay from command "
        "to response alone. Add the poses' by --pose-delay."
    )
    return 0.0, told, False


def _rows(vehicle: Vehicle, found: "Alignment") -> list[dict[str, Any]]:
    """Parameters before and after the fit."""
    own, late, sigma = found.delay
    rows: list[dict[str, Any]] = []
    if found.response is not None:
        value, off = found.response.gain
        rows.append({"name": "thrust over commanded", "unit": "1", "before": 1.0, "after": value, "sigma": off})
    if np.isfinite(late):
        delay = f"delay from command to {'setpoint' if found.measured else 'response'}"
        rows.append({"name": delay, "unit": "s", "before": own, "after": late, "sigma": sigma})
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


def _report(
    options: Align, vehicle: Vehicle, found: "Alignment", records: "list[Record]", loop: "ClosedLoop | None"
) -> dict[str, Any]:
    from e2efly.alignment.alignment import lag_refused, refused
    from e2efly.alignment.replay import SIGNALS
    from e2efly.alignment.windows import STEP
    from e2efly.validation.closed_loop import SIGNALS as SIGNALS_OF_LOOP

    windows, told = found.found.windows.some(found.found.held_out), found.response
    return {
        "vehicle": options.vehicle,
        "logs": [{"file": str(r.path), "seconds": r.duration, "notes": list(r.notes)} for r in records],
        "pose_delay_s": found.pose_delay,
        "parameters": _rows(vehicle, found),
        "thrust_over_simulated": found.thrust if np.isfinite(found.thrust) else None,
        "delay_from": "setpoints" if found.measured else "response",
        "thrust_response": None
        if told is None
        else {
            name: {"value": value, "sigma": sigma, "unit": unit}
            for name, (value, sigma), unit in (
                ("gain", told.gain, "1"),
                ("time_constant", told.lag, "s"),
                ("delay", told.delay, "s"),
            )
        },
        "policy": None
        if loop is None
        else {
            "file": str(loop.policy),
            "task": loop.task,
            "compared_s": loop.compared,
            "rms_difference": {
                stream: {"unit": unit, **{name: loop.difference(name, stream) for name in loop.simulated}}
                for stream, unit in SIGNALS_OF_LOOP.items()
            },
        },
        "refused": [*map(refused, found.refusals), *filter(None, [lag_refused(told)])],
        "held_out": {
            "seconds": windows.count * windows.steps * STEP,
            "length_s": windows.steps * STEP,
            "rms": {
                name: {"unit": SIGNALS[name], "before": before, "after": found.after[name]}
                for name, before in found.before.items()
            },
        },
    }


def _parameters(vehicle: Vehicle, found: "Alignment") -> Table:
    table = headed("parameter", "before", "aligned", "sigma")
    for row in _rows(vehicle, found):
        factor, unit = (1e3, "ms") if row["unit"] == "s" else (1.0, row["unit"])
        told = [f"{factor * row[key]:.{digits}g} {unit}" for key, digits in (("before", 4), ("after", 4), ("sigma", 2))]
        table.add_row(row["name"], *told)
    return table


def _loop_table(loop: "ClosedLoop") -> Table:
    from e2efly.validation.closed_loop import SIGNALS

    title = f"{loop.task}, closed loop over the first {loop.compared:.1f} s: simulator and flight differ by (rms)"
    table = headed(title, "before", "aligned")
    for stream, unit in SIGNALS.items():
        told = [f"{loop.difference(name, stream):.3g} {unit}" for name in loop.simulated]
        table.add_row(stream.replace("_", " "), *told)
    return table


def _errors(found: "Alignment") -> Table:
    from e2efly.alignment.replay import SIGNALS

    table = headed("error where the fit did not look (rms)", "before", "aligned")
    for name, before in found.before.items():
        told = [f"{value:.3g} {SIGNALS[name]}" for value in (before, found.after[name])]
        table.add_row(name.replace("_", " "), *told)
    return table
