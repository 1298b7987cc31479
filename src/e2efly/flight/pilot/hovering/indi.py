"""`indi`: incremental nonlinear dynamic inversion of the specific force.

Smeur, de Croon and Chu, Cascaded incremental nonlinear dynamic inversion for MAV disturbance rejection, 2018; Tal and
Karaman, Accurate tracking of aggressive quadrotor trajectories using incremental nonlinear dynamic inversion and
differential flatness, 2020.

The rotors should give what they gave, plus the wanted minus the measured acceleration, where both are filtered alike.
This equals the wanted acceleration minus the filtered push of everything but the rotors. It needs no mass, no drag and
no integral. In these papers, the inner increment is an increment of the moment. Here it is an increment of the body
rates, because the flight controller's rate loop takes body rates: the commanded rate, plus the wanted minus the
measured rate.
"""

import math
from dataclasses import dataclass
from typing import ClassVar

from e2efly.control import Ctbr, Vec3
from e2efly.control.place import ZERO, Place
from e2efly.control.vectors import Array
from e2efly.flight.pilot.hover import flight_gains
from e2efly.flight.pilot.hovering.loops import LIMIT, approach, steer
from e2efly.flight.pilot.hovering.registry import ROTOR_SPEED, register
from e2efly.flight.pilot.hovering.response import Seen, UnderWay, ahead, residue, slipped
from e2efly.vehicles.vehicle import Vehicle

FILTER_S = 0.2
"""Time constant of the filter of both accelerations, s."""
UNITS_S = 0.5
"""Time constant with which the thrust from the rotor speeds is scaled to that of the commands, s. The throttle map may
already have learned mass and battery, so the increments must not compensate for them a second time."""


@dataclass(frozen=True)
class FeltResponse:
    """What was measured in one flight."""

    pushed: Vec3 = ZERO
    """The acceleration caused by everything but the rotors and gravity, filtered, world, m/s^2."""
    slip: Vec3 = ZERO
    """How much faster the body turns than commanded, rad/s."""
    share: Array | None = None
    """The commanded thrust divided by the thrust from the rotor speeds. None: not known yet."""


@register("indi")
@dataclass(frozen=True)
class Indi:
    """The controller. Its memory is `FeltResponse`.

    If the rotor speeds are not known, the thrust is that of the commands after the lag of the motors.
    """

    needs: ClassVar[tuple[str, ...]] = (ROTOR_SPEED,)

    vehicle: Vehicle
    """The vehicle, with gains for the part of the latency that the prediction does not remove."""
    latency: float
    """The time from the vehicle's motion to its rate loop, s."""

    @classmethod
    def of(cls, vehicle: Vehicle, latency: float, hold: float = 0.0) -> "Indi":
        """See `HoverController.of`."""
        return cls(flight_gains(vehicle, residue(latency) + hold / 2), latency)

    def begin(self) -> FeltResponse:
        """The memory without any push."""
        return FeltResponse()

    def step(
        self, memory: FeltResponse, seen: Seen, under_way: UnderWay, place: Place, dt: float, *, held: bool = False
    ) -> tuple[FeltResponse, Ctbr]:
        """See `HoverController.step`."""
        vehicle, motion, goal = self.vehicle, seen, place.after(-seen.age)
        if not held:
            memory = felt(memory, seen, under_way, dt)
            motion, _ = ahead(vehicle, seen, under_way, memory.pushed, memory.slip)
            goal = place.after(self.latency - seen.age)
        behind = approach(vehicle, motion, goal) - motion.velocity
        wanted = behind.times(Vec3.of(vehicle.velocity_gain)) + goal.acceleration - memory.pushed
        return memory, steer(vehicle, motion, wanted, goal, memory.slip)


def felt(before: FeltResponse, seen: Seen, under_way: UnderWay, dt: float) -> FeltResponse:
    """The memory after a step of `dt` s."""
    slip = slipped(before.slip, seen, under_way, dt)
    if seen.force is None:
        return FeltResponse(before.pushed, slip, before.share)
    gave, share = under_way.thrust, before.share
    if seen.thrust is not None:
        now = under_way.thrust / seen.thrust
        share = now if share is None else share + (now - share) * (1 - math.exp(-dt / UNITS_S))
        gave = share * seen.thrust
    push = seen.attitude.rotate(seen.force - Vec3(0.0, 0.0, gave))
    return FeltResponse(
        (before.pushed + (push - before.pushed) * (1 - math.exp(-dt / FILTER_S))).clip(LIMIT), slip, share
    )
