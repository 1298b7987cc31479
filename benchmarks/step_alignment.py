"""Alignment of vehicles whose parameters are hidden, by a flight of steps as a user flies it, against the truth.

    python benchmarks/step_alignment.py [--plant mujoco|betaflight] [--vehicles 20] [--first 0] [--vehicle vis_r]

The vehicles are drawn as in benchmarks/identify.py. `e2efly fly steps` flies each, and `e2efly align` aligns the file
with the log. In MuJoCo, the flight controller is a rate loop of first order that believes in the file, and the log has
the noise of `e2efly.validation.plant_excitation`; the delay, the gain of each axis and the motor lag are known exactly.
Behind the real firmware (in virtual time; by the bridge's own log, and with the blackbox laid over it), the delay is
known by the rig's clock: the age of the poses, and the time from a command to the setpoint of the blackbox. The
firmware has P, I and D, and no gain.

Seeds from 900 on were for tuning; the published figures are of seeds from 0 on. A script that was stopped goes on where
it was.
"""

import dataclasses
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, measured, table
from identify import ROOM, hidden
from tests.validation.firmware_excitation import fly_excited

from e2efly.alignment.alignment import Alignment, align
from e2efly.alignment.checks import checked
from e2efly.commands.align import pose_delay_of
from e2efly.control.step_schedule import Steps
from e2efly.flight.excitation import StepsOptions
from e2efly.logs.blackbox_merge import setpoint_delay, with_blackboxes
from e2efly.logs.readers import read_flights
from e2efly.logs.telemetry import Telemetry
from e2efly.simulation.device import prepare
from e2efly.validation import firmware_program
from e2efly.validation.bridge_session import rehearsal_settings
from e2efly.validation.plant_excitation import Sensors, fly_excitation, sensed
from e2efly.validation.plants import find_plant
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

DELAY_MS, GAIN_SHARE = 2.0, 0.05
"""Within which delay and gains are to be found."""


def in_mujoco(vehicle: Vehicle, seed: int) -> dict[str, Any]:
    """What was found, and the truth."""
    body = hidden(vehicle, np.random.default_rng(seed))
    plant = find_plant("mujoco")(vehicle)  # type: ignore[call-arg]
    plant.meet(body)
    options = StepsOptions()
    steps = Steps(options.rate, options.thrust, options.length, options.count)
    record = sensed(fly_excitation(plant, vehicle, body.latency, steps=steps), Sensors(pose_delay=0.0), seed)
    found = align(vehicle, [record])
    lift = float(body.thrust_map[0] / vehicle.thrust_map[0])
    gain = body.rate_gain * vehicle.inertia / body.inertia * lift
    gain[2] *= body.torque_ratio / vehicle.torque_ratio
    truth = {"delay_s": body.latency, "rate_gain": gain.tolist(), "thrust": lift * vehicle.mass / body.mass}
    return told(found, body, truth, found.delay[1])


def through_firmware(vehicle: Vehicle, seed: int) -> dict[str, Any]:
    """What was found from the bridge's log alone and with the blackbox, and the truth by the rig's clock."""
    body = hidden(vehicle, np.random.default_rng(seed))
    settings = dataclasses.replace(rehearsal_settings(1.5), fence=ROOM)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.mcap"
        with Telemetry(path) as log:
            flight = fly_excited(
                firmware_program.chosen(), vehicle, body, settings, options=StepsOptions(), log=log,
                folder=Path(folder), blackbox=True, seed=seed,
            )  # fmt: skip
        if not flight.complete or flight.blackbox is None:
            return {"ended_early": str(flight.flown.changes)}
        (exact,) = with_blackboxes([flight.truth, *read_flights(flight.blackbox)])
        link, age = setpoint_delay(exact), flight.truth.pose_age
        assert link is not None
        assert age is not None
        out = {}
        for label, logs in (("alone", [path]), ("with_blackbox", [path, flight.blackbox])):
            records = checked(with_blackboxes([r for each in logs for r in read_flights(each)]), vehicle)
            found = align(vehicle, records, pose_delay_of(None, records)[0])
            delay = found.delay[1] + found.pose_delay
            out[label] = told(found, body, {"delay_s": link + age, "thrust": 1.0}, delay)
    return out


