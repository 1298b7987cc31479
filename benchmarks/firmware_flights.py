"""Whole flights of the zoo through the real Betaflight firmware: take-off, hover, policy, landing, nobody helping.

    python benchmarks/firmware_flights.py [--vehicle vis_r] [--flights 5] [--tasks hover land ...] [--json FILE]
    python benchmarks/firmware_flights.py --room [--tasks race ...]

All nine tasks; what policies by sight see is rendered at the body's true pose, in another world of the training's
each time. Time is virtual: the figures do not depend on the machine. The firmware is built where need be. Rows of tasks
that are not named stay as they are in the file, with their flights.

With `--room` the paper's six tasks fly in a room of 6x6x3 m, inside its fence, which ends a policy's flight before the
vehicle leaves it. The fastest race is that of the highest speed of `SPEEDS` at which each flight succeeds.
"""

import dataclasses
import json
import time
from argparse import Namespace
from typing import Any

import numpy as np
from common import RESULTS, arguments, table, with_earlier, write
from rich.console import Console

from e2efly.commands.rehearsals import fly_whole
from e2efly.config.storage import finite
from e2efly.flight.settings import Fence
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.tasks.route import route_of
from e2efly.validation.candidate import candidate
from e2efly.validation.rehearsal import Rehearsal
from e2efly.vehicles.loading import load_vehicle

FENCE = Fence(low=(-2.8, -2.8, 0.1), high=(2.8, 2.8, 2.8), speed=12.0)
"""The fence in a room of 6x6x3 m: 0.2 m before its walls."""
RACE: dict[str, Any] = {"track": "room_6", "laps": 3}
SPEEDS = (8.0, 7.0, 6.0, 5.0, 4.0)
"""Commanded speeds at which the fastest race is sought, m/s."""
TASKS: dict[str, tuple[str, dict[str, Any]]] = {
    name: (name, {})
    for name in ("hover", "hover_aware", "land", "track", "gap", "race", "land_visual", "avoid", "race_clutter")
}
IN_ROOM: dict[str, tuple[str, dict[str, Any]]] = {
    "hover": ("hover", {}),
    "land": ("land", {}),
    "track, circle": ("track", {}),
    "track, lemniscate": ("track", {"reference": "lemniscate"}),
    "race, 3 m/s": ("race_speed", {**RACE, "speed": 3.0}),
    "race, fastest": ("race_speed", RACE),
    "land_visual": ("land_visual", {}),
    "race_clutter": ("race_clutter_room", {}),
}
"""Policy and goal of each row."""


def flight_row(flight: Rehearsal) -> dict[str, Any]:
    """A flight as JSON, without its track. Missing values are null."""
    return finite({f.name: getattr(flight, f.name) for f in dataclasses.fields(flight) if f.name != "flown"})


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(__doc__ or "", vehicle="vis_r", flights=5, tasks=[""], room=False)
    known, name = (IN_ROOM, "room_flights") if args.room else (TASKS, "firmware_flights")
    compute_at_once()
    prepare("cpu")
    path = args.json or RESULTS / f"{name}.json"
    rows, flights = [], json.loads(path.read_text())["flights"] if path.exists() else {}
    for task in known if args.tasks == [""] else args.tasks:
        began = time.perf_counter()
        told, flown = flown_of(task, *known[task], args)
        flights[task] = [flight_row(flight) for flight in flown]
        rows.append({
            "task": task,
            "complete": f"{sum(f.complete for f in flown)} of {len(flown)}",
            "success": f"{sum(f.success for f in flown)} of {len(flown)}",
            "hover error, worst": f"{100 * max(f.hover_error for f in flown):.1f} cm",
            "the policy, each flight": told + "; ".join(f.told for f in flown),
            "top speed": f"{max(f.top_speed for f in flown):.1f} m/s",
            **({"flown space": space(flown)} if args.room else {}),
        })  # fmt: skip
        print(f"{task}: {rows[-1]['complete']} complete in {time.perf_counter() - began:.0f} s", flush=True)
        for flight in flown:
            if not flight.complete:
                print(f"  not complete: {flight.modes} {flight.reasons}", flush=True)
    print(table(rows))
    whole = with_earlier(name, args.json, "table", ("task",), rows)
    whole.sort(key=lambda row: list(known).index(row["task"]))
    write(name, args.json, {"table": whole, "flights": flights})


def flown_of(task: str, policy: str, goal: dict[str, Any], args: Namespace) -> tuple[str, list[Rehearsal]]:
    """The flights of a row, and what is to be said before them."""
    found, vehicle = candidate(policy, args.vehicle), load_vehicle(args.vehicle)
    if not args.room:
        return "", fly_whole(found, vehicle, args.flights, Console(quiet=True))
    route, flown = route_of(found.policy.contract)(**goal), list[Rehearsal]()
    for speed in SPEEDS if task == "race, fastest" else [None]:
        chosen = route if speed is None else dataclasses.replace(route, **{"speed": speed})
        flown = fly_whole(found, vehicle, args.flights, Console(quiet=True), route=chosen, fence=FENCE)
        if all(flight.complete and flight.success for flight in flown):
            break
    return "" if speed is None else f"told {speed:g} m/s: ", flown


def space(flown: list[Rehearsal]) -> str:
    """The box of all positions of all flights, m."""
    every = np.concatenate([np.array(flight.flown.position) for flight in flown])
    return " x ".join(f"{length:.1f}" for length in np.ptp(every, axis=0)) + " m"


if __name__ == "__main__":
    main()
