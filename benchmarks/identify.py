"""Identification of vehicles whose parameters are hidden, from logs of a flight with noise, delay, gaps and sag.

    python benchmarks/identify.py [--vehicles 100] [--first 0] [--vehicle vis_r] [--plant mujoco]

Each vehicle is drawn about the file (mass 20 %, thrust 12 %, inertia 30 % an axis, motor lag 40 %, drag 50 %, torque
ratio 20 %, rate gain 30 %, delay 20 to 80 ms, sag up to 8 %), flown for 30 s in MuJoCo by a flight controller that
believes in the file, and identified from the log of its sensors (`e2efly.validation.plant_excitation`). Its mass is
weighed.

`--plant betaflight` flies them by the bridge's excitation mode through the real firmware
(`tests.validation.firmware_excitation`), and identifies each twice: from the flight log alone,
and with the firmware's blackbox laid over it. The delay is compared with the one on the rig's own clock: the age of
the poses, and the time from a command to the setpoint.
`--first` is the seed of the first vehicle. A flight that ends before its excitation does is named in the JSON file,
and has no errors to count.
"""

import dataclasses
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, table, write
from tests.validation.firmware_excitation import fly_excited

from e2efly.alignment.checks import checked
from e2efly.alignment.identification import Found, identify, whole_covariance
from e2efly.flight.settings import Fence
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

INTERVAL = 1.645
"""Standard deviations of the interval that holds 90 %."""
AIR = 5.0
"""At which speed drag is compared, m/s."""
WIDTHS = {
    "mass": 0.2, "inertia": 0.3, "thrust_map": 0.12, "motor_time_constant": 0.4, "drag_linear": 0.5,
    "drag_quadratic": 0.5, "torque_ratio": 0.2, "rate_gain": 0.3,
}  # fmt: skip


def hidden(vehicle: Vehicle, rng: np.random.Generator) -> Vehicle:
    """One that may fly behind the file."""
    changed: dict[str, Any] = {}
    for name, width in WIDTHS.items():
        value = np.asarray(getattr(vehicle, name), float)
        shape = () if name == "thrust_map" else value.shape
        changed[name] = value * (1 + width * rng.uniform(-1, 1, shape))
        while name == "inertia" and 2 * changed[name].max() > changed[name].sum():  # of no rigid body
            changed[name] = value * (1 + width * rng.uniform(-1, 1, shape))
    changed["rotor_thrust_max"] = vehicle.rotor_thrust_max * changed["thrust_map"][0] / vehicle.thrust_map[0]
    changed = {k: x if np.ndim(x) else float(x) for k, x in changed.items()}
    return dataclasses.replace(vehicle, **changed, latency=float(rng.uniform(0.02, 0.08)))


class EndedEarlyError(Exception):
    """The bridge left the excitation before its end: the message says the vehicle and its changes of mode."""


Errors = dict[str, tuple[float, float]]
"""By parameter: its error (relative, or s) and by how many standard deviations it is off."""
ROOM = Fence(low=(-6.0, -6.0, 0.2), high=(6.0, 6.0, 5.0), speed=8.0)
"""In which the firmware's flights stay."""


def through_firmware(vehicle: Vehicle, seed: int) -> dict[str, Errors]:
    """By what it is identified from."""
    rng = np.random.default_rng(seed)
    body = hidden(vehicle, rng)
    settings = dataclasses.replace(rehearsal_settings(1.5), fence=ROOM)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.mcap"
        with Telemetry(path) as log:
            flight = fly_excited(
                firmware_program.chosen(), vehicle, body, settings, log=log, folder=Path(folder), blackbox=True,
                sag=rng.uniform(0, 0.08), seed=seed,
            )  # fmt: skip
        if not flight.complete or flight.blackbox is None:
            raise EndedEarlyError(f"vehicle {seed}: {flight.flown.changes}")
        (exact,) = with_blackboxes([flight.truth, *read_flights(flight.blackbox)])
        link, age = setpoint_delay(exact), flight.truth.pose_age
        assert link is not None
        assert age is not None
        body = dataclasses.replace(body, latency=link + age)
        weighed, out = dataclasses.replace(vehicle, mass=body.mass), {}
        for label, logs in (("flight log", [path]), ("with blackbox", [path, flight.blackbox])):
            records = checked(with_blackboxes([r for p in logs for r in read_flights(p)]), weighed)
            out[label] = errors(body, identify(weighed, records, believed=vehicle), by_firmware=True)
    return out


def one(vehicle: Vehicle, seed: int) -> Errors:
    """Flown in MuJoCo."""
    rng = np.random.default_rng(seed)
    body = hidden(vehicle, rng)
    plant = find_plant("mujoco")(vehicle)
    plant.meet(body)
    record = sensed(fly_excitation(plant, vehicle, body.latency, sag=rng.uniform(0, 0.08)), Sensors(), seed)
    weighed = dataclasses.replace(vehicle, mass=body.mass)
    return errors(body, identify(weighed, [record], believed=vehicle))


