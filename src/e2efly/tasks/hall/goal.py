"""Flight through a cluttered hall: the route of a flight. The goal is that of avoid. Imports no JAX."""

from dataclasses import dataclass
from typing import ClassVar

from e2efly.config import number
from e2efly.config.numbers import SPEED
from e2efly.tasks.avoid.goal import AvoidRoute
from e2efly.tasks.hall import HallConfig


@dataclass(frozen=True)
class HallRoute(AvoidRoute):
    """How fast to fly through the hall, which begins at the origin."""

    options: ClassVar = HallConfig

    speed: float = number(3.0, above=0, high=SPEED)
    """Commanded speed, m/s."""
