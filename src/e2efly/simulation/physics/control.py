"""From a command to rotor speed commands: the control law of each command mode.

A command enters the cascade at its own level (`e2efly.control`). Every level below it runs along the differential
equation, down to rotor thrusts and speeds: `integrate.ahead` says at which state. All laws use the nominal vehicle:
the flight controller does not know what was randomised.
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

Command = tuple[Array, ...]
"""Four numbers, or one for each rotor in the modes of rotor thrusts."""
Law = Callable[[Vehicle, Mixer, Parts, Command, RateLoop | None], Rotors]
"""(nominal vehicle, its mixer, state, command, memory of the rate loop) -> rotor speed commands, rad/s."""


def control_law(mode: CommandMode) -> Law:
    """The control law of a command mode: rotors within their limits, or body rates held by the rate loop."""
    controller = mode.controller

    def law(vehicle: Vehicle, mixer: Mixer, parts: Parts, command: Command, memory: RateLoop | None = None) -> Rotors:
        if controller is None:
            if mode.of_largest == "speed":
                low, high = rotor_speed_for(vehicle, (jnp.asarray(mixer.thrust_min), jnp.asarray(mixer.thrust_max)))
                return tuple(jnp.clip(share * high, low, high) for share in command)
            if mode.of_largest == "thrust":
                command = tuple(share * mixer.thrust_max for share in command)
            return rotor_speed_for(vehicle, mixer.limit(command))
        return _rates(vehicle, mixer, parts.body_rate, controller(vehicle, parts, _four(command)), memory)

    return law


def remembered(
    mode: CommandMode, vehicle: Vehicle, memory: RateLoop, begin: Parts, now: Parts, command: Command, time: float
) -> RateLoop:
    """What the rate loop remembers at a state that is reached `time` seconds after `begin`, where it was `memory`.

    The body rates in between are those of a constant acceleration. With T s' = w - s for the filtered rates s, their
    integral is that of the true rates w, minus T times the change of s.
    """
    assert mode.controller is not None, "no rate loop"
    mean, seen, integral = (begin.body_rate + now.body_rate) * 0.5, None, None
    turned = mean * time
    if memory.seen is not None:
        lag = vehicle.gyro_time_constant
        left, half = jnp.exp(-time / lag), jnp.exp(-0.5 * time / lag)
        followed = begin.body_rate + (now.body_rate - begin.body_rate) * ((2 * half + 1) / (left + 4 * half + 1))
        seen = followed + (memory.seen - followed) * left
        turned = turned - (seen - memory.seen) * lag
    if memory.integral is not None:
        wanted = (
            mode.controller(vehicle, begin, _four(command)).rate + mode.controller(vehicle, now, _four(command)).rate
        ) * 0.5
        # limited to the proportional part at an error of `body_rate_max`, so that it does not wind up when rotors
        # saturate
        most = Vec3.of(vehicle.rate_gain * vehicle.body_rate_max)
        integral = (memory.integral + Vec3.of(vehicle.rate_integral_gain).times(wanted * time - turned)).clip(most)
    return RateLoop(integral, seen)


def _four(command: Command) -> tuple[Array, Array, Array, Array]:
    a, b, c, d = command
    return a, b, c, d


def _rates(vehicle: Vehicle, mixer: Mixer, rate: Vec3, wanted: Ctbr, memory: RateLoop | None) -> Rotors:
    """The rate loop: torque = J (K (wanted - w) + I) + w x J w, at the body rates w, rad/s.

    A loop with a filter has filtered rates in their place. I is its integral part, rad/s^2.
    """
    extra = None if memory is None else memory.integral
    if memory is not None and memory.seen is not None:
        rate = memory.seen
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
