"""An evolution strategy: `e2efly train hover --algo examples/08_own_algorithm.py:ESConfig`, or run this file."""

import sys
import tempfile
from dataclasses import dataclass
from typing import Any, ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

import e2efly
from e2efly.config import AlgorithmConfig, number
from e2efly.learning.algorithm import Algorithm, TrainState, annealed, descend, episode_metrics
from e2efly.learning.networks import Weights


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Parameters:
    """What is learned."""

    policy: Weights


class ES(Algorithm):
    """Evolution strategy (Salimans et al. 2017): each vehicle flies with its own weights. Better ones count more."""

    def init(self, env: Any, config: Any, seed: int) -> Parameters:
        """A fresh network."""
        return Parameters(self.actor.init(np.random.default_rng(seed), np.asarray(env.hover)))

    def update(self, env: Any, config: Any, state: TrainState, progress: Any) -> tuple[TrainState, dict[str, Any]]:
        """A flight of `horizon` steps from new starts. Two vehicles with opposite weight changes share each start."""
        key, start_key, noise_key = jax.random.split(state.key, 3)
        n, (flat, shaped) = state.observation.shape[0], ravel_pytree(state.parameters.policy)
        noise = jax.random.normal(noise_key, (n // 2, flat.size))
        weights = jax.vmap(shaped)(flat + config.sigma * jnp.concatenate([noise, -noise]))
        rows = jnp.arange(n) % (n // 2)
        begun, observation = env.reset(start_key, n)
        begun = jax.tree.map(lambda x: x[rows] if x.shape[:1] == (n,) else x, begun)

        def step(carry: Any, _: None) -> tuple[Any, Any]:
            env_state, seen, memory = carry
            features = self.actor.features(seen, env_state.images)
            action, memory = jax.vmap(self.actor)(weights, features, memory)
            env_state, out = env.step(env_state, action)
            return (env_state, out.observation, memory), out

        first = begun, observation[rows], jnp.zeros_like(state.memory)
        _, flown = jax.lax.scan(step, first, None, length=config.horizon)
        rank = jnp.argsort(jnp.argsort(flown.reward.sum(0))) / (n - 1) - 0.5
        ascent = (rank[: n // 2] - rank[n // 2 :]) @ noise / (n * config.sigma)
        rate, optimizer = annealed(config, progress), state.optimizer
        parameters, optimizer, _ = descend(config, rate, state.parameters, optimizer, Parameters(shaped(-ascent)))
        told = {"reward": jnp.mean(flown.reward)} | episode_metrics(flown.done, flown.success)
        return TrainState(parameters, optimizer, state.env, state.observation, state.memory, key), told


@e2efly.register_algorithm("es")
@dataclass(frozen=True)
class ESConfig(AlgorithmConfig):
    """Evolution strategy, with PPO's rewards."""

    program: ClassVar = ES
    envs: int = number(256, above=0)
    horizon: int = number(100, above=0)
    max_grad_norm: float = number(100.0, above=0)
    sigma: float = number(0.05, above=0)
    """Standard deviation of the weights' noise."""
    learning_rate: float = number(0.02, above=0)
    """Adam's step at the start."""
    learning_rate_end: float = number(0.005, above=0)
    """Adam's step at the end."""


if __name__ == "__main__":
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000
    with tempfile.TemporaryDirectory() as folder:
        summary = e2efly.train("hover", ESConfig, out=f"{folder}/run", steps=steps, progress=True)
    print(f"success on unseen starts: {summary['shipped']['hover']['success']:.1%}")
