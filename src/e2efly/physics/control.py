"""Command modes: from a command of four numbers to rotor speed commands, by one cascade.

position + yaw -> velocity + yaw -> acceleration + yaw -> attitude + thrust -> collective thrust and body rates
(CTBR) -> rotor thrusts -> rotor speeds. A mode enters the cascade at its own level; every level below runs at every
physics sub-step. All laws use the nominal vehicle: the flight controller does not know what was randomised.
"""

from collections.abc import Callable
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.physics.body import Rotors, gyroscopic_torque, rotor_speed_for
from e2efly.physics.components import Quat, Vec3, safe_sqrt
from e2efly.physics.mixer import Mixer
from e2efly.physics.rotation import euler_components
from e2efly.physics.state import Parts
from e2efly.vehicles.vehicle import GRAVITY, Vehicle

Command = tuple[Array, Array, Array, Array]
Law = Callable[[Vehicle, Mixer, Parts, Command], Rotors]
"""(nominal vehicle, its mixer, state, command) -> rotor speed commands, rad/s."""


def rotor_thrust_law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
    """Command: thrust of each rotor, N."""
    del parts
    return rotor_speed_for(vehicle, mixer.limit(command))


def ctbr_law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
    """Command: collective thrust over mass, m/s^2, and body rates, rad/s."""
    return _rates(vehicle, mixer, parts, command[0], Vec3(*command[1:]))


def attitude_law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
    """Command: collective thrust over mass, m/s^2; roll, pitch, yaw, rad (R = Rz Ry Rx)."""
    thrust, roll, pitch, yaw = command
    return _attitude(vehicle, mixer, parts, thrust, euler_components(roll, pitch, yaw))


def acceleration_law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
    """Command: acceleration in the world, m/s^2, and yaw, rad."""
    return _accelerate(vehicle, mixer, parts, Vec3(*command[:3]), command[3])


def velocity_law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
    """Command: velocity in the world, m/s, and yaw, rad."""
    return _velocity(vehicle, mixer, parts, Vec3(*command[:3]), command[3])


def position_law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
    """Command: position in the world, m, and yaw, rad."""
    error = Vec3(*command[:3]) - parts.position
    wanted = error.times(Vec3.of(vehicle.position_gain)).clip(Vec3.of(vehicle.speed_max))
    return _velocity(vehicle, mixer, parts, wanted, command[3])


def _velocity(vehicle: Vehicle, mixer: Mixer, parts: Parts, wanted: Vec3, yaw: Array) -> Rotors:
    error = wanted - parts.velocity
    return _accelerate(vehicle, mixer, parts, error.times(Vec3.of(vehicle.velocity_gain)), yaw)


def _accelerate(vehicle: Vehicle, mixer: Mixer, parts: Parts, wanted: Vec3, yaw: Array) -> Rotors:
    """Point the thrust along the wanted acceleration less gravity, within the tilt limit."""
    wanted = wanted.clip(Vec3.of(vehicle.acceleration_max))
    up = jnp.maximum(wanted.z + GRAVITY, 0.1 * GRAVITY)  # the rotors push up: a steeper fall is not commanded
    level = safe_sqrt(wanted.x**2 + wanted.y**2)
    reach = up * jnp.tan(vehicle.tilt_max)
    shrink = reach / jnp.maximum(level, reach)
    force = Vec3(wanted.x * shrink, wanted.y * shrink, up)
    thrust = force.norm()
    axis = force * (1 / thrust)
    # shortest turn from up to the axis, after a turn by yaw about up: singular only upside down, out of reach here
    half = jnp.sqrt((1 + axis.z) / 2)
    tilt = Quat(half, -axis.y / (2 * half), axis.x / (2 * half), jnp.zeros_like(half))
    zero = jnp.zeros_like(half)
    attitude = tilt.compose(Quat(jnp.cos(yaw / 2), zero, zero, jnp.sin(yaw / 2)))
    along = parts.attitude.z_axis().dot(force)  # thrust for the acceleration along the axis as it is now
    return _attitude(vehicle, mixer, parts, jnp.maximum(along, 0.0), attitude)


