"""High-speed obstacle avoidance: through a random forest at a commanded speed, seeing it alone."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.observation import Field
from e2efly.physics import State
from e2efly.physics.rotation import from_euler
from e2efly.scenes.generate import forest
from e2efly.scenes.scene import Scene, Solids
from e2efly.tasks.avoid import AvoidConfig
from e2efly.tasks.task import Outcome, Shape, at_rest, struck, uniform
from e2efly.tasks.way import open_heading

BEYOND = 10.0
"""The vehicle is sent to a point this far behind the end of the forest, m."""
CLIMB = 1.0
"""Largest commanded vertical speed, m/s."""
ROOM = 0.4
"""What an open way leaves between the vehicle and a tree, m."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Memory:
    """The forest, and how fast to fly through it."""

    trees: Solids
    speed: Float[Array, " n"]
    """m/s."""


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape"], meta_fields=["control_period", "checks"])
@dataclass(frozen=True)
class Avoid:
    """The lane runs from the origin along world x."""

    config: AvoidConfig
    shape: Shape
    control_period: float
    checks: int
    """How often a control step is checked for collisions."""

    fields = (
        Field("desired_velocity", 3, "world", "m/s", 4.0, "velocity to fly at, if nothing stood in the way"),
        Field("height", 1, "none", "m", 1.0, "height of the centre of mass over the ground"),
    )

    @classmethod
    def of(cls, config: AvoidConfig, shape: Shape, control_period: float, substeps: int = 1) -> "Avoid":
        """See `e2efly.tasks.task.make_task`."""
        return cls(config, shape, control_period, substeps)

    @property
    def episode_s(self) -> float | Array:
        """Time limit, s."""
        return self.config.episode_s

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Memory]:
        """At rest before the forest, facing it."""
        trees_key, state_key = jax.random.split(key)
        c, u, zero = self.config, uniform(state_key, n, 5), jnp.zeros(n)
        state = at_rest(jnp.stack([zero, c.sideways * u[:, 0], c.altitude + 0.3 * u[:, 1]], axis=-1))
        low, high = c.speed
        speed = (low + high) / 2 + (high - low) / 2 * u[:, 2]
        end = jnp.stack([zero + c.forest.length, zero, zero], axis=-1)
        trees = forest(trees_key, n, c.forest, state.position, end)
        return dataclasses.replace(state, quaternion=from_euler(zero, zero, 0.3 * u[:, 3])), Memory(trees, speed)

    def goal(self, memory: Memory, time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """Behind the end of the forest."""
        del time
        c, zero = self.config, jnp.zeros_like(memory.speed)
        return jnp.stack([zero + c.forest.length + BEYOND, zero, zero + c.altitude], axis=-1)

    def desired_velocity(self, memory: Memory, state: State) -> Float[Array, "n 3"]:
        """Level towards the goal at the commanded speed, and to the altitude."""
        away = self.goal(memory, memory.speed) - state.position
        level = away[:, :2] / jnp.linalg.norm(away[:, :2], axis=-1, keepdims=True)
        return jnp.concatenate([memory.speed[:, None] * level, jnp.clip(away[:, 2:], -CLIMB, CLIMB)], axis=-1)

    def open_velocity(self, memory: Memory, state: State) -> Float[Array, "n 3"]:
        """The desired velocity, turned to where the way is open: what a reward may know and the policy may not."""
        wanted = self.desired_velocity(memory, state)
        bearing = jnp.arctan2(wanted[:, 1], wanted[:, 0])
        side = self.config.forest.width / 2 - ROOM
        heading = open_heading(memory.trees, state.position[:, :2], bearing, self.shape.radius + ROOM, side)
        return jnp.concatenate([memory.speed[:, None] * heading, wanted[:, 2:]], axis=-1)

    def observe(self, memory: Memory, time: Float[Array, " n"], state: State) -> Float[Array, "n 4"]:
        """The desired velocity and the height."""
        del time
        return jnp.concatenate([self.desired_velocity(memory, state), state.position[:, 2:]], axis=-1)

    def scene(self, memory: Memory) -> Scene:
        """The trees on level ground."""
        return Scene.of({"cylinder": memory.trees}, memory.speed.shape[0])

    def desired_yaw(self, memory: Memory, state: State) -> Float[Array, " n"]:
        """Towards the goal."""
        away = self.goal(memory, memory.speed) - state.position
        return jnp.arctan2(away[:, 1], away[:, 0])

    def advance(
        self, memory: Memory, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[Memory, Outcome]:
        """Success: past the end of the forest, without touching anything or leaving the lane."""
        del timed_out
        c = self.config
        x, y, z = after.position[:, 0], after.position[:, 1], after.position[:, 2]
        hit = struck(self.scene(memory), before, after, time, self.control_period, self.checks, self.shape.radius)
        left = (jnp.abs(y) > c.forest.width / 2) | (z > c.ceiling) | (z < self.shape.feet_height) | (x < -5.0)
        crashed = hit | left
        success = (x >= c.forest.length) & ~crashed
        ends = left | (hit & (c.collisions_end > 0))
        signals = {
            "desired_velocity": self.open_velocity(memory, after),
            "desired_speed": memory.speed,
        }
        error = jnp.maximum(c.forest.length - x, 0.0)
        return memory, Outcome(
            terminated=ends | (x >= c.forest.length),
            success=success,
            arrived=success,
            crashed=crashed,
            error=error,
            signals=signals,
        )
