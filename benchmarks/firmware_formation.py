"""Several vehicles through the real firmware at once, in lockstep: they exchange their places.

    python benchmarks/firmware_formation.py [--policy swap] [--vehicles 4] [--flights 5] [--seed 7000000] [--json FILE]

The places are drawn as in training (`e2efly.tasks.swap`). Time is virtual: the figures do not depend on the machine.
"""

import numpy as np
from common import arguments, table, write

from e2efly.environment import random_key
from e2efly.simulation.device import compute_at_once, prepare
from e2efly.tasks.swap import SwapConfig
from e2efly.tasks.swap.goal import SwapRoute
from e2efly.tasks.swap.world import Swap
from e2efly.tasks.task import Shape
from e2efly.validation import firmware_program
from e2efly.validation.evaluation import candidate
from e2efly.validation.formation import fly_formation
from e2efly.vehicles.loading import load_vehicle

VEHICLE = "vis_r"


def main() -> None:
    """Fly, print the table, write the figures."""
    args = arguments(__doc__ or "", policy="swap", vehicles=4, flights=5, seed=7_000_000)
    compute_at_once()
    prepare("cpu")
    vehicle, found, built = load_vehicle(VEHICLE), candidate(args.policy, VEHICLE), firmware_program.chosen()
    options = SwapConfig(agents=args.vehicles)
    task = Swap(options, Shape(vehicle.feet_height, vehicle.radius), 1 / vehicle.control_rate, 1)
    rows = []
    for seed in range(args.seed, args.seed + args.flights):
        state, memory = task.start(random_key(seed), args.vehicles)
        starts, places = (np.asarray(x, float) for x in (state.position, memory.place))
        routes = [SwapRoute(target=tuple(place.tolist()), outside=True) for place in places]
        flight = fly_formation(built, found.policy, vehicle, routes, list(starts), options.episode_s, seed)
        apart = flight.nearest - 2 * vehicle.radius
        rows.append({
            "seed": seed,
            "whole flights": f"{sum(flight.complete)} of {args.vehicles}",
            "success": bool(all(flight.complete) and apart > 0 and max(flight.error) < options.radius),
            "farthest from its place": f"{100 * max(flight.error):.1f} cm",
            "smallest gap between two": f"{100 * apart:.0f} cm",
        })  # fmt: skip
        print(rows[-1], "" if all(flight.complete) else flight.modes, flush=True)
    print(table(rows))
    write("firmware_formation", args.json, {"table": rows, "vehicles": args.vehicles})


if __name__ == "__main__":
    main()
