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


class BPTT(Algorithm):
    """Back-propagation through time; see the module."""

    def init(self, env: Env, config: BPTTConfig, seed: int) -> BPTTParameters:
        """A fresh network, made by NumPy."""
        policy = self.actor.init(np.random.default_rng(seed), np.asarray(env.hover))
        return BPTTParameters(policy, jax.tree.map(np.copy, policy))

    def optimizer(self, config: BPTTConfig, parameters: BPTTParameters) -> Any:
        """Adam's initial state."""
        return adam_state(config, parameters.learner)

    def update(
        self, env: Env, config: BPTTConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One window and one gradient step."""
        old, rate = state.parameters, annealed(config, progress)

        def gain(learner: Weights) -> tuple[dict[str, Array], Any]:
            return self._window(env, config, learner, state, progress)

        grads, (end, metrics), norms = gradient_per_term(gain, old.learner, config.term_gradients)
        learner, optimizer, norm = descend(config, rate, old.learner, state.optimizer, grads)
        policy = learner
        if config.average is not None:
            count = optax.tree_utils.tree_get(optimizer, "count").astype(jnp.float32)
            share = jnp.minimum(config.average, 1 - 1 / count)  # with few policies, their plain mean
            policy = jax.tree.map(lambda a, b: b + share * (a - b), old.policy, learner)
        metrics |= {"loss/gradient_norm": norm, **norms}
        return end.into(state, parameters=BPTTParameters(policy, learner), optimizer=optimizer), metrics

    def _window(
        self, env: Env, config: BPTTConfig, learner: Weights, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[dict[str, Array], tuple[RolloutState, dict[str, Array]]]:
        def step(at: RolloutState, cut: Array) -> tuple[RolloutState, Any]:
            at = at.cut(cut) if config.horizon_start else at
            features = self.actor.features(at.observation, at.env.images)
            action, memory = self.actor(learner, features, at.memory)
            after, out = advance(env, config, at, action, memory, critic=False)
            record = StepRecord.of(out)
            parts = record.terms if config.term_gradients else {"reward": jnp.mean(out.reward)}
            return after, ({name: at.discount * x for name, x in parts.items()}, record)

        first = RolloutState.of(state, jnp.float32(1.0))
        end, (gain, record) = jax.lax.scan(step, first, gradient_cuts(config, progress))
        return {name: jnp.sum(x) / config.horizon for name, x in gain.items()}, (end, record.metrics())
