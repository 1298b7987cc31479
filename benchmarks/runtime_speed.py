"""The runtime on a companion computer: from the start of the process to the first action, and the time of an action.

    python benchmarks/runtime_speed.py [--policy FILE] [--starts 5] [--json FILE]

Without --policy an untrained one of the race, of the size that the presets train. On one core, where the system lets
a process choose; no JAX in the processes that are timed.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from common import arguments, median, table, write

ACTS = 10_000
"""Actions that are timed in each process; the figures are medians over the processes."""


def untrained(path: Path) -> None:
    """Write a policy of the race as the presets shape it, with random weights."""
    import numpy as np

    from e2efly.environment import Env
    from e2efly.learning.networks import Actor, Weights, init_mlp
    from e2efly.learning.onnx_export import contract_of, export_policy
    from e2efly.runs import presets

    config = presets.preset("race", "ppo")
    env = Env.of(config.task, config.reward, config.env)
    actor = Actor.of(env.fields, env.cameras, config.network)
    layers = init_mlp(np.random.default_rng(0), (actor.features.size, *config.network.hidden, 4), 1.0)
    export_policy(path, Weights((), None, layers), actor, contract_of(env, config))


def flight(path: str, acts: int) -> dict[str, float]:
    """What this process takes to its first action and when that was, and the times of `acts` more; s."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    began = time.perf_counter()
    import numpy as np

    from e2efly.policy.loader import load_policy
    from e2efly.policy.odometry import Odometry
    from e2efly.policy.runtime import Runtime, act, begin
    from e2efly.tasks.route import course_for
    from e2efly.vehicles.loading import load_vehicle

    imported = time.perf_counter()
    policy = load_policy(path)
    vehicle = load_vehicle(policy.contract.vehicle)
    goal = course_for(policy.contract, vehicle)
    runtime = Runtime.of(policy, goal, vehicle)
    rng, level = np.random.default_rng(0), np.array([1.0, 0.0, 0.0, 0.0])
    above = np.array([0.0, 0.0, 3.0])
    motions = [
        Odometry(k * runtime.period, rng.normal(size=3) + above, rng.normal(size=3), level, rng.normal(size=3))
        for k in range(100)
    ]
    state = begin(runtime, motions[0], 0.0)
    state, _ = act(runtime, state, motions[0], 0.0)
    first, at = time.perf_counter(), time.time()
    whole, network = np.empty(acts), np.empty(acts)
    for k in range(acts):
        motion = motions[k % len(motions)]
        start = time.perf_counter()
        state, decision = act(runtime, state, motion, (k + 1) * runtime.period)
        whole[k], network[k] = time.perf_counter() - start, decision.inference_s
    figures = {"at": at, "imports": imported - began, "imports, load and first action": first - began}
    for name, values in (("action", whole), ("inference", network), ("action without inference", whole - network)):
        figures |= {f"{name}, median": float(np.median(values)), f"{name}, p99": float(np.quantile(values, 0.99))}
    return figures


def process(path: str, acts: int) -> dict[str, float]:
    """`flight` in a process of its own, with the time of the whole process until its first action, s."""
    began = time.time()
    command = [sys.executable, __file__, "--flight", path, str(acts)]
    figures = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
    return {"start of the process to the first action": figures.pop("at") - began, **figures}


def main() -> None:
    """Measure, print a table, write JSON."""
    options = arguments(__doc__ or "", policy=None, starts=5)
    with tempfile.TemporaryDirectory() as folder:
        path = options.policy or str(Path(folder) / "policy.onnx")
        if not options.policy:
            untrained(Path(path))
        runs = [process(path, ACTS) for _ in range(options.starts)]
    figures = {name: median([run[name] for run in runs]) for name in runs[0]}
    rows = [{"what": name, "ms": f"{1e3 * value:.3f}"} for name, value in figures.items()]
    write("runtime_speed", options.json, {"table": rows, "seconds": figures, "acts": ACTS, "runs": runs})
    print(table(rows))


if __name__ == "__main__":
    if sys.argv[1:2] == ["--flight"]:
        print(json.dumps(flight(sys.argv[2], int(sys.argv[3]))))
    else:
        main()
