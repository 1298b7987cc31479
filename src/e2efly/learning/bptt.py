"""Back-propagation through time: gradient ascent on the return, through physics, latency and policy.

Each update simulates a window of steps with the deterministic policy and follows the exact gradient of its discounted
reward. The next window continues from the state at the end of this one, without its gradient. A new start inside a
window cuts the gradient by itself, because it does not depend on earlier steps.
"""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import optax
from jaxtyping import Array, Float

from e2efly.config import BPTTConfig
from e2efly.environment import Env
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
        policy = self.actor.init(np.random.default_rng(seed), np.asarray(env.hover))
        members = founded(policy, config.league) if config.league else None
        return BPTTParameters(policy, jax.tree.map(np.copy, policy), members)

    def optimizer(self, config: BPTTConfig, parameters: BPTTParameters) -> Any:
        """Adam's initial state."""
        return adam_state(config, parameters.learner)

    def update(
        self, env: Env, config: BPTTConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One window and one gradient step."""
        old, rate, key = state.parameters, annealed(config, progress), state.key
        rival = None
        if old.league is not None:
            drawn, key = jax.random.split(key)
            rival = opponent(old.league, drawn, seat(progress, config.league))

        def gain(learner: Weights) -> tuple[dict[str, Array], Any]:
            return self._window(env, config, learner, rival, state, progress)

        grads, (end, metrics), norms = gradient_per_term(gain, old.learner, config.term_gradients)
        learner, optimizer, norm = descend(config, rate, old.learner, state.optimizer, grads)
        policy = learner
        if config.average is not None:
            count = optax.tree_utils.tree_get(optimizer, "count").astype(jnp.float32)
            share = jnp.minimum(config.average, 1 - 1 / count)  # with few policies, their plain mean
            policy = jax.tree.map(lambda a, b: b + share * (a - b), old.policy, learner)
        metrics |= {"loss/gradient_norm": norm, **norms}
        members = None if old.league is None else joined(old.league, learner, seat(progress, config.league))
        parameters = BPTTParameters(policy, learner, members)
        return end.into(state, parameters=parameters, optimizer=optimizer, key=key), metrics

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
