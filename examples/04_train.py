"""Train a hover policy from Python, with a reward of one's own, and fly the exported file."""

import dataclasses
import sys
import tempfile
from pathlib import Path

import numpy as np

from e2efly.config import RewardConfig
from e2efly.deploy.policy import load_policy
from e2efly.device import prepare
from e2efly.learn.runner import train
from e2efly.presets import preset


class Print:
    """Shows the progress of a run."""

    def compiling(self) -> None:
        """Nothing flies yet."""
        print("compiling")

    def progress(self, steps: int, total: int, rate: float, success: float, best: float, stage: str) -> None:
        """An evaluation was done."""
        print(f"{steps / 1e6:.2f} of {total / 1e6:.2f} M steps, {rate / 1e3:.0f} k/s, success {success:.0%}")


prepare()  # XLA options, compilation cache, a device a core: before anything computes
steps = int(sys.argv[1]) if len(sys.argv) > 1 else 500_000
reward = RewardConfig({"prog2": 1.0, "v1": 0.1, "anglev_sq": 0.02, "act2_sq": 0.05})
config = dataclasses.replace(preset("hover", "bptt"), reward=reward, steps=steps)
with tempfile.TemporaryDirectory() as folder:
    summary = train(config, Path(folder) / "run", Print())
    policy = load_policy(Path(folder) / "run" / "policy.onnx", task="hover")
observation = np.zeros(policy.contract.observation_size, np.float32)
observation[policy.contract.slices["attitude"]] = (1, 0, 0, 0)
action, _ = policy.act(observation)
print(f"success on unseen starts: {summary['shipped']['hover']['success']:.1%}")
print(
    "at the target it commands", dict(zip(policy.contract.action.fields, policy.command(action).round(2), strict=True))
)
