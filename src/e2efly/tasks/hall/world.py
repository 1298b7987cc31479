"""Flight through a cluttered hall: pillars and crates between two walls, seen only by a LiDAR."""

import dataclasses
import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.generate import corridor
from e2efly.simulation.scenes.scene import Scene, join
from e2efly.tasks.avoid.world import Avoid, AvoidWorld
from e2efly.tasks.hall import HallConfig

BEYOND = 10.0
"""Length of the walls behind the end of the hall, m."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HallWorld(AvoidWorld):
    """The hall, and the commanded speed. `trees` are the circles around all obstacles."""

    crate: Bool[Array, "n k"]
    """Which obstacles are crates."""
    turn: Float[Array, "n k"]
    """Angle by which each crate is turned, rad."""


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape"], meta_fields=["control_period", "checks"])
@dataclass(frozen=True)
class Hall(Avoid):
    """Starts at one end of a random hall."""

    config: HallConfig

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, HallWorld]:
        """At rest at the end of the hall, facing it."""
        state, world = super().start(key, n)
        kind_key, turn_key = jax.random.split(jax.random.fold_in(key, 1))
        crate = jax.random.uniform(kind_key, world.trees.active.shape) < self.config.crates
        turn = jax.random.uniform(turn_key, crate.shape, maxval=math.pi / 2)
        return state, HallWorld(world.speed, world.trees, crate, turn)

    def scene(self, memory: Any) -> Scene:
        """The pillars, the crates and the walls on a level floor."""
        c, trees, n = self.config, memory.trees, memory.speed.shape[0]
        zero = jnp.zeros_like(memory.turn)
        half = trees.size[..., 0] / math.sqrt(2)
        crates = dataclasses.replace(
            trees,
            quaternion=from_euler(zero, zero, memory.turn),
            size=jnp.stack([half, half, trees.size[..., 1], zero], axis=-1),
            active=trees.active & memory.crate,
        )
        pillars = dataclasses.replace(trees, active=trees.active & ~memory.crate)
        walls = corridor(n, c.forest.length + BEYOND, c.forest.width, c.ceiling)
        return Scene.of({"cylinder": pillars, "box": join(crates, walls)}, n)
