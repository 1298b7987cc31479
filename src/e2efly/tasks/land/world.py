"""Landing: touch down gently on a point of the ground."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.courses.solids import DISC
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.scene import Scene, Solids
from e2efly.tasks.land.goal import LandGoal
from e2efly.tasks.task import at_rest, uniform


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Land(LandGoal):
    """Starts above and beside a flat pad."""

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Float[Array, "n 0"]]:
        """Level, any heading, above and beside the pad."""
        return above_pad(self.config, uniform(key, n, 7), self.shape.feet_height), jnp.zeros((n, 0))

    def scene(self, memory: Float[Array, "n 0"]) -> Scene:
        """A flat pad on level ground."""
        n = memory.shape[0]
        return Scene.of(
            {"pad": Solids.of("pad", jnp.zeros((n, 1, 3)), jnp.array([2 * self.config.radius, 0.002, DISC]))}, n
        )


def above_pad(c: Any, u: Float[Array, "n c"], standing: float) -> State:
    """Level, any heading, above and beside a pad.

    Args:
        c: the options of the task.
        u: uniform in [-1, 1].
        standing: height of the centre of mass of a vehicle that stands on the pad, m.
    """
    low, high = c.height
    height = standing + (low + high) / 2 + (high - low) / 2 * u[:, 2]
    state = at_rest(jnp.stack([c.sideways * u[:, 0], c.sideways * u[:, 1], height], axis=-1))
    zero = jnp.zeros(len(u))
    quaternion = from_euler(zero, zero, jnp.pi * u[:, 6])
    return dataclasses.replace(state, velocity=c.velocity * u[:, 3:6], quaternion=quaternion)
