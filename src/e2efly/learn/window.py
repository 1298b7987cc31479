"""Windows of flight whose gradient is followed, with a critic's value where they end: SHAC's, ABPT's and FOPPO's."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from e2efly.config import ABPTConfig, FOPPOConfig, SHACConfig
from e2efly.env import Env, EnvState, Step
from e2efly.learn.algorithm import damped

Worth = Callable[[EnvState, Array, Array], Array]
"""State, observation (n, o), memory (n, k) -> the discounted reward that follows (n,)."""
Config = SHACConfig | ABPTConfig | FOPPOConfig


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Flight:
    """Where n vehicles are in a window."""

    env: EnvState
    observation: Float[Array, "n o"]
    memory: Float[Array, "n k"]
    """Of the policy's GRU."""
    discount: Float[Array, " n"]
    """Of what comes next: 1 where a window, a piece of it or an episode begins."""

    @staticmethod
    def of(env: EnvState, observation: Float[Array, "n o"], memory: Float[Array, "n k"]) -> "Flight":
        """At the start of a window."""
        return Flight(env, observation, memory, jnp.ones(observation.shape[0]))

    def worth(self, worth: Worth) -> Float[Array, ""]:
        """The mean of what follows, discounted."""
        return jnp.mean(self.discount * worth(self.env, self.observation, self.memory))


def cut_off(config: Config, flight: Flight, cut: Bool[Array, ""], worth: Worth) -> tuple[Flight, Float[Array, ""]]:
    """Where the gradient is cut, a piece ends as a window does: the flight from there, and what it was worth.

    Args:
        config: of the algorithm; without a `horizon_start` nothing is cut.
        flight: before a step.
        cut: whether it is here (`algorithm.ends`).
        worth: the critic's word.
    """
    if not config.horizon_start:
        return flight, jnp.float32(0.0)
    env, observation, memory = damped((flight.env, flight.observation, flight.memory), 1.0 - cut)
    return Flight(env, observation, memory, jnp.where(cut, 1.0, flight.discount)), cut * flight.worth(worth)


def flown(
    env: Env, config: Config, flight: Flight, action: Float[Array, "n 4"], memory: Float[Array, "n k"], worth: Worth
) -> tuple[Flight, dict[str, Array], Float[Array, " n"], Step]:
    """A control step, and new starts.

    Args:
        env: the environment.
        config: of the algorithm.
        flight: before the step.
        action: in [-1, 1], clipped by the environment.
        memory: of the GRU after it chose the action.
        worth: the critic's word of where the step leads, before any new start.

    Returns:
        The flight after it; what it gained, discounted, by part: the reward (or, `term_gradients`, its terms), and
        `value` where time ran out; the worth of where it led; and what the environment said.
    """
    reached, out = env.advance(flight.env, action)
    follows = worth(reached, out.final_observation, memory)
    terms = out.terms if config.term_gradients else {"reward": out.reward}
    gain = {name: jnp.mean(flight.discount * x) for name, x in terms.items()}
    gain["value"] = jnp.mean(flight.discount * out.truncated * config.gamma * follows)
    env_state, out = env.restart(reached, out)
    keep = jnp.exp(-config.gradient_decay * env.control_period)
    env_state = dataclasses.replace(env_state, vehicle=damped(env_state.vehicle, keep))
    env_state = env.look(env_state, out.done)
    memory = jnp.where(out.done[:, None], 0.0, memory)
    discount = jnp.where(out.done, 1.0, flight.discount * config.gamma)
    return Flight(env_state, out.observation, memory, discount), gain, follows, out
