"""Inputs and outputs of a step of the environment."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from e2efly.environment.disturbance import Disturbance
from e2efly.environment.lost_commands import LostCommands
from e2efly.environment.lost_rotor import LostRotor
from e2efly.environment.pose_errors import PoseErrors
from e2efly.simulation.physics import State
from e2efly.simulation.sensors import imu
from e2efly.simulation.sensors.eyes import Eye

STARTS, INERTIAL, SEEN, IMAGES, DISTURBED, ESTIMATED, SENT = range(7)
"""The random parts of a control step. Each has its own keys."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class EnvState:
    """Everything that one step passes to the next. Each leaf has shape (n, ...), except the key and the tick."""

    vehicle: State
    memory: Any
    """The task's own state."""
    time: Float[Array, " n"]
    """Time since the start of the episode, s."""
    actions: Float[Array, "n k c"]
    """The policy's last actions, newest first."""
    action_latency: Float[Array, " n"]
    """Latency from observation to command, s."""
    plant: dict[str, Array]
    """The randomised vehicle parameters."""
    wind: Float[Array, "n 3"] | None
    """Wind, world, m/s."""
    family: Float[Array, "n u"] | None
    """The uniform random numbers that define each episode's vehicle, for a family."""
    disturbance: Disturbance | None
    """Gusts, rotors, sag and drift."""
    lost_rotor: LostRotor | None
    """The rotor that stops."""
    estimate: PoseErrors | None
    """The errors of the observed state."""
    link: LostCommands | None
    """The commands that are lost."""
    past: State | None
    """The last states, newest first, if observations are delayed."""
    observation_latency: Float[Array, " n"]
    """Age of the observed state, s."""
    imu: imu.ImuState | None
    """Biases and the last measurement."""
    eyes: tuple[Eye, ...]
    """How the cameras are mounted, camera by camera."""
    images: tuple[Float[Array, "n *image"], ...]
    """The newest image of each camera, without gradient. `sensors.eyes.see` tells what it shows."""
    key: PRNGKeyArray
    tick: Int[Array, ""]
    """Steps since `reset`. Together with the key, it seeds everything random."""

    def key_of(self, what: int) -> PRNGKeyArray:
        """The key of one of the random parts of a control step."""
        return jax.random.fold_in(jax.random.fold_in(self.key, self.tick), what)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Step:
    """What a step returns in addition to the new state. Each leaf has shape (n, ...)."""

    observation: Float[Array, "n o"]
    """The observation to act on next. Where an episode ended, it is that of the new one."""
    final_observation: Float[Array, "n o"]
    """The observation of the state that was reached, before any new start: the one to bootstrap from."""
    reward: Float[Array, " n"]
    terms: dict[str, Float[Array, " n"]]
    """The weighted terms of the reward."""
    terminated: Bool[Array, " n"]
    """The episode ended for good. No value follows it."""
    truncated: Bool[Array, " n"]
    """The time was over, and nothing else ended the episode."""
    success: Bool[Array, " n"]
    """The episode ended in this step and met the criterion."""
    error: Float[Array, " n"]
    """The task's error, m."""
    final_privileged: Float[Array, "n p"] | None = None
    """`Env.privileged` of the state that was reached, before any new start. None if it was not requested."""

    @property
    def done(self) -> Bool[Array, " n"]:
        """Terminated or truncated."""
        return self.terminated | self.truncated


def where(mask: Bool[Array, " n"], a: Any, b: Any) -> Any:
    """Leaf by leaf, `a` where the mask is true. Leaves without the batch axis come from `b`."""

    def choose(x: Array, y: Array) -> Array:
        if y.shape[:1] != mask.shape:
            return y
        return jnp.where(mask.reshape(mask.shape + (1,) * (y.ndim - 1)), x, y)

    return jax.tree.map(choose, a, b)


def pushed(past: State, newest: State) -> State:
    """The last states with the newest added at the front and the oldest removed."""
    return jax.tree.map(lambda old, new: jnp.concatenate([new[:, None], old[:, :-1]], axis=1), past, newest)
