"""Perception-aware hovering: the goal, and the route of a flight. Imports no JAX."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.config import number
from e2efly.config.domain import Domain, extent
from e2efly.control.place import Place
from e2efly.control.vectors import Array, Quat, Vec3, namespace, unrotate
from e2efly.courses import defaults
from e2efly.policy.goal import Course, Goal, Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.hover_aware import HoverAwareConfig
from e2efly.tasks.route import Route, place
from e2efly.tasks.verdicts import distance, held_longer, touches_ground

OUTSIDE = 10.0
"""Limit of pixel coordinates, in halves of the image. Points behind the camera also get this value."""
NEAREST = 1e-3
"""A point nearer to the camera than this along the optical axis counts as behind it, m."""


@dataclass(frozen=True)
class HoverAwareMemory:
    """The object to look at, a ball on a circle, and the time for which both conditions of success have held."""

    centre: Array
    """(n, 3) centre of the circle, world, m."""
    away: Array
    """(n,) radius of the circle, m."""
    angle: Array
    """(n,) angle of the ball on the circle at the start, rad."""
    rate: Array
    """(n,) rate of that angle, rad/s."""
    time: Array
    """(n,) time at the end of the last step, s."""
    held: Array
    """(n,) time for which the conditions have held, s."""


@dataclass(frozen=True)
class HoverAwareGoal(Goal):
    """Hover and look at an object.

    The camera belongs to the task, and its images need not be rendered. Its pixel coordinates are in halves of the
    image.
    """

    config: HoverAwareConfig
    shape: Shape
    control_period: float | Array

    def goal(self, memory: HoverAwareMemory, time: Array) -> Array:
        """The point to hover at."""
        xp = namespace(memory.held)
        return xp.broadcast_to(xp.asarray(self.config.target), (*memory.held.shape, 3))

    def look_at(self, memory: HoverAwareMemory, time: Array) -> Array:
        """(n, 3) position of the object to look at, world, m."""
        xp, angle = namespace(memory.away), memory.angle + memory.rate * time
        circle = xp.stack([memory.away * xp.cos(angle), memory.away * xp.sin(angle), 0.0 * angle], axis=-1)
        return memory.centre + circle

    def look_at_offset(self, memory: HoverAwareMemory, time: Array, body: Any) -> Array:
        """Position of the object to look at minus position."""
        return self.look_at(memory, time) - body.position

    observation = (
        (Field("position_error", 3, "world", "m", 1.0, "target position minus vehicle position"), Goal.position_error),
        (Field("look_at", 3, "world", "m", 4.0, "position of what to look at minus vehicle position"), look_at_offset),
    )

    @classmethod
    def aim(cls, shown: Mapping[str, Array]) -> Place:
        """The target, with the heading towards the object to look at."""
        there = shown["look_at"]
        yaw = namespace(there).arctan2(there[..., 1], there[..., 0])
        return Place(Vec3.of(shown["position_error"]), yaw=yaw)

    def pixel(self, position: Array, quaternion: Array, point: Array) -> Array:
        """(n, 2) pixel of a point in the vehicle's camera.

        Coordinates are right and down from the image centre, in halves of the image. They are limited to `OUTSIDE` in
        both directions, and a point behind the camera is put there, too.
        """
        c, xp = self.config, namespace(position)
        mounted = unrotate(quaternion, point - position) - xp.asarray(c.camera_position)
        zero = 0.0 * position[:, 0]
        seen = unrotate(Quat.of_euler(zero, zero + c.camera_pitch, zero).stack(), mounted)
        ahead, edge = seen[:, :1], xp.tan(xp.asarray(c.fov) / 2)
        front = ahead > NEAREST
        inside = xp.clip(-seen[:, 1:] / edge / xp.where(front, ahead, 1.0), -OUTSIDE, OUTSIDE)
        return xp.where(front, inside, OUTSIDE)

    def advance(
        self, memory: HoverAwareMemory, before: Any, after: Any, time: Array, timed_out: Array
    ) -> tuple[HoverAwareMemory, Outcome]:
        """Judge a step. Success: within the radius and with the object centred for the last `hold_s` of the episode.

        Leaving the fence, or touching the ground or the object, fails.
        """
        c, ball = self.config, self.look_at(memory, time)
        error = distance(after.position, self.goal(memory, time))
        pixel = self.pixel(after.position, after.quaternion, ball)
        well = (error < c.radius) & (abs(pixel) < c.centred).all(-1)
        held = held_longer(memory.held, well, self.control_period)
        near = distance(after.position, ball) < c.size + self.shape.radius
        crashed = (error > c.fence) | touches_ground(self.shape, after) | near
        success = timed_out & ~crashed & (held >= c.hold_s - 1e-4)
        arrived = (held > 0) & (memory.held == 0)
        return dataclasses.replace(memory, time=time, held=held), Outcome(
            terminated=crashed, success=success, arrived=arrived, crashed=crashed, error=error, signals={"pixel": pixel}
        )


@dataclass(frozen=True)
class HoverAwareRoute(Route):
    """Where to hover, and what to look at."""

    longest_s: ClassVar = 8.0
    trained: ClassVar = {"target": defaults.TARGET}

    target: tuple[float, float, float] = place((0.0, 0.0, defaults.FLOWN_HEIGHT))
    """Point to hover at, m."""
    look_at: tuple[float, float, float] = place((5.0, 0.0, defaults.FLOWN_HEIGHT))
    """Position of the object to look at when the policy takes over, m."""
    turn_rate: float = place(0.0)
    """Rate at which the object circles around the target, rad/s."""
    size: float = number(0.2, above=0)
    """Radius of the object to look at, m."""

    def domain(self) -> Domain:
        """The object to look at."""
        x, y, _ = np.subtract(self.look_at, self.target)
        return extent("object_distance", "m", math.hypot(x, y)), extent("object_rate", "rad/s", self.turn_rate)

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course to the target. It has no end."""
        x, y, z = np.subtract(self.look_at, self.target)
        config = dataclasses.replace(HoverAwareConfig(), target=self.target, size=self.size)
        memory = HoverAwareMemory(
            centre=np.array([[*self.target[:2], self.target[2] + z]]), away=np.array([math.hypot(x, y)]),
            angle=np.array([math.atan2(y, x)]), rate=np.array([self.turn_rate]), time=np.zeros(1), held=np.zeros(1),
        )  # fmt: skip
        start = np.add(self.target, (0.5, -0.5, -0.2))
        return Course(HoverAwareGoal(config, shape, control_period), memory, start, points=[self.target])
