"""Controllers: from a command of four numbers to collective thrust and body rates (CTBR), by one cascade.

position + yaw -> velocity + yaw -> acceleration + yaw -> attitude + thrust -> CTBR. A command enters at its own level.
The simulator's command modes and the flight bridge run these same functions, on JAX and on NumPy arrays.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from e2efly.control.vectors import Array, Quat, Vec3, namespace, safe_sqrt
from e2efly.vehicles.vehicle import GRAVITY, Vehicle

Command = tuple[Array, Array, Array, Array]


class Motion(Protocol):
    """What the controllers know of the vehicle: world ENU, body FLU, SI units."""

    @property
    def position(self) -> Vec3:
        """Centre of mass, world, m."""
        ...

    @property
    def velocity(self) -> Vec3:
        """World, m/s."""
        ...

    @property
    def attitude(self) -> Quat:
        """Body to world."""
        ...


@dataclass(frozen=True)
class Ctbr:
    """Collective thrust and body rates: what the flight controller's rate loop is told."""

    thrust: Array
    """Collective thrust over mass, m/s^2."""
    rate: Vec3
    """Body rates, rad/s, within the vehicle's `body_rate_max`."""


Controller = Callable[[Vehicle, Motion, Command], Ctbr]
"""(nominal vehicle, motion, command) -> CTBR."""


def ctbr(vehicle: Vehicle, motion: Motion, command: Command) -> Ctbr:
    """Command: collective thrust over mass, m/s^2, and body rates, rad/s."""
    del motion
    return _limited(vehicle, command[0], Vec3(*command[1:]))


def attitude(vehicle: Vehicle, motion: Motion, command: Command) -> Ctbr:
    """Command: collective thrust over mass, m/s^2; roll, pitch, yaw, rad (R = Rz Ry Rx)."""
    thrust, roll, pitch, yaw = command
    return _turn(vehicle, motion, thrust, Quat.of_euler(roll, pitch, yaw))


def acceleration(vehicle: Vehicle, motion: Motion, command: Command) -> Ctbr:
    """Command: acceleration in the world, m/s^2, and yaw, rad."""
    return _accelerate(vehicle, motion, Vec3(*command[:3]), command[3])


def velocity(vehicle: Vehicle, motion: Motion, command: Command) -> Ctbr:
    """Command: velocity in the world, m/s, and yaw, rad."""
    return _reach(vehicle, motion, Vec3(*command[:3]), command[3])


def position(vehicle: Vehicle, motion: Motion, command: Command) -> Ctbr:
    """Command: position in the world, m, and yaw, rad."""
    error = Vec3(*command[:3]) - motion.position
    wanted = error.times(Vec3.of(vehicle.position_gain)).clip(Vec3.of(vehicle.speed_max))
    return _reach(vehicle, motion, wanted, command[3])


CASCADE: dict[str, Controller] = {
    "ctbr": ctbr,
    "attitude": attitude,
    "acceleration": acceleration,
    "velocity": velocity,
    "position": position,
}
"""Controllers by the name of their command mode."""


def _reach(vehicle: Vehicle, motion: Motion, wanted: Vec3, yaw: Array) -> Ctbr:
    error = wanted - motion.velocity
    return _accelerate(vehicle, motion, error.times(Vec3.of(vehicle.velocity_gain)), yaw)


def _accelerate(vehicle: Vehicle, motion: Motion, wanted: Vec3, yaw: Array) -> Ctbr:
    """Point the thrust along the wanted acceleration less gravity, within the tilt limit."""
    wanted = wanted.clip(Vec3.of(vehicle.acceleration_max))
    xp = namespace(wanted.z, yaw)
    up = xp.maximum(wanted.z + GRAVITY, 0.1 * GRAVITY)  # the rotors push up: a steeper fall is not commanded
    level = safe_sqrt(wanted.x**2 + wanted.y**2)
    reach = up * xp.tan(vehicle.tilt_max)
    shrink = reach / xp.maximum(level, reach)
    force = Vec3(wanted.x * shrink, wanted.y * shrink, up)
    thrust = force.norm()
    axis = force * (1 / thrust)
    # shortest turn from up to the axis, after a turn by yaw about up: singular only upside down, out of reach here
    half = xp.sqrt((1 + axis.z) / 2)
    zero = xp.zeros_like(half)
    tilt = Quat(half, -axis.y / (2 * half), axis.x / (2 * half), zero)
    wanted_attitude = tilt.compose(Quat(xp.cos(yaw / 2), zero, zero, xp.sin(yaw / 2)))
    along = motion.attitude.z_axis().dot(force)  # thrust for the acceleration along the axis as it is now
    return _turn(vehicle, motion, xp.maximum(along, 0.0), wanted_attitude)


def _turn(vehicle: Vehicle, motion: Motion, thrust: Array, wanted: Quat) -> Ctbr:
    """Tilt-prioritised law (Brescianini and D'Andrea, Tilt-prioritized quadrocopter attitude control, 2018)."""
    e = motion.attitude.conjugate().compose(wanted)
    xp = namespace(e.w)
    n = xp.sqrt(e.w**2 + e.z**2 + 1e-12)
    sign = xp.where(e.w >= 0, 1.0, -1.0)
    tilt, yaw = 2 * vehicle.attitude_gain[..., 0] / n, 2 * vehicle.attitude_gain[..., 1] / n
    rate = Vec3(tilt * (e.w * e.x - e.y * e.z), tilt * (e.w * e.y + e.x * e.z), yaw * sign * e.z)
    return _limited(vehicle, thrust, rate)


def _limited(vehicle: Vehicle, thrust: Array, rate: Vec3) -> Ctbr:
    return Ctbr(thrust, rate.clip(Vec3.of(vehicle.body_rate_max)))
