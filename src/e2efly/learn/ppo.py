"""Proximal policy optimisation (Schulman et al. 2017) on the environment, one update a call.

The policy is a tanh network with Gaussian noise of learned, state-independent size; actions are clipped to [-1, 1]
by the environment's action map. Time-outs bootstrap with the value of the observation before the new start. Where
there are cameras the critic sees no images but the true scene (`Env.privileged`). The gradient of a GRU reaches one
step back: its memory is stored with the sample.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import PPOConfig
from e2efly.env import Env, EnvState
from e2efly.learn.algorithm import TrainState, annealed, at_rest, descend, episode_metrics
from e2efly.learn.critic import gae, init_critic, known, value
from e2efly.learn.networks import Actor, Layers, Weights


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Parameters:
    """What PPO learns."""

    policy: Weights
    log_std: Float[Array | np.ndarray, "4"]
    critic: Layers


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Samples:
    """What a rollout gathers, each leaf (steps, n, ...) or flat."""

    features: Float[Array, "*t f"]
    memory: Float[Array, "*t k"]
    known: Float[Array, "*t c"]
    """What the critic is fed."""
    action: Float[Array, "*t 4"]
    log_prob: Float[Array, "*t"]
    advantage: Float[Array, "*t"]
    value_target: Float[Array, "*t"]


def log_prob(
    action: Float[Array, "*t 4"], mean: Float[Array, "*t 4"], log_std: Float[Array | np.ndarray, "4"]
) -> Float[Array, "*t"]:
    """Log density of a diagonal Gaussian."""
    z = (action - mean) * jnp.exp(-log_std)
    return -jnp.sum(0.5 * z**2 + log_std + 0.5 * jnp.log(2 * jnp.pi), axis=-1)


@dataclass(frozen=True)
class PPO:
    """The algorithm on one environment's shapes; its numbers come in with `config` at every call."""

    actor: Actor

    def init(self, env: Env, config: PPOConfig, seed: int) -> Parameters:
        """Fresh networks, made by NumPy."""
        rng = np.random.default_rng(seed)
        return Parameters(
            self.actor.init(rng, np.asarray(env.hover)),
            np.full(4, config.log_std, np.float32),
            init_critic(rng, self.actor, env),
        )

    def optimizer(self, config: PPOConfig, parameters: Parameters) -> Any:
        """Adam at rest."""
        return at_rest(config, parameters)

    def replay(self, env: Env, config: PPOConfig, state: EnvState, observation: Float[Array, "n o"]) -> None:
        """Nothing: each update learns from its own steps."""

    def update(
        self, env: Env, config: PPOConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """A rollout of every environment, then epochs of minibatches over it.

        Args:
            env: the environment.
            config: numbers of the algorithm.
            state: where the last update ended.
            progress: share of the run that is done, in [0, 1]: sets the learning rate.

        Returns:
            The new state and the metrics of this update.
        """
        key, rollout_key, epoch_key = jax.random.split(state.key, 3)
        samples, env_state, observation, memory, metrics = self._rollout(env, config, state, rollout_key)
        parameters, optimizer, losses = improve(
            self.actor, config, annealed(config, progress), state.parameters, state.optimizer, samples, epoch_key
        )
        metrics |= losses
        metrics["std"] = jnp.mean(jnp.exp(parameters.log_std))
        return dataclasses.replace(
            state,
            parameters=parameters,
            optimizer=optimizer,
            env=env_state,
            observation=observation,
            memory=memory,
            key=key,
        ), metrics

    def _rollout(
        self, env: Env, config: PPOConfig, state: TrainState, key: PRNGKeyArray
    ) -> tuple[Samples, EnvState, Array, Array, dict[str, Array]]:
        parameters = state.parameters
        noise = jax.random.normal(key, (config.horizon, *state.observation.shape[:1], 4))

        def step(carry: tuple[EnvState, Array, Array], z: Array) -> tuple[tuple[EnvState, Array, Array], Any]:
            env_state, observation, memory = carry
            features = self.actor.features(observation, env_state.images)
            mean, next_memory = self.actor(parameters.policy, features, memory)
            action = mean + jnp.exp(parameters.log_std) * z
            from_here = known(self.actor, env, env_state, observation)
            reached, out = env.advance(env_state, action)
            to_there = known(self.actor, env, reached, out.final_observation)
            env_state, out = env.restart(reached, out)
            env_state = env.look(env_state, out.done)
            next_memory = jnp.where(out.done[:, None], 0.0, next_memory)
            gathered = (
                (features, memory, from_here),
                action,
                to_there,
                out.reward,
                out.terminated.astype(jnp.float32),
                out.done.astype(jnp.float32),
                out.success.astype(jnp.float32),
                {name: jnp.mean(x) for name, x in out.terms.items()},
            )
            return (env_state, out.observation, next_memory), gathered

        first = (state.env, state.observation, state.memory)
        (env_state, observation, memory), gathered = jax.lax.scan(step, first, noise)
        (features, memories, from_here), action, to_there, reward, terminated, done, success, terms = gathered
        here, follows = (value(self.actor, parameters.critic, x) for x in (from_here, to_there))
        advantage = gae(reward, here, follows, terminated, done, config.gamma, config.gae_lambda)
        density = -jnp.sum(0.5 * noise**2 + parameters.log_std + 0.5 * jnp.log(2 * jnp.pi), axis=-1)
        samples = Samples(features, memories, from_here, action, density, advantage, advantage + here)
        metrics = {
            "reward": jnp.mean(reward),
            **episode_metrics(done, success),
            **{f"reward/{name}": jnp.mean(x) for name, x in terms.items()},
        }
        return samples, env_state, observation, memory, metrics


def improve(
    actor: Actor,
    config: Any,
    rate: Float[Array, ""],
    parameters: Parameters,
    optimizer: Any,
    samples: Samples,
    key: PRNGKeyArray,
) -> tuple[Parameters, Any, dict[str, Array]]:
    """Epochs of minibatches over the samples of a rollout.

    Returns:
        New parameters and optimiser, and the mean losses, `loss/NAME`.
    """
    size, batches_an_epoch = samples.advantage.size, config.envs * config.horizon // config.minibatch
    # one sort of random bits: sorting is slow on a CPU, so that both epochs share the order
    order = jnp.argsort(jax.random.bits(key, (size,)))
    flat = jax.tree.map(lambda x: x.reshape(size, *x.shape[2:])[order], samples)
    batches = jax.tree.map(lambda x: x.reshape(batches_an_epoch, size // batches_an_epoch, *x.shape[1:]), flat)

    def minibatch(carry: tuple[Parameters, Any], batch: Samples) -> tuple[tuple[Parameters, Any], dict[str, Array]]:
        parameters, optimizer = carry
        grads, losses = jax.grad(_loss, argnums=1, has_aux=True)(actor, parameters, config, batch)
        parameters, optimizer, norm = descend(config, rate, parameters, optimizer, grads)
        return (parameters, optimizer), {**losses, "gradient_norm": norm}

    def epoch(carry: tuple[Parameters, Any], _: None) -> tuple[Any, dict[str, Array]]:
        return jax.lax.scan(minibatch, carry, batches)

    (parameters, optimizer), losses = jax.lax.scan(epoch, (parameters, optimizer), None, length=config.epochs)
    return parameters, optimizer, {f"loss/{name}": jnp.mean(x) for name, x in losses.items()}


def _loss(actor: Actor, parameters: Parameters, config: Any, batch: Samples) -> tuple[Array, dict[str, Array]]:
    mean, _ = actor(parameters.policy, batch.features, batch.memory)
    ratio = jnp.exp(log_prob(batch.action, mean, parameters.log_std) - batch.log_prob)
    advantage = (batch.advantage - jnp.mean(batch.advantage)) / (jnp.std(batch.advantage) + 1e-8)
    clipped = jnp.clip(ratio, 1 - config.clip, 1 + config.clip)
    policy_loss = -jnp.mean(jnp.minimum(ratio * advantage, clipped * advantage))
    estimate = value(actor, parameters.critic, batch.known)
    value_loss = 0.5 * jnp.mean((estimate - batch.value_target) ** 2)
    entropy = jnp.sum(parameters.log_std)
    total = policy_loss + config.value_weight * value_loss - config.entropy_weight * entropy
    return total, {"policy": policy_loss, "value": value_loss, "ratio": jnp.mean(ratio)}
