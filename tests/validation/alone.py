"""A flight of one vehicle."""

from typing import Any

from e2efly.validation.plant_flight import Trajectory, flying, together


def fly(*given: Any, **options: Any) -> Trajectory:
    """The flight of `flying`, with its arguments."""
    (flown,) = together([flying(*given, **options)])
    return flown
