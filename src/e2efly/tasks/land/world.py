"""Landing: touch down gently on a point of the ground."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.deploy.goals import LandGoal
from e2efly.observation import Field
from e2efly.physics import State
from e2efly.physics.rotation import cos_tilt, from_euler
from e2efly.scenes.scene import Scene, Solids
from e2efly.scenes.shapes import DISC
from e2efly.tasks.land import LandConfig
from e2efly.tasks.task import Outcome, Shape, at_rest, touches_ground, uniform


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Land:
    """The pad lies at the world's origin. The task's memory is empty: an array of shape (n, 0)."""

    config: LandConfig
    shape: Shape

    fields = (
        Field("position_error", 3, "world", "m", 1.0, "where the centre of mass is after landing, minus where it is"),
    )

    @classmethod
    def of(cls, config: LandConfig, shape: Shape, control_period: float, substeps: int = 1) -> "Land":
        """See `e2efly.tasks.task.make_task`."""
        del control_period, substeps
        return cls(config, shape)

    @property
    def episode_s(self) -> float | Array:
        """Time limit, s."""
        return self.config.episode_s

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Float[Array, "n 0"]]:
        """Level, any heading, over and beside the pad."""
        c, u = self.config, uniform(key, n, 7)
        low, high = c.height
        height = self.shape.feet_height + (low + high) / 2 + (high - low) / 2 * u[:, 2]
        state = at_rest(jnp.stack([c.sideways * u[:, 0], c.sideways * u[:, 1], height], axis=-1))
        zero = jnp.zeros(n)
        quaternion = from_euler(zero, zero, jnp.pi * u[:, 6])
        return dataclasses.replace(state, velocity=c.velocity * u[:, 3:6], quaternion=quaternion), jnp.zeros((n, 0))

    def goal(self, memory: Float[Array, "n 0"], time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """The centre of mass of a vehicle that stands on the pad."""
        del memory
        zero = jnp.zeros_like(time)
        return jnp.stack([zero, zero, zero + self.shape.feet_height], axis=-1)

    def observe(self, memory: Float[Array, "n 0"], time: Float[Array, " n"], state: State) -> Float[Array, "n 3"]:
        """Goal minus position."""
        return self.goal(memory, time) - state.position

    def scene(self, memory: Float[Array, "n 0"]) -> Scene:
        """A flat pad on level ground."""
        n = memory.shape[0]
        return Scene.of(
            {"pad": Solids.of("pad", jnp.zeros((n, 1, 3)), jnp.array([2 * self.config.radius, 0.002, DISC]))}, n
        )

    def flight_goal(self, memory: Any) -> LandGoal:
        """See `e2efly.validate.starts.goal_of`."""
        del memory
        return LandGoal(np.zeros(3), float(self.shape.feet_height), float(self.config.fence))

    def desired_yaw(self, memory: Float[Array, "n 0"], state: State) -> Float[Array, " n"]:
        """Along world x."""
        del memory
        return jnp.zeros_like(state.position[:, 0])

    def advance(
        self,
        memory: Float[Array, "n 0"],
        before: State,
        after: State,
        time: Float[Array, " n"],
        timed_out: Bool[Array, " n"],
    ) -> tuple[Float[Array, "n 0"], Outcome]:
        """The episode ends at the first touch; success: near the centre, slow, upright. Judged at the step's end."""
        del before, timed_out
        c = self.config
        offset = after.position - self.goal(memory, time)
        sideways = jnp.linalg.norm(offset[:, :2], axis=-1)
        touched = touches_ground(self.shape, after)
        success = (
            touched
            & (sideways < c.radius)
            & (jnp.abs(offset[:, 2]) < c.height_error)
            & (jnp.linalg.norm(after.velocity, axis=-1) < c.speed)
            & (cos_tilt(after.quaternion) > jnp.cos(c.tilt))
        )
        lost = (sideways > c.fence) | (offset[:, 2] > c.fence)
        return memory, Outcome(
            terminated=touched | lost,
            success=success,
            arrived=success,
            crashed=(touched & ~success) | lost,
            error=sideways,
        )
