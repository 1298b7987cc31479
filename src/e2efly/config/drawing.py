"""Objects to draw in space: polylines, faces and marks. Plain data in world coordinates, m. Imports no JAX."""

from dataclasses import dataclass

import numpy as np

INK, ORANGE = "#222222", "#E69F00"
"""Colours of a task's objects in space, from the palette of Okabe and Ito."""

Points = np.ndarray
"""(m, 3)."""


@dataclass(frozen=True)
class Line:
    """A curve."""

    points: Points
    color: str
    width: float
    label: str = ""


@dataclass(frozen=True)
class Face:
    """A flat polygon."""

    points: Points
    color: str
    label: str = ""


@dataclass(frozen=True)
class Mark:
    """A point with a Matplotlib marker, or with a word if `text` is given."""

    point: np.ndarray
    marker: str = ""
    text: str = ""
    label: str = ""


Thing = Line | Face | Mark


def circle(centre: np.ndarray, radius: float) -> Points:
    """A horizontal circle."""
    angle = np.linspace(0, 2 * np.pi, 49)
    return centre + radius * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)
