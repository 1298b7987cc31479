"""Visual landing: the goal, and where it is flown. Imports no JAX."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.control.vectors import Array, namespace
from e2efly.courses.origin import Origin
from e2efly.goal import Course, Outcome, Shape
from e2efly.observation import Field
from e2efly.tasks.land.goal import Landing, LandRoute, touchdown
from e2efly.tasks.land_visual import LandVisualConfig


@dataclass(frozen=True)
class LandVisualGoal(Landing):
    """The pad stands at the world's origin; the policy only sees it."""

    config: LandVisualConfig
    shape: Shape

    @classmethod
    def state(cls, memory: Any) -> Array:
        """Nothing: the pad is only seen."""
        del memory
        return np.zeros((1, 0))

    def goal(self, memory: Any, time: Array) -> Array:
        """The centre of mass of a vehicle that stands on the pad."""
        del memory
        zero = 0.0 * time
        return namespace(time).stack([zero, zero, zero + self.config.pad_height + self.shape.feet_height], axis=-1)

    def height(self, memory: Any, time: Array, body: Any) -> Array:
        """Height of the feet over the ground."""
        del memory, time
        return body.position[:, 2:] - self.shape.feet_height

    observation = ((Field("height", 1, "none", "m", 1.0, "height of the feet over the ground"), height),)

    def advance(self, memory: Any, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Any, Outcome]:
        """The verdict of one that does not know the pad's outline: it counts as a disc of the largest width."""
        del before, timed_out
        feet = after.position[:, 2] - self.shape.feet_height
        over = (after.position[:, :2] ** 2).sum(-1) < (self.config.pad_size[1] / 2) ** 2
        return memory, self.verdict(memory, after, time, (feet <= 0) | (over & (feet <= self.config.pad_height)))

    def verdict(self, memory: Any, body: Any, time: Array, touched: Array) -> Outcome:
        """The episode ends at the first touch of pad or ground, judged at the step's end.

        Success: on the pad's top, near its centre, slow, upright.
        """
        return touchdown(self.config, body, self.goal(memory, time), touched)


@dataclass(frozen=True)
class LandVisualRoute(LandRoute):
    """Where the pad is: the point of the ground under it."""

    def course(self, shape: Shape, control_period: float) -> Course:
        """The pad, which is the origin of the task's world."""
        del control_period
        start = np.array([0.5, 0.3, 2.0])
        return Course(LandVisualGoal(LandVisualConfig(), shape), np.zeros((1, 0)), start, origin=Origin(self.pad))
