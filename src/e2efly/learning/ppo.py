"""Proximal policy optimisation (Schulman et al. 2017) on the environment.

The policy is a tanh network with Gaussian noise of learned, state-independent size; actions are clipped to [-1, 1]
by the environment's action map. Time-outs bootstrap with the value of the observation before the new start. If the
policy has cameras, the critic sees the true scene (`Env.privileged`) instead of the images. A GRU learns from pieces of
`sequence` steps. Each piece begins with the memory that the rollout had at that step, and the gradient goes back to the
first step of the piece.
"""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.environment import Env
from e2efly.learning.algorithm import Algorithm, TrainState, annealed, epochs
from e2efly.learning.critic import critic_input, gae, init_critic, value
from e2efly.learning.networks import Actor, Layers, Weights
from e2efly.learning.rollout import RolloutState, StepRecord, advance


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PPOParameters:
    """What PPO learns."""

    policy: Weights
    log_std: Float[Array | np.ndarray, " c"]
    critic: Layers


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Acted:
    """The inputs of the policy and the critic, and the actions taken. Each leaf is (steps, n, ...) or flat."""

    features: Float[Array, "*t f"]
    memory: Float[Array, "*t k"]
    critic_input: Float[Array, "*t c"]
    action: Float[Array, "*t c"]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class PPOSamples:
    """The samples from which the epochs learn. Each leaf is (steps, n, ...) or flat."""

    acted: Acted
    log_prob: Float[Array, "*t"]
    advantage: Float[Array, "*t"]
    value_target: Float[Array, "*t"]
    done: Bool[Array, "*t"]
    """Whether the episode ended with this step. The next step then begins without memory."""


def log_prob(z: Float[Array, "*t c"], log_std: Float[Array | np.ndarray, " c"]) -> Float[Array, "*t"]:
    """Log density of a diagonal Gaussian at a point that is `z` standard deviations from the mean."""
    return -jnp.sum(0.5 * z**2 + log_std + 0.5 * jnp.log(2 * jnp.pi), axis=-1)


