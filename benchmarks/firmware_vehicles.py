"""The zoo's policies on every vehicle through the real Betaflight firmware: success against the simulator's, whole
flights, and what ended or broke a flight, by name.

    python benchmarks/firmware_vehicles.py [--vehicles crazyflie ...] [--tasks hover ...] [--flights 5] [--episodes 20]
    python benchmarks/firmware_vehicles.py --flights 10 --episodes 0    # the watches: nothing may end a sound flight

Whole flights begin at the seed 7000000, which is for publishing: tune with `--seed 5000000 --json FILE`. Each flight is
written at once, and a script that was stopped goes on where it was: delete the file to fly anew. Time is virtual: the
figures do not depend on the machine. `--episodes 0` flies no starts of `e2efly validate`.
"""

import json
import re
from typing import Any

from common import RESULTS, arguments, table, write
from firmware_flights import flight_row
from rich.console import Console

from e2efly.commands.rehearsals import fly_whole
from e2efly.flight.pilot.flight_state import Mode, Reason
from e2efly.policy.zoo import contents
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.validation.candidate import candidate
from e2efly.validation.plant_validation import validate
from e2efly.validation.rehearsal import Rehearsal
from e2efly.vehicles.loading import load_vehicle

VEHICLES = ("vis_r", "vis_h", "crazyflie", "hexa", "octo")
OF_FAMILY = {"hexa": "multirotor", "octo": "multirotor"}
"""Whose policies fly the vehicles that have none of their own. The firmware drives them by its mixers HEX6X and
OCTOFLATX."""
EXPECTED = {"", *map(str, (Reason.POLICY_DONE, Reason.MISSION, Reason.LANDED, Reason.TOUCHED, Reason.DISARMED))}
"""Reasons of the modes after the policy's in a flight that nothing ended."""


def alarms_of(flight: Rehearsal) -> list[str]:
    """What else gave a flight another mode, without the numbers. A flight without a policy has its last reason."""
    after = flight.modes.index(Mode.POLICY) + 1 if Mode.POLICY in flight.modes else -1
    said = [reason for reasons in flight.reasons[after:] for reason in reasons.split("; ")]
    return [re.sub(r"[-+]?\d[\d.]*", "#", reason) for reason in said if reason not in EXPECTED]


def main() -> None:
    """Fly what the file does not have yet, print the table, write the figures."""
    args = arguments(__doc__ or "", vehicles=list(VEHICLES), tasks=[""], flights=5, episodes=20, seed=7_000_000)
    compute_at_once()
    prepare("cpu")
    path = args.json or RESULTS / "firmware_vehicles.json"
    known = json.loads(path.read_text()) if path.exists() else {"flights": [], "starts": []}
    flights, starts = known["flights"], known["starts"]

    def keep() -> None:
        write("firmware_vehicles", args.json, {"table": rows_of(flights, starts), "flights": flights, "starts": starts})

    for vehicle in args.vehicles:
        whose = OF_FAMILY.get(vehicle) or vehicle
        for task in [task for task in contents()[whose] if args.tasks == [""] or task in args.tasks]:
            pair = {"vehicle": vehicle, "task": task}
            for seed in range(args.seed, args.seed + args.flights):
                if any(pair.items() <= row.items() and row["seed"] == seed for row in flights):
                    continue
                found = candidate(f"{whose}/{task}", vehicle)
                (flight,) = fly_whole(found, load_vehicle(vehicle), 1, Console(quiet=True), seed)
                flights.append({**pair, "seed": seed, "alarms": alarms_of(flight), **flight_row(flight)})
                keep()
                print(vehicle, task, seed, flight.complete, flight.success, flight.told, alarms_of(flight), flush=True)
            if args.episodes and not any(pair.items() <= row.items() for row in starts):
                other = None if whose == vehicle else vehicle
                told = validate(f"{whose}/{task}", "betaflight", args.episodes, vehicle=other).as_json()["criteria"]
                starts += [
                    {**pair, "criterion": name, **{k: one[k]["success"] for k in ("training", "betaflight")}}
                    for name, one in told.items()
                ]
                keep()
    print(table(rows_of(flights, starts)))


def rows_of(flights: list[dict[str, Any]], starts: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """A row for each policy."""
    rows = []
    for vehicle, task in dict.fromkeys((row["vehicle"], row["task"]) for row in [*flights, *starts]):
        own = [row for row in flights if (row["vehicle"], row["task"]) == (vehicle, task)]
        compared = [row for row in starts if (row["vehicle"], row["task"]) == (vehicle, task)]
        rows.append({
            "vehicle": vehicle, "task": task,
            "whole flights": f"{sum(row['complete'] for row in own)} of {len(own)}",
            "success": f"{sum(row['success'] for row in own)} of {len(own)}",
            "starts, simulator / firmware": "; ".join(
                f"{row['criterion']} {100 * row['training']:.0f} / {100 * row['betaflight']:.0f} %" for row in compared
            ),
            "what ended a flight": "; ".join(dict.fromkeys(alarm for row in own for alarm in row["alarms"])),
        })  # fmt: skip
    return rows


if __name__ == "__main__":
    main()