def told(found: Alignment, body: Vehicle, truth: dict[str, Any], delay: float) -> dict[str, Any]:
    """Truth, what was found, its standard deviation, and the errors that are left."""
    values = {e.name: e for e in found.estimates}
    assert found.response is not None
    out: dict[str, Any] = {
        "truth": {**truth, "motor_lag_s": float(body.motor_time_constant)},
        "found": {"delay_s": delay, "thrust": found.response.gain[0], "motor_lag_s": found.response.lag[0]},
        "sigma": {
            "delay_s": found.delay[2], "thrust": found.response.gain[1], "motor_lag_s": found.response.lag[1],
        },
        "lag_refused": found.response.reason,
        "held_out": {"before": found.before, "aligned": found.after},
    }  # fmt: skip
    if "rate_gain" in truth:
        out["found"]["rate_gain"] = values["rate_gain"].value.tolist()
        out["sigma"]["rate_gain"] = values["rate_gain"].sigma.tolist()
    return out


def rows_of(runs: list[dict[str, Any]]) -> list[dict[str, str]]:
    """A row for each plant and quantity."""
    rows, each = [], list[dict[str, Any]]()
    for run in runs:
        parts = {name: run[key] for key, name in LOGS.items() if key in run} or {run["plant"]: run}
        each += [{**part, "plant": name} for name, part in parts.items() if "found" in part]
    for plant in dict.fromkeys(run["plant"] for run in each):
        own = [run for run in each if run["plant"] == plant]
        for name, label, unit, scale in (
            ("delay_s", "delay", "ms", 1e3), ("rate_gain", "rate gain", "%", 100.0),
            ("motor_lag_s", "motor lag", "ms", 1e3), ("thrust", "thrust over commanded", "%", 100.0),
        ):  # fmt: skip
            told = [run for run in own if name in run["truth"]]
            if not told:
                continue
            true, value, sigma = (
                np.array([np.atleast_1d(run[part][name]) for run in told]).ravel()
                for part in ("truth", "found", "sigma")
            )
            off = scale * np.abs(value - true) / (1.0 if unit == "ms" else true)
            limit = {"delay_s": DELAY_MS, "rate_gain": 100 * GAIN_SHARE}.get(name)
            rows.append({
                "plant": plant, "vehicles": str(len(told)), "quantity": label,
                "median error": f"{np.median(off):.2g} {unit}", "largest": f"{off.max():.2g} {unit}",
                "within": "" if limit is None else f"{100 * np.mean(off <= limit):.0f} % within {limit:g} {unit}",
                "truth within 2 sigma": f"{100 * np.mean(np.abs(value - true) <= 2 * sigma):.0f} %",
            })  # fmt: skip
        for signal, unit in (("roll_rate", "rad/s"), ("pitch_rate", "rad/s"), ("yaw_rate", "rad/s")):
            before, after = (np.median([run["held_out"][part][signal] for run in own]) for part in HELD_OUT)
            rows.append({
                "plant": plant, "vehicles": str(len(own)), "quantity": f"{signal.replace('_', ' ')}, held out",
                "median error": f"{before:.2g} before, {after:.2g} {unit} aligned", "largest": "", "within": "",
                "truth within 2 sigma": "",
            })  # fmt: skip
    return rows


LOGS = {"alone": "firmware, bridge's log", "with_blackbox": "firmware, with blackbox"}
HELD_OUT = ("before", "aligned")


def main() -> None:
    """Align all of them, print a table, write JSON."""
    options = arguments(__doc__ or "", vehicles=20, first=0, vehicle="vis_r", plant="mujoco")
    prepare("cpu")
    vehicle = load_vehicle(options.vehicle)
    fly = {"mujoco": in_mujoco, "betaflight": through_firmware}[options.plant]
    last: list[dict[str, str]] = []

    def shown(runs: list[dict[str, Any]]) -> list[dict[str, str]]:
        last[:] = rows_of(runs)
        return last

    for seed in range(options.first, options.first + options.vehicles):
        about = {"plant": options.plant, "vehicle": options.vehicle, "seed": seed}
        measured("step_alignment", options.json, about, lambda seed=seed: fly(vehicle, seed), shown)
    print(table(last))


if __name__ == "__main__":
    main()
