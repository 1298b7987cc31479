"""Flying through a forest together: the goal. Imports no JAX."""

from dataclasses import dataclass
from typing import Any

from e2efly.control.vectors import Array, namespace
from e2efly.tasks.avoid.goal import AvoidGoal, AvoidMemory


@dataclass(frozen=True)
class AvoidTogetherMemory(AvoidMemory):
    """The commanded speed, and the way of each vehicle."""

    beside: Array
    """(n,) how far to the left of the lane's middle the vehicle started, m."""


@dataclass(frozen=True)
class AvoidTogetherGoal(AvoidGoal):
    """Fly through a lane, beside others, whose ways do not run together.

    In flight the lane of each vehicle begins where it starts, so that its route is that of a vehicle alone.
    """

    @classmethod
    def state(cls, memory: Any) -> AvoidTogetherMemory:
        """The state without what only cameras see."""
        return AvoidTogetherMemory(memory.speed, memory.beside)

    def goal(self, memory: Any, time: Array) -> Array:
        """A point behind the end of the forest, straight ahead of the vehicle's start."""
        xp, middle = namespace(memory.speed), super().goal(memory, time)
        return xp.stack([middle[:, 0], memory.beside, middle[:, 2]], axis=-1)
