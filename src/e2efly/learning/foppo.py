"""PPO refined by first-order gradients: exploration with noise, then the exact gradient of the same flights.

A rollout of the policy with noise is differentiated through physics, latency and policy. PPO's epochs learn from its
samples. They find solutions that no gradient points to (avoiding a tumble, passing an event). The policy then takes one
step along the exact gradient of the rollout's reward and of the critic's value of the state where the rollout ends.
This step refines the solution that was found.
"""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import FOPPOConfig
from e2efly.environment import Env
from e2efly.learning.algorithm import TrainState, adam_state, annealed, descend, gradient_cuts, gradient_per_term
from e2efly.learning.critic import critic_input, value
from e2efly.learning.networks import Weights
from e2efly.learning.ppo import PPO, Acted, PPOParameters
from e2efly.learning.rollout import RolloutState, window


class FOPPO(PPO):
    """PPO refined by first-order gradients; see the module."""

    def optimizer(self, config: FOPPOConfig, parameters: PPOParameters) -> dict[str, Any]:
        """The initial states of Adam for PPO's epochs and for the exact gradient."""
        return {"epochs": adam_state(config, parameters), "exact": adam_state(config, parameters.policy)}

    def update(
        self, env: Env, config: FOPPOConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """A rollout and its exact gradient, PPO's epochs over its samples, then one step along the gradient."""
        key, noise_key, epoch_key = jax.random.split(state.key, 3)
        learned, rate, adam = state.parameters, annealed(config, progress), state.optimizer

        def gain(policy: Weights) -> tuple[dict[str, Array], Any]:
            return self._window(env, config, dataclasses.replace(learned, policy=policy), state, noise_key, progress)

        grads, (end, samples, metrics), norms = gradient_per_term(gain, learned.policy, config.term_gradients)
        found, epochs_adam, losses = self.improve(config, rate, learned, adam["epochs"], samples, epoch_key)
        policy, exact_adam, norm = descend(config, config.exact_rate * rate, found.policy, adam["exact"], grads)
        metrics |= norms | losses | {"loss/exact_gradient_norm": norm, "std": jnp.mean(jnp.exp(found.log_std))}
        parameters = dataclasses.replace(found, policy=policy)
        optimizer = {"epochs": epochs_adam, "exact": exact_adam}
        return end.into(state, parameters=parameters, optimizer=optimizer, key=key), metrics

    def _window(
        self,
        env: Env,
        config: FOPPOConfig,
        parameters: PPOParameters,
        state: TrainState,
        key: PRNGKeyArray,
        progress: Float[Array, ""],
    ) -> tuple[dict[str, Array], Any]:
        """The gain of the rollout, with its gradient. Then the end of the rollout, the samples and the metrics, without
        gradient.
        """
        n = state.observation.shape[0]
        noise, cuts = jax.random.normal(key, (config.horizon, n, env.action_size)), gradient_cuts(config, progress)

        def follows(images: Any, observation: Array, privileged: Array, memory: Array, noise: Any) -> Array:
            del images, memory, noise
            return value(self.actor, parameters.critic, critic_input(self.actor, observation, privileged))

        def act(at: RolloutState, z: Array) -> tuple[Array, Array, Acted]:
            return self.act(env, parameters, at, z)

        first = RolloutState.of(state, jnp.ones(n))
        gain, end, (acted, after, record) = window(env, config, first, act, follows, noise, cuts)
        samples = jax.lax.stop_gradient(self.samples(config, parameters, acted, noise, after, record))
        return gain, (end, samples, record.metrics())
