"""Tuning a policy to a vehicle whose parameters are hidden and far from its file: fly, tune, fly, stress.

    python benchmarks/tune.py [--vehicles 20] [--vehicle vis_r] [--tasks race hover] [--first 0] [--truth]

Each hidden body is off the file by mass +25 %, thrust -20 %, inertia x1.5, motor lag x1.6, delay +30 ms and drag x2,
each drawn between a half and all of that. MuJoCo flies it for 30 s by a flight controller that believes in the file;
`e2efly tune` makes a policy of the sensors' log and flies it in the stress about the identified vehicle; MuJoCo flies
that policy on the hidden body, whose flight controller now believes in the identified file. Beside it: the zoo's policy
on the same body, and with `--truth` a policy trained in the same way on a file that has the truth.
"""

import dataclasses
import json
import subprocess
import sys
import tempfile
import time
from itertools import product
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


def one(base: str, task: str, seed: int, truth: bool, folder: Path) -> dict[str, Any]:
    """All of it for one hidden body."""
    vehicle = load_vehicle(base)
    hidden = far(vehicle, seed)
    body, file, log = dataclasses.replace(vehicle, **hidden), folder / "truth.toml", folder / "flight.csv"
    sure = {name: Estimate(name, np.asarray(x, float), np.abs(x) * EXACT, "hidden") for name, x in hidden.items()}
    write_vehicle(file, base, vehicle, sure)
    plant = find_plant("mujoco")(vehicle)
    plant.meet(body)
    sag = np.random.default_rng(seed).uniform(0, 0.08)
    write_csv(sensed(fly_excitation(plant, vehicle, body.latency, sag=sag), Sensors(), seed), log)
    weighed, tuned = ("--mass", str(body.mass), str(body.mass * EXACT)), folder / "tuned"
    seconds = command("tune", str(log), "--task", task, "--vehicle", base, *weighed, "--out", str(tuned))
    rows = json.loads((tuned / "stress.json").read_text())["stress"]
    found: dict[str, Any] = {
        "task": task,
        "seed": seed,
        "thrust_to_weight": body.thrust_to_weight,
        "seconds": seconds,
        "parts": json.loads((tuned / "tuned.json").read_text())["seconds"],
        "steps": json.loads((tuned / "run" / "summary.json").read_text())["env_steps"],
        "stress": {row: min(told["success"] for told in criteria.values()) for row, criteria in rows.items()},
    }
    policies = {"zoo": task, "tuned": str(tuned / "run")}
    if truth:
        out = folder / "true"
        command("train", task, "--vehicle", str(file), "--preset", "identified", "--out", str(out), "--no-plots")
        policies["truth"] = str(out)
    for name, policy in policies.items():
        found[name] = dict(zip(("success", "time"), flown(policy, file), strict=True))
    return found


def summed(task: str, every: list[dict[str, Any]]) -> dict[str, str]:
    """The row of a task in the table. Of several bodies: means, and the worst of each row of the stress."""

    def mean(name: str) -> str:
        success, lap = (np.array([found[name][key] for found in every]) for key in ("success", "time"))
        return f"{100 * success.mean():.0f} %, {np.nanmean(lap):.2f} s" if np.isfinite(lap).any() else "0 %"

    worst = {row: min(found["stress"][row] for found in every) for row in every[0]["stress"]}
    told = sorted(worst.items(), key=lambda row: row[1])[:3]
    parts = {part: np.mean([found["parts"][part] for found in every]) for part in every[0]["parts"]}
    return {
        "task": task,
        "bodies": str(len(every)),
        "the zoo's policy": mean("zoo"),
        "tuned": mean("tuned"),
        **({"trained on the truth": mean("truth")} if "truth" in every[0] else {}),
        "worst rows of the stress": ", ".join(f"{row} {100 * success:.1f} %" for row, success in told),
        "environment steps": f"{every[0]['steps'] / 1e6:.2f} M",
        "seconds": ", ".join(f"{part} {s:.0f}" for part, s in parts.items()),
    }


def main() -> None:
    """Tune for all of them, print a table, write JSON."""
    options = arguments(__doc__ or "", vehicles=20, vehicle="vis_r", tasks=["race", "hover"], first=0, truth=False)
    every: dict[str, list[dict[str, Any]]] = {task: [] for task in options.tasks}
    for task, seed in product(options.tasks, range(options.first, options.first + options.vehicles)):
        with tempfile.TemporaryDirectory() as folder:
            every[task].append(one(options.vehicle, task, seed, options.truth, Path(folder)))
        print(every[task][-1], flush=True)
    rows = [summed(task, found) for task, found in every.items()]
    write("tune", options.json, {"table": rows, "vehicles": [each for found in every.values() for each in found]})
    print(table(rows))


if __name__ == "__main__":
    main()
