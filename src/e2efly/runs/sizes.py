"""The sizes of a preset on a GPU: environments, minibatch, steps, evaluations. Imports no JAX.

Presets are sized for a few CPU cores, where each environment costs time. On a GPU an update takes nearly as long with
64 environments as with thousands, because the time goes into launching small kernels. There, presets have as many
environments as docs/gpu.md has measurements of. Their gradients have less noise, so fewer updates are enough.
"""

import dataclasses
import math
from typing import Any

from e2efly.config import TrainConfig
from e2efly.runs.paper import NAMES

MEASURED = ("ppo", "bptt")
"""Algorithms whose rates on a GPU are measured. The others keep their sizes there."""
PLAIN, MEMORY, SIGHT = 16_384, 4096, 2048
"""Environments on a GPU: of a policy without memory on one course; of a policy that remembers, or whose every episode
has its own course; of a policy that sees."""
HALF, QUARTER, ENOUGH = 2, 4, 300
"""A run on a GPU has half of the updates, at most 300, or a quarter if that is more. On a CPU the preset nominal of
hover, land, track and race reaches its criterion within 210 updates, in spite of the noise of its gradients. Longer
runs are long because of this noise."""
MORE_STARTS = 4
"""Factor by which an evaluation on a GPU has more starts, which fly together."""
EVALUATIONS = 10
"""Least number of evaluations of a run on a GPU."""


def environments(config: TrainConfig) -> int:
    """Number of environments of a configuration on a GPU."""
    if config.env.cameras:
        return SIGHT
    return MEMORY if config.network.recurrent or config.task.own_worlds else PLAIN


def for_device(config: TrainConfig, preset: str, device: str) -> TrainConfig:
    """A preset's configuration with the sizes for a device.

    On a GPU the environments, the samples of a minibatch, and the steps of the run and of each stage of its curriculum
    grow together: an update has as many gradient steps as before, and the run has fewer updates (`HALF`). The learning
    rates stay, and so does the number of updates between two evaluations if there are enough of them.

    Args:
        config: the configuration for a CPU, as the preset gives it.
        preset: name of the preset.
        device: `cpu` or `gpu`.
    """
    algo: Any = config.algo
    factor = environments(config) // algo.envs
    if device != "gpu" or preset in NAMES or algo.name not in MEASURED or factor <= QUARTER:
        return config
    sizes = {name: factor * getattr(algo, name) for name in ("envs", "minibatch") if hasattr(algo, name)}
    before = math.ceil(config.steps / algo.steps)
    updates = max(1, before // QUARTER, min(before // HALF, ENOUGH))
    steps = updates * factor * algo.steps
    return dataclasses.replace(
        config,
        algo=dataclasses.replace(algo, **sizes),
        steps=steps,
        chunk=max(1, min(config.chunk, updates // EVALUATIONS)),
        eval_episodes=MORE_STARTS * config.eval_episodes,
        curriculum=tuple(
            stage if stage.steps is None else dataclasses.replace(stage, steps=stage.steps * steps // config.steps)
            for stage in config.curriculum
        ),
    )
