"""Perception-aware hovering: stay at a point, and keep what moves around it in the middle of the camera's image."""

import dataclasses
from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.config import CameraConfig
from e2efly.control.vectors import Quat, Vec3
from e2efly.observation import Field
from e2efly.physics import State
from e2efly.physics.rotation import from_euler
from e2efly.scenes.camera import mount, pose
from e2efly.scenes.scene import Scene, Solids
from e2efly.tasks.hover_aware import HoverAwareConfig
from e2efly.tasks.task import Outcome, Shape, at_rest, touches_ground, uniform

OUTSIDE = 10.0
"""Pixels end here, in halves of the image; what is behind the camera is here, too."""
NEAREST = 1e-3
"""What is nearer along the optical axis than this counts as behind the camera, m."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Memory:
    """What to look at, and for how long all has been well."""

    seen: Solids
    """A ball on a circle, one in each world."""
    time: Float[Array, " n"]
    """Of the last step's end, s."""
    held: Float[Array, " n"]
    """s."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HoverAware:
    """The camera is the task's own, which nobody has to render; its pixels are in halves of the image."""

    config: HoverAwareConfig
    shape: Shape
    control_period: float | Array

    fields = (
        Field("position_error", 3, "world", "m", 1.0, "target position minus vehicle position"),
        Field("look_at", 3, "world", "m", 4.0, "position of what to look at minus vehicle position"),
    )

    @classmethod
    def of(cls, config: HoverAwareConfig, shape: Shape, control_period: float, substeps: int = 1) -> "HoverAware":
        """See `e2efly.tasks.task.make_task`."""
        del substeps
        return cls(config, shape, control_period)

    @property
    def episode_s(self) -> float | Array:
        """Time limit, s."""
        return self.config.episode_s

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Memory]:
        """Uniform about the target: position, velocity, roll, pitch, any yaw; what to look at somewhere around it."""
        c, u, zero = self.config, uniform(key, n, 13), jnp.zeros(n)
        target = jnp.asarray(c.target)
        state = at_rest(target + c.position * u[:, :3])
        quaternion = from_euler(c.tilt * u[:, 6], c.tilt * u[:, 7], jnp.pi * u[:, 8])
        low, high = c.distance
        away, angle = (low + high) / 2 + (high - low) / 2 * u[:, 9], jnp.pi * u[:, 10]
        x, y = away * jnp.cos(angle), away * jnp.sin(angle)
        centre = target + jnp.stack([zero, zero, c.elevation * u[:, 11]], axis=-1)
        ball = dataclasses.replace(
            Solids.of("sphere", centre[:, None], jnp.asarray(c.size)[None]),
            cosine=jnp.stack([x, y, zero], axis=-1)[:, None],
            sine=jnp.stack([-y, x, zero], axis=-1)[:, None],
            rate=c.turn_rate * u[:, 12:],
        )
        return dataclasses.replace(state, velocity=c.velocity * u[:, 3:6], quaternion=quaternion), Memory(
            ball, zero, zero
        )

    def goal(self, memory: Memory, time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """Where to hover."""
        del time
        return jnp.broadcast_to(jnp.asarray(self.config.target), (*memory.held.shape, 3))

    def look_at(self, memory: Memory, time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """Where what to look at is, world, m."""
        return memory.seen.position(time)[:, 0]

    def observe(self, memory: Memory, time: Float[Array, " n"], state: State) -> Float[Array, "n 6"]:
        """Both minus position."""
        return jnp.concatenate(
            [self.goal(memory, time) - state.position, self.look_at(memory, time) - state.position], axis=-1
        )

    def scene(self, memory: Memory) -> Scene:
        """The ball over level ground."""
        return Scene.of({"sphere": memory.seen}, memory.held.shape[0])

    def desired_yaw(self, memory: Memory, state: State) -> Float[Array, " n"]:
        """Towards where what to look at was at the end of the last step."""
        away = self.look_at(memory, memory.time) - state.position
        return jnp.arctan2(away[:, 1], away[:, 0] + 1e-6)

    def pixel(
        self, position: Float[Array, "n 3"], quaternion: Float[Array, "n 4"], point: Float[Array, "n 3"]
    ) -> Float[Array, "n 2"]:
        """Where the camera of a vehicle sees a point: right and down from the middle, in halves of the image.

        Up to `OUTSIDE` either way; a point behind the camera is there, too.
        """
        c = self.config
        eye = mount(CameraConfig(fov=c.fov, position=c.camera_position, pitch=c.camera_pitch), 1)
        origin, matrix = pose(eye, position, quaternion)
        # the columns of the matrix are perpendicular: right and down to the image's edge, ahead by one
        along = jnp.einsum("ni,nij->nj", point - origin, matrix) / jnp.sum(matrix**2, axis=1)
        ahead = along[:, 2:]
        front = ahead > NEAREST
        inside = jnp.clip(along[:, :2] / jnp.where(front, ahead, 1.0), -OUTSIDE, OUTSIDE)
        return jnp.where(front, inside, OUTSIDE)

    def projection(
        self, memory: Memory, state: State, time: Float[Array, " n"]
    ) -> tuple[Float[Array, "n 2"], Float[Array, "n 2"]]:
        """The pixel of what to look at, and its velocity, 1/s: by the vehicle's motion, its turning and what moves."""

        def seen(position: Array, quaternion: Array, time: Array) -> Array:
            return self.pixel(position, quaternion, self.look_at(memory, time))

        turning = Quat.of(state.quaternion).derivative(Vec3.of(state.body_rate)).stack()
        return jax.jvp(seen, (state.position, state.quaternion, time), (state.velocity, turning, jnp.ones_like(time)))

    def advance(
        self, memory: Memory, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[Memory, Outcome]:
        """Success: for the last `hold_s` of the episode within the radius, and what to look at in the image's middle.

        Leaving the fence, touching the ground or what to look at fails.
        """
        del before
        c = self.config
        error = jnp.linalg.norm(after.position - self.goal(memory, time), axis=-1)
        pixel, pixel_velocity = self.projection(memory, after, time)
        well = (error < c.radius) & jnp.all(jnp.abs(pixel) < c.centred, axis=-1)
        held = jnp.where(well, memory.held + self.control_period, 0.0)
        away = jnp.linalg.norm(after.position - self.look_at(memory, time), axis=-1)
        crashed = (error > c.fence) | touches_ground(self.shape, after) | (away < c.size + self.shape.radius)
        success = timed_out & ~crashed & (held >= c.hold_s - 1e-4)
        arrived = (held > 0) & (memory.held == 0)
        signals = {"pixel": pixel, "pixel_velocity": pixel_velocity}
        return Memory(memory.seen, time, held), Outcome(
            terminated=crashed, success=success, arrived=arrived, crashed=crashed, error=error, signals=signals
        )
