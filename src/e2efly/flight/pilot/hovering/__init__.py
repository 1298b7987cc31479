"""Hover controllers. They fly take-off, hover and landing, and policies are compared with them. Imports no JAX."""

from e2efly.flight.pilot.hovering import geometric, indi, mpc, pid
from e2efly.flight.pilot.hovering.registry import HOVERS, ROTOR_SPEED, HoverController, register
from e2efly.flight.pilot.hovering.response import Seen, UnderWay, ahead, sent, thrust_of
from e2efly.vehicles.vehicle import Vehicle

DEFAULT = "pid"
"""The hover controller that flies if none is named."""

__all__ = [
    "DEFAULT",
    "HOVERS",
    "ROTOR_SPEED",
    "HoverController",
    "Seen",
    "UnderWay",
    "ahead",
    "hover_controller",
    "register",
    "sent",
    "thrust_of",
]  # fmt: skip
_SHIPPED = geometric, indi, mpc, pid  # these modules register their controllers when imported


def hover_controller(name: str, vehicle: Vehicle, latency: float, hold: float = 0.0) -> HoverController:
    """Make a hover controller for a vehicle. `name` is one of `HOVERS`, or the reference `path/to/file.py:Name` or
    `module:Name` of the user's own controller. `latency` is the time from the vehicle's motion to its rate loop, s.
    `hold` is how long a command is held, s, if this comes in addition to the latency.

    Raises:
        ValueError: the name is unknown; the message lists all names. Or a package that the controller needs is missing;
            the message names it.
    """
    return HOVERS.find(name).of(vehicle, latency, hold)
