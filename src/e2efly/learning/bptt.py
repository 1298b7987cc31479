"""Back-propagation through time: gradient ascent on the return, through physics, latency and policy.

Each update simulates a window of steps with the deterministic policy and follows the exact gradient of its discounted
reward. The next window continues from the state at the end of this one, without its gradient. A new start inside a
window cuts the gradient by itself, because it does not depend on earlier steps.

A run may begin with the imitation of the task's expert (`BPTTConfig.imitated`): where it takes memory and sight to see
what the reward punishes, a gradient finds nothing from fresh weights, and much from those of an imitator.
"""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float

from e2efly.config import BPTTConfig, DAggerConfig
from e2efly.config.algorithms import IMITATION_WINDOW
from e2efly.environment import Env
from e2efly.learning import dagger
from e2efly.learning.algorithm import (
    Algorithm,
    TrainState,
    adam_state,
    annealed,
    descend,
    gradient_cuts,
    gradient_per_term,
)
from e2efly.learning.league import flown_by_opponents, founded, joined, opponent, seat
from e2efly.learning.networks import Weights
from e2efly.learning.rollout import RolloutState, StepRecord, advance
from e2efly.learning.teacher import Expert


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class BPTTParameters:
    """What BPTT learns."""

    policy: Weights
    """The weights that are judged and shipped: those of `learner`, or their running mean (`BPTTConfig.average`)."""
    learner: Weights
    """The weights that fly the windows and take the gradient steps."""
    league: Any = None
    """Past selves, each leaf (league, ...)."""


class BPTT(Algorithm):
    """Back-propagation through time; see the module."""

    def init(self, env: Env, config: BPTTConfig, seed: int) -> BPTTParameters:
        """A fresh network, made by NumPy.

        Raises:
            ValueError: for a league of a task with one vehicle in a world.
        """
        if config.league and env.agents == 1:
            raise ValueError(f"algo.league is {config.league}; accepted: 0, or a task with several vehicles in a world")
        if config.imitated is not None:
            Expert().check(env, "algo.imitated", config.imitated, "None")
        policy = self.actor.init(np.random.default_rng(seed), np.asarray(env.hover))
        members = founded(policy, config.league) if config.league else None
        return BPTTParameters(policy, jax.tree.map(np.copy, policy), members)

    def optimizer(self, config: BPTTConfig, parameters: BPTTParameters) -> Any:
        """Adam's initial state."""
        return adam_state(config, parameters.learner)

    def update(
        self, env: Env, config: BPTTConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One window and one gradient step, or as much flight in short windows of imitation."""
        share = config.imitated
        if share is None:
            after, metrics = self._gained(env, config, state, progress)
        else:
            after, metrics = jax.lax.cond(
                progress < share,
                lambda state: self._imitated(env, config, state, progress / share),
                lambda state: self._gained(env, config, state, (progress - share) / (1 - share)),
                state,
            )
        parameters: BPTTParameters = after.parameters
        policy = parameters.learner
        if config.average is not None:
            count = optax.tree_utils.tree_get(after.optimizer, "count").astype(jnp.float32)
            steps = 1 if share is None else jnp.where(progress < share, config.horizon // IMITATION_WINDOW, 1)
            kept = jnp.minimum(config.average, 1 - steps / count)  # with few policies, their plain mean
            policy = jax.tree.map(lambda a, b: b + kept * (a - b), parameters.policy, parameters.learner)
        return dataclasses.replace(after, parameters=dataclasses.replace(parameters, policy=policy)), metrics

    def _gained(
        self, env: Env, config: BPTTConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """A step along the gradient of the reward. `progress` is that of this part of the run."""
        old, rate, key = state.parameters, annealed(config, progress), state.key
        rival = None
        if old.league is not None:
            drawn, key = jax.random.split(key)
            rival = opponent(old.league, drawn, seat(progress, config.league))

        def gain(learner: Weights) -> tuple[dict[str, Array], Any]:
            return self._window(env, config, learner, rival, state, progress)

        grads, (end, metrics), norms = gradient_per_term(gain, old.learner, config.term_gradients)
        learner, optimizer, norm = descend(config, rate, old.learner, state.optimizer, grads)
        metrics |= {"loss/gradient_norm": norm, **norms}
        metrics |= {} if config.imitated is None else {"loss/imitation": jnp.float32(0.0)}
        members = None if old.league is None else joined(old.league, learner, seat(progress, config.league))
        parameters = BPTTParameters(old.policy, learner, members)
        return end.into(state, parameters=parameters, optimizer=optimizer, key=key), metrics

    def _imitated(
        self, env: Env, config: BPTTConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """Steps that imitate the expert, each after a window of its own. `progress` is that of this part."""
        key, drawn = jax.random.split(state.key)
        leads = dagger.leading(drawn, state.observation.shape[0], DAggerConfig.led, progress)
        rate = config.imitation_rate * (config.learning_rate / config.imitation_rate) ** progress
        guide, old = Expert(), state.parameters

        def step(carry: tuple[RolloutState, Any, Any], _: None) -> tuple[Any, dict[str, Array]]:
            at, learner, optimizer = carry
            remembered = guide.memory(at.observation.shape[0])
            gradient, (at, remembered, metrics) = dagger.window(
                env, config, self.actor, guide, learner, at, remembered, leads, IMITATION_WINDOW
            )
            learner, optimizer, norm = descend(config, rate, learner, optimizer, gradient)
            return (at, learner, optimizer), {**metrics, "loss/gradient_norm": norm}

        first = RolloutState.of(state), old.learner, state.optimizer
        (end, learner, optimizer), metrics = jax.lax.scan(step, first, None, length=config.horizon // IMITATION_WINDOW)
        ended = jnp.sum(metrics["episodes"])
        told = {name: jnp.mean(x) for name, x in metrics.items()} | {"episodes": ended}
        told["train_success"] = jnp.sum(metrics["train_success"] * metrics["episodes"]) / jnp.maximum(ended, 1)
        names = [name.removeprefix("reward/") for name in told if name.startswith("reward/")]
        told |= {f"gradient/{name}": jnp.float32(0.0) for name in names if config.term_gradients}
        return end.into(state, parameters=dataclasses.replace(old, learner=learner), optimizer=optimizer, key=key), told

    def _window(
        self, env: Env, config: BPTTConfig, learner: Weights, rival: Weights | None, state: TrainState,
        progress: Float[Array, ""],
    ) -> tuple[dict[str, Array], tuple[RolloutState, dict[str, Array]]]:  # fmt: skip
        def step(at: RolloutState, cut: Array) -> tuple[RolloutState, Any]:
            at = at.cut(cut) if config.horizon_start else at
            features = self.actor.features(at.observation, at.env.images)
            action, memory = self.actor(learner, features, at.memory)
            if rival is not None:
                theirs = flown_by_opponents(action.shape[0], env.agents)[:, None]
                other, remembered = self.actor(rival, features, at.memory)
                action, memory = jnp.where(theirs, other, action), jnp.where(theirs, remembered, memory)
            after, out = advance(env, config, at, action, memory, critic=False)
            record = StepRecord.of(out)
            parts = record.terms if config.term_gradients else {"reward": jnp.mean(out.reward)}
            return after, ({name: at.discount * x for name, x in parts.items()}, record)

        first = RolloutState.of(state, jnp.float32(1.0))
        end, (gain, record) = jax.lax.scan(step, first, gradient_cuts(config, progress))
        return {name: jnp.sum(x) / config.horizon for name, x in gain.items()}, (end, record.metrics())
