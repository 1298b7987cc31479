"""Several vehicles through the real firmware at once, in lockstep: they exchange their places, or race.

    python benchmarks/firmware_formation.py [--task race_duel] [--policy POLICY] [--vehicles 2] [--flights 5]
        [--seed 7000000] [--json FILE]

The starts are drawn as in training. A race has three laps. Time is virtual: the figures do not depend on the machine.
"""

import itertools
from typing import Any

import numpy as np
from common import arguments, table, write

from e2efly.courses.gates import Gates
from e2efly.environment import random_key
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.tasks.race_duel import RaceDuelConfig
from e2efly.tasks.race_duel.goal import RaceDuelRoute
from e2efly.tasks.race_duel.world import RaceDuel
from e2efly.tasks.swap import SwapConfig
from e2efly.tasks.swap.goal import SwapRoute
from e2efly.tasks.swap.world import Swap
from e2efly.tasks.task import Shape
from e2efly.validation import firmware_program
from e2efly.validation.candidate import candidate
from e2efly.validation.formation import FormationFlight, fly_formation
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

VEHICLE, LAPS, RACE_S = "vis_r", 3, 12.0


def swapped(vehicle: Vehicle, count: int, seed: int) -> tuple[list, np.ndarray, float]:
    """Routes, starts (k, 3) and the duration of an exchange of places."""
    options = SwapConfig(agents=count)
    task = Swap(options, Shape(vehicle.feet_height, vehicle.radius), 1 / vehicle.control_rate, 1)
    state, memory = task.start(random_key(seed), count)
    places = np.asarray(memory.place, float)
    routes = [SwapRoute(target=tuple(place.tolist()), outside=True) for place in places]
    return routes, np.asarray(state.position, float), options.episode_s


def raced(vehicle: Vehicle, count: int, seed: int) -> tuple[list, np.ndarray, float]:
    """The same of a race."""
    options = RaceDuelConfig(agents=count, spacing=1.0 if count == 2 else 0.7)
    task = RaceDuel.of(options, Shape(vehicle.feet_height, vehicle.radius), 1 / vehicle.control_rate)
    state, _ = task.start(random_key(seed), count)
    return [RaceDuelRoute(laps=0)] * count, np.asarray(state.position, float), RACE_S


def finishes(flight: FormationFlight, gates: Gates, radius: float) -> list[float | None]:
    """When each racer has finished `LAPS` laps, s. None: it missed or touched a gate before, or was too slow."""
    times: list[float | None] = []
    for path in np.swapaxes(flight.track, 0, 1):
        passed, time = 0, None
        for k, (before, after) in enumerate(itertools.pairwise(path)):
            through, missed, struck = gates.judge(np.array([passed % gates.count]), before[None], after[None], radius)
            if missed[0] or struck[0]:
                break
            passed += int(through[0])
            if passed == LAPS * gates.count:
                time = round((k + 1) * flight.step_s, 2)
                break
        times.append(time)
    return times


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(__doc__ or "", task="race_duel", policy="", vehicles=2, flights=5, seed=7_000_000)
    compute_at_once()
    prepare("cpu")
    vehicle, built = load_vehicle(VEHICLE), firmware_program.chosen()
    found, rows = candidate(args.policy or args.task, VEHICLE), []
    for seed in range(args.seed, args.seed + args.flights):
        draw = raced if args.task == "race_duel" else swapped
        routes, starts, seconds = draw(vehicle, args.vehicles, seed)
        flight = fly_formation(built, found.policy, vehicle, routes, list(starts), seconds, seed)
        apart = flight.nearest - 2 * vehicle.radius
        row: dict[str, Any] = {"seed": seed, "whole flights": f"{sum(flight.complete)} of {args.vehicles}"}
        if args.task == "race_duel":
            times = finishes(flight, RaceDuel.of(RaceDuelConfig(), Shape(0, 0), 1.0).track, vehicle.radius)
            well = all(times)
            row |= {f"{LAPS} laps of racer {i + 1}": f"{time} s" for i, time in enumerate(times)}
        else:
            well = max(flight.error) < SwapConfig().radius
            row["farthest from its place"] = f"{100 * max(flight.error):.1f} cm"
        row |= {
            "smallest gap between two": f"{100 * apart:.0f} cm",
            "success": bool(all(flight.complete) and apart > 0 and well),
        }
        rows.append(row)
        print(row, "" if all(flight.complete) else flight.modes, flush=True)
    print(table(rows))
    write(f"firmware_{args.task}", args.json, {"table": rows, "task": args.task, "vehicles": args.vehicles})


if __name__ == "__main__":
    main()
