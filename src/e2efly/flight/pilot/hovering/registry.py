"""The hover controllers by name. The controllers of e2efly register themselves. The user's own are named by a reference
to their file.
"""

from collections.abc import Callable
from typing import Any, ClassVar, Protocol, Self, TypeVar

from e2efly.config.registry import Registry, check_methods
from e2efly.control import Ctbr
from e2efly.control.place import Place
from e2efly.flight.pilot.hovering.response import Seen, UnderWay
from e2efly.vehicles.vehicle import Vehicle

METHODS = ("needs", "of", "begin", "step")
"""The attributes that a hover controller must have."""
ROTOR_SPEED = "rotor_speed"
"""The entry of `needs` of a controller that needs measured rotor speeds, from which `Seen.thrust` is computed."""


class HoverController(Protocol):
    """Flies a vehicle to a place, with a memory that each control step passes to the next. Its methods are pure."""

    needs: ClassVar[tuple[str, ...]]
    """Telemetry that it cannot fly without: `ROTOR_SPEED`, or nothing."""

    @classmethod
    def of(cls, vehicle: Vehicle, latency: float, hold: float = 0.0) -> Self:
        """Make a controller. `latency` is the time from the vehicle's motion to its rate loop, s. `hold` is how long a
        command is held, s, if this comes in addition to the latency.

        Raises:
            ValueError: something that the controller needs is missing on this machine. The message names it.
        """
        ...

    def begin(self) -> Any:
        """The memory for the first step: no integral, and no known push."""
        ...

    def step(
        self, memory: Any, seen: Seen, under_way: UnderWay, place: Place, dt: float, *, held: bool = False
    ) -> tuple[Any, Ctbr]:
        """One control step.

        Args:
            memory: the memory from `begin` or the last step.
            seen: the newest motion.
            under_way: the commands that were sent but do not act yet.
            place: where the vehicle should be.
            dt: time since the last step, s.
            held: the vehicle stands on the ground, or may not receive the commands. Then nothing is learned and nothing
                is predicted.

        Returns:
            The memory for the next step, and the command, within the vehicle's limits.
        """
        ...


HOVERS: Registry[type[HoverController]] = Registry("hover controller")
"""The hover controllers by name."""

T = TypeVar("T", bound=type[HoverController])


def register(name: str) -> Callable[[T], T]:
    """Register a class of hover controllers, for `--hover NAME` and `--baseline NAME`.

    Raises:
        ValueError: the name is already used, or the class lacks an attribute of `METHODS`.
    """

    def complete(kind: T) -> T:
        check_methods(kind, METHODS)
        return kind

    return HOVERS.adding(name, complete)