def errors(body: Vehicle, found: Found, by_firmware: bool = False) -> Errors:
    """What was found against what flew. The firmware has no rate gain."""
    values = {e.name: (e.value, e.sigma) for e in found.estimates}
    out: Errors = {}

    def told(label: str, error: float, sigma: float) -> None:
        out[label] = error, error / sigma

    for name, label in (
        ("thrust_map", "thrust over mass"), ("inertia", "inertia over torque"), ("torque_ratio", "torque ratio"),
        ("motor_time_constant", "motor lag"), ("rate_gain", "rate gain"), ("latency", "delay"),
    ):  # fmt: skip
        if name not in values or (by_firmware and name == "rate_gain"):
            continue
        truth = np.atleast_1d(np.asarray(getattr(body, name), float))
        value, sigma = (np.atleast_1d(x) for x in values[name])
        for i in range(1 if name == "thrust_map" else truth.size):
            if np.isfinite(value[i]):
                scale = 1.0 if name in ("latency", "motor_time_constant") else truth[i]
                axis = f" {'xyz'[i]}" if truth.size == 3 and name != "thrust_map" else ""
                told(label + axis, float((value[i] - truth[i]) / scale), float(sigma[i] / abs(scale)))
    truth = body.drag_linear * AIR + body.drag_quadratic * AIR**2
    for axis, value, sigma, true in zip("xyz", *drag_at(found, AIR), truth, strict=True):
        told(f"drag at {AIR:g} m/s, {axis}", float(value / true - 1), float(sigma / true))
    return out


def drag_at(found: Found, speed: float) -> tuple[np.ndarray, np.ndarray]:
    """Drag along each axis at a speed, m/s, and its standard deviation, (3,) N.

    A flight determines the drag at its own speeds better than the division into a linear and a quadratic part.
    """
    covariance = whole_covariance(found.fit, found.sigma)
    value, sigma = np.zeros(3), np.zeros(3)
    for axis in range(3):
        slope = np.zeros(len(found.p))
        for power, name in ((1, "drag_linear"), (2, "drag_quadratic")):
            part = float(getattr(found.model.base, name)[axis]) * speed**power
            for i, unknown in enumerate(found.model.unknowns):
                if unknown.field == name and axis in unknown.entries:
                    part *= float(np.exp(found.p[i]))
                    slope[i] = part
            value[axis] += part
        sigma[axis] = np.sqrt(slope @ covariance @ slope)
    return value, sigma


def main() -> None:
    """Identify all of them, print a table, write JSON."""
    options = arguments(__doc__ or "", vehicles=100, first=0, vehicle="vis_r", plant="mujoco")
    prepare("cpu")
    vehicle, began = load_vehicle(options.vehicle), time.perf_counter()
    every: dict[str, list[Errors]] = {}
    ended: list[str] = []
    for seed in range(options.first, options.first + options.vehicles):
        try:
            found = through_firmware(vehicle, seed) if options.plant == "betaflight" else {"": one(vehicle, seed)}
        except EndedEarlyError as early:
            ended.append(str(early))
            print(early, flush=True)
            continue
        for label, errors_of in found.items():
            every.setdefault(label, []).append(errors_of)
        if (seed + 1 - options.first) % 10 == 0 or options.plant == "betaflight":
            print(seed + 1 - options.first, f"{time.perf_counter() - began:.0f} s", flush=True)
    tables = {label: rows_of(found) for label, found in every.items()}
    seconds = (time.perf_counter() - began) / options.vehicles
    name = "identify" if options.plant == "mujoco" else f"identify_{options.plant}"
    told = {"first": options.first, "seconds_each": seconds, "ended_early": ended}
    if options.plant == "mujoco":
        write(name, options.json, {"table": tables[""], **told, "vehicles": every[""]})
    else:
        both = [{"from": label, **row} for label, rows in tables.items() for row in rows]
        write(name, options.json, {"table": both, **told, "vehicles": every})
    for label, rows in tables.items():
        print(label, table(rows), sep="\n")
    print(f"{seconds:.1f} s a vehicle, flight and fit")


def rows_of(every: list[Errors]) -> list[dict[str, str]]:
    """A row for each parameter, and one for all."""
    rows = []
    for label in dict.fromkeys(name for found in every for name in found):
        of = np.array([found[label] for found in every if label in found])
        in_time = label in ("delay", "motor lag")
        shown = 1000 * of[:, 0] if in_time else 100 * of[:, 0]
        unit = "ms" if in_time else "%"
        rows.append({
            "parameter": label,
            "identified": f"{len(of)} of {len(every)}",
            "median error": f"{np.median(np.abs(shown)):.2g} {unit}",
            "90 % below": f"{np.quantile(np.abs(shown), 0.9):.2g} {unit}",
            "truth in the 90 % interval": f"{100 * np.mean(np.abs(of[:, 1]) < INTERVAL):.0f} %",
        })  # fmt: skip
    inside = np.concatenate([[abs(z) < INTERVAL for _, z in found.values()] for found in every])
    last = {"parameter": "all", "identified": "", "median error": "", "90 % below": ""}
    rows.append(last | {"truth in the 90 % interval": f"{100 * np.mean(inside):.0f} %"})
    return rows


if __name__ == "__main__":
    main()
