"""`geometric`: tracking control directly on the rotation group, for the motion predicted over the latency.

Lee, Leok and McClamroch, Geometric tracking control of a quadrotor UAV on SE(3), 2010, with the integral of Goodarzi,
Lee and Leok, Geometric nonlinear PID control of a quadrotor UAV on SE(3), 2013. Where they command a moment, this
controller commands a body rate, which the flight controller's own loop follows. The attitude error is the sine of its
angle, so it is zero upside down.
"""

from dataclasses import dataclass
from typing import ClassVar

from e2efly.control import Ctbr, Quat, Vec3
from e2efly.control.cascade import attitude_along, limited, pull
from e2efly.control.place import ZERO, Place
from e2efly.control.vectors import Array, namespace
from e2efly.flight.pilot.hover import flight_gains
from e2efly.flight.pilot.hovering.loops import approach, attainable, grown, lead
from e2efly.flight.pilot.hovering.registry import register
from e2efly.flight.pilot.hovering.response import Seen, UnderWay, ahead, residue, slipped
from e2efly.vehicles.vehicle import Vehicle


@dataclass(frozen=True)
class Learned:
    """What was learned in one flight."""

    integral: Vec3 = ZERO
    """The integral of the errors of position and velocity, world, m/s^2."""
    slip: Vec3 = ZERO
    """How much faster the body turns than commanded, rad/s. It replaces the integral of the attitude error."""


@register("geometric")
@dataclass(frozen=True)
class Geometric:
    """The controller. Its memory is `Learned`."""

    needs: ClassVar[tuple[str, ...]] = ()

    vehicle: Vehicle
    """The vehicle, with gains for the part of the latency that the prediction does not remove."""
    latency: float
    """The time from the vehicle's motion to its rate loop, s."""

    @classmethod
    def of(cls, vehicle: Vehicle, latency: float, hold: float = 0.0) -> "Geometric":
        """See `HoverController.of`."""
        return cls(flight_gains(vehicle, residue(latency) + hold / 2), latency)

    def begin(self) -> Learned:
        """The memory without any integral."""
        return Learned()

    def step(
        self, memory: Learned, seen: Seen, under_way: UnderWay, place: Place, dt: float, *, held: bool = False
    ) -> tuple[Learned, Ctbr]:
        """See `HoverController.step`."""
        vehicle, gains = self.vehicle, Vec3.of(self.vehicle.velocity_gain)
        # the integral learns from the measured motion: the prediction has the error that the integral compensates
        then = place.after(-seen.age)
        error = approach(vehicle, seen, then) - seen.velocity
        motion, goal = seen, then
        if not held:
            motion, _ = ahead(vehicle, seen, under_way, memory.integral * -1.0, memory.slip)
            goal = place.after(self.latency - seen.age)
        behind = approach(vehicle, motion, goal) - motion.velocity
        wanted = behind.times(gains) + goal.acceleration + memory.integral
        if not held:
            integral = grown(memory.integral, vehicle, error, wanted, attainable(vehicle, wanted), dt)
            memory = Learned(integral, slipped(memory.slip, seen, under_way, dt))
        yaw = motion.attitude.yaw() if goal.yaw is None else goal.yaw
        force = pull(vehicle, wanted)
        along = motion.attitude.z_axis().dot(force)
        rate = turning(vehicle, motion.attitude, force, yaw) + lead(motion.attitude, force, goal.jerk) - memory.slip
        return memory, limited(vehicle, namespace(along).maximum(along, 0.0), rate)


def turning(vehicle: Vehicle, attitude: Quat, force: Vec3, yaw: Array) -> Vec3:
    """The body rates that turn the thrust along a force, rad/s. `attitude` is body to world. `force` is the wanted
    force of the rotors over mass, world, m/s^2. `yaw` is the wanted yaw, rad.
    """
    error = attitude_along(force * (1 / force.norm()), yaw).conjugate().compose(attitude)
    tilt, turn = -2 * vehicle.attitude_gain[..., 0] * error.w, -2 * vehicle.attitude_gain[..., 1] * error.w
    return Vec3(tilt * error.x, tilt * error.y, turn * error.z)
