"""Identification of vehicles whose parameters are hidden, from logs of a flight with noise, delay, gaps and sag.

    python benchmarks/identify.py [--vehicles 100] [--first 0] [--vehicle vis_r]

Each vehicle is drawn about the file (mass 20 %, thrust 12 %, inertia 30 % an axis, motor lag 40 %, drag 50 %, torque
ratio 20 %, rate gain 30 %, delay 20 to 80 ms, sag up to 8 %), flown for 30 s in MuJoCo by a flight controller that
believes in the file, and identified from the log of its sensors (`e2efly.validation.excitation`). Its mass is weighed.
`--first` is the seed of the first vehicle.
"""

import dataclasses
import time
from typing import Any

import numpy as np
from common import arguments, table, write

from e2efly.device import prepare
from e2efly.identification.flight import identify
from e2efly.validation.excitation import Sensors, fly_excitation, sensed
from e2efly.validation.plants import find_plant
from e2efly.vehicles import Vehicle, load_vehicle

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
    changed["rotor_thrust_max"] = vehicle.rotor_thrust_max * changed["thrust_map"][0] / vehicle.thrust_map[0]
    changed = {k: x if np.ndim(x) else float(x) for k, x in changed.items()}
    return dataclasses.replace(vehicle, **changed, latency=float(rng.uniform(0.02, 0.08)))


def one(vehicle: Vehicle, seed: int) -> dict[str, tuple[float, float]]:
    """By parameter: its error (relative, or s) and by how many standard deviations it is off."""
    rng = np.random.default_rng(seed)
    body = hidden(vehicle, rng)
    plant = find_plant("mujoco")(vehicle)
    plant.meet(body)
    record = sensed(fly_excitation(plant, vehicle, body.latency, sag=rng.uniform(0, 0.08)), Sensors(), seed)
    weighed = dataclasses.replace(vehicle, mass=body.mass)
    found = identify(weighed, [record], believed=vehicle)
    values = {e.name: (e.value, e.sigma) for e in found.estimates}
    out: dict[str, tuple[float, float]] = {}

    def told(label: str, error: float, sigma: float) -> None:
        out[label] = error, error / sigma

    for name, label in (
        ("thrust_map", "thrust over mass"), ("inertia", "inertia over torque"), ("torque_ratio", "torque ratio"),
        ("motor_time_constant", "motor lag"), ("rate_gain", "rate gain"), ("latency", "delay"),
    ):  # fmt: skip
        if name not in values:
            continue
        truth = np.atleast_1d(np.asarray(getattr(body, name), float))
        value, sigma = (np.atleast_1d(x) for x in values[name])
        for i in range(1 if name == "thrust_map" else truth.size):
            if np.isfinite(value[i]):
                scale = 1.0 if name in ("latency", "motor_time_constant") else truth[i]
                axis = f" {'xyz'[i]}" if truth.size == 3 and name != "thrust_map" else ""
                told(label + axis, float((value[i] - truth[i]) / scale), float(sigma[i] / abs(scale)))
    truth = body.drag_linear * AIR + body.drag_quadratic * AIR**2
    for axis, value, sigma, true in zip("xyz", *found.drag_at(AIR), truth, strict=True):
        told(f"drag at {AIR:g} m/s, {axis}", float(value / true - 1), float(sigma / true))
    return out


def main() -> None:
    """Identify all of them, print a table, write JSON."""
    options = arguments(__doc__ or "", vehicles=100, first=0, vehicle="vis_r")
    prepare("cpu")
    vehicle, began, every = load_vehicle(options.vehicle), time.perf_counter(), []
    for seed in range(options.first, options.first + options.vehicles):
        every.append(one(vehicle, seed))
        if len(every) % 10 == 0:
            print(len(every), f"{time.perf_counter() - began:.0f} s", flush=True)
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
    seconds = (time.perf_counter() - began) / len(every)
    write("identify", options.json, {"table": rows, "first": options.first, "seconds_each": seconds, "vehicles": every})
    print(table(rows))
    print(f"{seconds:.1f} s a vehicle, flight and fit")


if __name__ == "__main__":
    main()
