"""What every algorithm is to the runner, and what they share."""

from dataclasses import dataclass
from typing import Any, Protocol

import jax
import optax
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import AlgorithmConfig, BPTTConfig, NetworkConfig, PPOConfig
from e2efly.env import Env, EnvState
from e2efly.learn.networks import Features

for _config in (PPOConfig, BPTTConfig):
    _shapes = [name for name, kind in _config.__annotations__.items() if kind is int]
    jax.tree_util.register_dataclass(
        _config,
        data_fields=[name for name in _config.__annotations__ if name not in _shapes],
        meta_fields=_shapes,
    )


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class TrainState:
    """Everything that an update changes: what a checkpoint holds."""

    parameters: Any
    """What is learned: a dataclass with at least `policy`."""
    optimizer: Any
    env: EnvState
    observation: Float[Array, "n o"]
    key: PRNGKeyArray


class Algorithm(Protocol):
    """A learning algorithm on the shapes of one environment."""

    def init(self, env: Env, config: Any, seed: int) -> Any:
        """Fresh parameters, made by NumPy: nothing to compile."""
        ...

    def update(
        self, env: Env, config: Any, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One update at `progress` in [0, 1] of the run: the new state, and scalar metrics."""
        ...


def adam(max_grad_norm: float | Array) -> optax.GradientTransformation:
    """Adam's direction (the learning rate is applied by the algorithm) of the norm-clipped gradient.

    Works on all parameters as one vector: a dozen small arrays take longer to compile than the rest of an update.
    """
    return optax.flatten(optax.chain(optax.clip_by_global_norm(max_grad_norm), optax.scale_by_adam()))


def begin(env: Env, config: AlgorithmConfig, parameters: Any, key: PRNGKeyArray) -> TrainState:
    """The first state of a run: environments as started, the optimiser at rest."""
    env_state, observation = env.reset(jax.random.fold_in(key, 0), config.envs)
    return TrainState(parameters, adam(config.max_grad_norm).init(parameters), env_state, observation, key)


def annealed(config: AlgorithmConfig, progress: Float[Array, ""]) -> Float[Array, ""]:
    """The learning rate, exponential from `learning_rate` to `learning_rate_end`."""
    return config.learning_rate * (config.learning_rate_end / config.learning_rate) ** progress


def make_algorithm(config: AlgorithmConfig, env: Env, network: NetworkConfig) -> Algorithm:
    """The algorithm of a configuration."""
    from e2efly.learn.bptt import BPTT
    from e2efly.learn.ppo import PPO

    makers: dict[type, type] = {PPOConfig: PPO, BPTTConfig: BPTT}
    return makers[type(config)](Features(env.fields), network)
