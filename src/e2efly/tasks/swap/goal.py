"""Exchanging places: the goal. Imports no JAX."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.control.place import Place
from e2efly.control.vectors import Array, Vec3, namespace
from e2efly.courses import defaults
from e2efly.policy.goal import Course, Goal, Observed, Outcome, Shape
from e2efly.policy.observation import OTHERS, Company, Field
from e2efly.policy.others import Others, company_of, nobody, others_fields
from e2efly.tasks.route import Route, place
from e2efly.tasks.swap import SwapConfig
from e2efly.tasks.verdicts import distance, held_longer, touches_ground


@dataclass(frozen=True)
class SwapMemory:
    """Where to go, for how long the vehicle has been there, and the others."""

    place: Array
    """(n, 3) the goal, world, m."""
    held: Array
    """(n,) time for which the vehicle has been within the radius, s."""
    others: Others
    """The others that the policy observes, the nearest first."""


@dataclass(frozen=True)
class SwapGoal(Goal):
    """Fly to a place that another vehicle leaves, and touch none on the way."""

    config: SwapConfig
    shape: Shape
    control_period: float
    checks: int
    """Number of collision checks per control step."""

    @property
    def neighbours(self) -> int:
        """See `SwapConfig.neighbours`."""
        return self.config.neighbours

    @property
    def company(self) -> Company | None:
        """The others may be as far away as two places, and fly at more than twice the speed of the reward. None: by
        cameras alone.
        """
        c = self.config
        if not c.shows(OTHERS):
            return None
        return company_of(self.neighbours, math.hypot(c.side, c.side, 2 * c.height), 2.5 * float(c.speed))

    def among(self, memory: SwapMemory, others: Others) -> SwapMemory:
        """The state with these others."""
        return dataclasses.replace(memory, others=others)

    def goal(self, memory: Any, time: Array) -> Array:
        """The place."""
        return memory.place

    def others(self, memory: Any, time: Array, body: Any) -> Array:
        """See `Others.offsets`."""
        return memory.others.offsets(body)

    def others_velocity(self, memory: Any, time: Array, body: Any) -> Array:
        """See `Others.motion`."""
        return memory.others.motion(body)

    @property
    def observable(self) -> tuple[Observed, ...]:
        """The place, and the nearest others."""
        where, motion = others_fields(self.config.neighbours)
        place = Field("position_error", 3, "world", "m", 1.0, "target position minus vehicle position")
        cls = SwapGoal
        return ((place, cls.position_error), (where, cls.others), (motion, cls.others_velocity))

    @classmethod
    def aim(cls, shown: Mapping[str, Array]) -> Place:
        """The place."""
        return Place(Vec3.of(shown["position_error"]))

    def advance(self, memory: Any, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Any, Outcome]:
        """The verdict on a vehicle alone: see `verdict`."""
        return self.verdict(memory, after, timed_out, False)

    def verdict(self, memory: Any, after: Any, timed_out: Array, hit: Array | bool) -> tuple[Any, Outcome]:
        """The state after a step, and the outcome. Success: within the radius for the last `hold_s` of the episode.

        Leaving the fence and touching the ground fail. `hit`: another vehicle was touched.
        """
        c, xp = self.config, namespace(after.position)
        error = distance(after.position, memory.place)
        held = held_longer(memory.held, error < c.radius, self.control_period)
        away = distance(after.position, xp.asarray(c.centre))
        lost = (away > c.fence) | touches_ground(self.shape, after)
        crashed = lost | hit
        arrived = (held > 0) & (memory.held == 0)
        success = timed_out & ~crashed & (held >= c.hold_s - 1e-4)
        ends = lost | (hit & (c.collisions_end > 0))
        moved = dataclasses.replace(memory, held=held)
        return moved, Outcome(terminated=ends, success=success, arrived=arrived, crashed=crashed, error=error)


@dataclass(frozen=True)
class SwapRoute(Route):
    """Where to fly, among others."""

    longest_s: ClassVar = 10.0
    trained: ClassVar = {"target": (0.0, 0.0, 2.0)}

    target: tuple[float, float, float] = place((0.0, 0.0, defaults.FLOWN_HEIGHT))
    """The place to fly to, m."""

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course to the place. It has no end."""
        goal = SwapGoal(dataclasses.replace(SwapConfig(), centre=self.target), shape, control_period, 1)
        others = nobody(np.array([self.target]), goal.neighbours)
        start = np.add(self.target, (1.5, -1.0, 0.0))
        memory = SwapMemory(np.array([self.target]), np.zeros(1), others)
        return Course(goal, memory, start, duration=math.inf, points=[self.target])
