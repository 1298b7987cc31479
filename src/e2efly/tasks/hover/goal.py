"""Hovering: the goal, and the route of a flight. Imports no JAX."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.control.place import Place
from e2efly.control.vectors import Array, Vec3, namespace
from e2efly.courses import defaults
from e2efly.policy.goal import Course, Goal, Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.hover import HoverConfig
from e2efly.tasks.route import Route, place
from e2efly.tasks.verdicts import distance, held_longer, touches_ground


@dataclass(frozen=True)
class HoverGoal(Goal):
    """Fly to a point and stay there.

    The task's state is the time that the vehicle has been within the radius, (n,) s.
    """

    config: HoverConfig
    shape: Shape
    control_period: float | Array

    def goal(self, memory: Array, time: Array) -> Array:
        """The target."""
        xp = namespace(time, memory)
        return xp.broadcast_to(xp.asarray(self.config.target), (*memory.shape, 3))

    observation = (
        (Field("position_error", 3, "world", "m", 1.0, "target position minus vehicle position"), Goal.position_error),
    )

    @classmethod
    def aim(cls, shown: Mapping[str, Array]) -> Place:
        """The target."""
        return Place(Vec3.of(shown["position_error"]))

    def advance(self, memory: Array, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Array, Outcome]:
        """Judge a step. Success: within the radius for the last `hold_s` of the episode.

        Leaving the fence, touching the ground or tumbling fails.
        """
        c = self.config
        error = distance(after.position, self.goal(memory, time))
        held = held_longer(memory, error < c.radius, self.control_period)
        xp = namespace(error)
        tumbles = xp.sum(after.body_rate**2, axis=-1) > c.spin**2
        crashed = (error > c.fence) | touches_ground(self.shape, after) | tumbles
        arrived = (held > 0) & (memory == 0)
        success = timed_out & ~crashed & (held >= c.hold_s - 1e-4)
        return held, Outcome(terminated=crashed, success=success, arrived=arrived, crashed=crashed, error=error)


@dataclass(frozen=True)
class HoverRoute(Route):
    """Where to hover."""

    longest_s: ClassVar = 8.0
    trained: ClassVar = {"target": defaults.TARGET}

    target: tuple[float, float, float] = place((0.0, 0.0, defaults.FLOWN_HEIGHT))
    """Point to hover at, m."""

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course to the target. It has no end."""
        goal = HoverGoal(dataclasses.replace(HoverConfig(), target=self.target), shape, control_period)
        start = np.add(self.target, (0.6, -0.4, -0.2))
        return Course(goal, np.zeros(1), start, duration=math.inf, points=[self.target])
