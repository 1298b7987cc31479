"""Rollouts of a policy that learns, and windows whose gradient is followed up to a critic's value."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from e2efly.env import Env, EnvState, Step
from e2efly.learn.algorithm import TrainState, episode_metrics

Value = Callable[[tuple[Array, ...], Array, Array, Array, Any], Array]
"""Images, observation (n, o), privileged observation (n, p), recurrent state (n, k) and the noise of an action
(n, 4) -> the discounted reward that follows (n,)."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class RolloutState:
    """Where n vehicles are in a rollout."""

    env: EnvState
    observation: Float[Array, "n o"]
    memory: Float[Array, "n k"]
    """Recurrent state of the policy."""
    discount: Any = None
    """Of the next reward, where rewards are summed. Of shape (n,): 1 again where an episode begins; a scalar: of the
    window, whatever ends within."""

    @staticmethod
    def of(state: TrainState, discount: Array | None = None) -> "RolloutState":
        """Where the last update ended."""
        return RolloutState(state.env, state.observation, state.memory, discount)

    def into(self, state: TrainState, **changes: Any) -> TrainState:
        """The training state that goes on from here, with other changes of its fields."""
        return dataclasses.replace(state, env=self.env, observation=self.observation, memory=self.memory, **changes)

    def cut(self, here: Bool[Array, ""]) -> "RolloutState":
        """The same flight, with no gradient from what came before where `here` holds: a new piece begins."""
        env, observation, memory = damped((self.env, self.observation, self.memory), 1.0 - here)
        return RolloutState(env, observation, memory, jnp.where(here, 1.0, self.discount))

    def value(self, env: Env, value: Value, noise: Any = None) -> Float[Array, ""]:
        """The mean of what follows, discounted."""
        follows = value(self.env.images, self.observation, env.privileged(self.env), self.memory, noise)
        return jnp.mean(self.discount * follows)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Record:
    """What every rollout gathers, each leaf (steps, n), the terms (steps,)."""

    reward: Float[Array, "*t"]
    terminated: Bool[Array, "*t"]
    done: Bool[Array, "*t"]
    success: Bool[Array, "*t"]
    terms: dict[str, Float[Array, "*t"]]

    @staticmethod
    def of(out: Step) -> "Record":
        """Of one step."""
        terms = {name: jnp.mean(x) for name, x in out.terms.items()}
        return Record(out.reward, out.terminated, out.done, out.success, terms)

    def metrics(self) -> dict[str, Array]:
        """Means over the rollout."""
        return {"reward": jnp.mean(self.reward), **episode_metrics(self.done, self.success), **self.term_metrics()}

    def term_metrics(self) -> dict[str, Array]:
        """The mean of each term of the reward."""
        return {f"reward/{name}": jnp.mean(x) for name, x in self.terms.items()}


def damped(tree: Any, keep: Array) -> Any:
    """The same values; their gradient scaled by `keep`."""

    def damp(x: Array) -> Array:
        return keep * x + jax.lax.stop_gradient((1 - keep) * x) if jnp.issubdtype(x.dtype, jnp.floating) else x

    return jax.tree.map(damp, tree)


def advance(
    env: Env, config: Any, at: RolloutState, action: Float[Array, "n 4"], memory: Float[Array, "n k"], critic: bool
) -> tuple[RolloutState, Step]:
    """A control step, and new starts.

    Args:
        env: the environment.
        config: of the algorithm. Where rewards are summed, its `gamma` discounts and its `gradient_decay` damps.
        at: before the step.
        action: in [-1, 1], clipped by the environment.
        memory: recurrent state after the action was chosen.
        critic: whether the result is to have `final_privileged`.
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
    noise: Float[Array, "t n 4"],
    cuts: Bool[Array, " t"],
    last_noise: Float[Array, "n 4"] | None = None,
) -> tuple[dict[str, Array], RolloutState, tuple[Any, Array, Record]]:
    """A rollout whose gradient is followed, with a critic's value where it ends, is cut or an episode's time is out.

    Args:
        env: the environment.
        config: numbers of the algorithm.
        start: where it begins, with a discount of 1 each.
        act: (before the step, noise) -> action, next recurrent state, and what to gather of it.
        value: the critic's estimate of what follows.
        noise: of the actions.
        cuts: before which steps the gradient is cut (`algorithm.gradient_cuts`); unused without `horizon_start`.
        last_noise: of the action whose value the window ends with.

    Returns:
        What a step gained on average, discounted, by part: the reward (with `term_gradients`: each of its terms), and
        `value`; where the window ended; and, without gradient: what `act` gathers, the value of where each step led,
        and the record.
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
        return after, (gain, jax.lax.stop_gradient((gathered, follows, Record.of(out))))

    end, (gain, gathered) = jax.lax.scan(step, start, (noise, cuts))
    gain = {name: jnp.sum(x) / config.horizon for name, x in gain.items()}
    gain["value"] += end.value(env, value, last_noise) / config.horizon
    return gain, end, gathered
