"""Tuning a policy to a vehicle whose parameters are hidden and far from its file: fly, tune, fly.

    python benchmarks/tune.py [--vehicles 20] [--vehicle vis_r] [--task race] [--first 0]

Each hidden body is off the file by mass +25 %, thrust -20 %, inertia x1.5, motor lag x1.6, delay +30 ms and drag x2,
each drawn between a half and all of that. MuJoCo flies it for 30 s by a flight controller that believes in the file;
`e2efly tune` makes a policy of the sensors' log; MuJoCo flies that policy on the hidden body, whose flight controller
now believes in the identified file. Beside it: the zoo's policy on the same body, and a policy trained in the same way
on a file that has the truth.
"""

import dataclasses
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, table, write

import e2efly
from e2efly.alignment.estimates import Estimate
from e2efly.alignment.vehicle_file import write_vehicle
from e2efly.logs.csv_file import write_csv
from e2efly.validation.plant_excitation import Sensors, fly_excitation, sensed
from e2efly.validation.plants import find_plant
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

FLIGHTS = 100
"""Of each policy on its body."""
EXACT = 1e-3
"""Relative standard deviations of the file that has the truth, and of the scale."""


def far(vehicle: Vehicle, seed: int) -> dict[str, Any]:
    """What is off, by field."""
    rng = np.random.default_rng(seed)

    def off(most: float) -> float:
        return 1 + (most - 1) * float(rng.uniform(0.5, 1.0))

    thrust, drag = off(0.8), off(2.0)
    return {
        "mass": vehicle.mass * off(1.25),
        "thrust_map": vehicle.thrust_map * thrust,
        "rotor_thrust_max": vehicle.rotor_thrust_max * thrust,
        "inertia": vehicle.inertia * off(1.5),
        "motor_time_constant": vehicle.motor_time_constant * off(1.6),
        "drag_linear": vehicle.drag_linear * drag,
        "drag_quadratic": vehicle.drag_quadratic * drag,
        "latency": vehicle.latency + 0.03 * float(rng.uniform(0.5, 1.0)),
    }


def flown(policy: str, truth: Path) -> tuple[float, float]:
    """Success on the hidden body in MuJoCo, and the median time of a success, s."""
    verdicts = next(iter(e2efly.validate(policy, "mujoco", FLIGHTS, vehicle=str(truth)).criteria.values())).flown
    success = np.asarray(verdicts.success)
    return float(success.mean()), float(np.median(np.asarray(verdicts.duration)[success])) if success.any() else np.nan


def command(*words: str) -> float:
    """Run one of ours; seconds."""
    began = time.perf_counter()
    subprocess.run([sys.executable, "-m", "e2efly", *words], check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - began


def one(base: str, task: str, seed: int, folder: Path) -> dict[str, Any]:
    """All of it for one hidden body."""
    vehicle = load_vehicle(base)
    hidden = far(vehicle, seed)
    body, truth, log = dataclasses.replace(vehicle, **hidden), folder / "truth.toml", folder / "flight.csv"
    sure = {name: Estimate(name, np.asarray(x, float), np.abs(x) * EXACT, "hidden") for name, x in hidden.items()}
    write_vehicle(truth, base, vehicle, sure)
    plant = find_plant("mujoco")(vehicle)
    plant.meet(body)
    sag = np.random.default_rng(seed).uniform(0, 0.08)
    write_csv(sensed(fly_excitation(plant, vehicle, body.latency, sag=sag), Sensors(), seed), log)
    weighed = ("--mass", str(body.mass), str(body.mass * EXACT))
    seconds = command("tune", str(log), "--task", task, "--vehicle", base, *weighed, "--out", str(folder / "tuned"))
    parts = json.loads((folder / "tuned" / "tuned.json").read_text())["seconds"]
    command(
        "train", task, "--vehicle", str(truth), "--preset", "identified", "--out", str(folder / "true"), "--no-plots"
    )
    found: dict[str, Any] = {
        "seed": seed,
        "thrust_to_weight": body.thrust_to_weight,
        "seconds": seconds,
        "parts": parts,
    }
    for name, policy in (("zoo", task), ("tuned", folder / "tuned" / "run"), ("truth", folder / "true")):
        found[name] = dict(zip(("success", "time"), flown(str(policy), truth), strict=True))
    return found


def main() -> None:
    """Tune for all of them, print a table, write JSON."""
    options = arguments(__doc__ or "", vehicles=20, vehicle="vis_r", task="race", first=0)
    every = []
    for seed in range(options.first, options.first + options.vehicles):
        with tempfile.TemporaryDirectory() as folder:
            every.append(one(options.vehicle, options.task, seed, Path(folder)))
        print(every[-1], flush=True)
    rows = []
    for name, told in (("zoo", "the zoo's policy"), ("tuned", "tuned"), ("truth", "trained on the truth")):
        success, lap = (np.array([found[name][key] for found in every]) for key in ("success", "time"))
        rows.append({
            "policy": told,
            "success, mean": f"{100 * success.mean():.1f} %",
            "worst body": f"{100 * success.min():.0f} %",
            "time, median": f"{np.nanmedian(lap):.2f} s" if np.isfinite(lap).any() else "",
            "over the truth's": f"{100 * (np.nanmedian(lap / [f['truth']['time'] for f in every]) - 1):+.1f} %",
        })  # fmt: skip
    write("tune", options.json, {"table": rows, "vehicles": every})
    print(table(rows))
    print(f"{np.median([found['seconds'] for found in every]):.0f} s a vehicle, from the log to the policy")


if __name__ == "__main__":
    main()
