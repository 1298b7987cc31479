"""Dodging balls: hover at a place, while balls are thrown at it."""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.policy.goal import Outcome
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.scene import Scene, Solids
from e2efly.simulation.scenes.shapes import FAR
from e2efly.tasks.dodge.goal import DodgeGoal, DodgeMemory
from e2efly.tasks.dodge.pilot import passing, way_out
from e2efly.tasks.task import Flier, at_rest, between, into_ball, struck, uniform
from e2efly.vehicles.gravity import GRAVITY

jax.tree_util.register_dataclass(DodgeMemory)

REACTION, GONE = 0.1, 0.7
"""The expert knows of a ball from the first to the second time after its throw, s. A policy cannot see it earlier."""
COLOUR = (0.85, 0.25, 0.12)
"""Colour of the balls, RGB."""


def launch(
    release: Float[Array, "*n 3"], aim: Float[Array, "*n 3"], speed: Float[Array, "*n"]
) -> tuple[Float[Array, "*n 3"], Float[Array, "*n"]]:
    """The velocity, m/s, with which a ball that is thrown at this speed flies through a point, and the time until then.

    Of the two ways it is the flatter one. A ball that cannot come so far, falls short. Positions in m, times in s.
    """
    away = aim - release
    b = speed**2 - GRAVITY * away[..., 2]
    root = jnp.sqrt(jnp.maximum(b**2 - GRAVITY**2 * jnp.sum(away**2, axis=-1), 0.0))
    time = jnp.sqrt(2 * (b - root)) / GRAVITY
    return away / time[..., None] + jnp.array([0.0, 0.0, GRAVITY / 2]) * time[..., None], time


@partial(jax.tree_util.register_dataclass, data_fields=["config", "shape"], meta_fields=["control_period", "checks"])
@dataclass(frozen=True)
class Dodge(DodgeGoal):
    """Starts about the place, with throws from a sector that the vehicle faces."""

    def start(self, key: PRNGKeyArray, n: int) -> tuple[State, DodgeMemory]:
        """About the place, almost at rest, roughly facing the thrower."""
        state_key, throw_key = jax.random.split(key)
        c, u, zero = self.config, uniform(state_key, n, 8), jnp.zeros(n)
        yaw = jnp.pi * u[:, 6]
        state = at_rest(jnp.asarray(c.target) + c.position * u[:, :3])
        quaternion = from_euler(zero, zero, yaw + c.turned * u[:, 7])
        memory = self.thrown(throw_key, yaw)
        return dataclasses.replace(state, velocity=c.velocity * u[:, 3:6], quaternion=quaternion), memory

    def thrown(self, key: PRNGKeyArray, yaw: Float[Array, " n"]) -> DodgeMemory:
        """Random throws from the sectors about these bearings, rad."""
        c, n, k = self.config, yaw.shape[0], self.config.throws
        u = jax.random.uniform(key, (n, k, 9), minval=-1.0, maxval=1.0)
        waits = jnp.concatenate([between(c.first, u[:, :1, 0]), between(c.pause, u[:, 1:, 0])], axis=1)
        since = jnp.cumsum(waits, axis=1)
        bearing, away = yaw[:, None] + c.sector * u[..., 1], between(c.distance, u[..., 2])
        target = jnp.asarray(c.target)
        offset = [away * jnp.cos(bearing), away * jnp.sin(bearing), between(c.rise, u[..., 3])]
        release = target + jnp.stack(offset, axis=-1)
        aim = target + c.scatter * into_ball(u[..., 4:7].reshape(-1, 3)).reshape(n, k, 3)
        velocity, _ = launch(release, aim, between(c.speed, u[..., 7]))
        t, fall = since[..., None], jnp.array([0.0, 0.0, -GRAVITY])
        return DodgeMemory(
            yaw=yaw,
            since=since,
            centre=release - t * velocity + t**2 / 2 * fall,
            velocity=velocity - t * fall,
            size=between(c.size, u[..., 8]),
            failed=jnp.zeros(n, bool),
        )

    def scene(self, memory: DodgeMemory) -> Scene:
        """The balls over level ground. Each is there from its throw on."""
        balls = dataclasses.replace(
            Solids.of("sphere", memory.centre, memory.size[..., None], colour=COLOUR),
            velocity=memory.velocity,
            acceleration=jnp.broadcast_to(jnp.array([0.0, 0.0, -GRAVITY]), memory.velocity.shape),
            since=memory.since,
        )
        return Scene.of({"sphere": balls}, memory.yaw.shape[0])

    def expert(self, memory: DodgeMemory, flier: Flier) -> tuple[Float[Array, "n 3"], Float[Array, " n"]]:
        """Velocity, m/s, and yaw, rad, of an expert that knows every ball in the air."""
        age = flier.time[:, None] - memory.since
        keep = jnp.where((age >= REACTION) & (age < GONE), memory.size + self.shape.radius, -1.0)

        def balls(time: Float[Array, " n"]) -> tuple[Array, Array, Array]:
            return (*self.flying(memory, time), keep)

        return way_out(balls, flier, self.goal(memory, flier.time)), memory.yaw

    def drawn(self, memory: DodgeMemory) -> dict[str, Array]:
        """The throws: times, s, places, m, and velocities, m/s, of the release, and radii, m."""
        t, fall = memory.since[..., None], jnp.array([0.0, 0.0, -GRAVITY])
        return {
            "throw_time_s": memory.since,
            "throw_from_m": memory.centre + t * memory.velocity + t**2 / 2 * fall,
            "throw_velocity_m_s": memory.velocity + t * fall,
            "ball_radius_m": memory.size,
        }

    def desired_yaw(self, memory: DodgeMemory, state: State) -> Float[Array, " n"]:
        """Towards the middle of the thrower's sector."""
        return memory.yaw

    def passing(
        self, memory: DodgeMemory, before: State, after: State, time: Float[Array, " n"]
    ) -> Float[Array, "n k"]:
        """Smallest distance between the vehicle's sphere and each ball during a control step, m. Differentiable.

        Both move straight on during the step. `FAR` before the throw.
        """
        balls = (self.flying(memory, t)[0] for t in (time - self.control_period, time))
        first, last = (at.position[:, None] - ball for at, ball in zip((before, after), balls, strict=True))
        gap = passing(first, last) - memory.size - self.shape.radius
        return jnp.where(time[:, None] > memory.since, gap, FAR)

    def advance(
        self, memory: DodgeMemory, before: State, after: State, time: Float[Array, " n"], timed_out: Bool[Array, " n"]
    ) -> tuple[DodgeMemory, Outcome]:
        """The goal's verdict, with signals for the reward."""
        hit = struck(self.scene(memory), before, after, time, self.control_period, self.checks, self.shape.radius)
        moved, outcome = self.verdict(memory, after, time, timed_out, hit)
        signals = {"overhang": -self.passing(memory, before, after, time)}
        return moved, dataclasses.replace(outcome, signals=signals)
