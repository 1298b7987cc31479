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
from e2efly.control.modes import COMMANDS
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


def rotor_share_law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
    """Command: thrust of each rotor as a share of its largest."""
    a, b, c, d = (share * mixer.thrust_max for share in command)
    return rotor_thrust_law(vehicle, mixer, parts, (a, b, c, d))


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
    limits: Callable[[Vehicle, float], tuple[list[float], list[float]]]
    """(nominal vehicle, position range in m) -> smallest and largest command."""

    @property
    def fields(self) -> tuple[str, ...]:
        """Names of the four numbers."""
        return COMMANDS[self.name][0]

    @property
    def units(self) -> tuple[str, ...]:
        """Their units."""
        return COMMANDS[self.name][1]


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


_LIMITS: dict[str, Callable[[Vehicle, float], tuple[list[float], list[float]]]] = {
    "rotor_thrust": lambda v, _: ([v.thrust_range[0]] * 4, [v.thrust_range[1]] * 4),
    "rotor_share": lambda v, _: ([0.0] * 4, [1.0] * 4),
    "ctbr": _ctbr_limits,
    "attitude": _attitude_limits,
    "acceleration": lambda v, _: _symmetric(*v.acceleration_max, np.pi),
    "velocity": lambda v, _: _symmetric(*v.speed_max, np.pi),
    "position": lambda _, reach: _symmetric(reach, reach, reach, np.pi),
}

_OF_ROTORS = {"rotor_thrust": rotor_thrust_law, "rotor_share": rotor_share_law}
COMMAND_MODES: dict[str, CommandMode] = {
    name: CommandMode(name, _OF_ROTORS.get(name) or _law(name), limits) for name, limits in _LIMITS.items()
}
"""Command modes by name."""


def command_limits(mode: CommandMode, vehicle: Vehicle, position_range: float = 5.0) -> np.ndarray:
    """Smallest and largest command, (2, 4), of the nominal (loaded) vehicle."""
    return np.asarray(mode.limits(vehicle, position_range), np.float64)
