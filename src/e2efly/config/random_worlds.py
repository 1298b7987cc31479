"""Options of random worlds. Imports no JAX."""

import math
from dataclasses import dataclass

from e2efly.config.numbers import number, shape

CLUTTER = ("box", "capsule", "cylinder", "sphere")
"""Shapes of obstacles. All shapes share the available places of a world."""


@dataclass(frozen=True)
class ForestConfig:
    """Trees at random places of a lane along world x."""

    density: float = number(0.1, high=100.0)
    """Number of trees per square metre."""
    length: float = number(40.0, above=0)
    """Length of the lane, measured from the start, m."""
    width: float = number(16.0, above=0)
    """Width of the lane, m."""
    radius: tuple[float, float] = number((0.1, 0.35), above=0, rising=True)
    """Radius of the trunks, m."""
    height: tuple[float, float] = number((4.0, 8.0), rising=True)
    """Height of the trunks, m."""
    clear: float = 2.0
    """No tree is nearer than this to the start or to the goal, m."""
    room: int = shape(64)
    """Largest number of trees in a world (sets shapes)."""

    def check(self, name: str) -> None:
        """Check that `room` is large enough for the trees.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        trees = self.density * self.length * self.width
        if trees > self.room + 1e-3:
            raise ValueError(
                f"{name}.room is {self.room}; accepted: {math.ceil(trees - 1e-3)} or more, the trees on average"
            )


@dataclass(frozen=True)
class ClutterConfig:
    """Boxes, spheres, cylinders and capsules at random places along a track."""

    obstacles: float = 16.0
    """Average number of obstacles. Each of the `room` places is occupied with the same probability."""
    sideways: float = 2.5
    """Largest distance of their centres from the straight lines between gates, m per axis."""
    size: tuple[float, float] = number((0.15, 0.4), rising=True)
    """Half-lengths and radii of the obstacles, m."""
    clear: float = 0.5
    """No obstacle nearer than this to a gate's opening or to the start, m."""
    moving: float = number(0.0, high=1.0)
    """Share of the obstacles that swing back and forth."""
    swing: float = 1.0
    """Amplitude of the swinging obstacles, m."""
    room: int = shape(16)
    """Largest number of obstacles in a world; a multiple of 4 (sets shapes)."""

    def check(self, name: str) -> None:
        """Check that `room` is large enough for the obstacles.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        if self.room < 1 or self.room % len(CLUTTER):
            raise ValueError(f"{name}.room is {self.room}; accepted: a positive multiple of {len(CLUTTER)}")
        if self.obstacles > self.room:
            raise ValueError(f"{name}.obstacles is {self.obstacles}; accepted: at most {name}.room, {self.room}")
