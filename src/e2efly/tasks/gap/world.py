"""Narrow gap: through a slit in a wall, tilted so that only a vehicle that banks with it fits.

The slit's frame: origin in the middle of the opening, x the way through, y along the long side, z across the short one.
"""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.observation import Field
from e2efly.physics import State
from e2efly.physics.rotation import from_euler, rotate, unrotate
from e2efly.scenes.scene import WALL, Scene, Solids
from e2efly.scenes.shapes import FAR
from e2efly.tasks.gap import GapConfig
from e2efly.tasks.task import Outcome, Shape, at_rest, offsets, struck, uniform

WALL_WIDTH = 3.0
"""The wall reaches this far around the opening, m."""
START_YAW = 0.3
"""Half-width of the heading at the start, rad."""
PASSING = 0.2
"""What is nearer to the middle of the wall than this is to be inside the opening already, or still, m."""
RIM = 8
"""Points on each of the two rims of the vehicle's body that must not touch the wall."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Memory:
    """The slit of each vehicle, and whether it is through."""

    centre: Float[Array, "n 3"]
    """World, m."""
    quaternion: Float[Array, "n 4"]
    """Slit's frame to world."""
    passed: Bool[Array, " n"]


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape"], meta_fields=["control_period", "checks"])
@dataclass(frozen=True)
class Gap:
    """Make it with `Gap.of`. The vehicle counts as a flat cylinder: `radius`, and `feet_height` up and down."""

    config: GapConfig
    shape: Shape
    control_period: float
    checks: int
    """How often a control step is checked for collisions."""

    fields = (
        Field("gap", 6, "world", "m", 2.0, "middle of the slit and the point behind it minus vehicle position"),
        Field("gap_axes", 6, "world", "1", 1.0, "unit vectors: the way through the slit, across its short side"),
    )

    @staticmethod
    def of(config: GapConfig, shape: Shape, control_period: float, checks: int) -> "Gap":
        """Check that the vehicle fits.

        Raises:
            ValueError: for an opening that a well banked vehicle does not fit through, or a slit too low.
        """
        least = (2 * float(shape.radius), 2 * float(shape.feet_height))
        if not (config.opening[0] > least[0] and config.opening[1] > least[1]):
            raise ValueError(
                f"task.opening is {config.opening}; accepted: more than the vehicle's ({least[0]:g}, {least[1]:g}) m"
            )
        lowest = config.altitude - config.sideways - config.opening[0] / 2
        if not lowest > 0:
            raise ValueError(
                f"task.altitude is {config.altitude}; accepted: more than task.sideways and half of task.opening "
                f"together, {config.altitude - lowest:g} m"
            )
        return Gap(config, shape, control_period, checks)

    @property
    def episode_s(self) -> float | Array:
        """Time limit, s."""
        return self.config.episode_s

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, Memory]:
        """At rest before the wall, roughly facing it; the slit anywhere ahead, tilted to the left or right."""
        c, u, zero = self.config, uniform(key, n, 7), jnp.zeros(n)
        state = at_rest(jnp.stack([zero, zero, zero + c.altitude], axis=-1))
        ahead = _within(c.distance, u[:, 0])
        centre = jnp.stack([ahead, c.sideways * u[:, 1], c.altitude + c.sideways * u[:, 2]], axis=-1)
        roll = jnp.where(u[:, 3] < 0, -1.0, 1.0) * _within(c.roll, u[:, 4])
        memory = Memory(centre, from_euler(roll, zero, c.yaw * u[:, 5]), jnp.zeros(n, bool))
        return dataclasses.replace(state, quaternion=from_euler(zero, zero, START_YAW * u[:, 6])), memory

    def targets(self, memory: Memory) -> Float[Array, "n 2 3"]:
        """The middle of the slit and the point behind it, world, m."""
        through = self.axes(memory)[:, 0]
        return jnp.stack([memory.centre, memory.centre + self.config.beyond * through], axis=1)

    def axes(self, memory: Memory) -> Float[Array, "n 2 3"]:
        """Unit vectors in the world: the way through, and across the short side."""
        x, z = jnp.eye(3)[0], jnp.eye(3)[2]
        shape = memory.centre.shape
        return jnp.stack([rotate(memory.quaternion, jnp.broadcast_to(axis, shape)) for axis in (x, z)], axis=1)

    def goal(self, memory: Memory, time: Float[Array, " n"]) -> Float[Array, "n 3"]:
        """The slit; once through, the point behind it."""
        del time
        slit, behind = jnp.moveaxis(self.targets(memory), 1, 0)
        return jnp.where(memory.passed[:, None], behind, slit)

    def observe(self, memory: Memory, time: Float[Array, " n"], state: State) -> Float[Array, "n 12"]:
        """Both targets minus position, and the axes."""
        del time
        axes = self.axes(memory).reshape(memory.centre.shape[0], -1)
        return jnp.concatenate([offsets(self.targets(memory), state), axes], axis=-1)

    def scene(self, memory: Memory) -> Scene:
        """The wall over level ground: a gate with bars so wide that they are one."""
        c, n = self.config, memory.centre.shape[0]
        size = jnp.stack([jnp.asarray(x) for x in (c.opening[0] / 2, c.opening[1] / 2, WALL_WIDTH, c.thickness / 2)])
        wall = Solids.of("gate", memory.centre[:, None], size, label=WALL)
        return Scene.of({"gate": dataclasses.replace(wall, quaternion=memory.quaternion[:, None])}, n)

    def desired_yaw(self, memory: Memory, state: State) -> Float[Array, " n"]:
        """Straight through the wall."""
        del state
        through = self.axes(memory)[:, 0]
        return jnp.arctan2(through[:, 1], through[:, 0])

    def roll_error(self, memory: Memory, state: State) -> Float[Array, " n"]:
        """The turn about the way through that would lay the vehicle along the slit, rad; 0 where it points along it."""
        zero = jnp.zeros_like(state.position)
        up = unrotate(memory.quaternion, rotate(state.quaternion, zero.at[:, 2].set(1.0)))
        defined = up[:, 1] ** 2 + up[:, 2] ** 2 > 1e-12
        return jnp.arctan2(jnp.where(defined, -up[:, 1], 0.0), jnp.where(defined, up[:, 2], 1.0))

    def overhang(self, memory: Memory, state: State) -> Float[Array, "n p"]:
        """How far each of the body's points stands out of the opening, m; negative inside, `-FAR` off the wall."""
        half = jnp.asarray(self.config.opening) / 2
        points = rims(self.shape)
        place = state.position[:, None] + rotate(state.quaternion[:, None], points) - memory.centre[:, None]
        local = unrotate(memory.quaternion[:, None], place)
        out = jnp.max(jnp.abs(local[..., 1:]) - half, axis=-1)
        return jnp.where(jnp.abs(local[..., 0]) < PASSING, out, -FAR)

    def touched(self, memory: Memory, before: State, after: State, time: Float[Array, " n"]) -> Bool[Array, " n"]:
        """Whether the body touched wall or ground during a control step: `struck`, of points on its two rims."""
        scene = self.scene(memory)

        def at(point: Float[Array, "3"], state: State) -> State:
            arm = jnp.broadcast_to(point, state.position.shape)
            return dataclasses.replace(
                state,
                position=state.position + rotate(state.quaternion, arm),
                velocity=state.velocity + rotate(state.quaternion, jnp.cross(state.body_rate, arm)),
            )

        def one(point: Float[Array, "3"]) -> Bool[Array, " n"]:
            return struck(scene, at(point, before), at(point, after), time, self.control_period, self.checks, 0.0)

        return jnp.any(jax.vmap(one)(rims(self.shape)), axis=0)

    def advance(
        self, memory: Memory, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[Memory, Outcome]:
        """Success: through the slit to the point behind it, without touching anything.

        The centre of mass goes through where the straight line of the step crosses the wall's middle forward inside
        the opening; crossing it forward elsewhere is a failure, round the wall, too.
        """
        del timed_out
        c = self.config
        a, b = (unrotate(memory.quaternion, s.position - memory.centre) for s in (before, after))
        share = a[:, 0] / jnp.where(a[:, 0] == b[:, 0], 1.0, a[:, 0] - b[:, 0])
        y, z = (jnp.abs(a[:, i] + share * (b[:, i] - a[:, i])) for i in (1, 2))
        forward = (a[:, 0] < 0) & (b[:, 0] >= 0) & ~memory.passed
        inside = (y < c.opening[0] / 2) & (z < c.opening[1] / 2)
        moved = dataclasses.replace(memory, passed=memory.passed | (forward & inside))
        error = jnp.linalg.norm(after.position - self.goal(moved, time), axis=-1)
        hit = self.touched(memory, before, after, time)
        lost = (forward & ~inside) | (error > c.fence)
        reached = moved.passed & (error < c.radius) & ~lost
        crashed = hit | lost
        success = reached & ~crashed
        signals = {
            "roll_error": self.roll_error(memory, after),
            "overhang": self.overhang(memory, after),
            "approaching": (b[:, 0] > -c.approach) & (b[:, 0] < c.thickness / 2 + self.shape.radius),
        }
        arrived = (forward & inside) | success
        ends = lost | reached | (hit & (c.collisions_end > 0))
        return moved, Outcome(
            terminated=ends, success=success, arrived=arrived, crashed=crashed, error=error, signals=signals
        )


def rims(shape: Shape) -> Float[Array, "p 3"]:
    """Points on the upper and lower rim of the vehicle's body, body frame, m."""
    angle = 2 * np.pi * np.arange(RIM) / RIM
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(RIM)], axis=-1)
    up = np.array([0.0, 0.0, 1.0])
    points = [shape.radius * jnp.asarray(around) + side * shape.feet_height * jnp.asarray(up) for side in (1, -1)]
    return jnp.concatenate(points).astype(jnp.float32)


def _within(bounds: tuple[float, float], u: Float[Array, " n"]) -> Float[Array, " n"]:
    """From u in [-1, 1] to between the bounds."""
    low, high = bounds
    return (low + high) / 2 + (high - low) / 2 * u
