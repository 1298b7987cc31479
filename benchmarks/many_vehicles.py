"""Steps of vehicles that share a world, beside those of vehicles alone, in one run.

    python benchmarks/many_vehicles.py [--rounds 3] [--vehicles 1024] [--json FILE]

Each row is an environment with everything included: physics, latency, randomised vehicles, observation, reward, new
starts of whole worlds, collisions between all pairs of a world. The rows are timed in turn; the table has the medians,
and the ratio of the time to that of hover. QuadSwarm's figure is its authors' (Huang et al. 2023, arXiv 2306.09537): 8
vehicles per world, 16 cores.
"""

import dataclasses

from common import arguments, median, table, write

from e2efly.config import TrainConfig
from e2efly.learning.step_rates import environment_steps
from e2efly.runs import presets
from e2efly.simulation.device import prepare
from e2efly.tasks.swap import SwapConfig

QUADSWARM = 62_000
"""Samples per second."""


def swap(agents: int, neighbours: int, downwash: float = 0.0) -> TrainConfig:
    """Exchanging places, so many vehicles in a world."""
    config = presets.preset("swap", "ppo", presets.NOMINAL)
    task = SwapConfig(agents=agents, neighbours=neighbours)
    return dataclasses.replace(config, task=task, env=dataclasses.replace(config.env, downwash=downwash))


def main() -> None:
    """Time, print the table, write the figures."""
    args = arguments(__doc__ or "", rounds=3, vehicles=1024)
    prepare("cpu")
    rows = {
        "hover, 1 vehicle in a world": presets.preset("hover", "ppo", presets.NOMINAL),
        "swap, 2 in a world, 1 observed": swap(2, 1),
        "swap, 8 in a world, 2 observed": swap(8, 2),
        "swap, 8 in a world, 2 observed, downwash": swap(8, 2, 1.0),
        "swap, 8 in a world, all 7 observed, downwash": swap(8, 7, 1.0),
    }
    rates: dict[str, list[float]] = {name: [] for name in rows}
    for _ in range(args.rounds):
        for name, config in rows.items():
            rates[name].append(environment_steps(config, args.vehicles))
            print(f"{name}: {rates[name][-1]:.0f} vehicle steps per second", flush=True)
    alone = median(rates["hover, 1 vehicle in a world"])
    found = [
        {
            "environment": name,
            "vehicle steps per second": f"{median(each):,.0f}",
            "time / hover's": f"{alone / median(each):.2f}",
            "rate / QuadSwarm's 62,000": f"{median(each) / QUADSWARM:.1f}",
        }
        for name, each in rates.items()
    ]
    print(table(found))
    write("many_vehicles", args.json, {"table": found, "rates": rates, "vehicles": args.vehicles})


if __name__ == "__main__":
    main()
