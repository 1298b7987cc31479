"""Whole flights of the zoo through the real Betaflight firmware: take-off, hover, policy, landing, nobody helping.

    python benchmarks/firmware_flights.py [--vehicle vis_r] [--flights 5] [--tasks hover land ...] [--json FILE]

All nine tasks; what policies by sight see is rendered at the body's true pose, in another world of the training's
each time. Time is virtual: the figures do not depend on the machine. The firmware is built where need be. Rows of tasks
that are not named stay as they are in the file.
"""

import time

from common import arguments, table, with_earlier, write
from rich.console import Console

from e2efly.commands.rehearsals import flight_row, fly_whole
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.validation.evaluation import candidate
from e2efly.vehicles.loading import load_vehicle


def main() -> None:
    """Fly, print the table, write the figures."""
    tasks = ["hover", "hover_aware", "land", "track", "gap", "race", "land_visual", "avoid", "race_clutter"]
    args = arguments(__doc__ or "", vehicle="vis_r", flights=5, tasks=tasks)
    compute_at_once()
    prepare("cpu")
    rows, flights = [], {}
    for task in args.tasks:
        policy = candidate(task, args.vehicle)
        began = time.perf_counter()
        flown = fly_whole(policy, load_vehicle(args.vehicle), args.flights, Console(quiet=True))
        took = time.perf_counter() - began
        flights[task] = [flight_row(flight) for flight in flown]
        rows.append({
            "task": task,
            "complete": f"{sum(f.complete for f in flown)} of {len(flown)}",
            "success": f"{sum(f.success for f in flown)} of {len(flown)}",
            "hover error, worst": f"{100 * max(f.hover_error for f in flown):.1f} cm",
            "the policy, each flight": "; ".join(f.told for f in flown),
            "top speed": f"{max(f.top_speed for f in flown):.1f} m/s",
        })  # fmt: skip
        print(f"{task}: {rows[-1]['complete']} complete in {took:.0f} s", flush=True)
        for flight in flown:
            if not flight.complete:
                print(f"  not complete: {flight.modes} {flight.reasons}", flush=True)
    print(table(rows))
    whole = with_earlier("firmware_flights", args.json, "table", ("task",), rows)
    whole.sort(key=lambda row: tasks.index(row["task"]))
    write("firmware_flights", args.json, {"table": whole, "flights": flights})


if __name__ == "__main__":
    main()
