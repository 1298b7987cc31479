"""Command modes: from a command of four numbers to rotor speed commands, by one cascade.

position + yaw -> ... -> collective thrust and body rates (`e2efly.control`) -> rotor thrusts -> rotor speeds. A mode
enters the cascade at its own level; every level below runs at every physics sub-step. All laws use the nominal
vehicle: the flight controller does not know what was randomised.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jax import Array

from e2efly.control import CASCADE, Ctbr, Vec3
from e2efly.physics.body import gyroscopic_torque, rotor_speed_for
from e2efly.physics.mixer import Mixer
from e2efly.physics.plant import Rotors
from e2efly.physics.state import Parts
from e2efly.vehicles.vehicle import Vehicle

Command = tuple[Array, Array, Array, Array]
Law = Callable[[Vehicle, Mixer, Parts, Command], Rotors]
"""(nominal vehicle, its mixer, state, command) -> rotor speed commands, rad/s."""


def rotor_thrust_law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
    """Command: thrust of each rotor, N."""
    del parts
    return rotor_speed_for(vehicle, mixer.limit(command))


def _law(name: str) -> Law:
    """The law of a controller of the cascade: its body rates held by the rate loop."""
    controller = CASCADE[name]

    def law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
        return _rates(vehicle, mixer, parts, controller(vehicle, parts, command))

    return law


def _rates(vehicle: Vehicle, mixer: Mixer, parts: Parts, wanted: Ctbr) -> Rotors:
    """The rate loop: torque = J K (wanted - w) + w x J w."""
    stiffness = Vec3.of(vehicle.inertia * vehicle.rate_gain)
    held = gyroscopic_torque(Vec3.of(vehicle.inertia), parts.body_rate)
    torque = stiffness.times(wanted.rate - parts.body_rate) + held
    return rotor_speed_for(vehicle, mixer.thrusts(vehicle.mass * wanted.thrust, torque))


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
            _law("ctbr"),
            ("collective_thrust", "roll_rate", "pitch_rate", "yaw_rate"),
            ("m/s^2", "rad/s", "rad/s", "rad/s"),
            _ctbr_limits,
        ),
        CommandMode(
            "attitude",
            _law("attitude"),
            ("collective_thrust", "roll", "pitch", "yaw"),
            ("m/s^2", "rad", "rad", "rad"),
            _attitude_limits,
        ),
        CommandMode(
            "acceleration",
            _law("acceleration"),
            ("x", "y", "z", "yaw"),
            ("m/s^2", "m/s^2", "m/s^2", "rad"),
            lambda v, _: _symmetric(*v.acceleration_max, np.pi),
        ),
        CommandMode(
            "velocity",
            _law("velocity"),
            ("x", "y", "z", "yaw"),
            ("m/s", "m/s", "m/s", "rad"),
            lambda v, _: _symmetric(*v.speed_max, np.pi),
        ),
        CommandMode(
            "position",
            _law("position"),
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
