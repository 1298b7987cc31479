"""Whole flights of the zoo through the real Betaflight firmware: take-off, hover, policy, landing, nobody helping.

    python benchmarks/firmware_flights.py [--vehicle vis_r] [--flights 5] [--tasks hover land ...] [--json FILE]

The tasks are those of the zoo that need no camera. Time is virtual: the figures do not depend on the
machine. The firmware is built where need be.
"""

import time

from common import arguments, table, write
from rich.console import Console

from e2efly.commands.rehearsals import flight_row, fly_whole
from e2efly.deploy.policy.loader import load_policy
from e2efly.device import compute_at_once
from e2efly.vehicles import load_vehicle
from e2efly.zoo import policy_file


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(
        __doc__ or "", vehicle="vis_r", flights=5, tasks=["hover", "hover_aware", "land", "track", "gap", "race"]
    )
    compute_at_once()
    rows, flights = [], {}
    for task in args.tasks:
        policy = load_policy(policy_file(task, args.vehicle))
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
            "real time": f"{took:.0f} s",
        })  # fmt: skip
        print(f"{task}: {rows[-1]['complete']} complete in {took:.0f} s", flush=True)
        for flight in flown:
            if not flight.complete:
                print(f"  not complete: {flight.modes} {flight.reasons}", flush=True)
    print(table(rows))
    write("firmware_flights", args.json, {"table": rows, "flights": flights})


if __name__ == "__main__":
    main()
