"""Whole flights through the real Betaflight firmware: take-off, hover, policy, landing, nobody helping.

    python benchmarks/firmware_flights.py [--runs FOLDER] [--flights 5] [--tasks hover land track race] [--json FILE]

FOLDER holds a run directory a task, as `e2efly train TASK --out FOLDER/TASK` writes them; what is missing is trained.
Time is virtual: the figures do not depend on the machine. The firmware is built where need be.
"""

import math
import subprocess
import sys
import time
from pathlib import Path

from common import arguments, table, write
from rich.console import Console

from e2efly.commands.rehearsals import flight_row, fly_whole
from e2efly.deploy.policy import load_policy
from e2efly.device import compute_at_once
from e2efly.vehicles import load_vehicle


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(__doc__ or "", runs="runs/firmware", flights=5, tasks=["hover", "land", "track", "race"])
    compute_at_once()
    rows, flights = [], {}
    for task in args.tasks:
        run = Path(args.runs) / task
        if not (run / "policy.onnx").is_file():
            train = [sys.executable, "-m", "e2efly", "train", task, "--out", str(run), "--no-plots"]
            subprocess.run(train, check=True)
        policy = load_policy(run / "policy.onnx")
        began = time.perf_counter()
        flown = fly_whole(policy, load_vehicle(policy.contract.vehicle), args.flights, Console(quiet=True))
        took = time.perf_counter() - began
        flights[task] = [flight_row(flight) for flight in flown]
        laps = f"{min(f.laps for f in flown):g} laps, {_worst([f.lap_time for f in flown], 1, 's')} each"
        rows.append({
            "task": task,
            "complete": f"{sum(f.complete for f in flown)} of {len(flown)}",
            "hover error, worst": f"{100 * max(f.hover_error for f in flown):.1f} cm",
            "policy error, worst": _worst([f.policy_error for f in flown], 100, "cm"),
            "race, worst": laps if task == "race" else "",
            "touch, worst": _worst([f.touch[0] for f in flown], 100, "cm") + " "
            + _worst([f.touch[1] for f in flown], 1, "m/s"),
            "top speed": f"{max(f.top_speed for f in flown):.1f} m/s",
            "real time": f"{took:.0f} s",
        })  # fmt: skip
        print(f"{task}: {rows[-1]['complete']} complete in {took:.0f} s", flush=True)
        for flight in flown:
            if not flight.complete:
                print(f"  not complete: {flight.modes} {flight.reasons}", flush=True)
    print(table(rows))
    write("firmware_flights", args.json, {"table": rows, "flights": flights})


def _worst(values: list[float], scale: float, unit: str) -> str:
    known = [value for value in values if not math.isnan(value)]
    return f"{scale * max(known):.1f} {unit}" if known else ""


if __name__ == "__main__":
    main()
