"""Command modes: the meaning and limits of the numbers of a command, and how they become CTBR. Imports no JAX.

A mode is one entry of `COMMAND_MODES`. Simulator, contract, bridge and other plants use only this entry.
"""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from e2efly.control.cascade import Command, Controller, Ctbr, Motion, accelerate, limited, reach, turn
from e2efly.control.vectors import Quat, Vec3
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

Limits = tuple[list[float], list[float]]
ROTORS = ("rear_right", "front_right", "rear_left", "front_left")
"""Names of a quadrotor's rotors, in their order."""
THRUST, RATES = "collective_thrust", ("rad/s", "rad/s", "rad/s")


@dataclass(frozen=True)
class CommandMode:
    """A command mode."""

    name: str
    fields: tuple[str, ...]
    """Names of the four numbers. In the modes of rotor thrusts, those of a quadrotor: see `of`."""
    units: tuple[str, ...]
    """Their units."""
    limits: Callable[[Vehicle, float], Limits]
    """(nominal vehicle, range of positions in m) -> smallest and largest command."""
    controller: Controller | None
    """Controller that makes CTBR of a command. None: the command is the rotor thrusts, below the flight controller's
    rate loop."""
    hover: Callable[[Vehicle], tuple[float, ...]] = lambda vehicle: (0.0, 0.0, 0.0, 0.0)
    """The command that makes a level vehicle hover, if the mode has one."""
    fixed: tuple[str, ...] = ("origin_yaw",)
    """Options of a goal that would move the world under the command. They concern the world axes, which no policy
    observes."""
    of_largest: Literal["thrust", "speed"] | None = None
    """What the commands of the rotors are shares of: of the largest thrust, or of the rotor speed that gives it. None:
    they are thrusts in N."""

    def of(self, rotor_count: int) -> "CommandMode":
        """The mode for vehicles with this number of rotors: only modes of rotor thrusts depend on it."""
        if self.controller is not None:
            return self
        return dataclasses.replace(self, fields=rotor_names(rotor_count), units=self.units[:1] * rotor_count)


def ctbr(vehicle: Vehicle, motion: Motion, command: Command) -> Ctbr:
    """Command: collective thrust over mass, m/s^2, and body rates, rad/s."""
    del motion
    return limited(vehicle, command[0], Vec3(*command[1:]))


def attitude(vehicle: Vehicle, motion: Motion, command: Command) -> Ctbr:
    """Command: collective thrust over mass, m/s^2; roll, pitch, yaw, rad (R = Rz Ry Rx)."""
    thrust, roll, pitch, yaw = command
    return turn(vehicle, motion, thrust, Quat.of_euler(roll, pitch, yaw))


def acceleration(vehicle: Vehicle, motion: Motion, command: Command) -> Ctbr:
    """Command: acceleration in the world, m/s^2, and yaw, rad."""
    return accelerate(vehicle, motion, Vec3(*command[:3]), command[3])


def velocity(vehicle: Vehicle, motion: Motion, command: Command) -> Ctbr:
    """Command: velocity in the world, m/s, and yaw, rad."""
    return reach(vehicle, motion, Vec3(*command[:3]), command[3])


def position(vehicle: Vehicle, motion: Motion, command: Command) -> Ctbr:
    """Command: position in the world, m, and yaw, rad."""
    error = Vec3(*command[:3]) - motion.position
    wanted = error.times(Vec3.of(vehicle.position_gain)).clip(Vec3.of(vehicle.speed_max))
    return reach(vehicle, motion, wanted, command[3])


def rotor_names(count: int) -> tuple[str, ...]:
    """Names of the rotors of a vehicle, in their order."""
    return ROTORS if count == len(ROTORS) else tuple(f"rotor_{i}" for i in range(count))


def _symmetric(*limits: float) -> Limits:
    return [-float(x) for x in limits], [float(x) for x in limits]


def _rotors(vehicle: Vehicle, _: float) -> Limits:
    low, high = vehicle.thrust_range
    return [low] * vehicle.rotor_count, [high] * vehicle.rotor_count


def _with_thrust(vehicle: Vehicle, *limits: float) -> Limits:
    """Limits of a collective thrust, which is never negative, and of three other numbers."""
    low, high = _symmetric(*limits)
    return [0.0, *low], [vehicle.lift * vehicle.thrust_range[1] / vehicle.mass, *high]


def _each(vehicle: Vehicle, x: float) -> tuple[float, ...]:
    return (x,) * vehicle.rotor_count


COMMAND_MODES: dict[str, CommandMode] = {
    mode.name: mode
    for mode in (
        CommandMode(
            "rotor_thrust", ROTORS, ("N", "N", "N", "N"), _rotors, None,
            hover=lambda v: _each(v, v.mass * GRAVITY / v.lift),
        ),
        CommandMode(
            "rotor_share", ROTORS, ("1", "1", "1", "1"), lambda v, _: (list(_each(v, 0.0)), list(_each(v, 1.0))), None,
            hover=lambda v: _each(v, 1 / v.thrust_to_weight), of_largest="thrust",
        ),
        CommandMode(
            "rotor_speed", ROTORS, ("1", "1", "1", "1"), lambda v, _: (list(_each(v, 0.0)), list(_each(v, 1.0))), None,
            hover=lambda v: _each(v, v.hover_rotor_speed / v.full_rotor_speed), of_largest="speed",
        ),
        CommandMode(
            "ctbr", (THRUST, "roll_rate", "pitch_rate", "yaw_rate"), ("m/s^2", *RATES),
            lambda v, _: _with_thrust(v, *v.body_rate_max), ctbr, lambda v: (GRAVITY, 0.0, 0.0, 0.0), fixed=(),
        ),
        CommandMode(
            "attitude", (THRUST, "roll", "pitch", "yaw"), ("m/s^2", "rad", "rad", "rad"),
            lambda v, _: _with_thrust(v, v.tilt_max, v.tilt_max, np.pi), attitude, lambda v: (GRAVITY, 0.0, 0.0, 0.0),
        ),
        CommandMode(
            "acceleration", ("x", "y", "z", "yaw"), ("m/s^2", "m/s^2", "m/s^2", "rad"),
            lambda v, _: _symmetric(*v.acceleration_max, np.pi), acceleration,
        ),
        CommandMode(
            "velocity", ("x", "y", "z", "yaw"), ("m/s", "m/s", "m/s", "rad"),
            lambda v, _: _symmetric(*v.speed_max, np.pi), velocity,
        ),
        CommandMode(
            "position", ("x", "y", "z", "yaw"), ("m", "m", "m", "rad"),
            lambda _, reach: _symmetric(reach, reach, reach, np.pi), position,
            fixed=("origin", "origin_yaw", "pad", "target", "centre"),
        ),
    )
}  # fmt: skip
"""Command modes by name."""


def command_limits(mode: CommandMode, vehicle: Vehicle, position_range: float = 5.0) -> np.ndarray:
    """Smallest and largest command, (2, 4) or one for each rotor, (2, N), for the nominal (loaded) vehicle."""
    return np.asarray(mode.limits(vehicle, position_range), np.float64)
