"""Back-propagation through time: gradient ascent on the return, through physics, latency and policy.

Each update rolls a window of the deterministic policy and follows the exact gradient of its discounted reward. The
state carries over to the next window, detached; a new start inside a window cuts the gradient by itself, as it does
not depend on what came before.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float

from e2efly.config import BPTTConfig
from e2efly.env import Env, EnvState
from e2efly.learn.algorithm import TrainState, annealed, ascended, at_rest, damped, descend, ends, episode_metrics
from e2efly.learn.networks import Actor, Weights


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Parameters:
    """What BPTT learns."""

    policy: Weights
    """What is judged and shipped: what learns, or its running mean (`BPTTConfig.average`)."""
    learner: Weights
    """What flies the windows and takes the steps."""


@dataclass(frozen=True)
class BPTT:
    """The algorithm on one environment's shapes; its numbers come in with `config` at every call."""

    actor: Actor

    def init(self, env: Env, config: BPTTConfig, seed: int) -> Parameters:
        """A fresh network, made by NumPy."""
        del config
        rng = np.random.default_rng(seed)
        policy = self.actor.init(rng, np.asarray(env.hover))
        return Parameters(policy, jax.tree.map(np.copy, policy))

    def optimizer(self, config: BPTTConfig, parameters: Parameters) -> Any:
        """Adam at rest."""
        return at_rest(config, parameters.learner)

    def replay(self, env: Env, config: BPTTConfig, state: EnvState, observation: Float[Array, "n o"]) -> None:
        """Nothing: each update learns from its own steps."""

    def update(
        self, env: Env, config: BPTTConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One window and one gradient step.

        Args:
            env: the environment.
            config: numbers of the algorithm.
            state: where the last window ended.
            progress: share of the run that is done, in [0, 1]: sets the learning rate.

        Returns:
            The new state and the metrics of this update.
        """
        old, rate = state.parameters, annealed(config, progress)

        def gain(learner: Weights) -> tuple[dict[str, Array], Any]:
            return self._window(env, config, learner, state, progress)

        grads, (env_state, observation, memory, metrics), norms = ascended(gain, old.learner, config.term_gradients)
        learner, optimizer, norm = descend(config, rate, old.learner, state.optimizer, grads)
        metrics |= {"loss/gradient_norm": norm, **norms}
        policy = learner
        if config.average is not None:
            count = optax.tree_utils.tree_get(optimizer, "count").astype(jnp.float32)
            share = jnp.minimum(config.average, 1 - 1 / count)  # of few policies, their plain mean
            policy = jax.tree.map(lambda a, b: b + share * (a - b), old.policy, learner)
        return dataclasses.replace(
            state,
            parameters=Parameters(policy, learner),
            optimizer=optimizer,
            env=env_state,
            observation=observation,
            memory=memory,
        ), metrics

    def _window(
        self, env: Env, config: BPTTConfig, learner: Weights, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[dict[str, Array], Any]:
        keep = jnp.exp(-config.gradient_decay * env.control_period)

        def step(carry: tuple[EnvState, Array, Array, Array], cut: Array) -> tuple[Any, Any]:
            if config.horizon_start:
                carry = (*damped(carry[:3], 1.0 - cut), jnp.where(cut, 1.0, carry[3]))
            env_state, observation, memory, discount = carry
            features = self.actor.features(observation, env_state.images)
            action, memory = self.actor(learner, features, memory)
            env_state, out = env.step(env_state, action)
            env_state = dataclasses.replace(env_state, vehicle=damped(env_state.vehicle, keep))
            gathered = (
                jnp.mean(out.reward),
                jnp.sum(out.done),
                jnp.sum(out.success),
                {name: jnp.mean(x) for name, x in out.terms.items()},
            )
            memory = jnp.where(out.done[:, None], 0.0, memory)
            parts = gathered[-1] if config.term_gradients else {"reward": gathered[0]}
            gain = {name: discount * x for name, x in parts.items()}
            return (env_state, out.observation, memory, discount * config.gamma), (gain, gathered)

        first = (state.env, state.observation, state.memory, jnp.float32(1.0))
        (env_state, observation, memory, _), (gain, gathered) = jax.lax.scan(step, first, ends(config, progress))
        reward, done, success, terms = gathered
        metrics = {
            "reward": jnp.mean(reward),
            **episode_metrics(done, success),
            **{f"reward/{name}": jnp.mean(x) for name, x in terms.items()},
        }
        gain = {name: jnp.sum(x) / config.horizon for name, x in gain.items()}
        return gain, (env_state, observation, memory, metrics)
