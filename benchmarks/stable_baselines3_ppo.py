"""Seconds from process start to the hover criterion: our PPO and Stable-Baselines3's, on the same environment.

    python benchmarks/stable_baselines3_ppo.py [--seeds 3] [--limit 200] [--json FILE]

Both step 64 vehicles with the rewards, features and starts of our PPO preset. Stable-Baselines3's PPO learns with its
own defaults, and with what of our preset it has: rollout, minibatch, epochs, discount, learning rate, first noise,
networks. The criterion is 99 % of 250 starts, and of 1000 others. Evaluations take time on both sides: ours after every
20 updates, theirs after every rollout of the defaults, after every 8 of the short ones. `limit`: seconds after which a
run is given up. After the clock has stopped, what Stable-Baselines3 has learned is exported, evaluated and flown in
MuJoCo.
"""

import json
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from common import arguments, median, table, write
from time_to_criterion import run as ours

import e2efly
from e2efly.learning.usage import since_process_start

GOAL = 0.99
KINDS = ["defaults", "our numbers"]


def theirs(kind: str, seed: int, limit: float) -> dict[str, float]:
    """Train in this process until the criterion: seconds, steps, success of the export; NaN if not met."""
    from e2efly.simulation.device import prepare

    prepare("cpu")
    import numpy as np
    import torch
    from stable_baselines3 import PPO

    from e2efly.adapters.stable_baselines3 import SB3VecEnv

    torch.set_num_threads(1)
    env, watched = SB3VecEnv("hover", 64), SB3VecEnv("hover", 250)
    if kind == "defaults":
        model, between = PPO("MlpPolicy", env, seed=seed, device="cpu"), 2048 * 64
    else:
        model = PPO(
            "MlpPolicy", env, n_steps=64, batch_size=512, n_epochs=2, gamma=0.96, learning_rate=3e-3,
            policy_kwargs={"log_std_init": -1.0, "net_arch": [64, 64], "activation_fn": torch.nn.ReLU}, seed=seed,
            device="cpu",
        )  # fmt: skip
        between = 8 * 64 * 64

    def success(stream: int) -> float:
        watched.seed(stream)
        observation, over, met = watched.reset(), np.zeros(250, bool), np.zeros(250, bool)
        while not over.all():
            observation, _, done, told = watched.step(model.predict(observation, deterministic=True)[0])
            for i in np.flatnonzero(done & ~over):
                met[i] = told[i]["is_success"]
            over |= done
        return float(met.mean())

    while since_process_start() < limit:
        model.learn(between, reset_num_timesteps=False)
        if success(1) >= GOAL and np.mean([success(2 + i) for i in range(4)]) >= GOAL:
            found = {"seconds": since_process_start(), "steps": float(model.num_timesteps)}
            with tempfile.TemporaryDirectory() as folder:
                path = e2efly.export(model, Path(folder) / "policy.onnx")
                mujoco = e2efly.validate(path).criteria["hover"].flown
                return found | {"eval": e2efly.evaluate(path).success, "mujoco": float(np.mean(mujoco.success))}
    return {"seconds": math.nan, "steps": math.nan}


def in_process(kind: str, seed: int, limit: float) -> dict[str, float]:
    """`theirs` in a process of its own."""
    done = subprocess.run(
        [sys.executable, __file__, "--child", kind, str(seed), str(limit)], capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Measure, print a table, write JSON."""
    if sys.argv[1:2] == ["--child"]:
        kind, seed, limit = sys.argv[2:]
        print(json.dumps(theirs(kind, int(seed), float(limit))))
        return
    options = arguments(__doc__ or "", seeds=3, limit=200.0)
    found: dict[str, list[dict[str, Any]]] = {"e2efly, first run": [], "e2efly, later": []}
    found |= {f"Stable-Baselines3, {kind}": [] for kind in KINDS}
    for seed in range(options.seeds):
        with tempfile.TemporaryDirectory() as cache:
            for name in ("e2efly, first run", "e2efly, later"):
                found[name].append(ours("hover", "ppo", seed, Path(cache)))
        for kind in KINDS:
            found[f"Stable-Baselines3, {kind}"].append(in_process(kind, seed, options.limit))
        print({name: rows[-1] for name, rows in found.items()}, time.strftime("%X"), flush=True)
    usual = median([row["seconds"] for row in found["e2efly, later"]])
    rows = [
        {
            "PPO of": name,
            "seconds, median": f"{median([r['seconds'] for r in each]):.1f}",
            "seconds, every seed": " ".join(f"{r['seconds']:.1f}" for r in each),
            "million steps": f"{median([r['steps'] for r in each]) / 1e6:.2f}",
            "times ours, later": f"{median([r['seconds'] for r in each]) / usual:.1f}",
            "success, exported": " ".join(f"{r['eval']:.1%}" for r in each if "eval" in r),
            "success, MuJoCo": " ".join(f"{r['mujoco']:.1%}" for r in each if "mujoco" in r),
        }
        for name, each in found.items()
    ]
    write("stable_baselines3_ppo", options.json, {"table": rows, "runs": found})
    print(table(rows))


if __name__ == "__main__":
    main()
