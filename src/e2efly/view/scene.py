"""What a task has in space, as polylines, faces and marks: pure, in world coordinates, m."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from e2efly.courses.gates import FRAME
from e2efly.tasks import Hover, Land, Race, Track
from e2efly.view.flights import Flights
from e2efly.view.style import HALO, INK, ORANGE

Points = Float[np.ndarray, "m 3"]


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
    """A point with a Matplotlib marker or, where `text` is given, a word."""

    point: Float[np.ndarray, "3"]
    marker: str = ""
    text: str = ""
    label: str = ""


Thing = Line | Face | Mark


def scene(task: Any, flights: Flights) -> list[Thing]:
    """What the task has in space; of an unknown task, the goals of the flights."""
    if isinstance(task, Hover):
        target = np.asarray(task.config.target, float)
        mark = Mark(target, marker="*", label="target")
        return [mark, Line(_circle(target, float(task.config.radius)), INK, 1.0)]
    if isinstance(task, Land):
        pad = _circle(np.zeros(3), float(task.config.radius))
        return [Face(pad, ORANGE, label="pad: touch down within"), Line(pad, INK, 1.0)]
    if isinstance(task, Race):
        return _gates(task)
    label = "reference" if isinstance(task, Track) else "goal"
    return [
        Line(flights.goal[:length, i], HALO, 5.0, label=label if i == 0 else "")
        for i, length in enumerate(flights.length)
    ]


def _circle(centre: Float[np.ndarray, "3"], radius: float) -> Points:
    angle = np.linspace(0, 2 * np.pi, 49)
    return centre + radius * np.stack([np.cos(angle), np.sin(angle), np.zeros_like(angle)], axis=-1)


def _gates(task: Race) -> list[Thing]:
    things: list[Thing] = []
    gates = task.gates
    rows = zip(*(np.asarray(x, float) for x in (gates.position[:-1], gates.cos, gates.sin, gates.half)), strict=True)
    for i, (centre, cos, sin, half) in enumerate(rows):
        left, up = np.array([-sin, cos, 0.0]), np.array([0.0, 0.0, 1.0])
        inner, outer = (
            [centre + a * w * left + b * h * up for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))]
            for w, h in (half, half + FRAME)
        )
        for k in range(4):
            bar = np.stack([inner[k], inner[k - 1], outer[k - 1], outer[k]])
            things.append(Face(bar, ORANGE, label="gate, numbered in order" if i == k == 0 else ""))
        beyond = centre + (half[1] + FRAME + 0.3) * up + (half[0] + FRAME + 0.3) * left
        things.append(Mark(beyond, text=str(i + 1)))
    return things
