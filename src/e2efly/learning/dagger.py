"""Imitation of another policy that is told more, or of the task's expert (DAgger, Ross et al. 2011).

The policy that learns flies, and at each state that it meets, the teacher says what it would do there. The error of the
action is minimised over windows of steps, through the recurrent network but not through physics: what the teacher does
already looks ahead. At the start of a run the teacher flies in a share of the windows, so that the policy sees where a
good flight leads.
"""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.config import DAggerConfig
from e2efly.environment import Env, EnvState
from e2efly.learning.algorithm import Algorithm, TrainState, annealed, descend
from e2efly.learning.networks import Actor, Weights
from e2efly.learning.rollout import RolloutState, StepRecord, advance
from e2efly.learning.teacher import Expert, Teacher, teacher_of


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class DAggerParameters:
    """What DAgger learns."""

    policy: Weights


class DAgger(Algorithm):
    """Imitation of a teacher; see the module."""

    def init(self, env: Env, config: DAggerConfig, seed: int) -> DAggerParameters:
        """A fresh network, made by NumPy.

        Raises:
            ValueError: for a teacher that does not fly in this environment.
        """
        teacher(env, config).check(env)
        return DAggerParameters(self.actor.init(np.random.default_rng(seed), np.asarray(env.hover)))

    def replay(self, env: Env, config: DAggerConfig, state: EnvState, observation: Float[Array, "n o"]) -> Array:
        """The teacher's memory."""
        return teacher(env, config).memory(observation.shape[0])

    def update(
        self, env: Env, config: DAggerConfig, state: TrainState, progress: Float[Array, ""]
    ) -> tuple[TrainState, dict[str, Array]]:
        """One window and one gradient step."""
        key, drawn = jax.random.split(state.key)
        guide, rate = teacher(env, config), annealed(config, progress)
        leads = leading(drawn, state.observation.shape[0], config.led, progress)
        gradient, (end, remembered, metrics) = window(
            env, config, self.actor, guide, state.parameters.policy, RolloutState.of(state), state.replay, leads,
            config.horizon,
        )  # fmt: skip
        parameters, optimizer, norm = descend(
            config, rate, state.parameters, state.optimizer, DAggerParameters(gradient)
        )
        metrics |= {"loss/gradient_norm": norm}
        return end.into(state, parameters=parameters, optimizer=optimizer, key=key, replay=remembered), metrics


def leading(key: PRNGKeyArray, n: int, led: float | Array, progress: Float[Array, ""]) -> Bool[Array, "n 1"]:
    """In whose windows the teacher flies: in all at the start of a run, in none from a share `led` of it on."""
    return jax.random.uniform(key, (n, 1)) < 1 - progress / jnp.maximum(led, 1e-6)


def window(
    env: Env, config: Any, actor: Actor, guide: Teacher | Expert, weights: Weights, start: RolloutState,
    remembered: Float[Array, "n m"], leads: Bool[Array, "n 1"], length: int,
) -> tuple[Weights, tuple[RolloutState, Float[Array, "n m"], dict[str, Array]]]:  # fmt: skip
    """A window in which a policy imitates.

    Args:
        env: the environment.
        config: options of the algorithm.
        actor: the policy's network.
        guide: the teacher.
        weights: of the policy.
        start: the state before the window.
        remembered: the teacher's memory.
        leads: where the teacher flies, not the policy.
        length: steps of the window.

    Returns:
        The gradient of the mean squared error of the action, the state after the window, the teacher's memory, and the
        metrics.
    """

    def loss(weights: Weights) -> tuple[Array, Any]:
        def step(carry: tuple[RolloutState, Array], _: None) -> tuple[Any, Any]:
            at, remembered = carry
            action, memory = actor(weights, actor.features(at.observation, at.env.images), at.memory)
            wanted, remembered = guide.act(env, at.env, remembered)
            flown = jax.lax.stop_gradient(jnp.where(leads, wanted, action))
            after, out = advance(env, config, at, flown, memory, critic=False)
            remembered = jnp.where(out.done[:, None], 0.0, remembered)
            return (after, remembered), (jnp.mean((action - wanted) ** 2), StepRecord.of(out))

        (end, memory), (errors, record) = jax.lax.scan(step, (start, remembered), None, length=length)
        error = jnp.mean(errors)
        return error, (end, memory, {**record.metrics(), "loss/imitation": error})

    return jax.grad(loss, has_aux=True)(weights)


def teacher(env: Env, config: DAggerConfig) -> Teacher | Expert:
    """The teacher that the options name: by default, the zoo's policy of the same task."""
    task: Any = env.task
    return teacher_of(config.teacher or task.config.name)
