"""Dodging balls: the goal, and the route of a flight. Imports no JAX."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.control.vectors import Array, namespace
from e2efly.courses import defaults
from e2efly.policy.goal import Course, Goal, Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.dodge import DodgeConfig
from e2efly.tasks.route import Route, place
from e2efly.tasks.verdicts import distance, touches_ground
from e2efly.vehicles.gravity import GRAVITY

IN_AIR = 1.0
"""A ball is shown for so long after its throw, s. Then it has passed."""
SHOWN_AHEAD = 4.0
"""Distance of the point that is shown in the middle of the thrower's sector, m."""


@dataclass(frozen=True)
class DodgeMemory:
    """The k throws, and whether the vehicle has failed."""

    yaw: Array
    """(n,) bearing of the middle of the thrower's sector, rad from world x."""
    since: Array
    """(n, k) time of each throw, s."""
    centre: Array
    """(n, k, 3) where each ball would have been at time 0, world, m."""
    velocity: Array
    """(n, k, 3) velocity that it would have had at time 0, world, m/s."""
    size: Array
    """(n, k) its radius, m."""
    failed: Array
    """(n,) whether the vehicle has been struck, or was not at its place when a ball was thrown."""


@dataclass(frozen=True)
class DodgeGoal(Goal):
    """Be at a place, and not where balls come along."""

    config: DodgeConfig
    shape: Shape
    control_period: float | Array
    checks: int
    """Number of collision checks per control step."""

    def goal(self, memory: DodgeMemory, time: Array) -> Array:
        """The vehicle's place."""
        xp = namespace(memory.yaw)
        return xp.broadcast_to(xp.asarray(self.config.target), (*memory.yaw.shape, 3))

    def thrower(self, memory: DodgeMemory, time: Array, body: Any) -> Array:
        """A point in the middle of the thrower's sector minus position."""
        xp, away = namespace(memory.yaw), SHOWN_AHEAD
        ahead = xp.stack([away * xp.cos(memory.yaw), away * xp.sin(memory.yaw), 0.0 * memory.yaw], axis=-1)
        return self.position_error(memory, time, body) + ahead

    def flying(self, memory: DodgeMemory, time: Array) -> tuple[Array, Array]:
        """(n, k, 3) where balls are, world, m, and (n, k, 3) their velocities, m/s, if they fly at (n,) a time, s."""
        xp, t = namespace(memory.since), time[:, None, None]
        fall = xp.asarray([0.0, 0.0, -GRAVITY])
        return memory.centre + t * (memory.velocity + t / 2 * fall), memory.velocity + t * fall

    def _ball_seen(self, memory: DodgeMemory, time: Array) -> tuple[Array, Array, Array]:
        """Which ball is told of, (n, k, 1): 1 or 0; where it was, and its velocity."""
        then = time - self.config.ball_age
        age = then[:, None] - memory.since
        position, velocity = self.flying(memory, then)
        return ((age >= 0) & (age < IN_AIR))[..., None] * 1.0, position, velocity

    def ball(self, memory: DodgeMemory, time: Array, body: Any) -> Array:
        """Position of the ball minus position, 0 if none is in the air."""
        there, position, _ = self._ball_seen(memory, time)
        return (there * (position - body.position[:, None])).sum(1)

    def ball_velocity(self, memory: DodgeMemory, time: Array, body: Any) -> Array:
        """Velocity of the ball, 0 if none is in the air."""
        there, _, velocity = self._ball_seen(memory, time)
        return (there * velocity).sum(1)

    observation = (
        (Field("position_error", 3, "world", "m", 1.0, "the vehicle's place minus its position"), Goal.position_error),
        (
            Field("thrower", 3, "world", "m", 4.0, "a point ahead, about where balls come from, minus its position"),
            thrower,
        ),
        (Field("ball", 3, "world", "m", 4.0, "position of a ball in the air minus vehicle position, or 0"), ball),
        (Field("ball_velocity", 3, "world", "m/s", 8.0, "velocity of a ball in the air, or 0"), ball_velocity),
    )

    def advance(
        self, memory: DodgeMemory, before: Any, after: Any, time: Array, timed_out: Array
    ) -> tuple[DodgeMemory, Outcome]:
        """The verdict without knowledge of what touches the vehicle."""
        return self.verdict(memory, after, time, timed_out, False)

    def verdict(
        self, memory: DodgeMemory, after: Any, time: Array, timed_out: Array, hit: Array | bool
    ) -> tuple[DodgeMemory, Outcome]:
        """Judge a step. Success: never struck, at its place whenever a ball is thrown, and back at the end.

        `hit`: a ball has struck the vehicle in this step.
        """
        c = self.config
        error = distance(after.position, self.goal(memory, time))
        thrown = ((memory.since <= time[:, None]) & (memory.since > time[:, None] - self.control_period)).any(-1)
        left = (error > c.fence) | touches_ground(self.shape, after)
        now = (thrown & (error > c.ready)) | hit
        failed = memory.failed | now | left
        success = timed_out & ~failed & (error < c.radius)
        arrived = ~memory.failed & timed_out & success
        ends = left | (now & (c.collisions_end > 0))
        moved = dataclasses.replace(memory, failed=failed)
        return moved, Outcome(
            terminated=ends, success=success, arrived=arrived, crashed=left | now, error=error, signals={}
        )


@dataclass(frozen=True)
class DodgeRoute(Route):
    """Where to hover, and from where balls may come."""

    longest_s: ClassVar = 7.5
    trained: ClassVar = {"target": DodgeConfig.target}

    target: tuple[float, float, float] = place((0.0, 0.0, defaults.FLOWN_HEIGHT))
    """Point to hover at, m."""
    thrower: tuple[float, float] = place((4.0, 0.0))
    """A point, x and y, in the middle of the sector from which balls may come, m. The policy looks there."""

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course at the target. It has no end, and it knows of no throw."""
        x, y = np.subtract(self.thrower, self.target[:2])
        config = dataclasses.replace(DodgeConfig(), target=self.target)
        none = np.zeros((1, 0))
        memory = DodgeMemory(
            yaw=np.array([math.atan2(y, x)]), since=none, centre=np.zeros((1, 0, 3)), velocity=np.zeros((1, 0, 3)),
            size=none, failed=np.zeros(1, bool),
        )  # fmt: skip
        goal = DodgeGoal(config, shape, control_period, 1)
        return Course(goal, memory, np.asarray(self.target), heading=float(memory.yaw[0]), points=[self.target])
