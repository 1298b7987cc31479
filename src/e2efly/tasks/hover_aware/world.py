"""Perception-aware hovering: stay at a point, and keep a moving object in the middle of the camera's image."""

import dataclasses
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.control.vectors import Quat, Vec3
from e2efly.policy.goal import Outcome
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.scene import Scene, Solids
from e2efly.tasks.hover_aware.goal import HoverAwareGoal, HoverAwareMemory
from e2efly.tasks.task import at_rest, uniform

jax.tree_util.register_dataclass(HoverAwareMemory)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HoverAware(HoverAwareGoal):
    """Starts around the target, with a ball on a circle around it."""

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, HoverAwareMemory]:
        """Uniform around the target: position, velocity, roll, pitch, any yaw.

        The object is somewhere around the target.
        """
        c, u, zero = self.config, uniform(key, n, 13), jnp.zeros(n)
        target = jnp.asarray(c.target)
        state = at_rest(target + c.position * u[:, :3])
        quaternion = from_euler(c.tilt * u[:, 6], c.tilt * u[:, 7], jnp.pi * u[:, 8])
        low, high = c.distance
        away, angle = (low + high) / 2 + (high - low) / 2 * u[:, 9], jnp.pi * u[:, 10]
        centre = target + jnp.stack([zero, zero, c.elevation * u[:, 11]], axis=-1)
        memory = HoverAwareMemory(centre, away, angle, c.turn_rate * u[:, 12], zero, zero)
        return dataclasses.replace(state, velocity=c.velocity * u[:, 3:6], quaternion=quaternion), memory

    def scene(self, memory: HoverAwareMemory) -> Scene:
        """The ball over level ground."""
        x, y, zero = memory.away * jnp.cos(memory.angle), memory.away * jnp.sin(memory.angle), 0.0 * memory.away
        ball = dataclasses.replace(
            Solids.of("sphere", memory.centre[:, None], jnp.asarray(self.config.size)[None]),
            cosine=jnp.stack([x, y, zero], axis=-1)[:, None],
            sine=jnp.stack([-y, x, zero], axis=-1)[:, None],
            rate=memory.rate[:, None],
        )
        return Scene.of({"sphere": ball}, memory.held.shape[0])

    def desired_yaw(self, memory: HoverAwareMemory, state: State) -> Float[Array, " n"]:
        """Towards the position of the object at the end of the last step."""
        away = self.look_at(memory, memory.time) - state.position
        return jnp.arctan2(away[:, 1], away[:, 0] + 1e-6)

    def projection(
        self, memory: HoverAwareMemory, state: State, time: Float[Array, " n"]
    ) -> tuple[Float[Array, "n 2"], Float[Array, "n 2"]]:
        """Pixel of the object, and its velocity, 1/s, from the motion of the vehicle and of the object."""

        def seen(position: Array, quaternion: Array, time: Array) -> Array:
            return self.pixel(position, quaternion, self.look_at(memory, time))

        turning = Quat.of(state.quaternion).derivative(Vec3.of(state.body_rate)).stack()
        return jax.jvp(seen, (state.position, state.quaternion, time), (state.velocity, turning, jnp.ones_like(time)))

    def advance(
        self,
        memory: HoverAwareMemory,
        before: State,
        after: State,
        time: Float[Array, " n"],
        timed_out: Bool[Array, " n"],
    ) -> tuple[HoverAwareMemory, Outcome]:
        """The goal's verdict, with the pixel's velocity for the reward."""
        moved, outcome = super().advance(memory, before, after, time, timed_out)
        pixel, velocity = self.projection(memory, after, time)
        return moved, dataclasses.replace(outcome, signals={"pixel": pixel, "pixel_velocity": velocity})
