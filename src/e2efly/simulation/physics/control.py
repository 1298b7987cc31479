"""From a command to rotor speed commands: the control law of each command mode.

A command enters the cascade at its own level (`e2efly.control`). Every level below it runs at every physics sub-step,
down to rotor thrusts and speeds. All laws use the nominal vehicle: the flight controller does not know what was
randomised.
"""

from collections.abc import Callable

import jax.numpy as jnp
from jax import Array

from e2efly.control import CommandMode, Ctbr, Vec3
from e2efly.simulation.physics.airframe import Rotors
from e2efly.simulation.physics.body import gyroscopic_torque, rotor_speed_for, tensor_times
from e2efly.simulation.physics.mixer import Mixer
from e2efly.simulation.physics.state import Parts, RateLoop
from e2efly.vehicles.vehicle import Vehicle

Command = tuple[Array, Array, Array, Array]
Law = Callable[[Vehicle, Mixer, Parts, Command], Rotors]
"""(nominal vehicle, its mixer, state, command) -> rotor speed commands, rad/s."""
RememberingLaw = Callable[[Vehicle, Mixer, Parts, Command, RateLoop, float], tuple[Rotors, RateLoop]]
"""The same, with the state of the rate loop, split into components, and the time since the loop last ran, s."""


def control_law(mode: CommandMode) -> Law:
    """The control law of a command mode: rotor thrusts within their limits, or body rates held by the rate loop."""
    controller = mode.controller

    def law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command) -> Rotors:
        if controller is None:
            if mode.of_largest:
                a, b, c, d = (share * mixer.thrust_max for share in command)
                command = a, b, c, d
            return rotor_speed_for(vehicle, mixer.limit(command))
        return _rates(vehicle, mixer, parts.body_rate, controller(vehicle, parts, command))

    return law


def remembering_law(mode: CommandMode) -> RememberingLaw:
    """The control law of a command mode whose rate loop has an integral part, a filter of the body rates, or both."""
    controller = mode.controller
    assert controller is not None, "no rate loop"

    def law(
        vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command, loop: RateLoop, dt: float
    ) -> tuple[Rotors, RateLoop]:
        wanted, rate, extra = controller(vehicle, parts, command), parts.body_rate, None
        if loop.seen is not None:
            rate = rate + (loop.seen - rate) * jnp.exp(-dt / vehicle.gyro_time_constant)
        if loop.integral is not None:
            change = Vec3.of(vehicle.rate_integral_gain).times(wanted.rate - rate) * dt
            # limited to the proportional part at an error of `body_rate_max`, so that it does not wind up when rotors
            # saturate
            extra = (loop.integral + change).clip(Vec3.of(vehicle.rate_gain * vehicle.body_rate_max))
        rotors = _rates(vehicle, mixer, rate, wanted, extra)
        return rotors, RateLoop(extra, None if loop.seen is None else rate)

    return law


def _rates(vehicle: Vehicle, mixer: Mixer, rate: Vec3, wanted: Ctbr, extra: Vec3 | None = None) -> Rotors:
    """The rate loop at body rates w: torque = J (K (wanted - w) + extra) + w x J w.

    Units: rad/s, `extra` in rad/s^2.
    """
    error, inertia = wanted.rate - rate, Vec3.of(vehicle.inertia)
    if vehicle.inertia_products is None:
        pushed, products = Vec3.of(vehicle.inertia * vehicle.rate_gain).times(error), None
    else:
        products = Vec3.of(vehicle.inertia_products)
        pushed = tensor_times(inertia, products, Vec3.of(vehicle.rate_gain).times(error))
    torque = pushed + gyroscopic_torque(inertia, rate, products)
    if extra is not None:
        torque = torque + tensor_times(inertia, products, extra)
    return rotor_speed_for(vehicle, mixer.thrusts(vehicle.mass * wanted.thrust, torque))
