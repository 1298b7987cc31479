"""Amended back-propagation through time (Li et al. 2025): windows of a stochastic policy, with critics at both ends.

An update gathers transitions without gradients into a replay buffer and fits twin critics Q(s, a) to it. It then
ascends the gradient of a weighted mean of two estimates of the return. The first is the reward of a window plus Q at
its end, differentiated exactly. The second is Q at the start of the window. The first is accurate where rewards are
smooth. The second includes events that have no gradient. Windows begin at random either at new starts or at visited
states, so that the policy also learns from states far from a start.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import ABPTConfig
from e2efly.environment import Env, EnvState
from e2efly.learning.algorithm import (
    Algorithm,
    TrainState,
    adam_state,
    annealed,
    descend,
    episode_metrics,
    followed,
    gradient_cuts,
    gradient_per_term,
)
from e2efly.learning.critic import critic_input
from e2efly.learning.networks import Layers, Weights, init_mlp, mlp
from e2efly.learning.replay_buffer import Places, Ring
from e2efly.learning.rollout import RolloutState, advance, window

QUIETEST = -5.0
"""Lower limit of the log standard deviation of the action noise."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Stochastic:
    """A policy with noise."""

    mean: Weights
    log_std: Float[Array | np.ndarray, " c"]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ABPTParameters:
    """What ABPT learns."""

    policy: Weights
    log_std: Float[Array | np.ndarray, " c"]
    critics: tuple[Layers, Layers]
    targets: tuple[Layers, Layers]
    """The target critics: a slowly following average of the critics."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Situation:
    """The situation in which a policy acts, in the form that the networks take. Each leaf is (n, ...)."""

    features: Float[Array, "n f"]
    memory: Float[Array, "n k"]
    critic_input: Float[Array, "n c"]
    """The input of the critics in addition to the action."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Transition:
    """The transitions from which the critics learn. Each leaf is (n, ...)."""

    here: Situation
    action: Float[Array, "n c"]
    reward: Float[Array, " n"]
    ended: Float[Array, " n"]
    """1: the episode has terminated and nothing follows."""
    there: Situation


