"""Tracking: the goal, and the route of a flight. Imports no JAX."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.config import number
from e2efly.config.domain import Domain
from e2efly.config.names import unknown
from e2efly.config.numbers import BODY_RATE, SPEED
from e2efly.control.place import Place
from e2efly.control.vectors import Array, Vec3, namespace
from e2efly.courses import defaults
from e2efly.courses.references import LONGEST, POINTS, SPACING, Lissajous, Spline, knot_count, read_csv, through_points
from e2efly.policy.goal import Course, Goal, Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.route import Route, place
from e2efly.tasks.track import TrackConfig
from e2efly.tasks.verdicts import distance, offsets, touches_ground

SMALLEST = 1e-3
"""Smallest radius, speed and duration of circle and lemniscate, in their units."""

_MOTION = [
    np.linalg.inv(np.vander(SPACING * np.arange(5), increasing=True))[order] * math.factorial(order)
    for order in range(4)
]
"""Matrices that map five points to position, velocity, acceleration and jerk at the first of them."""


@dataclass(frozen=True)
class TrackMemory:
    """The reference, and the error summed over the counted steps."""

    reference: Spline
    error_sum: Array
    """(n,) sum of the distance to the reference over the counted steps, m."""
    steps: Array
    """(n,) number of counted steps."""


@dataclass(frozen=True)
class TrackGoal(Goal):
    """Follow a reference."""

    config: TrackConfig
    shape: Shape

    def goal(self, memory: TrackMemory, time: Array) -> Array:
        """The reference point for now."""
        return memory.reference.position(time[:, None])[:, 0]

    def targets(self, memory: TrackMemory, time: Array) -> Array:
        """(n, k, 3) the reference points for now and for the next second, world, m."""
        return memory.reference.position(time[:, None] + SPACING * np.arange(POINTS, dtype=np.float32))

    def target_offsets(self, memory: TrackMemory, time: Array, body: Any) -> Array:
        """The same points minus position."""
        return offsets(self.targets(memory, time), body)

    observation = (
        (
            Field(
                "reference", 3 * POINTS, "world", "m", 1.0,
                f"{POINTS} reference points minus vehicle position, {SPACING} s apart, the first for now",
            ),
            target_offsets,
        ),
    )  # fmt: skip

    @classmethod
    def aim(cls, shown: Mapping[str, Array]) -> Place:
        """The reference. Its motion comes from the polynomial through its next five points."""
        points = shown["reference"]
        near = namespace(points).reshape(points, (*points.shape[:-1], POINTS, 3))[..., :5, :]
        moves = (namespace(points).tensordot(_MOTION[order], near, axes=([0], [-2])) for order in range(4))
        position, velocity, acceleration, jerk = map(Vec3.of, moves)
        return Place(position, velocity, acceleration, jerk)

    def advance(
        self, memory: TrackMemory, before: Any, after: Any, time: Array, timed_out: Array
    ) -> tuple[TrackMemory, Outcome]:
        """Judge a step. Success: a small mean error since `settle_s` at the end of the episode.

        Leaving the fence or touching the ground fails.
        """
        c = self.config
        error = distance(after.position, self.goal(memory, time))
        counts = (time > c.settle_s).astype(error.dtype)
        memory = TrackMemory(memory.reference, memory.error_sum + counts * error, memory.steps + counts)
        crashed = (error > c.fence) | touches_ground(self.shape, after)
        mean = memory.error_sum / memory.steps.clip(1.0)
        success = timed_out & ~crashed & (mean < c.mean_error)
        return memory, Outcome(terminated=crashed, success=success, arrived=success, crashed=crashed, error=error)


_CURVE = ("centre", "radius", "phase", "duration")
_OPTIONS = {"circle": ("circle_rate", *_CURVE), "lemniscate": ("lemniscate_speed", *_CURVE)}
"""The options of each kind of reference, except a file."""


@dataclass(frozen=True)
class TrackRoute(Route):
    """The reference to follow."""

    height: ClassVar = "reference"
    longest_s: ClassVar = 12.0
    trained: ClassVar = {"centre": defaults.CENTRE}

    reference: str = "circle"
    """circle, lemniscate, or the path of a .csv file with columns t, x, y, z."""
    centre: tuple[float, float, float] = place((0.0, 0.0, defaults.FLOWN_HEIGHT))
    """Centre of the circle or lemniscate, m."""
    radius: float = number(defaults.FLOWN_RADIUS, low=SMALLEST)
    """Radius of the circle, or half the length of the lemniscate, m."""
    circle_rate: float = number(defaults.FLOWN_CIRCLE_RATE, low=-BODY_RATE, high=BODY_RATE)
    """Angular rate of the circle, rad/s. Negative: clockwise."""
    lemniscate_speed: float = number(defaults.FLOWN_LEMNISCATE_SPEED, low=SMALLEST, high=SPEED)
    """Top speed of the lemniscate, m/s."""
    phase: float = place(0.0)
    """Phase at which the circle or lemniscate begins, rad."""
    duration: float = number(20.0, low=SMALLEST, high=LONGEST)
    """Duration of the circle or lemniscate, s. After that its end point is held."""

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course along the reference, from its first point to its end."""
        spline = self._spline()
        start = np.array(spline.position(np.zeros((1, 1)))[0, 0], np.float64)
        memory = TrackMemory(spline, np.zeros(1), np.zeros(1))
        return Course(
            TrackGoal(TrackConfig(), shape), memory, start, duration=spline.duration, points=spline.knots[0, :, 0]
        )

    def domain(self) -> Domain:
        """Top speed and acceleration of the reference."""
        return self._spline().domain

    def unused(self) -> tuple[str, ...]:
        """Options of other kinds of reference."""
        used = _OPTIONS.get(self.reference, ())
        return tuple(name for names in _OPTIONS.values() for name in names if name not in used)

    def _spline(self) -> Spline:
        if self.circle_rate == 0:
            raise ValueError("goal.circle_rate is 0.0; accepted: any rate but 0, rad/s")
        if self.reference.endswith(".csv"):
            return through_points(read_csv(self.reference))
        if self.reference not in _OPTIONS:
            raise ValueError(unknown("reference", self.reference, _OPTIONS) + ", or the path of a .csv file")
        circle = self.reference == "circle"
        curve = (
            Lissajous.circle(self.radius, self.circle_rate)
            if circle
            else Lissajous.lemniscate(self.radius, self.lemniscate_speed)
        )
        spline = curve.spline(self.centre, np.array([self.phase]), knot_count(self.duration))
        return dataclasses.replace(spline, end=min(self.duration, math.inf))