class PPO(Algorithm):
    """Proximal policy optimisation; see the module."""

    def init(self, env: Env, config: Any, seed: int) -> PPOParameters:
        """Fresh networks, made by NumPy.

        Raises:
            ValueError: with a GRU, when the length of its pieces does not divide a rollout or a minibatch.
        """
        if self.actor.network.recurrent and (config.horizon % config.sequence or config.minibatch % config.sequence):
            raise ValueError(
                f"algo.sequence is {config.sequence}; accepted with a GRU: a divisor of algo.horizon "
                f"({config.horizon}) and of algo.minibatch ({config.minibatch})"
            )
        rng = np.random.default_rng(seed)
        return PPOParameters(
            self.actor.init(rng, np.asarray(env.hover)),
            np.full(env.action_size, config.log_std, np.float32),
            init_critic(rng, self.actor, env),
        )

    def update(
        self, env: Env, config: Any, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """A rollout of every environment, then several epochs of minibatches over its samples."""
        key, rollout_key, epoch_key = jax.random.split(state.key, 3)
        samples, end, metrics = self._rollout(env, config, state, rollout_key)
        parameters, optimizer, losses = self.improve(
            config, annealed(config, progress), state.parameters, state.optimizer, samples, epoch_key
        )
        metrics |= losses | {"std": jnp.mean(jnp.exp(parameters.log_std))}
        return end.into(state, parameters=parameters, optimizer=optimizer, key=key), metrics

    def act(
        self, env: Env, parameters: PPOParameters, at: RolloutState, z: Float[Array, "n c"]
    ) -> tuple[Array, Array, Acted]:
        """The action with noise, the next recurrent state, and the data that a sample stores."""
        features = self.actor.features(at.observation, at.env.images)
        mean, memory = self.actor(parameters.policy, features, at.memory)
        action = mean + jnp.exp(parameters.log_std) * z
        from_here = critic_input(self.actor, at.observation, env.privileged(at.env))
        return action, memory, Acted(features, at.memory, from_here, action)

    def samples(
        self, config: Any, parameters: PPOParameters, acted: Acted, noise: Array, next_value: Array, record: StepRecord
    ) -> PPOSamples:
        """The samples of a rollout: advantages and value targets by GAE."""
        here = value(self.actor, parameters.critic, acted.critic_input)
        ended = record.terminated, record.done
        advantage = gae(record.reward, here, next_value, *ended, config.gamma, config.gae_lambda)
        return PPOSamples(acted, log_prob(noise, parameters.log_std), advantage, advantage + here, record.done)

    def improve(
        self,
        config: Any,
        rate: Float[Array, ""],
        parameters: PPOParameters,
        optimizer: Any,
        samples: PPOSamples,
        key: PRNGKeyArray,
    ) -> tuple[PPOParameters, Any, dict[str, Array]]:
        """Run epochs of minibatches over the samples of a rollout.

        Returns:
            The new parameters, the new state of the optimiser, and the mean losses.
        """

        def loss(parameters: PPOParameters, batch: PPOSamples) -> tuple[Array, dict[str, Array]]:
            return _loss(self.actor, parameters, config, batch)

        if self.actor.network.recurrent:
            samples = in_pieces(samples, config.sequence)
        return epochs(config, rate, loss, parameters, optimizer, samples, key)

    def _rollout(
        self, env: Env, config: Any, state: TrainState, key: PRNGKeyArray
    ) -> tuple[PPOSamples, RolloutState, dict[str, Array]]:
        parameters = state.parameters
        noise = jax.random.normal(key, (config.horizon, *state.observation.shape[:1], env.action_size))

        def step(at: RolloutState, z: Array) -> tuple[RolloutState, Any]:
            action, memory, acted = self.act(env, parameters, at, z)
            after, out = advance(env, config, at, action, memory, critic=True)
            assert out.final_privileged is not None
            to_there = critic_input(self.actor, out.final_observation, out.final_privileged)
            return after, (acted, to_there, StepRecord.of(out))

        end, (acted, to_there, record) = jax.lax.scan(step, RolloutState.of(state), noise)
        follows = value(self.actor, parameters.critic, to_there)  # for all steps at once
        return self.samples(config, parameters, acted, noise, follows, record), end, record.metrics()


def in_pieces(samples: PPOSamples, length: int) -> PPOSamples:
    """Samples (steps, n, ...), cut into pieces of successive steps: (steps / length, n, length, ...)."""

    def cut(x: Array) -> Array:
        return jnp.swapaxes(x.reshape(-1, length, *x.shape[1:]), 1, 2)

    return jax.tree.map(cut, samples)


def means(actor: Actor, policy: Weights, batch: PPOSamples) -> Float[Array, "*t c"]:
    """The action of the policy without noise for each sample. With a GRU, the samples are pieces (m, length, ...)."""
    acted = batch.acted
    if not actor.network.recurrent:
        return actor(policy, acted.features, acted.memory)[0]

    def step(memory: Array, x: tuple[Array, Array]) -> tuple[Array, Array]:
        features, done = x
        mean, memory = actor(policy, features, memory)
        return jnp.where(done[:, None], 0.0, memory), mean

    along = jnp.swapaxes(acted.features, 0, 1), jnp.swapaxes(batch.done, 0, 1)
    return jnp.swapaxes(jax.lax.scan(step, acted.memory[:, 0], along)[1], 0, 1)


def _loss(actor: Actor, parameters: PPOParameters, config: Any, batch: PPOSamples) -> tuple[Array, dict[str, Array]]:
    acted = batch.acted
    mean = means(actor, parameters.policy, batch)
    z = (acted.action - mean) * jnp.exp(-parameters.log_std)
    ratio = jnp.exp(log_prob(z, parameters.log_std) - batch.log_prob)
    advantage = (batch.advantage - jnp.mean(batch.advantage)) / (jnp.std(batch.advantage) + 1e-8)
    clipped = jnp.clip(ratio, 1 - config.clip, 1 + config.clip)
    policy_loss = -jnp.mean(jnp.minimum(ratio * advantage, clipped * advantage))
    estimate = value(actor, parameters.critic, acted.critic_input)
    value_loss = 0.5 * jnp.mean((estimate - batch.value_target) ** 2)
    entropy = jnp.sum(parameters.log_std)
    total = policy_loss + config.value_weight * value_loss - config.entropy_weight * entropy
    return total, {"policy": policy_loss, "value": value_loss, "ratio": jnp.mean(ratio)}
