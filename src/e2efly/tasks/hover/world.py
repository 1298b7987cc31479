"""Hovering: fly to a point from anywhere near and stay there."""

import dataclasses
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.deploy.goals import HoverGoal
from e2efly.observation import Field
from e2efly.physics import State
from e2efly.physics.rotation import from_euler
from e2efly.scenes.scene import Scene
from e2efly.tasks.hover import HoverConfig
from e2efly.tasks.task import Outcome, Shape, at_rest, touches_ground, uniform


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Hover:
    """The task's memory is how long the vehicle has been within the radius, s."""

    config: HoverConfig
    shape: Shape
    control_period: float | Array

    fields = (Field("position_error", 3, "world", "m", 1.0, "target position minus vehicle position"),)

    @classmethod
    def of(cls, config: HoverConfig, shape: Shape, control_period: float, substeps: int = 1) -> "Hover":
        """See `e2efly.tasks.task.make_task`."""
        del substeps
        return cls(config, shape, control_period)

    @property
    def episode_s(self) -> float | Array:
        """Time limit, s."""
        return self.config.episode_s

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Float[Array, " n"]]:
        """Uniform about the target: position, velocity, roll, pitch, any yaw, body rates."""
        c, u = self.config, uniform(key, n, 12)
        state = at_rest(jnp.asarray(c.target) + c.position * u[:, :3])
        quaternion = from_euler(c.tilt * u[:, 6], c.tilt * u[:, 7], jnp.pi * u[:, 8])
        return dataclasses.replace(
            state, velocity=c.velocity * u[:, 3:6], quaternion=quaternion, body_rate=c.body_rate * u[:, 9:12]
        ), jnp.zeros(n)

    def goal(self, memory: Float[Array, " n"], time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """The target."""
        del time
        return jnp.broadcast_to(jnp.asarray(self.config.target), (*memory.shape, 3))

    def observe(self, memory: Float[Array, " n"], time: Float[Array, " n"], state: State) -> Float[Array, "n 3"]:
        """Target minus position."""
        return self.goal(memory, time) - state.position

    def scene(self, memory: Float[Array, " n"]) -> Scene:
        """Level ground."""
        return Scene.of({}, memory.shape[0])

    def flight_goal(self, memory: Any) -> HoverGoal:
        """See `e2efly.validate.starts.goal_of`."""
        del memory
        return HoverGoal(np.asarray(self.config.target, np.float64), float(self.config.fence))

    def desired_yaw(self, memory: Float[Array, " n"], state: State) -> Float[Array, " n"]:
        """Along world x."""
        del state
        return jnp.zeros_like(memory)

    def advance(
        self,
        memory: Float[Array, " n"],
        before: State,
        after: State,
        time: Float[Array, " n"],
        timed_out: Bool[Array, " n"],
    ) -> tuple[Float[Array, " n"], Outcome]:
        """Success: within the radius for the last `hold_s` of the episode, never outside the fence or on the ground."""
        del before
        c = self.config
        error = jnp.linalg.norm(after.position - self.goal(memory, time), axis=-1)
        held = jnp.where(error < c.radius, memory + self.control_period, 0.0)
        crashed = (error > c.fence) | touches_ground(self.shape, after)
        arrived = (held > 0) & (memory == 0)
        success = timed_out & ~crashed & (held >= c.hold_s - 1e-4)
        return held, Outcome(terminated=crashed, success=success, arrived=arrived, crashed=crashed, error=error)
