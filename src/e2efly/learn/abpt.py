"""Amended back-propagation through time (Li et al. 2025): windows of a stochastic policy between values of critics.

An update gathers transitions without gradients into a replay buffer, fits twin critics Q(s, a) to it, and then ascends
the mean of two estimates of the return: the exact gradient of a window's reward with Q of where it ends, and Q of where
it began. The first is sharp where rewards are smooth, the second knows of events that have no gradient. Windows begin
at new starts and at visited states, at random, so that those far from a start are learned from, too.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import ABPTConfig
from e2efly.env import Env, EnvState
from e2efly.learn.algorithm import TrainState, annealed, ascended, at_rest, descend, ends, episode_metrics
from e2efly.learn.critic import known
from e2efly.learn.networks import Actor, Layers, Weights, init_mlp, mlp
from e2efly.learn.replay import Places, Ring
from e2efly.learn.window import Flight, Worth, cut_off, flown

QUIETEST = -5.0
"""The log standard deviation of the action noise falls no lower."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Stochastic:
    """A policy with noise."""

    mean: Weights
    log_std: Float[Array | np.ndarray, "4"]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Parameters:
    """What ABPT learns."""

    policy: Weights
    log_std: Float[Array | np.ndarray, "4"]
    critics: tuple[Layers, Layers]
    targets: tuple[Layers, Layers]
    """The critics as they were, on average, a while ago."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Situation:
    """Where a policy acts, as networks take it; each leaf (n, ...)."""

    features: Float[Array, "n f"]
    memory: Float[Array, "n k"]
    known: Float[Array, "n c"]
    """What critics are fed beside the action."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Transition:
    """What the critics learn from, each leaf (n, ...)."""

    here: Situation
    action: Float[Array, "n 4"]
    reward: Float[Array, " n"]
    ended: Float[Array, " n"]
    """1: for good, nothing follows."""
    there: Situation


