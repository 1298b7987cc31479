"""Several vehicles in the same forest: a world ends and succeeds for all of its vehicles together."""

import dataclasses
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Bool, Float, PRNGKeyArray

from e2efly.policy.goal import Outcome
from e2efly.policy.others import Others
from e2efly.simulation.physics import State
from e2efly.simulation.scenes.scene import Scene
from e2efly.tasks import company
from e2efly.tasks.avoid.world import Avoid, AvoidWorld
from e2efly.tasks.avoid_together import AvoidTogetherConfig
from e2efly.tasks.avoid_together.goal import AvoidTogetherGoal
from e2efly.tasks.task import struck


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class AvoidTogetherWorld(AvoidWorld):
    """The forest, the commanded speed, and the others."""

    bodies: Others
    """All others, at `time`."""
    time: Float[jax.Array, " n"]
    """Time at the end of the last step, s."""
    past: Bool[jax.Array, " n"]
    """Whether the vehicle is past the end of the forest. What happens to it there does not count."""
    clean: Bool[jax.Array, " n"]
    """Whether no vehicle of the world has touched anything, or left the lane."""
    beside: Float[jax.Array, " n"]
    """How far to the left of the lane's middle the vehicle started, m."""


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape"], meta_fields=["control_period", "checks"])
@dataclass(frozen=True)
class AvoidTogether(AvoidTogetherGoal, Avoid):
    """Starts beside each other in front of a random forest."""

    config: AvoidTogetherConfig

    @property
    def agents(self) -> int:
        """Number of vehicles in a forest."""
        return self.config.agents

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, AvoidTogetherWorld]:
        """At rest in front of the same forest, in places of their own across its middle, in random order."""
        a, c = self.agents, self.config
        state, world = super().start(key, n)
        keys = jax.random.split(jax.random.fold_in(key, 2), n // a)
        order = jax.vmap(lambda k: jax.random.permutation(k, a))(keys).reshape(n)
        room = 2 * c.sideways / a
        free = jnp.maximum(room - 1.0, 0.0) / c.sideways  # of two neighbours, at least 1 m apart
        y = (order + 0.5) * room - c.sideways + free * state.position[:, 1] / 2
        state = dataclasses.replace(state, position=state.position.at[:, 1].set(y))
        trees = jax.tree.map(lambda x: jnp.repeat(x[::a], a, axis=0), world.trees)
        away = jnp.linalg.norm(
            trees.centre[:, None, :, :2] - state.position.reshape(-1, a, 3).repeat(a, 0)[:, :, None, :2], axis=-1
        )
        wide = trees.size[:, None, :, 0]
        if c.swing:
            wide += jnp.sqrt(jnp.sum(trees.cosine**2 + trees.sine**2, axis=-1))[:, None]
        free_of = jnp.all(away - wide > c.forest.clear, axis=1)
        trees = dataclasses.replace(trees, active=trees.active & free_of)
        no, bodies = jnp.zeros(n, bool), company.all_others(state, a)
        return state, AvoidTogetherWorld(world.speed, trees, bodies, jnp.zeros(n), no, ~no, y)

    def others(self, memory: Any) -> Others:
        """All others of the world."""
        return memory.bodies

    def scene(self, memory: Any) -> Scene:
        """The trees and the others on level ground."""
        others = company.spheres(memory.bodies, memory.time, self.shape.radius)
        return Scene.of({"cylinder": memory.trees, "sphere": others}, memory.speed.shape[0])

    def advance(
        self, memory: Any, before: State, after: State, time: Float[jax.Array, " n"], timed_out: Bool[jax.Array, " n"]
    ) -> tuple[AvoidTogetherWorld, Outcome]:
        """The world's verdict: it succeeds when all are past the end, and nothing was touched until then."""
        a, radius = self.agents, self.shape.radius
        hit = struck(super().scene(memory), before, after, time, self.control_period, self.checks, radius)
        hit |= company.collided(before, after, self.control_period, self.checks, a, 2 * radius)
        _, one = self.verdict(memory, before, after, time, hit & ~memory.past)
        crashed = one.crashed & ~memory.past
        past, clean = memory.past | one.success, memory.clean & ~company.any_of_world(crashed, a)
        all_past = company.all_of_world(past, a)
        left = crashed & ~hit
        ends = company.any_of_world(left | (crashed & (self.config.collisions_end > 0)), a) | all_past
        bodies = company.all_others(jax.lax.stop_gradient(after), a)
        moved = dataclasses.replace(memory, bodies=bodies, time=time, past=past, clean=clean)
        wanted, _ = self.expert(memory, self.flier(after, time))
        signals = {
            "desired_velocity": wanted, "desired_speed": memory.speed, "misses": company.misses(after, a, 2 * radius),
        }  # fmt: skip
        return moved, dataclasses.replace(
            one, terminated=ends, success=all_past & clean, crashed=crashed, signals=signals
        )
