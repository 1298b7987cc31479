"""Visual landing: the goal, and the route of a flight. Imports no JAX."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from e2efly.control.vectors import Array, namespace
from e2efly.policy.goal import Goal, Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.land.goal import Landing, LandRoute, touchdown
from e2efly.tasks.land_visual import LandVisualConfig


@dataclass(frozen=True)
class LandVisualGoal(Landing):
    """Land on a pad at the world's origin. The policy gets its position only from its camera, unless the options show
    it.
    """

    config: LandVisualConfig
    shape: Shape

    @classmethod
    def state(cls, memory: Any) -> Array:
        """Nothing: the pad is known only from camera images."""
        return np.zeros((1, 0))

    def goal(self, memory: Any, time: Array) -> Array:
        """The position of the centre of mass when the vehicle stands on the pad."""
        zero = 0.0 * time
        return namespace(time).stack([zero, zero, zero + self.config.pad_height + self.shape.feet_height], axis=-1)

    def height(self, memory: Any, time: Array, body: Any) -> Array:
        """Height of the feet above the ground."""
        return body.position[:, 2:] - self.shape.feet_height

    observation = (
        (Field("height", 1, "none", "m", 1.0, "height of the feet over the ground"), height),
        (
            Field("position_error", 3, "world", "m", 1.0, "where the centre of mass is on the pad, minus where it is"),
            Landing.position_error,
        ),
    )

    def advance(self, memory: Any, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Any, Outcome]:
        """The verdict without knowledge of the pad's outline. The pad counts as a disc of the largest width."""
        feet = after.position[:, 2] - self.shape.feet_height
        over = (after.position[:, :2] ** 2).sum(-1) < (self.config.pad_size[1] / 2) ** 2
        return memory, self.verdict(memory, after, time, (feet <= 0) | (over & (feet <= self.config.pad_height)))

    def verdict(self, memory: Any, body: Any, time: Array, touched: Array) -> Outcome:
        """Judge a step. Success: a touch on top of the pad, near its centre, slow and upright.

        The episode ends at the first touch of the pad or the ground. It is judged at the end of the step.
        """
        return touchdown(self.config, body, self.goal(memory, time), touched)


@dataclass(frozen=True)
class LandVisualRoute(LandRoute):
    """Where the pad is: the point on the ground under it."""

    def _goal(self, shape: Shape) -> Goal:
        return LandVisualGoal(LandVisualConfig(), shape)