def _attitude(vehicle: Vehicle, mixer: Mixer, parts: Parts, thrust: Array, wanted: Quat) -> Rotors:
    """Tilt-prioritised law (Brescianini and D'Andrea, Tilt-prioritized quadrocopter attitude control, 2018)."""
    e = parts.attitude.conjugate().compose(wanted)
    n = jnp.sqrt(e.w**2 + e.z**2 + 1e-12)
    sign = jnp.where(e.w >= 0, 1.0, -1.0)
    tilt, yaw = 2 * vehicle.attitude_gain[..., 0] / n, 2 * vehicle.attitude_gain[..., 1] / n
    rate = Vec3(tilt * (e.w * e.x - e.y * e.z), tilt * (e.w * e.y + e.x * e.z), yaw * sign * e.z)
    return _rates(vehicle, mixer, parts, thrust, rate)


def _rates(vehicle: Vehicle, mixer: Mixer, parts: Parts, thrust: Array, wanted: Vec3) -> Rotors:
    """The rate loop: torque = J K (wanted - w) + w x J w."""
    wanted = wanted.clip(Vec3.of(vehicle.body_rate_max))
    stiffness = Vec3.of(vehicle.inertia * vehicle.rate_gain)
    torque = stiffness.times(wanted - parts.body_rate) + gyroscopic_torque(vehicle, parts.body_rate)
    return rotor_speed_for(vehicle, mixer.thrusts(vehicle.mass * thrust, torque))


@dataclass(frozen=True)
class CommandMode:
    """A command mode: its law, and what its four numbers are."""

    name: str
    law: Law
    fields: tuple[str, str, str, str]
    units: tuple[str, str, str, str]
    limits: Callable[[Vehicle, float], tuple[list[float], list[float]]]
    """(nominal vehicle, position range in m) -> smallest and largest command."""


def _symmetric(*limit: float) -> tuple[list[float], list[float]]:
    return [-float(x) for x in limit], [float(x) for x in limit]


def _collective_max(vehicle: Vehicle) -> float:
    return 4 * vehicle.thrust_range[1] / vehicle.mass


def _ctbr_limits(vehicle: Vehicle, _: float) -> tuple[list[float], list[float]]:
    low, high = _symmetric(*vehicle.body_rate_max)
    return [0.0, *low], [_collective_max(vehicle), *high]


def _attitude_limits(vehicle: Vehicle, _: float) -> tuple[list[float], list[float]]:
    low, high = _symmetric(vehicle.tilt_max, vehicle.tilt_max, np.pi)
    return [0.0, *low], [_collective_max(vehicle), *high]


COMMAND_MODES: dict[str, CommandMode] = {
    mode.name: mode
    for mode in (
        CommandMode(
            "rotor_thrust",
            rotor_thrust_law,
            ("rear_right", "front_right", "rear_left", "front_left"),
            ("N", "N", "N", "N"),
            lambda v, _: ([v.thrust_range[0]] * 4, [v.thrust_range[1]] * 4),
        ),
        CommandMode(
            "ctbr",
            ctbr_law,
            ("collective_thrust", "roll_rate", "pitch_rate", "yaw_rate"),
            ("m/s^2", "rad/s", "rad/s", "rad/s"),
            _ctbr_limits,
        ),
        CommandMode(
            "attitude",
            attitude_law,
            ("collective_thrust", "roll", "pitch", "yaw"),
            ("m/s^2", "rad", "rad", "rad"),
            _attitude_limits,
        ),
        CommandMode(
            "acceleration",
            acceleration_law,
            ("x", "y", "z", "yaw"),
            ("m/s^2", "m/s^2", "m/s^2", "rad"),
            lambda v, _: _symmetric(*v.acceleration_max, np.pi),
        ),
        CommandMode(
            "velocity",
            velocity_law,
            ("x", "y", "z", "yaw"),
            ("m/s", "m/s", "m/s", "rad"),
            lambda v, _: _symmetric(*v.speed_max, np.pi),
        ),
        CommandMode(
            "position",
            position_law,
            ("x", "y", "z", "yaw"),
            ("m", "m", "m", "rad"),
            lambda _, reach: _symmetric(reach, reach, reach, np.pi),
        ),
    )
}
"""Command modes by name."""


def command_limits(mode: CommandMode, vehicle: Vehicle, position_range: float = 5.0) -> np.ndarray:
    """Smallest and largest command, (2, 4), of the nominal (loaded) vehicle."""
    return np.asarray(mode.limits(vehicle, position_range), np.float64)
