"""Hover controllers: what flies take-off, hover and landing, and what policies are compared with. Imports no JAX."""

from e2efly.deploy.pilot.hovering import geometric, indi, mpc, pid
from e2efly.deploy.pilot.hovering.registry import HOVERS, ROTOR_SPEED, HoverController, register
from e2efly.deploy.pilot.hovering.response import Seen, UnderWay, ahead, sent, thrust_of
from e2efly.vehicles.vehicle import Vehicle

DEFAULT = "pid"
"""The hover controller that flies if none is named."""

__all__ = [
    "DEFAULT", "HOVERS", "ROTOR_SPEED", "HoverController", "Seen", "UnderWay", "ahead", "hover_controller", "register",
    "sent", "thrust_of",
]  # fmt: skip
_SHIPPED = geometric, indi, mpc, pid  # which register themselves


def hover_controller(name: str, vehicle: Vehicle, latency: float, hold: float = 0.0) -> HoverController:
    """A hover controller for a vehicle.

    Args:
        name: of `HOVERS`, or the reference `path/to/file.py:Name` or `module:Name` of one of the user's own.
        vehicle: as loaded.
        latency: from the vehicle's motion to its rate loop, s.
        hold: for how long a command is held, s, where that counts beside the latency.

    Raises:
        ValueError: for an unknown name, with all there are; naming the package that the machine lacks for it.
    """
    return HOVERS.find(name).of(vehicle, latency, hold)
