"""Narrow gap: the goal, and the route of a flight. Imports no JAX.

Frame of the slit: origin in the middle of the opening, x in the direction of flight, y along the long side, z along the
short side.
"""

import dataclasses
import functools
import math
import operator
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from e2efly.config import number
from e2efly.config.domain import Domain, extent
from e2efly.control.vectors import Array, Quat, namespace, rotate, unrotate
from e2efly.policy.goal import Course, Goal, Outcome, Shape
from e2efly.policy.observation import Field
from e2efly.tasks.gap import GapConfig
from e2efly.tasks.route import Route, place
from e2efly.tasks.verdicts import distance, offsets

WALL_WIDTH = 3.0
"""Distance to which the wall extends around the opening, m."""
RIM = 8
"""Number of points on each of the two rims of the vehicle's body that are checked against the wall."""


@dataclass(frozen=True)
class GapMemory:
    """The slit of each vehicle, and whether the vehicle has passed it."""

    centre: Array
    """(n, 3) middle of the slit, world, m."""
    quaternion: Array
    """(n, 4) rotation from the slit's frame to the world."""
    passed: Array
    """(n,) whether the vehicle has passed the slit, bool."""


@dataclass(frozen=True)
class GapGoal(Goal):
    """Fly through the slit.

    The vehicle counts as a flat cylinder of `radius` that extends `feet_height` up and down.
    """

    config: GapConfig
    shape: Shape
    control_period: float
    checks: int
    """Number of collision checks per control step."""

    def targets(self, memory: GapMemory) -> Array:
        """(n, 2, 3) the middle of the slit and the point behind it, world, m."""
        through = self.axes(memory)[:, 0]
        return namespace(through).stack([memory.centre, memory.centre + self.config.beyond * through], axis=1)

    def axes(self, memory: GapMemory) -> Array:
        """(n, 2, 3) unit vectors, world: the direction of flight through the slit, and that of its short side."""
        xp = namespace(memory.centre)
        return rotate(memory.quaternion[:, None], xp.asarray(np.eye(3, dtype=np.float32)[[0, 2]]))

    def goal(self, memory: GapMemory, time: Array) -> Array:
        """The middle of the slit; once it is passed, the point behind it."""
        both = self.targets(memory)
        return namespace(both).where(memory.passed[:, None], both[:, 1], both[:, 0])

    def target_offsets(self, memory: GapMemory, time: Array, body: Any) -> Array:
        """Both targets minus position."""
        return offsets(self.targets(memory), body)

    def flat_axes(self, memory: GapMemory, time: Array, body: Any) -> Array:
        """Both axes as one vector."""
        return self.axes(memory).reshape(body.position.shape[0], 6)

    observation = (
        (
            Field("gap", 6, "world", "m", 2.0, "middle of the slit and the point behind it minus vehicle position"),
            target_offsets,
        ),
        (
            Field("gap_axes", 6, "world", "1", 1.0, "unit vectors: the way through the slit, across its short side"),
            flat_axes,
        ),
    )

    def touched(self, memory: GapMemory, before: Any, after: Any) -> Array:
        """(n,) whether one of the points on the body's two rims was in the wall or the ground during the step.

        Each point is checked `checks` times, on the cubic through its positions and velocities at both ends of the
        step.
        """
        xp = namespace(before.position)
        points = xp.asarray(rims(self.shape))
        s, h = (1 + np.arange(self.checks)) / self.checks, self.control_period
        weights = ((1 + 2 * s) * (1 - s) ** 2, h * s * (1 - s) ** 2, s**2 * (3 - 2 * s), h * s**2 * (s - 1))

        def ends(body: Any) -> tuple[Array, Array]:
            turn = body.quaternion[:, None]
            swept = xp.cross(body.body_rate[:, None], points)
            return body.position[:, None] + rotate(turn, points), body.velocity[:, None] + rotate(turn, swept)

        parts = (*ends(before), *ends(after))
        rows = [xp.asarray(w, parts[0].dtype)[:, None, None, None] for w in weights]
        path = functools.reduce(operator.add, map(operator.mul, rows, parts))
        local = xp.abs(unrotate(memory.quaternion[:, None], path - memory.centre[:, None]))  # (checks, n, points, 3)
        half = xp.asarray(self.config.opening) / 2
        across, opened = local[..., 1:] < half + WALL_WIDTH, local[..., 1:] < half
        inside = (local[..., 0] < self.config.thickness / 2) & across.all(-1) & ~opened.all(-1)
        return (inside | (path[..., 2] < 0)).any((0, 2))

    def advance(
        self, memory: GapMemory, before: Any, after: Any, time: Array, timed_out: Array
    ) -> tuple[GapMemory, Outcome]:
        """Judge a step. Success: through the slit to the point behind it, without touching anything.

        The slit is passed in a step whose straight line crosses the wall's middle plane forward inside the opening.
        Crossing this plane forward anywhere else fails, also beside the wall.
        """
        c, xp = self.config, namespace(after.position)
        a, b = (unrotate(memory.quaternion, body.position - memory.centre) for body in (before, after))
        share = a[:, 0] / xp.where(a[:, 0] == b[:, 0], 1.0, a[:, 0] - b[:, 0])
        y, z = (xp.abs(a[:, i] + share * (b[:, i] - a[:, i])) for i in (1, 2))
        forward = (a[:, 0] < 0) & (b[:, 0] >= 0) & ~memory.passed
        inside = (y < c.opening[0] / 2) & (z < c.opening[1] / 2)
        moved = dataclasses.replace(memory, passed=memory.passed | (forward & inside))
        error = distance(after.position, self.goal(moved, time))
        hit = self.touched(memory, before, after)
        missed = forward & ~inside
        lost = missed | (error > c.fence)
        reached = moved.passed & (error < c.radius) & ~lost
        crashed = hit | lost
        success = reached & ~crashed
        ends = lost | reached | (hit & (c.collisions_end > 0))
        return moved, Outcome(
            terminated=ends, success=success, arrived=(forward & inside) | success, crashed=crashed, error=error,
            signals={
                "missed": missed, "struck": hit,
                "approaching": (b[:, 0] > -c.approach) & (b[:, 0] < c.thickness / 2 + self.shape.radius),
            },
        )  # fmt: skip

    def told(self, arrivals: Sequence[float], mean_error: float, final_error: float, speed: float) -> str:
        """The time of passing the slit, as text."""
        return f"through after {arrivals[0]:.2f} s, then {speed:.1f} m/s" if arrivals else "not through"

    def failure(self, memory: GapMemory, outcome: Outcome) -> str:
        """Whether the slit was missed or the wall was touched, as text."""
        if outcome.signals["missed"][0]:
            return "the slit was missed"
        return "wall or ground struck" if outcome.signals["struck"][0] else super().failure(memory, outcome)


