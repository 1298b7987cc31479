"""The cascade of controllers down to collective thrust and body rates (CTBR).

velocity + yaw -> acceleration + yaw -> attitude + thrust -> CTBR. A command mode (`control/modes.py`) enters at its own
level. The simulator and the flight bridge run the same functions, on JAX arrays and on NumPy arrays.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from e2efly.control.vectors import Array, Quat, Vec3, namespace, safe_sqrt
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

Command = tuple[Array, Array, Array, Array]


class Motion(Protocol):
    """The vehicle's motion as the controllers know it: world ENU, body FLU, SI units."""

    @property
    def position(self) -> Vec3:
        """Centre of mass, world, m."""
        ...

    @property
    def velocity(self) -> Vec3:
        """Velocity, world, m/s."""
        ...

    @property
    def attitude(self) -> Quat:
        """Rotation from body to world."""
        ...


@dataclass(frozen=True)
class Ctbr:
    """Collective thrust and body rates: the command of the flight controller's rate loop."""

    thrust: Array
    """Collective thrust over mass, m/s^2."""
    rate: Vec3
    """Body rates, rad/s, within the vehicle's `body_rate_max`."""


Controller = Callable[[Vehicle, Motion, Command], Ctbr]
"""(nominal vehicle, motion, command) -> CTBR."""


def reach(vehicle: Vehicle, motion: Motion, wanted: Vec3, yaw: Array) -> Ctbr:
    """Control a velocity in the world, m/s, and a yaw, rad."""
    error = wanted - motion.velocity
    return accelerate(vehicle, motion, error.times(Vec3.of(vehicle.velocity_gain)), yaw)


def pull(vehicle: Vehicle, wanted: Vec3) -> Vec3:
    """Specific force of the rotors for a wanted acceleration, both world, m/s^2.

    It is the acceleration minus gravity, within the limits.
    """
    wanted = wanted.clip(Vec3.of(vehicle.acceleration_max))
    xp = namespace(wanted.x, wanted.z)
    up = xp.maximum(wanted.z + GRAVITY, 0.1 * GRAVITY)  # the rotors push up: a faster fall is not commanded
    level = safe_sqrt(wanted.x**2 + wanted.y**2)
    reach = up * xp.tan(vehicle.tilt_max)
    shrink = reach / xp.maximum(level, reach)
    return Vec3(wanted.x * shrink, wanted.y * shrink, up)


def attitude_along(axis: Vec3, yaw: Array) -> Quat:
    """The attitude whose z axis is a given unit vector, world, at a yaw, rad.

    It is a rotation by the yaw about up, followed by the shortest rotation from up to the axis. It is singular only
    upside down.
    """
    xp = namespace(axis.z, yaw)
    half = xp.sqrt((1 + axis.z) / 2)
    zero = xp.zeros_like(half)
    tilt = Quat(half, -axis.y / (2 * half), axis.x / (2 * half), zero)
    return tilt.compose(Quat(xp.cos(yaw / 2), zero, zero, xp.sin(yaw / 2)))


def accelerate(vehicle: Vehicle, motion: Motion, wanted: Vec3, yaw: Array) -> Ctbr:
    """Point the thrust along the wanted acceleration, world, m/s^2, minus gravity, within the tilt limit.

    The yaw is in rad.
    """
    force = pull(vehicle, wanted)
    axis = force * (1 / force.norm())
    along = motion.attitude.z_axis().dot(force)  # thrust for the acceleration along the present axis
    xp = namespace(along)
    return turn(vehicle, motion, xp.maximum(along, 0.0), attitude_along(axis, yaw))


def turn(vehicle: Vehicle, motion: Motion, thrust: Array, wanted: Quat) -> Ctbr:
    """Control an attitude, with priority for the tilt.

    Brescianini and D'Andrea, Tilt-prioritized quadrocopter attitude control, 2018.
    """
    e = motion.attitude.conjugate().compose(wanted)
    xp = namespace(e.w)
    n = xp.sqrt(e.w**2 + e.z**2 + 1e-12)
    sign = xp.where(e.w >= 0, 1.0, -1.0)
    tilt, yaw = 2 * vehicle.attitude_gain[..., 0] / n, 2 * vehicle.attitude_gain[..., 1] / n
    rate = Vec3(tilt * (e.w * e.x - e.y * e.z), tilt * (e.w * e.y + e.x * e.z), yaw * sign * e.z)
    return limited(vehicle, thrust, rate)


def limited(vehicle: Vehicle, thrust: Array, rate: Vec3) -> Ctbr:
    """CTBR with the body rates, rad/s, within the vehicle's `body_rate_max`."""
    return Ctbr(thrust, rate.clip(Vec3.of(vehicle.body_rate_max)))
