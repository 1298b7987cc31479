"""The objects of a flight in space: those of the task, or else the path of its goal."""

from e2efly.config import TaskConfig
from e2efly.config.drawing import Line, Thing
from e2efly.viewing.flights import Flights
from e2efly.viewing.style import HALO


def scene(task: TaskConfig, flights: Flights) -> list[Thing]:
    """The objects of the task. If it has none, the goals of the flights."""
    if (things := task.drawing()) is not None:
        return things
    return [
        Line(flights.goal[:length, i], HALO, 5.0, label=task.goal if i == 0 else "")
        for i, length in enumerate(flights.length)
    ]
