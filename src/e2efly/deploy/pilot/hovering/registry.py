"""The hover controllers by name. One registers itself; one of the user's own is a reference to its file."""

from collections.abc import Callable
from typing import Any, ClassVar, Protocol, Self, TypeVar

from e2efly.control import Ctbr
from e2efly.control.place import Place
from e2efly.deploy.pilot.hovering.response import Seen, UnderWay
from e2efly.registry import Registry, origin
from e2efly.vehicles.vehicle import Vehicle

METHODS = ("needs", "of", "begin", "step")
"""What a hover controller must have."""
ROTOR_SPEED = "rotor_speed"
"""What a controller needs that is told the speeds of the rotors: `Seen.thrust`."""


class HoverController(Protocol):
    """Flies a vehicle to a place, with a memory that each control step passes to the next. Its methods are pure."""

    needs: ClassVar[tuple[str, ...]]
    """Telemetry that it cannot fly without: `ROTOR_SPEED`, or nothing."""

    @classmethod
    def of(cls, vehicle: Vehicle, latency: float, hold: float = 0.0) -> Self:
        """Make it.

        Args:
            vehicle: as loaded.
            latency: from the vehicle's motion to its rate loop, s.
            hold: for how long a command is held, s, where that counts beside the latency.

        Raises:
            ValueError: naming what the machine lacks for it.
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
            memory: from `begin` or the last step.
            seen: the newest motion.
            under_way: what was sent and does not act yet.
            place: where to be.
            dt: since the last step, s.
            held: it stands on the ground, or may not get what is sent: nothing is learned and nothing predicted.

        Returns:
            What the next step is handed, and the command, within the vehicle's limits.
        """
        ...


HOVERS: Registry[type[HoverController]] = Registry("hover controller")
"""The hover controllers by name."""

T = TypeVar("T", bound=type[HoverController])


def register(name: str) -> Callable[[T], T]:
    """Register a class of hover controllers, for `--hover NAME` and `--baseline NAME`.

    Raises:
        ValueError: for a name that is taken, or a class that lacks a method.
    """

    def registered(kind: T) -> T:
        if lacking := [method for method in METHODS if not hasattr(kind, method)]:
            raise ValueError(f"{origin(kind)} has no {', '.join(lacking)}; accepted: all of {', '.join(METHODS)}")
        HOVERS.add(name, kind)
        return kind

    return registered
