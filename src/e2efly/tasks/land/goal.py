"""Landing: the goal, and the route of a flight. Imports no JAX."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.control.place import Place
from e2efly.control.vectors import Array, Vec3, namespace
from e2efly.courses import defaults
from e2efly.courses.origin import Origin
from e2efly.policy.goal import Course, Goal, Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.land import LandConfig
from e2efly.tasks.route import Route, place
from e2efly.tasks.verdicts import touches_ground, upright

OVER = 0.3
"""Horizontal distance from the pad's centre within which a controller that is not a policy descends, m."""
SINK_RATE, SLOWEST, FASTEST = 0.7, 0.35, 1.2
"""Speed of this descent divided by height, 1/s, and the smallest and largest speed, m/s."""


class Landing(Goal):
    """A goal that ends on the ground."""

    lands: ClassVar = True

    def desired_yaw(self, memory: Any, state: Any) -> Array:
        """Along world x."""
        return namespace(state.position).zeros_like(state.position[:, 0])

    def done(self, outcome: Outcome) -> bool:
        """Done at the first touch, good or bad. A vehicle that has touched the ground must not climb again."""
        return bool(outcome.signals["touched"][0])

    def told(self, arrivals: Sequence[float], mean_error: float, final_error: float, speed: float) -> str:
        """The place and speed of the touch, as text."""
        return f"touched {100 * final_error:.1f} cm off at {speed:.2f} m/s"


@dataclass(frozen=True)
class LandGoal(Landing):
    """Land on a pad at the world's origin. The task's state is empty: an array of shape (n, 0)."""

    config: LandConfig
    shape: Shape

    def goal(self, memory: Array, time: Array) -> Array:
        """The position of the centre of mass when the vehicle stands on the pad."""
        zero = 0.0 * time
        return namespace(time).stack([zero, zero, zero + self.shape.feet_height], axis=-1)

    observation = (
        (
            Field(
                "position_error", 3, "world", "m", 1.0, "where the centre of mass is after landing, minus where it is"
            ),
            Goal.position_error,
        ),
    )

    @classmethod
    def aim(cls, shown: Mapping[str, Array]) -> Place:
        """A place over the pad. Once the vehicle is there, a descent that is slower near the ground."""
        x, y, z = (shown["position_error"][..., axis] for axis in range(3))
        xp = namespace(z)
        down = xp.where(x**2 + y**2 < OVER**2, xp.clip(SINK_RATE * z, -FASTEST, -SLOWEST), 0.0)
        return Place(Vec3(x, y, 0.0 * z), Vec3(0.0 * z, 0.0 * z, down))

    def advance(self, memory: Array, before: Any, after: Any, time: Array, timed_out: Array) -> tuple[Array, Outcome]:
        """Judge a step. Success: a touch near the centre, slow and upright.

        The episode ends at the first touch. It is judged at the end of the step.
        """
        return memory, touchdown(self.config, after, self.goal(memory, time), touches_ground(self.shape, after))


def touchdown(config: Any, body: Any, goal: Array, touched: Array) -> Outcome:
    """The verdict on a landing, by `radius`, `height_error`, `speed`, `tilt` and `must_touch` of the options, and their
    `fence`.

    `goal` is the position of the vehicles after landing. `touched` marks those that touch the pad or the ground.
    """
    xp = namespace(body.position)
    offset = body.position - goal
    sideways = xp.linalg.norm(offset[:, :2], axis=-1)
    success = (
        (sideways < config.radius)
        & (xp.abs(offset[:, 2]) < config.height_error)
        & (xp.linalg.norm(body.velocity, axis=-1) < config.speed)
        & upright(body, config.tilt)
    )
    success = success & touched if config.must_touch else success
    lost = (sideways > config.fence) | (offset[:, 2] > config.fence)
    return Outcome(
        terminated=touched | lost | success, success=success, arrived=success, crashed=(touched & ~success) | lost,
        error=sideways, signals={"touched": touched},
    )  # fmt: skip


@dataclass(frozen=True)
class LandRoute(Route):
    """Where to land."""

    longest_s: ClassVar = 15.0

    pad: tuple[float, float, float] = place((0.0, 0.0, 0.0))
    """Point on the ground to land on, m."""

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course to the pad, which is the origin of the task's world."""
        start, pad = np.array([0.6, 0.4, defaults.FLOWN_HEIGHT]), Origin(self.pad)
        return Course(self._goal(shape), np.zeros((1, 0)), start, points=np.zeros(3), clearance=-math.inf, origin=pad)

    def _goal(self, shape: Shape) -> Goal:
        return LandGoal(LandConfig(), shape)
