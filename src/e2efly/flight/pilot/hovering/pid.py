"""`pid`: the cascade of proportional loops down to body rates, with an integral of the velocity error."""

from dataclasses import dataclass
from typing import ClassVar

from e2efly.control import Ctbr, Vec3
from e2efly.control.cascade import accelerate
from e2efly.control.place import ZERO, Place
from e2efly.flight.pilot.hover import flight_gains
from e2efly.flight.pilot.hovering.loops import approach, attainable, grown
from e2efly.flight.pilot.hovering.registry import register
from e2efly.flight.pilot.hovering.response import Seen, UnderWay
from e2efly.vehicles.vehicle import Vehicle


@register("pid")
@dataclass(frozen=True)
class Pid:
    """Position -> velocity -> acceleration -> attitude -> body rates, with gains that suit the latency.

    Its memory is the integral, world, m/s^2.
    """

    needs: ClassVar[tuple[str, ...]] = ()

    vehicle: Vehicle
    """The vehicle with these gains."""

    @classmethod
    def of(cls, vehicle: Vehicle, latency: float, hold: float = 0.0) -> "Pid":
        """See `HoverController.of`."""
        return cls(flight_gains(vehicle, latency + hold / 2))

    def begin(self) -> Vec3:
        """The memory without any integral."""
        return ZERO

    def step(
        self, memory: Vec3, seen: Seen, under_way: UnderWay, place: Place, dt: float, *, held: bool = False
    ) -> tuple[Vec3, Ctbr]:
        """See `HoverController.step`."""
        del under_way
        place = place.after(-seen.age)
        error = approach(self.vehicle, seen, place) - seen.velocity
        wanted = error.times(Vec3.of(self.vehicle.velocity_gain)) + place.acceleration + memory
        if not held:
            memory = grown(memory, self.vehicle, error, wanted, attainable(self.vehicle, wanted), dt)
        yaw = seen.attitude.yaw() if place.yaw is None else place.yaw
        return memory, accelerate(self.vehicle, seen, wanted, yaw)
