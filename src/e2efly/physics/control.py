"""From a command to rotor speed commands: the law of each command mode.

A command enters the cascade at its own level (`e2efly.control`); every level below runs at every physics sub-step, down
to rotor thrusts and speeds. All laws use the nominal vehicle: the flight controller does not know what was randomised.
"""

from collections.abc import Callable

from jax import Array

from e2efly.control import CommandMode, Ctbr, Vec3
from e2efly.physics.body import gyroscopic_torque, rotor_speed_for, tensor_times
from e2efly.physics.mixer import Mixer
from e2efly.physics.plant import Rotors
from e2efly.physics.state import Parts
from e2efly.vehicles.vehicle import Vehicle

Command = tuple[Array, Array, Array, Array]
Law = Callable[[Vehicle, Mixer, Parts, Command], Rotors]
"""(nominal vehicle, its mixer, state, command) -> rotor speed commands, rad/s."""


def control_law(mode: CommandMode) -> Law:
    """The law of a command mode: rotor thrusts within their limits, or body rates held by the rate loop."""
    controller = mode.controller

    def law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
        if controller is None:
            if mode.of_largest:
                a, b, c, d = (share * mixer.thrust_max for share in command)
                command = a, b, c, d
            return rotor_speed_for(vehicle, mixer.limit(command))
        return _rates(vehicle, mixer, parts, controller(vehicle, parts, command))

    return law


def _rates(vehicle: Vehicle, mixer: Mixer, parts: Parts, wanted: Ctbr) -> Rotors:
    """The rate loop: torque = J K (wanted - w) + w x J w."""
    error, inertia = wanted.rate - parts.body_rate, Vec3.of(vehicle.inertia)
    if vehicle.inertia_products is None:
        pushed, products = Vec3.of(vehicle.inertia * vehicle.rate_gain).times(error), None
    else:
        products = Vec3.of(vehicle.inertia_products)
        pushed = tensor_times(inertia, products, Vec3.of(vehicle.rate_gain).times(error))
    torque = pushed + gyroscopic_torque(inertia, parts.body_rate, products)
    return rotor_speed_for(vehicle, mixer.thrusts(vehicle.mass * wanted.thrust, torque))
