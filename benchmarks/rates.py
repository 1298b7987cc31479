"""Rates of physics, environment and training, with the peers measured in the same run.

    python benchmarks/rates.py [--rounds 3] [--json FILE]

Crazyflow, RotorPy, L2F and PyFlyt are installed into virtual environments of their own (`peers.py`). All are timed in
turn, `rounds` times, on 1024 vehicles where nothing else is said; the table has the medians, and the ratio to the
median of the best peer. Each figure is written as it is measured, and a script that was stopped goes on where it was.
"""

from collections.abc import Callable
from functools import partial
from typing import Any

from common import arguments, measured, median, training
from peers import PEERS, physics_steps
from variants import own, own_parameters, wide

from e2efly.config import EnvConfig
from e2efly.learning.step_rates import environment_steps, physics_substeps, training_steps
from e2efly.runs import presets
from e2efly.simulation.device import prepare

WORLDS = 1024
OWN = ", each with parameters of its own"
PHYSICS, ENVIRONMENT = f"physics sub-steps, {WORLDS} vehicles", f"environment steps, {WORLDS} environments, hover"
"""Sub-steps of the default integrator. Environment steps have seven of them, and include everything."""
WIDE = ", 100 environments, horizon 96, networks 192-96"


def what(algo: str) -> str:
    """The name of a rate of training."""
    return f"{algo.upper()} training steps, hover"


def quantities() -> dict[str, tuple[dict[str, str], Callable[[], float]]]:
    """What is measured, in turn: what stands beside it, and how."""
    third = {"integrator": EnvConfig().integrator}
    found: dict[str, tuple[dict[str, str], Callable[[], float]]] = {
        f"{name}: physics steps": ({}, partial(physics_steps, name, WORLDS)) for name in PEERS
    }
    found[PHYSICS] = third, partial(physics_substeps, WORLDS)
    found[PHYSICS + OWN] = third, partial(physics_substeps, WORLDS, own_parameters(WORLDS))
    found[ENVIRONMENT] = third, partial(environment_steps, "hover", WORLDS)
    for algo in ("ppo", "bptt"):
        about = training(f"train hover --algo {algo} --preset nominal")
        config = presets.starting("hover", algo, presets.NOMINAL)
        found[what(algo)] = about, partial(training_steps, config)
        found[what(algo) + OWN] = about, partial(training_steps, own(config))
        if algo == "bptt":
            found[what(algo) + WIDE] = about, partial(training_steps, wide(config))
    return found


def rows(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The table: medians, and ratios of them where both are measured."""
    of = {name: [run for run in runs if run["what"] == name] for name in dict.fromkeys(run["what"] for run in runs)}
    rate = {name: median([run["rate"] for run in each]) for name, each in of.items()}
    table = [
        {
            "what": name,
            "per second": f"{rate[name]:,.0f}",
            "preset": each[0].get("preset", ""),
            "integrator": each[0].get("integrator", ""),
            "measured": max(run["date"] for run in each),
            "configuration": each[0].get("configuration", ""),
        }
        for name, each in of.items()
    ]
    best = max((name for name in rate if name.removesuffix(": physics steps") in PEERS), key=rate.__getitem__)
    ratios = {
        "physics over the best of the others": (PHYSICS, best),
        "physics, parameters as constants over each its own": (PHYSICS, PHYSICS + OWN),
        "PPO training, parameters as constants over each its own": (what("ppo"), what("ppo") + OWN),
        "BPTT training, parameters as constants over each its own": (what("bptt"), what("bptt") + OWN),
        "environment over a tenth of Crazyflow's physics steps, one bare control step": (
            ENVIRONMENT,
            "Crazyflow 0.4: physics steps",
        ),
    }
    for name, (a, b) in ratios.items():
        if a in rate and b in rate:
            ratio = rate[a] / rate[b] * (10 if a == ENVIRONMENT else 1)
            blank = dict.fromkeys(list(table[0])[2:], "")
            table.append({"what": f"ratio, {name}", "per second": f"{ratio:.2f}", **blank})
    return table


def main() -> None:
    """Measure, and write JSON."""
    options = arguments(__doc__ or "", rounds=3)
    prepare("cpu")
    for turn in range(options.rounds):
        for name, (about, rate) in quantities().items():
            key = {"what": name, "round": turn, **about}
            measured("rates", options.json, key, lambda rate=rate: {"rate": rate()}, rows)


if __name__ == "__main__":
    main()