def rims(shape: Shape) -> Array:
    """(2 * RIM, 3) points on the upper and lower rim of the vehicle's body, body frame, m."""
    angle = 2 * np.pi * np.arange(RIM) / RIM
    around = np.stack([np.cos(angle), np.sin(angle), np.zeros(RIM)], axis=-1).astype(np.float32)
    up = np.array([0.0, 0.0, 1.0], np.float32)
    xp = namespace(shape.radius, shape.feet_height)
    return xp.concatenate([shape.radius * around + side * shape.feet_height * up for side in (1, -1)])


@dataclass(frozen=True)
class GapRoute(Route):
    """Where the slit is, and how it is turned."""

    height: ClassVar = "slit"

    slit: tuple[float, float, float] = place((0.0, 0.0, 2.0))
    """Middle of the slit, m."""
    slit_yaw: float = place(0.0)
    """Heading of the flight through the slit, rad."""
    slit_roll: float = place(0.6)
    """Roll of the slit about the direction of flight, rad. Positive: its left end is up."""
    before: float = number(3.0, above=0)
    """Distance from the point where the policy takes over to the slit, m."""

    def domain(self) -> Domain:
        """Distance and tilt of the slit."""
        return extent("slit_distance", "m", self.before), extent("slit_tilt", "rad", abs(self.slit_roll))

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course from a point straight in front of the slit to the point behind it, flown once."""
        goal = GapGoal(GapConfig(), shape, control_period, checks=4)
        turn = Quat.of_euler(np.array([self.slit_roll]), np.zeros(1), np.array([self.slit_yaw])).stack()
        memory = GapMemory(np.array([self.slit]), turn, np.zeros(1, bool))
        ahead = np.array([math.cos(self.slit_yaw), math.sin(self.slit_yaw), 0.0])
        start = np.asarray(self.slit) - self.before * ahead
        below = np.asarray(self.slit) - (0.0, 0.0, goal.config.opening[0] / 2)
        points = [below, self.slit + goal.config.beyond * ahead]
        return Course(goal, memory, start, heading=self.slit_yaw, points=points, clearance=0.0)