@dataclass(frozen=True)
class ABPT:
    """The algorithm on one environment's shapes; its numbers come in with `config` at every call."""

    actor: Actor

    def init(self, env: Env, config: ABPTConfig, seed: int) -> Parameters:
        """Fresh networks, made by NumPy."""
        rng = np.random.default_rng(seed)
        policy = self.actor.init(rng, np.asarray(env.hover))
        sizes = (self.actor.features.state_size + env.privileged_size + 4, *self.actor.network.hidden, 1)
        critics = (init_mlp(rng, sizes, 1.0), init_mlp(rng, sizes, 1.0))
        return Parameters(policy, np.full(4, config.log_std, np.float32), critics, jax.tree.map(np.copy, critics))

    def optimizer(self, config: ABPTConfig, parameters: Parameters) -> dict[str, Any]:
        """Adam at rest, of the policy and of the critics."""
        policy = Stochastic(parameters.policy, parameters.log_std)
        return {"policy": at_rest(config, policy), "critics": at_rest(config, parameters.critics)}

    def replay(self, env: Env, config: ABPTConfig, state: EnvState, observation: Float[Array, "n o"]) -> dict[str, Any]:
        """An empty buffer of transitions, and the first states as places to begin windows at."""
        n = observation.shape[0]
        here = self._situation(env, state, observation, self.actor.memory(n))
        one = Transition(here, jnp.zeros((n, 4)), jnp.zeros(n), jnp.zeros(n), here)
        devices = config.envs // n
        places = Places.of((state, observation, self.actor.memory(n)), config.places // config.envs)
        return {"transitions": Ring.of(one, config.buffer // devices), "places": places}

    def update(
        self, env: Env, config: ABPTConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """Steps into the buffer, gradient steps of the critics, one window and one gradient step of the policy.

        Args:
            env: the environment.
            config: numbers of the algorithm.
            state: where the last update ended.
            progress: share of the run that is done, in [0, 1]: sets the learning rates.

        Returns:
            The new state and the metrics of this update.
        """
        key, collect_key, critic_key, start_key, window_key = jax.random.split(state.key, 5)
        learned, rate = state.parameters, annealed(config, progress)
        policy = Stochastic(learned.policy, learned.log_std)
        (env_state, observation, memory), transitions, metrics = self._collect(env, config, policy, state, collect_key)
        ring = state.replay["transitions"].filled(transitions)
        places = state.replay["places"].filled((env_state, observation, memory))
        critics, targets, critics_adam, metrics["loss/value"] = self._fit(
            config, config.critic_rate * rate, policy, learned, state.optimizer["critics"], ring, critic_key
        )

        start = self._start(env, config, places, env_state, start_key)

        def gain(policy: Stochastic) -> tuple[dict[str, Array], dict[str, Array]]:
            return self._window(env, config, policy, targets, start, window_key, progress)

        grads, more, norms = ascended(gain, policy, config.term_gradients)
        policy, policy_adam, norm = descend(config, rate, policy, state.optimizer["policy"], grads)
        log_std = jnp.maximum(policy.log_std, QUIETEST)
        return dataclasses.replace(
            state,
            parameters=Parameters(policy.mean, log_std, critics, targets),
            optimizer={"policy": policy_adam, "critics": critics_adam},
            env=env_state,
            observation=observation,
            memory=memory,
            key=key,
            replay={"transitions": ring, "places": places},
        ), metrics | more | norms | {"loss/gradient_norm": norm, "std": jnp.mean(jnp.exp(log_std))}

    def _situation(self, env: Env, state: EnvState, observation: Array, memory: Array) -> Situation:
        features = self.actor.features(observation, state.images)
        return Situation(features, memory, known(self.actor, env, state, observation))

    def _act(self, policy: Stochastic, here: Situation, z: Float[Array, "n 4"]) -> tuple[Array, Array]:
        """An action with noise, and the GRU's next memory."""
        mean, memory = self.actor(policy.mean, here.features, here.memory)
        return mean + jnp.exp(policy.log_std) * z, memory

    def _q(self, critics: tuple[Layers, Layers], here: Situation, action: Array) -> tuple[Array, Array]:
        fed = jnp.concatenate([here.known, jnp.clip(action, -1.0, 1.0)], axis=-1)
        one, other = (mlp(critic, fed, self.actor.network.activation)[..., 0] for critic in critics)
        return one, other

    def _worth(self, policy: Stochastic, targets: tuple[Layers, Layers], here: Situation, z: Array) -> Array:
        """What follows from here, at the policy's word: the smaller estimate of the two."""
        return jnp.minimum(*self._q(targets, here, self._act(policy, here, z)[0]))

    def _collect(
        self, env: Env, config: ABPTConfig, policy: Stochastic, state: TrainState, key: PRNGKeyArray
    ) -> tuple[Any, Transition, dict[str, Array]]:
        """Steps without gradients: where they end, the transitions (steps * n, ...), and the metrics."""

        def step(carry: tuple[EnvState, Array, Array], z: Array) -> tuple[Any, Any]:
            env_state, observation, memory = carry
            here = self._situation(env, env_state, observation, memory)
            action, memory = self._act(policy, here, z)
            reached, out = env.advance(env_state, action)
            env_state, out = env.restart(reached, out)
            env_state = env.look(env_state, out.done)
            # where an episode's time is out its last image stands for the next: good enough for a value
            images = tuple(
                jnp.where(out.done.reshape(-1, *[1] * (new.ndim - 1)), old, new)
                for old, new in zip(reached.images, env_state.images, strict=True)
            )
            seen = dataclasses.replace(reached, images=images)
            there = self._situation(env, seen, out.final_observation, memory)
            ended = out.terminated.astype(jnp.float32)
            memory = jnp.where(out.done[:, None], 0.0, memory)
            gathered = Transition(here, action, out.reward, ended, there), out.done, out.success
            return (env_state, out.observation, memory), gathered

        noise = jax.random.normal(key, (config.collect, *state.observation.shape[:1], 4))
        first = (state.env, state.observation, state.memory)
        last, (transitions, done, success) = jax.lax.scan(step, first, noise)
        flat = jax.tree.map(lambda x: x.reshape(x.shape[0] * x.shape[1], *x.shape[2:]), transitions)
        return last, flat, {"reward": jnp.mean(transitions.reward), **episode_metrics(done, success)}

    def _fit(
        self,
        config: ABPTConfig,
        rate: Float[Array, ""],
        policy: Stochastic,
        learned: Parameters,
        optimizer: Any,
        ring: Ring,
        key: PRNGKeyArray,
    ) -> tuple[tuple[Layers, Layers], tuple[Layers, Layers], Any, Array]:
        size = config.minibatch * ring.rows // config.buffer  # this device's part

        def error(critics: tuple[Layers, Layers], batch: Transition, target: Array) -> Array:
            return sum(0.5 * jnp.mean((q - target) ** 2) for q in self._q(critics, batch.here, batch.action))  # pyright: ignore

        def minibatch(carry: tuple[Any, Any, Any], key: PRNGKeyArray) -> tuple[Any, Array]:
            critics, targets, optimizer = carry
            rows_key, noise_key = jax.random.split(key)
            batch = ring.drawn(rows_key, size)
            follows = self._worth(policy, targets, batch.there, jax.random.normal(noise_key, (size, 4)))
            target = batch.reward + config.gamma * (1.0 - batch.ended) * follows
            loss, grads = jax.value_and_grad(error)(critics, batch, target)
            critics, optimizer, _ = descend(config, rate, critics, optimizer, grads)
            share = config.target_share
            targets = jax.tree.map(lambda old, new: old + share * (new - old), targets, critics)
            return (critics, targets, optimizer), loss

        first = (learned.critics, learned.targets, optimizer)
        (critics, targets, optimizer), losses = jax.lax.scan(minibatch, first, jax.random.split(key, config.fits))
        return critics, targets, optimizer, jnp.mean(losses)

    def _start(
        self, env: Env, config: ABPTConfig, places: Places, now: EnvState, key: PRNGKeyArray
    ) -> tuple[EnvState, Array, Array]:
        """Where windows begin: new starts and visited states."""
        reset_key, which_key, draw_key = jax.random.split(key, 3)
        state, observation, memory = places.drawn(draw_key)
        n = observation.shape[0]
        anew, first = env.reset(reset_key, n)
        state = dataclasses.replace(state, key=anew.key, tick=now.tick)
        fresh = jax.random.uniform(which_key, (n,)) < config.fresh_share

        def choose(new: Array, old: Array) -> Array:
            if old.shape[:1] != (n,):
                return old
            return jnp.where(fresh.reshape(-1, *[1] * (old.ndim - 1)), new, old)

        anew = dataclasses.replace(anew, tick=now.tick)
        return jax.tree.map(choose, (anew, first, self.actor.memory(n)), (state, observation, memory))

    def _window(
        self,
        env: Env,
        config: ABPTConfig,
        policy: Stochastic,
        targets: tuple[Layers, Layers],
        start: tuple[EnvState, Array, Array],
        key: PRNGKeyArray,
        progress: Float[Array, ""],
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        noise = jax.random.normal(key, (config.horizon + 2, start[1].shape[0], 4))

        def worth(policy: Stochastic, z: Array) -> Worth:
            return lambda *there: self._worth(policy, targets, self._situation(env, *there), z)

        def step(flight: Flight, x: tuple[Array, Array]) -> tuple[Flight, Any]:
            z, cut = x
            flight, late = cut_off(config, flight, cut, worth(policy, z))
            here = self._situation(env, flight.env, flight.observation, flight.memory)
            action, memory = self._act(policy, here, z)
            flight, gain, _, out = flown(env, config, flight, action, memory, worth(policy, jnp.zeros_like(z)))
            gain["value"] += late
            return flight, (gain, {name: jnp.mean(x) for name, x in out.terms.items()})

        first = Flight.of(*start)
        at_once = first.worth(worth(policy, noise[-1]))
        flight, (gain, terms) = jax.lax.scan(step, first, (noise[: config.horizon], ends(config, progress)))
        share, scale = config.at_once, 1.0 / config.horizon
        gain = {name: scale * (1 - share) * jnp.sum(x) for name, x in gain.items()}
        gain["value"] += scale * (1 - share) * flight.worth(worth(policy, noise[-2]))
        gain["at_once"] = scale * share * at_once
        gain["entropy"] = scale * config.entropy_weight * jnp.sum(policy.log_std)
        return gain, {"value": at_once, **{f"reward/{name}": jnp.mean(x) for name, x in terms.items()}}