class ABPT(Algorithm):
    """Amended back-propagation through time; see the module."""

    def init(self, env: Env, config: ABPTConfig, seed: int) -> ABPTParameters:
        """Fresh networks, made by NumPy.

        Raises:
            ValueError: for worlds of several vehicles, as its stored starts are of one vehicle each.
        """
        if getattr(env, "agents", 1) > 1:
            raise ValueError(
                f"algo is abpt and task.agents {env.agents}; accepted: one vehicle in a world, or another algorithm, "
                "as abpt starts from stored states of single vehicles"
            )
        rng = np.random.default_rng(seed)
        policy = self.actor.init(rng, np.asarray(env.hover))
        sizes = (self.actor.features.state_size + env.privileged_size + env.action_size, *self.actor.network.hidden, 1)
        critics = (init_mlp(rng, sizes, 1.0), init_mlp(rng, sizes, 1.0))
        return ABPTParameters(
            policy, np.full(env.action_size, config.log_std, np.float32), critics, jax.tree.map(np.copy, critics)
        )

    def optimizer(self, config: ABPTConfig, parameters: ABPTParameters) -> dict[str, Any]:
        """The initial states of Adam for the policy and for the critics."""
        policy = Stochastic(parameters.policy, parameters.log_std)
        return {"policy": adam_state(config, policy), "critics": adam_state(config, parameters.critics)}

    def replay(self, env: Env, config: ABPTConfig, state: EnvState, observation: Float[Array, "n o"]) -> dict[str, Any]:
        """An empty buffer of transitions, and the first states as places where windows can begin."""
        n = observation.shape[0]
        here = self._here(env, RolloutState(state, observation, self.actor.memory(n)))
        one = Transition(here, jnp.zeros((n, env.action_size)), jnp.zeros(n), jnp.zeros(n), here)
        devices = config.envs // n
        places = Places.of((state, observation, self.actor.memory(n)), config.places // config.envs)
        return {"transitions": Ring.of(one, config.buffer // devices), "places": places}

    def update(
        self, env: Env, config: ABPTConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """Gather steps into the buffer, take gradient steps of the critics, then one window and one gradient step of
        the policy.
        """
        key, collect_key, critic_key, start_key, window_key = jax.random.split(state.key, 5)
        learned, rate = state.parameters, annealed(config, progress)
        policy = Stochastic(learned.policy, learned.log_std)
        end, transitions, metrics = self._collect(env, config, policy, state, collect_key)
        ring = state.replay["transitions"].filled(transitions)
        places = state.replay["places"].filled((end.env, end.observation, end.memory))
        critics, targets, critics_adam, metrics["loss/value"] = self._fit(
            config, config.critic_rate * rate, policy, learned, state.optimizer["critics"], ring, critic_key
        )
        start = self._start(env, config, places, end.env, start_key)

        def gain(policy: Stochastic) -> tuple[dict[str, Array], dict[str, Array]]:
            return self._window(env, config, policy, targets, start, window_key, progress)

        grads, more, norms = gradient_per_term(gain, policy, config.term_gradients)
        policy, policy_adam, norm = descend(config, rate, policy, state.optimizer["policy"], grads)
        log_std = jnp.maximum(policy.log_std, QUIETEST)
        return end.into(
            state,
            parameters=ABPTParameters(policy.mean, log_std, critics, targets),
            optimizer={"policy": policy_adam, "critics": critics_adam},
            key=key,
            replay={"transitions": ring, "places": places},
        ), metrics | more | norms | {"loss/gradient_norm": norm, "std": jnp.mean(jnp.exp(log_std))}

    def _situation(self, images: Any, observation: Array, privileged: Array, memory: Array) -> Situation:
        features = self.actor.features(observation, images)
        return Situation(features, memory, critic_input(self.actor, observation, privileged))

    def _here(self, env: Env, at: RolloutState) -> Situation:
        return self._situation(at.env.images, at.observation, env.privileged(at.env), at.memory)

    def _act(self, policy: Stochastic, here: Situation, z: Float[Array, "n c"]) -> tuple[Array, Array]:
        """An action with noise, and the next recurrent state."""
        mean, memory = self.actor(policy.mean, here.features, here.memory)
        return mean + jnp.exp(policy.log_std) * z, memory

    def _q(self, critics: tuple[Layers, Layers], here: Situation, action: Array) -> tuple[Array, Array]:
        fed = jnp.concatenate([here.critic_input, jnp.clip(action, -1.0, 1.0)], axis=-1)
        one, other = (mlp(critic, fed, self.actor.network.activation)[..., 0] for critic in critics)
        return one, other

    def _value(self, policy: Stochastic, targets: tuple[Layers, Layers], here: Situation, z: Array) -> Array:
        """The value of acting here by the policy: the smaller of the two critics' estimates."""
        return jnp.minimum(*self._q(targets, here, self._act(policy, here, z)[0]))

    def _collect(
        self, env: Env, config: ABPTConfig, policy: Stochastic, state: TrainState, key: PRNGKeyArray
    ) -> tuple[RolloutState, Transition, dict[str, Array]]:
        """Steps without gradients."""

        def step(at: RolloutState, z: Array) -> tuple[RolloutState, Any]:
            here = self._here(env, at)
            action, memory = self._act(policy, here, z)
            after, out = advance(env, config, at, action, memory, critic=True)
            # when an episode ends, its last image is used in place of the next one: good enough for a value
            images = tuple(
                jnp.where(out.done.reshape(-1, *[1] * (new.ndim - 1)), old, new)
                for old, new in zip(at.env.images, after.env.images, strict=True)
            )
            assert out.final_privileged is not None
            there = self._situation(images, out.final_observation, out.final_privileged, memory)
            ended = out.terminated.astype(jnp.float32)
            return after, (Transition(here, action, out.reward, ended, there), out.done, out.success)

        noise = jax.random.normal(key, (config.collect, *state.observation.shape[:1], env.action_size))
        last, (transitions, done, success) = jax.lax.scan(step, RolloutState.of(state), noise)
        flat = jax.tree.map(lambda x: x.reshape(x.shape[0] * x.shape[1], *x.shape[2:]), transitions)
        return last, flat, {"reward": jnp.mean(transitions.reward), **episode_metrics(done, success)}

    def _fit(
        self,
        config: ABPTConfig,
        rate: Float[Array, ""],
        policy: Stochastic,
        learned: ABPTParameters,
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
            follows = self._value(policy, targets, batch.there, jax.random.normal(noise_key, batch.action.shape))
            target = batch.reward + config.gamma * (1.0 - batch.ended) * follows
            loss, grads = jax.value_and_grad(error)(critics, batch, target)
            critics, optimizer, _ = descend(config, rate, critics, optimizer, grads)
            return (critics, followed(targets, critics, config.target_share), optimizer), loss

        first = (learned.critics, learned.targets, optimizer)
        (critics, targets, optimizer), losses = jax.lax.scan(minibatch, first, jax.random.split(key, config.fits))
        return critics, targets, optimizer, jnp.mean(losses)

    def _start(self, env: Env, config: ABPTConfig, places: Places, now: EnvState, key: PRNGKeyArray) -> RolloutState:
        """The states at which windows begin: new starts and visited states."""
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
        fresh_starts, visited = (
            RolloutState(anew, first, self.actor.memory(n)),
            RolloutState(state, observation, memory),
        )
        return dataclasses.replace(jax.tree.map(choose, fresh_starts, visited), discount=jnp.ones(n))

    def _window(
        self,
        env: Env,
        config: ABPTConfig,
        policy: Stochastic,
        targets: tuple[Layers, Layers],
        start: RolloutState,
        key: PRNGKeyArray,
        progress: Float[Array, ""],
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        noise = jax.random.normal(key, (config.horizon + 2, start.observation.shape[0], env.action_size))

        def follows(images: Any, observation: Array, privileged: Array, memory: Array, z: Array) -> Array:
            return self._value(policy, targets, self._situation(images, observation, privileged, memory), z)

        def act(at: RolloutState, z: Array) -> tuple[Array, Array, None]:
            return *self._act(policy, self._here(env, at), z), None

        at_once = start.value(env, follows, noise[-1])
        cuts = gradient_cuts(config, progress)
        gain, _, (_, _, record) = window(env, config, start, act, follows, noise[: config.horizon], cuts, noise[-2])
        gain = {name: (1 - config.at_once) * x for name, x in gain.items()}
        gain["at_once"] = config.at_once / config.horizon * at_once
        gain["entropy"] = config.entropy_weight / config.horizon * jnp.sum(policy.log_std)
        return gain, {"value": at_once, **record.term_metrics()}
