"""Rates of physics, environment and training, with the peers measured in the same run.

    python benchmarks/rates.py [--rounds 5] [--json FILE]

Crazyflow, RotorPy, L2F and PyFlyt are installed into virtual environments of their own (`peers.py`). All are timed in
turn, `rounds` times, on 1024 vehicles where nothing else is said; the table has the medians, and the ratio to the
median of the best peer.
"""

from common import arguments, median, table, write
from peers import PEERS, physics_steps

from e2efly.device import prepare
from e2efly.learn.benchmark import environment_steps, physics_substeps, training_steps

WORLDS = 1024


def main() -> None:
    """Measure, print a table, write JSON."""
    options = arguments(__doc__ or "", rounds=5)
    prepare("cpu")
    ours, general, steps = [], [], []
    theirs: dict[str, list[float]] = {name: [] for name in PEERS}
    for _ in range(options.rounds):
        for name, found in theirs.items():
            found.append(physics_steps(name, WORLDS))
        ours.append(physics_substeps(WORLDS))
        general.append(physics_substeps(WORLDS, general=True))
        steps.append(environment_steps("hover", WORLDS))
    substeps, own, env = median(ours), median(general), median(steps)
    peer = max(median(found) for found in theirs.values())
    bare = median(theirs["Crazyflow 0.4"]) / 10
    ppo, bptt = ([training_steps("hover", algo, general=own) for own in (False, True)] for algo in ("ppo", "bptt"))
    figures = {
        **{f"{name}: physics steps": median(found) for name, found in theirs.items()},
        "Crazyflow 0.4: control steps (10 physics steps)": bare,
        f"e2efly physics sub-steps, {WORLDS} vehicles": substeps,
        f"e2efly physics sub-steps, {WORLDS} vehicles, each with parameters of its own": own,
        f"e2efly environment steps (7 sub-steps, everything included), {WORLDS} environments, hover": env,
        "e2efly PPO training steps, hover": ppo[0],
        "e2efly PPO training steps, hover, each vehicle with parameters of its own": ppo[1],
        "e2efly BPTT training steps, hover": bptt[0],
        "e2efly BPTT training steps, hover, each vehicle with parameters of its own": bptt[1],
        "e2efly BPTT training steps, hover, 100 environments, horizon 96, networks 192-96": training_steps(
            "hover", "bptt", wide=True
        ),
    }
    rows = [{"what": name, "per second": f"{value:,.0f}"} for name, value in figures.items()]
    ratios = {
        "physics over the best of the others": substeps / peer,
        "physics, parameters as constants over each its own": substeps / own,
        "PPO training, parameters as constants over each its own": ppo[0] / ppo[1],
        "BPTT training, parameters as constants over each its own": bptt[0] / bptt[1],
        "environment over Crazyflow's bare control steps": env / bare,
    }
    rows += [{"what": f"ratio, {name}", "per second": f"{value:.2f}"} for name, value in ratios.items()]
    rounds = {"e2efly": ours, "general": general, "environment": steps, **theirs}
    write("rates", options.json, {"table": rows, "figures": figures, "ratios": ratios, "rounds": rounds})
    print(table(rows))


if __name__ == "__main__":
    main()
