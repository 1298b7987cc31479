"""How far the actions of an exported policy are from those of the policy in memory."""

from pathlib import Path
from typing import Any

import jax
import numpy as np

from e2efly.learning.networks import Actor, Weights
from e2efly.policy.loader import load_policy
from e2efly.policy.random_inputs import random_images, random_observations


def parity(path: Path, weights: Weights, actor: Actor, count: int = 10_000, seed: int = 0) -> float:
    """The largest absolute difference between the actions of an exported policy and those of the original policy.

    Both act on random observations and images. A GRU also starts from random memories.

    Args:
        path: the `policy.onnx`, run in the same way as on the vehicle.
        weights: as for `export_policy`.
        actor: as for `export_policy`.
        count: number of random observations.
        seed: seed of the observations.

    Returns:
        The largest difference of the actions, whose range is [-1, 1].
    """
    rng, exported = np.random.default_rng(seed), load_policy(path)
    observation = random_observations(rng, actor.features.fields, count)
    images = [random_images(rng, image, count) for image in exported.contract.images]
    memory = rng.uniform(-1, 1, (count, actor.network.recurrent)).astype(np.float32)

    @jax.jit
    def wanted(weights: Weights, observation: Any, images: Any, memory: Any) -> Any:
        return actor(weights, actor.features(observation, images), memory)

    both = zip(exported.act(observation, images, memory), wanted(weights, observation, images, memory), strict=True)
    return float(max(np.max(np.abs(a - np.asarray(b)), initial=0.0) for a, b in both))
