"""High-speed obstacle avoidance: fly through a random forest at a commanded speed, by camera images alone."""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.policy.goal import Outcome
from e2efly.policy.others import Others
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.generate import forest
from e2efly.simulation.scenes.scene import Scene, Solids
from e2efly.tasks.avoid.goal import CLIMB, AvoidGoal, AvoidMemory
from e2efly.tasks.avoid.pilot import best_heading
from e2efly.tasks.task import Flier, at_rest, between, struck, uniform

STRICT = 1.5
"""Vertical speed of the expert divided by its height error, 1/s."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AvoidWorld(AvoidMemory):
    """The forest, and the commanded speed."""

    trees: Solids


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape"], meta_fields=["control_period", "checks"])
@dataclass(frozen=True)
class Avoid(AvoidGoal):
    """Starts in front of a random forest."""

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, AvoidWorld]:
        """At rest in front of the forest, facing it."""
        trees_key, state_key = jax.random.split(key)
        c, u, zero = self.config, uniform(state_key, n, 5), jnp.zeros(n)
        state = at_rest(jnp.stack([zero, c.sideways * u[:, 0], c.altitude + 0.3 * u[:, 1]], axis=-1))
        speed = between(c.speed, u[:, 2])
        end = jnp.stack([zero + c.forest.length, zero, zero], axis=-1)
        trees = forest(trees_key, n, c.forest, state.position, end)
        if c.swing:
            trees = self.swinging(jax.random.fold_in(key, 3), trees, state.position)
        return dataclasses.replace(state, quaternion=from_euler(zero, zero, 0.3 * u[:, 3])), AvoidWorld(speed, trees)

    def swinging(self, key: PRNGKeyArray, trees: Solids, start: Float[Array, "n 3"]) -> Solids:
        """The trunks as they swing, with any phase. One that would come near the start is left out."""
        c, turn = self.config, 2 * jnp.pi
        far, way, phase, period = jax.random.uniform(key, (4, *trees.active.shape))
        shortest, longest = c.swing_period
        far, way, phase = c.swing * far, turn * way, turn * phase
        along = far[..., None] * jnp.stack([jnp.cos(way), jnp.sin(way), 0.0 * way], axis=-1)
        away = jnp.linalg.norm(trees.centre[..., :2] - start[:, None, :2], axis=-1)
        return dataclasses.replace(
            trees,
            active=trees.active & (away - trees.size[..., 0] - far > c.forest.clear),
            cosine=along * jnp.cos(phase)[..., None],
            sine=along * jnp.sin(phase)[..., None],
            rate=turn / (shortest + (longest - shortest) * period),
        )

    def flier(self, after: State, time: Float[Array, " n"]) -> Flier:
        """The motion from which the expert flies on. Only trunks that swing are elsewhere at another time."""
        return Flier.usual(after.position, after.velocity, time if self.config.swing else 0.0)

    def expert(self, memory: AvoidWorld, flier: Flier) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """Velocity, m/s, and yaw, rad, of an expert that knows every tree, and all others if there are any.

        The yaw is half-way between the bearing of the goal and the heading of the velocity.
        """
        away = self.goal(memory, memory.speed) - flier.position
        bearing = jnp.arctan2(away[:, 1], away[:, 0])
        side = self.config.forest.width / 2
        others = self.others(memory)
        heading = best_heading(
            memory.trees, flier, bearing, memory.speed, self.shape.radius, side, others, self.config.swing > 0
        )
        level = memory.speed[:, None] * jnp.stack([jnp.cos(heading), jnp.sin(heading)], axis=-1)
        climb = jnp.clip(STRICT * away[:, 2:], -CLIMB, CLIMB)
        return jnp.concatenate([level, climb], axis=-1), (heading + bearing) / 2

    def others(self, memory: Any) -> Others | None:
        """The other vehicles, which the expert flies around."""
        del memory
        return None

    def scene(self, memory: AvoidWorld) -> Scene:
        """The trees on level ground."""
        return Scene.of({"cylinder": memory.trees}, memory.speed.shape[0])

    def desired_yaw(self, memory: AvoidWorld, state: State) -> Float[Array, " n"]:
        """Towards the goal."""
        away = self.goal(memory, memory.speed) - state.position
        return jnp.arctan2(away[:, 1], away[:, 0])

    def advance(
        self, memory: AvoidWorld, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[AvoidWorld, Outcome]:
        """The goal's verdict, with signals for the reward."""
        hit = struck(self.scene(memory), before, after, time, self.control_period, self.checks, self.shape.radius)
        moved, outcome = self.verdict(memory, before, after, time, hit)
        wanted, _ = self.expert(memory, self.flier(after, time))
        signals = {"desired_velocity": wanted, "desired_speed": memory.speed}
        return moved, dataclasses.replace(outcome, signals=signals)
