"""Short-horizon actor-critic (Xu et al. 2022): back-propagation through a short window, and a critic at its end.

The policy ascends the exact gradient of the window's discounted reward plus the value of where it ends; the critic
gives what lies beyond, and smooths events (a crash, a gate) that have no gradient of their own. It learns TD(lambda)
returns of a slowly following copy of itself. Where there are cameras it sees the true scene (`Env.privileged`).
"""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import SHACConfig
from e2efly.env import Env, EnvState
from e2efly.learn.algorithm import TrainState, annealed, ascended, at_rest, descend, ends, episode_metrics
from e2efly.learn.critic import gae, init_critic, known, value
from e2efly.learn.networks import Actor, Layers, Weights
from e2efly.learn.window import Flight, cut_off, flown


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Parameters:
    """What SHAC learns."""

    policy: Weights
    critic: Layers
    target: Layers
    """The critic as it was, on average, a while ago."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Samples:
    """What the critic learns from, each leaf (steps, n, ...) or flat."""

    known: Float[Array, "*t c"]
    value_target: Float[Array, "*t"]


@dataclass(frozen=True)
class SHAC:
    """The algorithm on one environment's shapes; its numbers come in with `config` at every call."""

    actor: Actor

    def init(self, env: Env, config: SHACConfig, seed: int) -> Parameters:
        """Fresh networks, made by NumPy."""
        del config
        rng = np.random.default_rng(seed)
        policy, critic = self.actor.init(rng, np.asarray(env.hover)), init_critic(rng, self.actor, env)
        return Parameters(policy, critic, jax.tree.map(np.copy, critic))

    def optimizer(self, config: SHACConfig, parameters: Parameters) -> dict[str, Any]:
        """Adam at rest, of the policy and of the critic."""
        return {name: at_rest(config, getattr(parameters, name)) for name in ("policy", "critic")}

    def replay(self, env: Env, config: SHACConfig, state: EnvState, observation: Float[Array, "n o"]) -> None:
        """Nothing: each update learns from its own steps."""

    def update(
        self, env: Env, config: SHACConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One window, one gradient step of the policy, and epochs of minibatches of the critic.

        Args:
            env: the environment.
            config: numbers of the algorithm.
            state: where the last window ended.
            progress: share of the run that is done, in [0, 1]: sets the learning rates.

        Returns:
            The new state and the metrics of this update.
        """
        key, noise_key, batch_key = jax.random.split(state.key, 3)
        learned, rate = state.parameters, annealed(config, progress)

        def gain(policy: Weights) -> tuple[dict[str, Array], Any]:
            return self._window(env, config, policy, learned.target, state, noise_key, progress)

        grads, (flight, samples, metrics), norms = ascended(gain, learned.policy, config.term_gradients)
        policy, policy_adam, norm = descend(config, rate, learned.policy, state.optimizer["policy"], grads)
        metrics |= {"loss/gradient_norm": norm, **norms}
        critic, critic_adam, metrics["loss/value"] = self._fit(
            config, config.critic_rate * rate, learned.critic, state.optimizer["critic"], samples, batch_key
        )
        share = config.target_share
        target = jax.tree.map(lambda old, new: old + share * (new - old), learned.target, critic)
        return dataclasses.replace(
            state,
            parameters=Parameters(policy, critic, target),
            optimizer={"policy": policy_adam, "critic": critic_adam},
            env=flight.env,
            observation=flight.observation,
            memory=flight.memory,
            key=key,
        ), metrics

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
        noise = config.noise * jax.random.normal(key, (config.horizon, *state.observation.shape[:1], 4))

        def worth(env_state: EnvState, observation: Array, memory: Array) -> Array:
            del memory
            return value(self.actor, target, known(self.actor, env, env_state, observation))

        def step(flight: Flight, x: tuple[Array, Array]) -> tuple[Flight, Any]:
            z, cut = x
            flight, late = cut_off(config, flight, cut, worth)
            from_here = known(self.actor, env, flight.env, flight.observation)
            features = self.actor.features(flight.observation, flight.env.images)
            action, memory = self.actor(policy, features, flight.memory)
            flight, gain, follows, out = flown(env, config, flight, action + z, memory, worth)
            gain["value"] += late
            gathered = (
                from_here, follows, out.reward, out.terminated, out.done, out.success,
                {name: jnp.mean(x) for name, x in out.terms.items()},
            )  # fmt: skip
            return flight, (gain, jax.lax.stop_gradient(gathered))

        first = Flight.of(state.env, state.observation, state.memory)
        flight, (gain, gathered) = jax.lax.scan(step, first, (noise, ends(config, progress)))
        gain = {name: jnp.sum(x) / config.horizon for name, x in gain.items()}
        gain["value"] += flight.worth(worth) / config.horizon
        from_here, follows, reward, terminated, done, success, terms = gathered
        here = value(self.actor, target, from_here)
        ended = (terminated.astype(jnp.float32), done.astype(jnp.float32))
        advantage = gae(reward, here, follows, *ended, config.gamma, config.td_lambda)
        samples = jax.lax.stop_gradient(Samples(from_here, here + advantage))
        metrics = {
            "reward": jnp.mean(reward),
            "value": jnp.mean(here),
            **episode_metrics(done, success),
            **{f"reward/{name}": jnp.mean(x) for name, x in terms.items()},
        }
        return gain, (flight, samples, metrics)

    def _fit(
        self,
        config: SHACConfig,
        rate: Float[Array, ""],
        critic: Layers,
        optimizer: Any,
        samples: Samples,
        key: PRNGKeyArray,
    ) -> tuple[Layers, Any, Array]:
        size, count = samples.value_target.size, config.envs * config.horizon // config.minibatch
        order = jnp.argsort(jax.random.bits(key, (size,)))
        flat = jax.tree.map(lambda x: x.reshape(size, *x.shape[2:])[order], samples)
        batches = jax.tree.map(lambda x: x.reshape(count, size // count, *x.shape[1:]), flat)

        def error(critic: Layers, batch: Samples) -> Array:
            return 0.5 * jnp.mean((value(self.actor, critic, batch.known) - batch.value_target) ** 2)

        def minibatch(carry: tuple[Layers, Any], batch: Samples) -> tuple[tuple[Layers, Any], Array]:
            critic, optimizer = carry
            loss, grads = jax.value_and_grad(error)(critic, batch)
            critic, optimizer, _ = descend(config, rate, critic, optimizer, grads)
            return (critic, optimizer), loss

        def epoch(carry: tuple[Layers, Any], _: None) -> tuple[Any, Array]:
            return jax.lax.scan(minibatch, carry, batches)

        (critic, optimizer), losses = jax.lax.scan(epoch, (critic, optimizer), None, length=config.epochs)
        return critic, optimizer, jnp.mean(losses)
