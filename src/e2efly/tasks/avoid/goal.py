"""High-speed obstacle avoidance: the goal, and the route of a flight. Imports no JAX."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from e2efly.config import number
from e2efly.config.domain import Domain, extent
from e2efly.config.numbers import SPEED
from e2efly.control.vectors import Array, namespace
from e2efly.policy.goal import Course, Goal, Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.avoid import AvoidConfig
from e2efly.tasks.route import Route

BEYOND = 10.0
"""Distance of the goal point behind the end of the forest, m."""
CLIMB = 1.0
"""Largest commanded vertical speed, m/s."""


@dataclass(frozen=True)
class AvoidMemory:
    """The commanded speed."""

    speed: Array
    """(n,) commanded speed, m/s."""


@dataclass(frozen=True)
class AvoidGoal(Goal):
    """Fly through a lane that begins at the origin and follows world x."""

    config: AvoidConfig
    shape: Shape
    control_period: float
    checks: int
    """Number of collision checks per control step."""

    @classmethod
    def state(cls, memory: Any) -> AvoidMemory:
        """The state without what only cameras see."""
        return AvoidMemory(**{part.name: getattr(memory, part.name) for part in dataclasses.fields(AvoidMemory)})

    def goal(self, memory: AvoidMemory, time: Array) -> Array:
        """A point behind the end of the forest."""
        c, zero = self.config, 0.0 * memory.speed
        return namespace(zero).stack([zero + c.forest.length + BEYOND, zero, zero + c.altitude], axis=-1)

    def desired_velocity(self, memory: AvoidMemory, time: Array, body: Any) -> Array:
        """(n, 3) velocity, m/s: horizontal to the goal at the commanded speed, vertical to the altitude."""
        xp, away = namespace(body.position), self.goal(memory, time) - body.position
        level = away[:, :2] / xp.linalg.norm(away[:, :2], axis=-1, keepdims=True)
        return xp.concatenate([memory.speed[:, None] * level, xp.clip(away[:, 2:], -CLIMB, CLIMB)], axis=-1)

    def height(self, memory: AvoidMemory, time: Array, body: Any) -> Array:
        """Height of the centre of mass above the ground."""
        return body.position[:, 2:]

    observation = (
        (
            Field("desired_velocity", 3, "world", "m/s", 4.0, "velocity to fly at, if nothing stood in the way"),
            desired_velocity,
        ),
        (Field("height", 1, "none", "m", 1.0, "height of the centre of mass over the ground"), height),
    )

    def advance(self, memory: Any, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Any, Outcome]:
        """The verdict without knowledge of the obstacles."""
        return self.verdict(memory, before, after, time, False)

    def verdict(self, memory: Any, before: Any, after: Any, time: Array, hit: Array | bool) -> tuple[Any, Outcome]:
        """Success: past the end of the forest, without touching anything or leaving the lane.

        `hit`: a tree was touched.
        """
        c, position = self.config, after.position
        x, y, z = position[:, 0], position[:, 1], position[:, 2]
        left = (abs(y) > c.forest.width / 2) | (z > c.ceiling) | (z < self.shape.feet_height) | (x < -5.0)
        crashed = left | hit
        success = (x >= c.forest.length) & ~crashed
        ends = left | (hit & (c.collisions_end > 0)) | (x >= c.forest.length)
        error = (c.forest.length - x).clip(0.0)
        return memory, Outcome(terminated=ends, success=success, arrived=success, crashed=crashed, error=error)

    def told(self, arrivals: Sequence[float], mean_error: float, final_error: float, speed: float) -> str:
        """The time at the end of the forest, or the distance flown, as text."""
        length = float(self.config.forest.length)
        if arrivals:
            return f"{length:g} m in {arrivals[-1]:.2f} s"
        return f"{max(length - final_error, 0.0):.1f} of {length:g} m"


@dataclass(frozen=True)
class AvoidRoute(Route):
    """How fast to fly through the lane, which begins at the origin."""

    longest_s: ClassVar = 20.0
    options: ClassVar[type[AvoidConfig]] = AvoidConfig
    """The task that the lane is of."""

    speed: float = number(5.0, above=0, high=SPEED)
    """Commanded speed, m/s."""

    @classmethod
    def drawn(cls, course: Course, file: Path) -> "AvoidRoute":
        """The route with the speed that was drawn."""
        return cls(speed=float(course.memory.speed[0]))

    def domain(self) -> Domain:
        """The commanded speed."""
        return (extent("speed", "m/s", self.speed),)

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course along the lane, with the heading of the lane."""
        config = self.options()
        goal, start = AvoidGoal(config, shape, control_period, 1), np.array([0.0, 0.0, config.altitude])
        return Course(
            goal,
            AvoidMemory(np.array([self.speed])),
            start,
            heading=0.0,
            points=[(config.forest.length, 0.0, config.altitude)],
        )
