"""What a viewer shows: a stage that stands, and frames that pass. NumPy alone."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from jaxtyping import Float

from e2efly.drawing import Thing
from e2efly.scenes.faces import Body
from e2efly.vehicles import Vehicle


@dataclass(frozen=True)
class Stage:
    """What stands still, or moves by itself."""

    vehicle: Vehicle
    """What flies: its rotors' places decide how it looks."""
    bodies: Sequence[Body] = ()
    """Solids, as they are at time 0."""
    things: Sequence[Thing] = ()
    """What the task has in space."""
    ground: bool = True
    """Whether there is level ground at height 0."""


@dataclass(frozen=True)
class Frame:
    """A moment of n vehicles."""

    time: float
    """Of the worlds' motion, s."""
    position: Float[np.ndarray, "n 3"]
    """Centre of mass, world, m."""
    quaternion: Float[np.ndarray, "n 4"]
    """Unit, wxyz, body to world."""
    velocity: Float[np.ndarray, "n 3"]
    """World, m/s."""
    rotor_speed: Float[np.ndarray, "n 4"]
    """Rad/s; zero where it is not known."""
    goal: Float[np.ndarray, "n 3"] | None = None
    """Where to be; NaN: nowhere."""
    images: dict[str, np.ndarray] = field(default_factory=dict)
    """What the cameras of the followed vehicle see, RGB in [0, 1] or grey, by name."""
    series: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Numbers of the followed vehicle by title: what was commanded, then what came of it; or one alone."""
    fresh: bool = False
    """The followed vehicle begins anew here: its trail ends."""
    note: str = ""
    """About the moment, Markdown."""


class Source(Protocol):
    """Where frames come from."""

    period: float
    """Seconds from frame to frame at the usual speed."""

    @property
    def origin(self) -> np.ndarray:
        """(3,) of the stage's world in the frames' world, m."""
        ...

    def stage_of(self, followed: int) -> Stage:
        """What stands in the world of a vehicle; the same object until it changes."""
        ...

    def step(self, followed: int) -> Frame:
        """The next frame.

        Args:
            followed: the vehicle whose images, series and world are wanted.
        """
        ...
