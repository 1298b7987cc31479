"""Commands that are lost on their way to the flight controller."""

import dataclasses
from dataclasses import dataclass, fields

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.config import LinkConfig
from e2efly.environment.draws import sometimes

jax.tree_util.register_dataclass(LinkConfig, data_fields=[field.name for field in fields(LinkConfig)], meta_fields=[])

EVERY = 3.0
"""Time between the starts of two silences, s."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LostCommands:
    """The link of n vehicles: what is drawn for an episode, and what arrived."""

    dropped: Float[Array | np.ndarray, " n"]
    """Probability that the command of a control step is lost."""
    silence: Float[Array | np.ndarray, " n"]
    """Length of a silence, s."""
    phase: Float[Array | np.ndarray, " n"]
    """Time since the start of the last silence at the start of the episode, s."""
    arrived: Float[Array | np.ndarray, "n k c"]
    """The actions that the flight controller has, newest first, in place of `EnvState.actions`."""

    def after(self, key: PRNGKeyArray, action: Float[Array, "n c"], time: Float[Array, " n"]) -> "LostCommands":
        """The link when an action is sent, at a time since the start of the episode, s."""
        newest = jnp.where(self.loses(key, time)[:, None], self.arrived[:, 0], action)
        return dataclasses.replace(self, arrived=jnp.concatenate([newest[:, None], self.arrived[:, :-1]], axis=1))

    def loses(self, key: PRNGKeyArray, time: Float[Array, " n"]) -> Bool[Array, " n"]:
        """Whether a command is lost that is sent at a time since the start of the episode, s."""
        dropped = jax.random.uniform(key, time.shape) < jnp.asarray(self.dropped)
        return dropped | (jnp.mod(time + self.phase, EVERY) < jnp.asarray(self.silence))


def draw(config: LinkConfig, key: PRNGKeyArray, actions: Float[Array, "n k c"]) -> LostCommands:
    """The links of n episodes that start with these actions on their way."""
    n = actions.shape[0]
    strength = sometimes(key, n, [config.dropped, config.silence])
    # no silence begins before the episode does
    phase = strength[:, 1] + (EVERY - strength[:, 1]) * jax.random.uniform(jax.random.fold_in(key, 1), (n,))
    return LostCommands(strength[:, 0], strength[:, 1], phase, actions)
