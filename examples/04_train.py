"""Train a hover policy from Python with your own reward. Judge it, and call the exported policy."""

import sys
import tempfile
from pathlib import Path

import numpy as np

import e2efly

steps = int(sys.argv[1]) if len(sys.argv) > 1 else 500_000
reward = {"prog2": 1.0, "v1": 0.1, "anglev_sq": 0.02, "act2_sq": 0.05}
with tempfile.TemporaryDirectory() as folder:
    run = Path(folder) / "run"
    e2efly.train("hover", "bptt", preset_name="nominal", out=run, reward=reward, steps=steps, progress=True)
    print(f"success on 100 unseen starts: {e2efly.evaluate(run, episodes=100).success:.0%}")
    policy = e2efly.load_policy(run)
observation = np.zeros(policy.contract.observation_size, np.float32)
observation[policy.contract.slices["attitude"]] = (1, 0, 0, 0)
action, _ = policy.act(observation)
print(
    "at the target it commands", dict(zip(policy.contract.action.fields, policy.command(action).round(2), strict=True))
)
