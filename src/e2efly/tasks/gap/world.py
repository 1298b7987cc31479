"""Narrow gap: fly through a slit in a wall. The slit is tilted, and only a vehicle that banks with it fits through."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.control.vectors import rotate, unrotate
from e2efly.policy.goal import Outcome, Shape
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.scene import WALL, Scene, Solids
from e2efly.simulation.scenes.shapes import FAR
from e2efly.tasks.gap import GapConfig
from e2efly.tasks.gap.goal import WALL_WIDTH, GapGoal, GapMemory, rims
from e2efly.tasks.task import at_rest, between, uniform

START_YAW = 0.3
"""Largest heading angle at the start, to either side, rad."""
PASSING = 0.2
"""Distance from the wall's middle plane within which a vehicle must be inside the opening, m."""
jax.tree_util.register_dataclass(GapMemory)


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape"], meta_fields=["control_period", "checks"])
@dataclass(frozen=True)
class Gap(GapGoal):
    """Make it with `Gap.of`."""

    @classmethod
    def of(cls, config: GapConfig, shape: Shape, control_period: float, checks: int = 1) -> "Gap":
        """Check that the vehicle fits.

        Raises:
            ValueError: for an opening through which even a well banked vehicle does not fit, or for a slit that is too
                low.
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

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, GapMemory]:
        """At rest in front of the wall, roughly facing it. The slit is anywhere ahead, tilted to the left or right."""
        c, u, zero = self.config, uniform(key, n, 7), jnp.zeros(n)
        state = at_rest(jnp.stack([zero, zero, zero + c.altitude], axis=-1))
        ahead = between(c.distance, u[:, 0])
        centre = jnp.stack([ahead, c.sideways * u[:, 1], c.altitude + c.sideways * u[:, 2]], axis=-1)
        roll = jnp.where(u[:, 3] < 0, -1.0, 1.0) * between(c.roll, u[:, 4])
        memory = GapMemory(centre, from_euler(roll, zero, c.yaw * u[:, 5]), jnp.zeros(n, bool))
        return dataclasses.replace(state, quaternion=from_euler(zero, zero, START_YAW * u[:, 6])), memory

    def scene(self, memory: GapMemory) -> Scene:
        """The wall over level ground: a gate with bars so wide that they form a wall."""
        c, n = self.config, memory.centre.shape[0]
        size = jnp.stack([jnp.asarray(x) for x in (c.opening[0] / 2, c.opening[1] / 2, WALL_WIDTH, c.thickness / 2)])
        wall = Solids.of("gate", memory.centre[:, None], size, label=WALL)
        return Scene.of({"gate": dataclasses.replace(wall, quaternion=memory.quaternion[:, None])}, n)

    def desired_yaw(self, memory: GapMemory, state: State) -> Float[Array, " n"]:
        """The heading straight through the wall."""
        through = self.axes(memory)[:, 0]
        return jnp.arctan2(through[:, 1], through[:, 0])

    def roll_error(self, memory: GapMemory, state: State) -> Float[Array, " n"]:
        """Rotation about the direction of flight that would align the vehicle with the slit, rad.

        It is 0 if the vehicle's z axis lies along this direction.
        """
        zero = jnp.zeros_like(state.position)
        up = unrotate(memory.quaternion, rotate(state.quaternion, zero.at[:, 2].set(1.0)))
        defined = up[:, 1] ** 2 + up[:, 2] ** 2 > 1e-12
        return jnp.arctan2(jnp.where(defined, -up[:, 1], 0.0), jnp.where(defined, up[:, 2], 1.0))

    def overhang(self, memory: GapMemory, state: State) -> Float[Array, "n p"]:
        """Distance by which each point of the body lies outside the opening, m.

        It is negative inside the opening, and `-FAR` away from the wall.
        """
        half = jnp.asarray(self.config.opening) / 2
        points = rims(self.shape)
        place = state.position[:, None] + rotate(state.quaternion[:, None], points) - memory.centre[:, None]
        local = unrotate(memory.quaternion[:, None], place)
        out = jnp.max(jnp.abs(local[..., 1:]) - half, axis=-1)
        return jnp.where(jnp.abs(local[..., 0]) < PASSING, out, -FAR)

    def advance(
        self, memory: GapMemory, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[GapMemory, Outcome]:
        """The goal's verdict, with signals for the reward."""
        moved, outcome = super().advance(memory, before, after, time, timed_out)
        signals = {"roll_error": self.roll_error(memory, after), "overhang": self.overhang(memory, after)}
        return moved, dataclasses.replace(outcome, signals=outcome.signals | signals)
