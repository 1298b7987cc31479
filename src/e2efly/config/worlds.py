"""Options of random worlds. Imports no JAX."""

import math
from dataclasses import dataclass

from e2efly.numbers import number, shape

CLUTTER = ("box", "capsule", "cylinder", "sphere")
"""Forms of obstacles, which share the places of a world."""


@dataclass(frozen=True)
class ForestConfig:
    """Trees at random places of a lane along world x."""

    density: float = 0.1
    """Trees a square metre."""
    length: float = number(40.0, above=0)
    """Length of the lane from the start on, m."""
    width: float = number(16.0, above=0)
    """Its width, m."""
    radius: tuple[float, float] = number((0.1, 0.35), above=0, rising=True)
    """Of the trunks, m."""
    height: tuple[float, float] = number((4.0, 8.0), rising=True)
    """Of the trunks, m."""
    clear: float = 2.0
    """No tree within this of the start and of the goal, m."""
    room: int = shape(64)
    """Most trees of a world (sets shapes)."""

    def check(self, name: str) -> None:
        """Check that there are places for the trees.

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
    """Boxes, balls, columns and capsules at random places along a track."""

    obstacles: float = 16.0
    """How many on average; each of `room` places is taken with the same probability."""
    sideways: float = 2.5
    """Their centres lie within this of the straight lines from gate to gate, m per axis."""
    size: tuple[float, float] = number((0.15, 0.4), rising=True)
    """Half-lengths and radii, m."""
    clear: float = 0.5
    """No obstacle nearer than this to a gate's opening or to the start, m."""
    moving: float = 0.0
    """Share of them that swings to and fro."""
    swing: float = 1.0
    """Amplitude of those, m."""
    room: int = shape(16)
    """Most obstacles of a world; a multiple of 4 (sets shapes)."""

    def check(self, name: str) -> None:
        """Check that there are places for the obstacles.

        Raises:
            ValueError: naming the field, the value and what is accepted.
        """
        if self.room < 1 or self.room % len(CLUTTER):
            raise ValueError(f"{name}.room is {self.room}; accepted: a positive multiple of {len(CLUTTER)}")
        if self.obstacles > self.room:
            raise ValueError(f"{name}.obstacles is {self.obstacles}; accepted: at most {name}.room, {self.room}")
        if self.moving > 1:
            raise ValueError(f"{name}.moving is {self.moving}; accepted: a share, 0 to 1")
