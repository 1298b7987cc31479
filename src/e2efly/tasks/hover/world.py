"""Hovering: fly to a point from anywhere near it, and stay there."""

import dataclasses
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.scene import Scene
from e2efly.tasks.hover.goal import HoverGoal
from e2efly.tasks.task import at_rest, uniform


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Hover(HoverGoal):
    """Starts around the target, over level ground."""

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Float[Array, " n"]]:
        """Uniform around the target: position, velocity, roll, pitch, yaw, body rates."""
        c, u = self.config, uniform(key, n, 12)
        state = at_rest(jnp.asarray(c.target) + c.position * u[:, :3])
        quaternion = from_euler(c.tilt * u[:, 6], c.tilt * u[:, 7], c.heading * u[:, 8])
        return dataclasses.replace(
            state, velocity=c.velocity * u[:, 3:6], quaternion=quaternion, body_rate=c.body_rate * u[:, 9:12]
        ), jnp.zeros(n)

    def scene(self, memory: Float[Array, " n"]) -> Scene:
        """Level ground."""
        return Scene.of({}, memory.shape[0])

    def desired_yaw(self, memory: Float[Array, " n"], state: State) -> Float[Array, " n"]:
        """Along world x."""
        return jnp.zeros_like(memory)
