"""Identification of vehicles whose parameters are hidden, from logs of a flight with noise, delay, gaps and sag.

    python benchmarks/identify.py [--vehicles 100] [--first 0] [--vehicle vis_r] [--plant mujoco] [--plain]
        [--bare]

Each vehicle is drawn about the file (mass 20 %, thrust 12 %, inertia 30 % an axis, motor lag 40 %, drag 50 %, torque
ratio 20 %, rate gain 30 %, delay 20 to 80 ms, sag up to 8 %), flown for 30 s in MuJoCo by a flight controller that
believes in the file, and identified from the log of its sensors (`e2efly.validation.plant_excitation`). Its mass is
weighed.

`--plant betaflight` flies them by the bridge's excitation mode through the real firmware
(`tests.validation.firmware_excitation`), and identifies each twice: from the flight log alone,
and with the firmware's blackbox laid over it. The delay is compared with the one on the rig's own clock: the age of
the poses, and the time from a command to the setpoint.
`--plant structure` flies them in MuJoCo with a structure that no vehicle file tells, behind a rate loop of its own
(`benchmarks/hidden_bodies.py`). Each is identified from its whole log, with `--bare` also from motor outputs in place
of rotor speeds and commands, and from commands alone.
`--plain` hides the structure from the first fit, too: what is then off by three standard deviations wants an alarm.
`--first` is the seed of the first vehicle. A flight that ends before its excitation does, and a log that is refused,
are named in the JSON file, and have no errors to count.
"""

import dataclasses
import tempfile
import time
from pathlib import Path

import numpy as np
from common import arguments, table, write
from hidden_bodies import HiddenPlant, drawn, parameters, truths
from tests.validation.firmware_excitation import fly_excited

from e2efly.alignment.checks import checked
from e2efly.alignment.found import Found, whole_covariance
from e2efly.alignment.identification import identify
from e2efly.alignment.model import value_of
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
SILENT = 3.0
"""Standard deviations by which nothing may be wrong without an alarm."""
AIR = 5.0
"""At which speed drag is compared, m/s."""


class EndedEarlyError(Exception):
    """The bridge left the excitation before its end: the message says its changes of mode."""


ALARM, WITH, MOTORS, WITHOUT = "alarm", "with rotor speeds", "with motor outputs", "without either"
IN_UNIT = {
    "delay": (1e3, "ms"), "motor lag": (1e3, "ms"), "motor lag down": (1e3, "ms"), "gyro filter": (1e3, "ms"),
    "centre of mass": (1e3, "mm"), "product of inertia": (1e6, "kg mm2"), "integral gain": (1.0, "1/s2"),
}  # fmt: skip
"""Parameters whose error is in a unit: its factor and name. All others are relative."""
Errors = dict[str, tuple[float, float]]
"""By parameter: its error (relative, or s) and by how many standard deviations it is off."""
ROOM = Fence(low=(-6.0, -6.0, 0.2), high=(6.0, 6.0, 5.0), speed=8.0)
"""In which the firmware's flights stay."""


def through_firmware(vehicle: Vehicle, seed: int) -> dict[str, Errors]:
    """By what it is identified from."""
    rng = np.random.default_rng(seed)
    body = parameters(vehicle, rng)
    settings = dataclasses.replace(rehearsal_settings(1.5), fence=ROOM)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.mcap"
        with Telemetry(path) as log:
            flight = fly_excited(
                firmware_program.chosen(), vehicle, body, settings, log=log, folder=Path(folder), blackbox=True,
                sag=rng.uniform(0, 0.08), seed=seed,
            )  # fmt: skip
        if not flight.complete or flight.blackbox is None:
            raise EndedEarlyError(str(flight.flown.changes))
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
    body = parameters(vehicle, rng)
    plant = find_plant("mujoco")(vehicle)
    plant.meet(body)
    record = sensed(fly_excitation(plant, vehicle, body.latency, sag=rng.uniform(0, 0.08)), Sensors(), seed)
    weighed = dataclasses.replace(vehicle, mass=body.mass)
    return errors(body, identify(weighed, [record], believed=vehicle))


def structured(vehicle: Vehicle, seed: int, plain: bool, bare_too: bool) -> dict[str, Errors]:
    """A body of hidden structure, flown in MuJoCo. By what it is identified from."""
    body = drawn(vehicle, np.random.default_rng(seed))
    plant = HiddenPlant(vehicle, body, seed)
    whole = sensed(fly_excitation(plant, vehicle, body.vehicle.latency, sag=body.sag), Sensors(), seed)
    commands = {k: s for k, s in whole.streams.items() if k != "rotor_speed"}
    outputs = {k: s for k, s in commands.items() if k != "command"} | {"motor": plant.outputs()}
    bare, motors = (dataclasses.replace(whole, streams=streams) for streams in (commands, outputs))
    weighed, out = dataclasses.replace(vehicle, mass=body.vehicle.mass), {}
    for label, record in ((WITH, whole), (MOTORS, motors), (WITHOUT, bare)) if bare_too else ((WITH, whole),):
        found = identify(weighed, checked([record], weighed), believed=vehicle, plain=plain)
        out[label] = errors(truths(body, vehicle), found) | alarm(found)
    return out


def alarm(found: Found) -> Errors:
    """The largest pull of what the fit leaves over, and whether it alarms."""
    return {ALARM: (max((m.pull for m in found.misfits), default=0.0), float(any(m.alarming for m in found.misfits)))}


