"""How often all of a world exchange their places in `swap`: the experts that know the two nearest and all others, which
bound those who imitate them, and policies.

    python benchmarks/exchanges.py [--policies runs/swap-bptt-0 ...] [--worlds 1000] [--seed 1000000]

The vehicle is that of the file, in still air. A world of eight succeeds if each is at its place for the last second and
none has touched another.
"""

import dataclasses
from pathlib import Path
from typing import Any

import jax
import numpy as np
from common import arguments, table, write

from e2efly.environment import Env, random_key
from e2efly.environment.episodes import Episodes, EpisodesUnderWay, wilson
from e2efly.runs.presets import preset
from e2efly.simulation.device import prepare
from e2efly.tasks.swap import SwapConfig
from e2efly.validation.evaluation import evaluate


def by_expert(neighbours: int, worlds: int, seed: int) -> Episodes:
    """Flights of the expert that knows so many of the nearest others."""
    config = preset("swap", "bptt", "nominal")
    (suite,) = dataclasses.replace(config.task, neighbours=neighbours).criteria().values()
    env = Env.of(suite, config.reward, config.env)
    steps = env.episode_steps

    @jax.jit
    def fly(env: Env) -> Any:
        def step(flight: EpisodesUnderWay, _: None) -> tuple[EpisodesUnderWay, None]:
            return flight.after(env, env.expert_action(flight.state), 0.0), None

        start = EpisodesUnderWay.of(*env.reset(random_key(seed), worlds * env.agents))
        return jax.lax.scan(step, start, None, length=steps)[0].episodes(env)

    return fly(env)


def row(name: str, flown: Episodes, agents: int) -> dict[str, Any]:
    """What became of the worlds."""
    success = np.asarray(flown.success)[::agents]  # a world's vehicles succeed together
    crashed = np.logical_or.reduce(np.asarray(flown.crashed).reshape(-1, agents), axis=1)
    low, high = wilson(int(success.sum()), len(success))
    return {
        "what": name,
        "worlds": len(success),
        "success, %": f"{100 * success.mean():.1f}",
        "95 %": f"{100 * low:.1f} to {100 * high:.1f}",
        "touched": int(crashed.sum()),
        "late": int((~success & ~crashed).sum()),
        "top speed, m/s": f"{float(np.max(flown.top_speed)):.1f}",
    }


def main() -> None:
    """Fly, print a table, write JSON."""
    args = arguments(__doc__ or "", policies=[], worlds=1000, seed=1_000_000)
    prepare("cpu")
    agents = SwapConfig().agents
    experts = {"expert that knows the 2 nearest": 2, "expert that knows all 7": agents - 1}
    rows = [row(name, by_expert(count, args.worlds, args.seed), agents) for name, count in experts.items()]
    for name in args.policies:
        found = evaluate(name, args.worlds * agents, seed=args.seed)
        (flown,) = found.flown.values()
        rows.append(row(Path(name).name, flown, agents))
    write("exchanges", args.json, {"seed": args.seed, "table": rows})
    print(table(rows))


if __name__ == "__main__":
    main()
