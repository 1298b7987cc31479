"""Rollouts of a policy that learns, and differentiable windows that end with a critic's value."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from e2efly.environment import Env, EnvState, Step
from e2efly.learning.algorithm import TrainState, episode_metrics

Value = Callable[[tuple[Array, ...], Array, Array, Array, Any], Array]
"""Images, observation (n, o), privileged observation (n, p), recurrent state (n, k) and the noise of an action
(n, 4) -> the discounted reward that follows (n,)."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RolloutState:
    """The state of n vehicles in a rollout."""

    env: EnvState
    observation: Float[Array, "n o"]
    memory: Float[Array, "n k"]
    """Recurrent state of the policy."""
    discount: Any = None
    """Discount of the next reward, if rewards are summed. With shape (n,), it returns to 1 when an episode begins. A
    scalar applies to the whole window, also when episodes end inside it."""

    @staticmethod
    def of(state: TrainState, discount: Array | None = None) -> "RolloutState":
        """The state at the end of the last update."""
        return RolloutState(state.env, state.observation, state.memory, discount)

    def into(self, state: TrainState, **changes: Any) -> TrainState:
        """The training state that continues from here, with `changes` to its other fields."""
        return dataclasses.replace(state, env=self.env, observation=self.observation, memory=self.memory, **changes)

    def cut(self, here: Bool[Array, ""]) -> "RolloutState":
        """The same state. If `here` is true, the gradient to earlier steps is cut: a new piece begins."""
        env, observation, memory = damped((self.env, self.observation, self.memory), 1.0 - here)
        return RolloutState(env, observation, memory, jnp.where(here, 1.0, self.discount))

    def value(self, env: Env, value: Value, noise: Any = None) -> Float[Array, ""]:
        """The mean over the vehicles of the discounted value of the reward that follows."""
        follows = value(self.env.images, self.observation, env.privileged(self.env), self.memory, noise)
        return jnp.mean(self.discount * follows)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StepRecord:
    """The data that every rollout gathers. Each leaf is (steps, n), the terms are (steps,)."""

    reward: Float[Array, "*t"]
    terminated: Bool[Array, "*t"]
    done: Bool[Array, "*t"]
    success: Bool[Array, "*t"]
    terms: dict[str, Float[Array, "*t"]]

    @staticmethod
    def of(out: Step) -> "StepRecord":
        """The record of one step."""
        terms = {name: jnp.mean(x) for name, x in out.terms.items()}
        return StepRecord(out.reward, out.terminated, out.done, out.success, terms)

    def metrics(self) -> dict[str, Array]:
        """Means over the rollout."""
        return {"reward": jnp.mean(self.reward), **episode_metrics(self.done, self.success), **self.term_metrics()}

    def term_metrics(self) -> dict[str, Array]:
        """The mean of each term of the reward."""
        return {f"reward/{name}": jnp.mean(x) for name, x in self.terms.items()}


def damped(tree: Any, keep: Array) -> Any:
    """The same values, with their gradient scaled by `keep`."""

    def damp(x: Array) -> Array:
        return keep * x + jax.lax.stop_gradient((1 - keep) * x) if jnp.issubdtype(x.dtype, jnp.floating) else x

    return jax.tree.map(damp, tree)


def advance(
    env: Env, config: Any, at: RolloutState, action: Float[Array, "n c"], memory: Float[Array, "n k"], critic: bool
) -> tuple[RolloutState, Step]:
    """One control step, with new starts where episodes ended.

    Args:
        env: the environment.
        config: options of the algorithm. If rewards are summed, `gamma` is their discount and `gradient_decay` damps
            the gradient.
        at: the state before the step.
        action: the action, in [-1, 1]; the environment clips it.
        memory: recurrent state after the action was chosen.
        critic: whether the result must contain `final_privileged`.
    """
    state, out = env.step(at.env, action, privileged=critic)
    memory = jnp.where(out.done[:, None], 0.0, memory)
    discount = at.discount
    if discount is not None:
        keep = jnp.exp(-config.gradient_decay * env.control_period)
        state = dataclasses.replace(state, vehicle=damped(state.vehicle, keep))
        discount = discount * config.gamma if discount.ndim == 0 else jnp.where(out.done, 1.0, discount * config.gamma)
    return RolloutState(state, out.observation, memory, discount), out


def window(
    env: Env,
    config: Any,
    start: RolloutState,
    act: Callable[[RolloutState, Array], tuple[Array, Array, Any]],
    value: Value,
    noise: Float[Array, "t n c"],
    cuts: Bool[Array, " t"],
    last_noise: Float[Array, "n c"] | None = None,
) -> tuple[dict[str, Array], RolloutState, tuple[Any, Array, StepRecord]]:
    """A differentiable rollout. A critic's value is added where the window ends, where the gradient is cut, and where
    an episode times out.

    Args:
        env: the environment.
        config: numbers of the algorithm.
        start: the state where the window begins, with a discount of 1 for each vehicle.
        act: (state before the step, noise) -> action, next recurrent state, and data to gather.
        value: the critic's estimate of the reward that follows.
        noise: noise of the actions.
        cuts: the steps before which the gradient is cut (`algorithm.gradient_cuts`). Unused without `horizon_start`.
        last_noise: noise of the action whose value is added at the end of the window.

    Returns:
        The discounted gain per step, on average, by part: the reward (with `term_gradients`: each of its terms) and
        `value`. The state at the end of the window. Without gradient: the data that `act` gathers, the value of the
        state after each step, and the record.
    """

    def step(at: RolloutState, x: tuple[Array, Array]) -> tuple[RolloutState, Any]:
        z, cut = x
        at_cut = jnp.float32(0.0)
        if config.horizon_start:
            at_cut, at = cut * at.value(env, value, z), at.cut(cut)
        action, memory, gathered = act(at, z)
        after, out = advance(env, config, at, action, memory, critic=True)
        assert out.final_privileged is not None
        follows = value(at.env.images, out.final_observation, out.final_privileged, memory, jnp.zeros_like(z))
        terms = out.terms if config.term_gradients else {"reward": out.reward}
        gain = {name: jnp.mean(at.discount * x) for name, x in terms.items()}
        gain["value"] = jnp.mean(at.discount * out.truncated * config.gamma * follows) + at_cut
        return after, (gain, jax.lax.stop_gradient((gathered, follows, StepRecord.of(out))))

    end, (gain, gathered) = jax.lax.scan(step, start, (noise, cuts))
    gain = {name: jnp.sum(x) / config.horizon for name, x in gain.items()}
    gain["value"] += end.value(env, value, last_noise) / config.horizon
    return gain, end, gathered
