"""The common parts of the hover controllers: the way to a place, the vehicle's limits, and the integral. Pure."""

from e2efly.control import Ctbr, Motion, Quat, Vec3
from e2efly.control.cascade import accelerate, limited, pull
from e2efly.control.place import Place
from e2efly.control.vectors import Array, namespace
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

SHARE = 0.2
"""Rate of change of the integral divided by the velocity error, in units of the velocity gain squared. It is a fifth,
so that the integral is clearly slower than the other loops."""
FASTEST = 0.3
"""The largest velocity error from which the integral learns, m/s. Larger errors count as this one, because the integral
is meant for lasting errors, not for steps and stops."""
LIMIT = Vec3(0.3 * GRAVITY, 0.3 * GRAVITY, 0.6 * GRAVITY)
"""The largest acceleration that the integral may command, m/s^2. Vertically, it suffices for a quadrotor with 2.5 times
its mass."""


def approach(vehicle: Vehicle, motion: Motion, place: Place) -> Vec3:
    """The velocity that leads to a place and moves along with it, world, m/s, within the vehicle's `speed_max`."""
    off = (place.position - motion.position).times(Vec3.of(vehicle.position_gain))
    return (off + place.velocity).clip(Vec3.of(vehicle.speed_max))


def attainable(vehicle: Vehicle, wanted: Vec3) -> Vec3:
    """The part of an acceleration that the limits of the vehicle allow, world, m/s^2."""
    force, most = pull(vehicle, wanted), vehicle.thrust_to_weight * GRAVITY
    return Vec3(force.x, force.y, namespace(force.z).minimum(force.z, most) - GRAVITY)


def lead(attitude: Quat, force: Vec3, jerk: Vec3) -> Vec3:
    """The body rates with which the thrust direction follows a jerk, rad/s. `attitude` is body to world. `force` is the
    wanted force of the rotors over mass, world, m/s^2, and `jerk` its rate of change, world, m/s^3.
    """
    scale = 1 / force.norm()
    return attitude.unrotate((force * scale).cross(jerk * scale))


def steer(vehicle: Vehicle, motion: Motion, wanted: Vec3, goal: Place, slip: Vec3) -> Ctbr:
    """The command for an acceleration, world, m/s^2, with the heading and the jerk of a place, minus a slip, rad/s."""
    yaw = motion.attitude.yaw() if goal.yaw is None else goal.yaw
    command = accelerate(vehicle, motion, wanted, yaw)
    goes = lead(motion.attitude, pull(vehicle, wanted), goal.jerk)
    return limited(vehicle, command.thrust, command.rate + goes - slip)


def grown(before: Vec3, vehicle: Vehicle, error: Vec3, wanted: Vec3, flown: Vec3, dt: float) -> Vec3:
    """The integral after another `dt` s, m/s^2.

    It does not change along an axis on which the limits cut the wanted acceleration, unless the error leads back
    (anti-windup). `error` is the wanted velocity minus the velocity, world, m/s. `wanted` is the wanted acceleration,
    and `flown` the part of it that the limits of the vehicle allow, world, m/s^2.
    """
    gains, xp = Vec3.of(vehicle.velocity_gain), namespace(error.x, error.z)
    level = FASTEST / xp.maximum(xp.sqrt(error.x**2 + error.y**2), FASTEST)
    error = Vec3(error.x * level, error.y * level, xp.clip(error.z, -FASTEST, FASTEST))

    def axis(i: Array, gain: Array, e: Array, asked: Array, given: Array, limit: float) -> Array:
        xp = namespace(i, e, asked)
        winds = (abs(asked - given) > 1e-3) & ((asked - given) * e > 0)
        return xp.clip(i + xp.where(winds, 0.0, SHARE * gain**2 * e * dt), -limit, limit)

    return Vec3(
        axis(before.x, gains.x, error.x, wanted.x, flown.x, LIMIT.x),
        axis(before.y, gains.y, error.y, wanted.y, flown.y, LIMIT.y),
        axis(before.z, gains.z, error.z, wanted.z, flown.z, LIMIT.z),
    )
