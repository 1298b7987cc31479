"""The data that a viewer shows: a stage, which stands still, and frames, which follow each other. Needs only NumPy."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from jaxtyping import Float

from e2efly.config.drawing import Thing
from e2efly.simulation.scenes.faces import FacesBody
from e2efly.vehicles.vehicle import Vehicle


@dataclass(frozen=True)
class Stage:
    """The objects that stand still or move by themselves."""

    vehicle: Vehicle
    """The vehicle that flies. Its shape is drawn from the positions of its rotors."""
    bodies: Sequence[FacesBody] = ()
    """Solids, at time 0."""
    things: Sequence[Thing] = ()
    """Objects of the task in space."""
    ground: bool = True
    """Whether there is level ground at height 0."""


@dataclass(frozen=True)
class StageFrame:
    """One moment of n vehicles."""

    time: float
    """Time of the worlds' motion, s."""
    position: Float[np.ndarray, "n 3"]
    """Centre of mass, world, m."""
    quaternion: Float[np.ndarray, "n 4"]
    """Unit quaternion, wxyz, body to world."""
    velocity: Float[np.ndarray, "n 3"]
    """World, m/s."""
    rotor_speed: Float[np.ndarray, "n r"]
    """Rotor speeds, rad/s: one for each rotor, or one for all of them. Zero if not known."""
    goal: Float[np.ndarray, "n 3"] | None = None
    """Goal positions, m. NaN: no goal."""
    load: Float[np.ndarray, "n 3"] | None = None
    """Positions of the loads that hang from the vehicles, m. None: nothing hangs from them."""
    images: dict[str, np.ndarray] = field(default_factory=dict)
    """Images of the followed vehicle's cameras by name, RGB in [0, 1] or grey."""
    series: dict[str, tuple[float, ...]] = field(default_factory=dict)
    """Numbers of the followed vehicle by title: the commanded value, then the actual value, or only one value."""
    fresh: bool = False
    """Whether the followed vehicle starts anew in this frame. Its old trail then ends."""
    together: int = 1
    """Number of vehicles in the first vehicle's world: the first ones. Films show all of them."""
    note: str = ""
    """Note about the moment, Markdown."""


class Source(Protocol):
    """A source of frames."""

    period: float
    """Time between frames at normal speed, s."""

    @property
    def origin(self) -> np.ndarray:
        """Origin of the stage's world in the frames' world, (3,) m."""
        ...

    def stage_of(self, followed: int) -> Stage:
        """The stage of a vehicle's world. It is the same object until the stage changes."""
        ...

    def step(self, followed: int) -> StageFrame:
        """The next frame.

        Args:
            followed: the vehicle whose images, series and world are requested.
        """
        ...
