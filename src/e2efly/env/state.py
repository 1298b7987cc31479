"""What a step of the environment takes and gives."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from e2efly.env.disturbance import Disturbance
from e2efly.physics import State
from e2efly.sensors import imu
from e2efly.sensors.eyes import Eye

STARTS, INERTIAL, SEEN, IMAGES, DISTURBED = range(5)
"""What is random in a control step: each has keys of its own."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class EnvState:
    """Everything that one step hands to the next, each leaf of shape (n, ...) but the key and the tick."""

    vehicle: State
    memory: Any
    """The task's own state."""
    time: Float[Array, " n"]
    """Since the start of the episode, s."""
    actions: Float[Array, "n k 4"]
    """The policy's last actions, newest first."""
    action_latency: Float[Array, " n"]
    """s."""
    plant: dict[str, Array]
    """The randomised vehicle parameters."""
    wind: Float[Array, "n 3"] | None
    """World, m/s."""
    family: Float[Array, "n u"] | None
    """The uniform numbers that make each episode's vehicle, where that is of a family."""
    disturbance: Disturbance | None
    """Gusts, rotors, sag and drift."""
    past: State | None
    """The last states, newest first, when observations are late."""
    observation_latency: Float[Array, " n"]
    """s."""
    imu: imu.ImuState | None
    """Biases and the last measurement."""
    eyes: tuple[Eye, ...]
    """How the cameras sit, camera by camera."""
    images: tuple[Float[Array, "n *image"], ...]
    """The newest image of each camera, without gradient; what it shows: `e2efly.sensors.eyes.see`."""
    key: PRNGKeyArray
    tick: Int[Array, ""]
    """Steps since `reset`; with the key it seeds everything random."""

    def key_of(self, what: int) -> PRNGKeyArray:
        """The key of one of the things that are random in a control step."""
        return jax.random.fold_in(jax.random.fold_in(self.key, self.tick), what)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Step:
    """What a step returns beside the new state, each leaf of shape (n, ...)."""

    observation: Float[Array, "n o"]
    """What to act on next: of a new episode where the last one ended."""
    final_observation: Float[Array, "n o"]
    """What was reached, before any new start: the one to bootstrap from."""
    reward: Float[Array, " n"]
    terms: dict[str, Float[Array, " n"]]
    """The weighted terms of the reward."""
    terminated: Bool[Array, " n"]
    """The episode ended for good: no value after it."""
    truncated: Bool[Array, " n"]
    """The time was out, and nothing else."""
    success: Bool[Array, " n"]
    """The episode ended in this step and met the criterion."""
    error: Float[Array, " n"]
    """The task's error, m."""
    final_privileged: Float[Array, "n p"] | None = None
    """`Env.privileged` of what was reached, before any new start; None where it was not asked for."""

    @property
    def done(self) -> Bool[Array, " n"]:
        """Terminated or truncated."""
        return self.terminated | self.truncated


def where(mask: Bool[Array, " n"], a: Any, b: Any) -> Any:
    """Leaf by leaf, `a` where the mask holds; leaves without the batch axis come from `b`."""

    def choose(x: Array, y: Array) -> Array:
        if y.shape[:1] != mask.shape:
            return y
        return jnp.where(mask.reshape(mask.shape + (1,) * (y.ndim - 1)), x, y)

    return jax.tree.map(choose, a, b)


def pushed(past: State, newest: State) -> State:
    """The last states with the newest before them, and without the oldest."""
    return jax.tree.map(lambda old, new: jnp.concatenate([new[:, None], old[:, :-1]], axis=1), past, newest)
