"""Short-horizon actor-critic (Xu et al. 2022): back-propagation through a short window, and a critic at its end.

The policy ascends the exact gradient of the window's discounted reward plus the value of the state where the window
ends. The critic estimates the reward after the window. It also smooths events (a crash, a gate) that have no gradient
of their own. It learns TD(lambda) returns that use a slowly following copy of itself. If the policy has cameras, the
critic sees the true scene (`Env.privileged`).
"""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import SHACConfig
from e2efly.environment import Env
from e2efly.learning.algorithm import (
    Algorithm,
    TrainState,
    adam_state,
    annealed,
    descend,
    epochs,
    followed,
    gradient_cuts,
    gradient_per_term,
)
from e2efly.learning.critic import critic_input, gae, init_critic, value
from e2efly.learning.networks import Layers, Weights
from e2efly.learning.rollout import RolloutState, window


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class SHACParameters:
    """What SHAC learns."""

    policy: Weights
    critic: Layers
    target: Layers
    """The target critic: a slowly following average of the critic."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class SHACSamples:
    """The samples from which the critic learns. Each leaf is (steps, n, ...) or flat."""

    critic_input: Float[Array, "*t c"]
    value_target: Float[Array, "*t"]


class SHAC(Algorithm):
    """Short-horizon actor-critic; see the module."""

    def init(self, env: Env, config: SHACConfig, seed: int) -> SHACParameters:
        """Fresh networks, made by NumPy."""
        rng = np.random.default_rng(seed)
        policy, critic = self.actor.init(rng, np.asarray(env.hover)), init_critic(rng, self.actor, env)
        return SHACParameters(policy, critic, jax.tree.map(np.copy, critic))

    def optimizer(self, config: SHACConfig, parameters: SHACParameters) -> dict[str, Any]:
        """The initial states of Adam for the policy and for the critic."""
        return {name: adam_state(config, getattr(parameters, name)) for name in ("policy", "critic")}

    def update(
        self, env: Env, config: SHACConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One window, one gradient step of the policy, then epochs of minibatches for the critic."""
        key, noise_key, batch_key = jax.random.split(state.key, 3)
        learned, rate, adam = state.parameters, annealed(config, progress), state.optimizer

        def gain(policy: Weights) -> tuple[dict[str, Array], Any]:
            return self._window(env, config, policy, learned.target, state, noise_key, progress)

        def loss(critic: Layers, batch: SHACSamples) -> tuple[Array, dict[str, Array]]:
            error = 0.5 * jnp.mean((value(self.actor, critic, batch.critic_input) - batch.value_target) ** 2)
            return error, {"value": error}

        grads, (end, samples, metrics), norms = gradient_per_term(gain, learned.policy, config.term_gradients)
        policy, policy_adam, norm = descend(config, rate, learned.policy, adam["policy"], grads)
        critic, critic_adam, losses = epochs(
            config, config.critic_rate * rate, loss, learned.critic, adam["critic"], samples, batch_key
        )
        target = followed(learned.target, critic, config.target_share)
        metrics |= losses | {"loss/gradient_norm": norm, **norms}
        parameters, optimizer = SHACParameters(policy, critic, target), {"policy": policy_adam, "critic": critic_adam}
        return end.into(state, parameters=parameters, optimizer=optimizer, key=key), metrics

    def _window(
        self,
        env: Env,
        config: SHACConfig,
        policy: Weights,
        target: Layers,
        state: TrainState,
        key: PRNGKeyArray,
        progress: Float[Array, ""],
    ) -> tuple[dict[str, Array], Any]:
        n = state.observation.shape[0]
        noise = config.noise * jax.random.normal(key, (config.horizon, n, env.action_size))

        def follows(images: Any, observation: Array, privileged: Array, memory: Array, noise: Any) -> Array:
            del images, memory, noise
            return value(self.actor, target, critic_input(self.actor, observation, privileged))

        def act(at: RolloutState, z: Array) -> tuple[Array, Array, Array]:
            from_here = critic_input(self.actor, at.observation, env.privileged(at.env))
            action, memory = self.actor(policy, self.actor.features(at.observation, at.env.images), at.memory)
            return action + z, memory, from_here

        first, cuts = RolloutState.of(state, jnp.ones(n)), gradient_cuts(config, progress)
        gain, end, (from_here, after, record) = window(env, config, first, act, follows, noise, cuts)
        here = value(self.actor, target, from_here)
        advantage = gae(record.reward, here, after, record.terminated, record.done, config.gamma, config.td_lambda)
        samples = jax.lax.stop_gradient(SHACSamples(from_here, here + advantage))
        return gain, (end, samples, {"value": jnp.mean(here), **record.metrics()})
