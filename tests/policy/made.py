"""Policies of random weights, as files."""

from pathlib import Path

import numpy as np

from e2efly.config import NetworkConfig, TrainConfig
from e2efly.environment import Env
from e2efly.learning.networks import Actor, Weights, init_mlp
from e2efly.learning.onnx_export import contract_of, export_policy
from e2efly.runs import presets


def made(
    path: Path,
    scale: float,
    env: Env | None = None,
    config: TrainConfig | None = None,
    hidden: int = 16,
    hovers: bool = True,
) -> Path:
    """Export a policy, of hovering if no other is given, that answers to what it sees, by `scale`."""
    config = config or presets.preset("hover", "ppo")
    env = env or Env.of(config.task, config.reward, config.env)
    actor = Actor.of(env.fields, (), NetworkConfig((hidden,)))
    layers = init_mlp(np.random.default_rng(0), (actor.features.size, hidden, len(env.hover)), scale)
    if hovers:
        layers = [*layers[:-1], (np.asarray(layers[-1][0]), np.arctanh(np.asarray(env.hover, np.float32)))]
    export_policy(path, Weights((), None, layers), actor, contract_of(env, config))
    return path