def errors(body: Vehicle, found: Found, by_firmware: bool = False) -> Errors:
    """What was found against what flew. The firmware has no rate gain."""
    values = {e.name: (e.value, e.sigma) for e in found.estimates}
    out: Errors = {}
    if found.model.driver == "rotor_speed":  # they tell the inertia about z over the torque ratio
        ratio = np.array([1.0, 1.0, float(found.model.base.torque_ratio / body.torque_ratio)])
        products = value_of(body, "inertia_products") * np.sqrt(ratio[[0, 0, 1]] * ratio[[1, 2, 2]])
        body = dataclasses.replace(body, inertia=body.inertia * ratio, inertia_products=products)

    def told(label: str, error: float, sigma: float) -> None:
        out[label] = error, error / sigma

    for name, label in (
        ("thrust_map", "thrust over mass"), ("inertia", "inertia over torque"), ("torque_ratio", "torque ratio"),
        ("motor_time_constant", "motor lag"), ("motor_time_constant_down", "motor lag down"),
        ("rate_gain", "rate gain"), ("rate_integral_gain", "integral gain"), ("gyro_time_constant", "gyro filter"),
        ("centre_of_mass", "centre of mass"), ("inertia_products", "product of inertia"), ("latency", "delay"),
    ):  # fmt: skip
        if name not in values or (by_firmware and name == "rate_gain"):
            continue
        truth = np.atleast_1d(np.asarray(value_of(body, name), float))
        value, sigma = (np.atleast_1d(x) for x in values[name])
        for i in range(1 if name == "thrust_map" else truth.size):
            if np.isfinite(value[i]) and np.isfinite(sigma[i]):
                scale = 1.0 if label in IN_UNIT else truth[i]
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
    options = arguments(__doc__ or "", vehicles=100, first=0, vehicle="vis_r", plant="mujoco", plain=False, bare=False)
    prepare("cpu")
    vehicle, began = load_vehicle(options.vehicle), time.perf_counter()
    every: dict[str, list[Errors]] = {}
    ended: list[str] = []
    for seed in range(options.first, options.first + options.vehicles):
        try:
            if options.plant == "structure":
                found = structured(vehicle, seed, options.plain, options.bare)
            elif options.plant == "betaflight":
                found = through_firmware(vehicle, seed)
            else:
                found = {"": one(vehicle, seed)}
        except (EndedEarlyError, ValueError) as error:
            ended.append(f"{seed}: {error}")
            print(ended[-1], flush=True)
            continue
        for label, errors_of in found.items():
            every.setdefault(label, []).append(errors_of)
        if (seed + 1 - options.first) % 10 == 0 or options.plant != "mujoco":
            print(seed + 1 - options.first, f"{time.perf_counter() - began:.0f} s", flush=True)
    tables = {label: rows_of(found) for label, found in every.items()}
    seconds = (time.perf_counter() - began) / options.vehicles
    name = "identify" if options.plant == "mujoco" else f"identify_{options.plant}{'_plain' * options.plain}"
    told = {"first": options.first, "seconds_each": seconds, "ended_or_refused": ended}
    if options.plant == "mujoco":
        write(name, options.json, {"table": tables[""], **told, "vehicles": every[""]})
    else:
        both = [{"from": label, **row} for label, rows in tables.items() for row in rows]
        write(name, options.json, {"table": both, **told, "vehicles": every})
    for label, rows in tables.items():
        print(label, table(rows), sep="\n")
    print(f"{seconds:.1f} s a vehicle, flight and fit")


def rows_of(every: list[Errors]) -> list[dict[str, str]]:
    """A row for each parameter, one for all, and one for the alarm."""
    alarms = [found.pop(ALARM) for found in (dict(found) for found in every) if ALARM in found]
    every = [{label: of for label, of in found.items() if label != ALARM} for found in every]
    rows, empty = [], {"identified": "", "median error": "", "90 % below": "", "truth in the 90 % interval": ""}
    for label in dict.fromkeys(name for found in every for name in found):
        of = np.array([found[label] for found in every if label in found])
        factor, unit = next(
            (told for name, told in IN_UNIT.items() if label in (name, f"{name} {label[-1]}")), (100.0, "%")
        )
        shown = factor * of[:, 0]
        rows.append({
            "parameter": label,
            "identified": f"{len(of)} of {len(every)}",
            "median error": f"{np.median(np.abs(shown)):.2g} {unit}",
            "90 % below": f"{np.quantile(np.abs(shown), 0.9):.2g} {unit}",
            "truth in the 90 % interval": f"{100 * np.mean(np.abs(of[:, 1]) < INTERVAL):.0f} %",
        })  # fmt: skip
    inside = np.concatenate([[abs(z) < INTERVAL for _, z in found.values()] for found in every])
    rows.append({"parameter": "all", **empty, "truth in the 90 % interval": f"{100 * np.mean(inside):.0f} %"})
    if alarms:
        rang = np.array([rang for _, rang in alarms], bool)
        wrong = np.array([any(abs(z) > SILENT for _, z in found.values()) for found in every])
        told = f"in {rang.sum()} of {len(every)}; without it {(wrong & ~rang).sum()} are off by {SILENT:g} sigma"
        rows.append({"parameter": ALARM, **empty, "identified": told})
    return rows


if __name__ == "__main__":
    main()
