"""Visual landing: touch down gently on a pad of random size and shape that is known only from camera images."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.courses.solids import DISC, TRIANGLE
from e2efly.policy.goal import Outcome
from e2efly.simulation.physics import State
from e2efly.simulation.scenes.scene import Scene, Solids, distances
from e2efly.tasks.land.world import above_pad
from e2efly.tasks.land_visual.goal import LandVisualGoal
from e2efly.tasks.task import uniform


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class LandVisual(LandVisualGoal):
    """Starts above and beside the pad. The pad is the task's state."""

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Solids]:
        """Level, any heading, above and beside the pad."""
        state_key, outline_key = jax.random.split(key)
        c, u = self.config, uniform(state_key, n, 9)
        zero, (low, high) = jnp.zeros(n), c.pad_size
        half = (low + high) / 4 + (high - low) / 4 * u[:, 7]
        outline = jax.random.randint(outline_key, (n,), DISC, TRIANGLE + 1)
        size = jnp.stack([half, zero + c.pad_height / 2, outline.astype(half.dtype)], axis=-1)
        centre = jnp.stack([zero, zero, zero + c.pad_height / 2], axis=-1)
        pad = Solids.of("pad", centre[:, None], size[:, None], yaw=jnp.pi * u[:, 8:])
        return above_pad(c, u, self.shape.feet_height + c.pad_height), pad

    def scene(self, memory: Solids) -> Scene:
        """The pad on level ground."""
        return Scene.of({"pad": memory}, memory.active.shape[0])

    def drawn(self, memory: Solids) -> dict[str, Array]:
        """The pad: its outline (0: disc, 1: square, 2: triangle) and its width, m."""
        return {"pad_outline": memory.size[:, 0, 2].astype(int), "pad_width_m": 2 * memory.size[:, 0, 0]}

    def advance(
        self, memory: Solids, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[Solids, Outcome]:
        """The goal's verdict. The pad's outline decides whether the vehicle touches the pad."""
        feet = after.position - jnp.array([0.0, 0.0, 1.0]) * self.shape.feet_height
        touched = (feet[:, 2] <= 0) | (distances("pad", memory, feet, time)[:, 0] <= 0)
        return memory, self.verdict(memory, after, time, touched)
