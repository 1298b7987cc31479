"""Holding a load: the goal, and the route of a flight. Imports no JAX."""

import dataclasses
import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from e2efly.config import number
from e2efly.config.domain import Domain, extent
from e2efly.courses import defaults
from e2efly.policy.goal import Course, Shape
from e2efly.tasks.hover.goal import HoverGoal
from e2efly.tasks.hover_payload import HoverPayloadConfig
from e2efly.tasks.route import Route, place

CABLE = 0.5
"""Length of the cable of a flight, unless it is given, m."""


@dataclass(frozen=True)
class HoverPayloadGoal(HoverGoal):
    """Be where the load hangs at its place, and let it not swing.

    The policy observes what that of `hover` does. In flight nothing measures the load: there the vehicle is judged.
    """

    config: HoverPayloadConfig


@dataclass(frozen=True)
class HoverPayloadRoute(Route):
    """Where the load is to hang."""

    longest_s: ClassVar = 10.0
    trained: ClassVar = {"target": (*defaults.TARGET[:2], defaults.TARGET[2] - CABLE)}

    target: tuple[float, float, float] = place((0.0, 0.0, defaults.FLOWN_HEIGHT - CABLE))
    """The load's place, m."""
    length: float = number(CABLE, above=0, high=10.0)
    """Height of the vehicle's centre of mass over a load that hangs still: the length of the cable, and how far its
    upper end is below the centre of mass, m."""

    def domain(self) -> Domain:
        """The cable."""
        return (extent("cable_length", "m", self.length),)

    def course(self, shape: Shape, control_period: float) -> Course:
        """The course to the place over that of the load. It has no end."""
        above = tuple(np.add(self.target, (0.0, 0.0, self.length)).tolist())
        goal = HoverPayloadGoal(dataclasses.replace(HoverPayloadConfig(), target=above), shape, control_period)
        start = np.add(above, (0.5, -0.4, 0.0))
        return Course(goal, np.zeros(1), start, duration=math.inf, points=[self.target, above])
