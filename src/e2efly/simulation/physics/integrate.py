"""Integrators of one sub-step. The motor lag is exact in each; the rigid body is advanced by the named method."""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.control.vectors import Vec3
from e2efly.simulation.physics.airframe import Airframe, Rotors
from e2efly.simulation.physics.body import accelerations, derivative, pulled
from e2efly.simulation.physics.cable import Hanging
from e2efly.simulation.physics.state import Parts

Integrator = Callable[[Airframe, Parts, Rotors, Vec3 | None, float], Parts]
"""(plant, state, rotor speed commands, wind, step in s) -> state one step later."""

HOLD = 0.00025
"""Time for which a flight controller holds its rotor commands, s: its rate loop runs at 4 kHz."""


def lagged(
    speed: Rotors, command: Rotors, decay: Array | np.ndarray, decay_down: Array | np.ndarray | None = None
) -> Rotors:
    """Rotor speeds after some time of first-order lag towards a constant command: the exact solution, rad/s.

    `decay` is the fraction of the difference to the command that remains after that time. For a rotor that slows down,
    it is `decay_down`, unless that is None.
    """
    if decay_down is None:
        return tuple(u + (w - u) * decay for w, u in zip(speed, command, strict=True))
    return tuple(u + (w - u) * jnp.where(u < w, decay_down, decay) for w, u in zip(speed, command, strict=True))


def ahead(plant: Airframe, parts: Parts, wind: Vec3 | None, dt: float) -> tuple[Parts, float]:
    """The state at which the flight controller computes the rotor commands of a step, and its time in the step, s.

    Held over the whole step, commands of the state in the middle act as the rate loop does that runs along the
    differential equation, to second order. The middle is predicted by the derivative at the start, which the methods
    of higher order need anyway. A loop that runs every `HOLD` is half of that behind.
    """
    time = (dt - min(HOLD, dt)) / 2
    moved = _advance(parts, derivative(plant, parts, wind), time)
    return _finish(moved, parts.rotor_speed), time


def euler(plant: Airframe, parts: Parts, command: Rotors, wind: Vec3 | None, dt: float) -> Parts:
    """Explicit Euler: all derivatives at the start of the step. First order."""
    speed = lagged(parts.rotor_speed, command, plant.decay, plant.decay_down)
    moved = _advance(parts, derivative(plant, parts, wind, _mean_change(plant, parts.rotor_speed, speed, dt)), dt)
    return _finish(moved, speed)


def semi_implicit(plant: Airframe, parts: Parts, command: Rotors, wind: Vec3 | None, dt: float) -> Parts:
    """Semi-implicit (symplectic) Euler: first the velocities, then poses from the new velocities.

    First order, most stable.
    """
    speed = lagged(parts.rotor_speed, command, plant.decay, plant.decay_down)
    turning = dataclasses.replace(parts, rotor_speed=speed)
    pull = pulled(plant, turning)
    linear, angular = accelerations(plant, turning, wind, _mean_change(plant, parts.rotor_speed, speed, dt), pull)
    load = parts.load
    if plant.cable is not None and load is not None and pull is not None:
        falls = load.velocity + plant.cable.falling(pull) * dt
        load = Hanging(load.position + falls * dt, falls)
    velocity = parts.velocity + linear * dt
    body_rate = parts.body_rate + angular * dt
    return Parts(
        position=parts.position + velocity * dt,
        velocity=velocity,
        attitude=(parts.attitude + parts.attitude.derivative(body_rate) * dt).normalized(),
        body_rate=body_rate,
        rotor_speed=speed,
        load=load,
    )


def rk3(plant: Airframe, parts: Parts, command: Rotors, wind: Vec3 | None, dt: float) -> Parts:
    """Kutta's method with the exact rotor speeds at the start, middle and end of the step. Third order.

    Source: W. Kutta, "Beitrag zur naeherungsweisen Integration totaler Differentialgleichungen", 1901.
    """
    middle = lagged(parts.rotor_speed, command, plant.half_decay, plant.half_decay_down)
    end = lagged(middle, command, plant.half_decay, plant.half_decay_down)
    k1 = _rate(plant, parts, parts.rotor_speed, command, wind)
    k2 = _rate(plant, _advance(parts, k1, dt / 2), middle, command, wind)
    last = jax.tree.map(lambda x, a, b: x + (2 * b - a) * dt, parts, k1, k2)
    k3 = _rate(plant, last, end, command, wind)
    mean = jax.tree.map(lambda a, b, c: (a + 4 * b + c) / 6, k1, k2, k3)
    return _finish(_advance(parts, mean, dt), end)


def rk4(plant: Airframe, parts: Parts, command: Rotors, wind: Vec3 | None, dt: float) -> Parts:
    """Classical Runge-Kutta method with the exact rotor speeds at the start, middle and end of the step.

    Fourth order.
    """
    middle = lagged(parts.rotor_speed, command, plant.half_decay, plant.half_decay_down)
    end = lagged(middle, command, plant.half_decay, plant.half_decay_down)

    k1 = _rate(plant, parts, parts.rotor_speed, command, wind)
    k2 = _rate(plant, _advance(parts, k1, dt / 2), middle, command, wind)
    k3 = _rate(plant, _advance(parts, k2, dt / 2), middle, command, wind)
    k4 = _rate(plant, _advance(parts, k3, dt), end, command, wind)
    mean = jax.tree.map(lambda a, b, c, d: (a + 2 * b + 2 * c + d) / 6, k1, k2, k3, k4)
    return _finish(_advance(parts, mean, dt), end)


def _rate(plant: Airframe, parts: Parts, rotor_speed: Rotors, command: Rotors, wind: Vec3 | None) -> Parts:
    change = None
    if plant.rotor_inertia is not None and plant.lag_rate is not None:
        up, down = plant.lag_rate, plant.lag_rate_down
        rates = (up if down is None else jnp.where(u < w, down, up) for w, u in zip(rotor_speed, command, strict=True))
        change = tuple((u - w) * rate for w, u, rate in zip(rotor_speed, command, rates, strict=True))
    return derivative(plant, dataclasses.replace(parts, rotor_speed=rotor_speed), wind, change)


def _mean_change(plant: Airframe, before: Rotors, after: Rotors, dt: float) -> Rotors | None:
    """Mean acceleration of the rotors over a step, rad/s^2, where the plant needs it.

    It gives the exact change of momentum.
    """
    if plant.rotor_inertia is None:
        return None
    return tuple((end - start) / dt for start, end in zip(before, after, strict=True))


def _advance(parts: Parts, rate: Parts, dt: float) -> Parts:
    return jax.tree.map(lambda x, dx: x + dx * dt, parts, rate)


def _finish(parts: Parts, rotor_speed: Rotors) -> Parts:
    return dataclasses.replace(parts, attitude=parts.attitude.normalized(), rotor_speed=rotor_speed)


INTEGRATORS: dict[str, Integrator] = {"euler": euler, "semi_implicit": semi_implicit, "rk3": rk3, "rk4": rk4}
"""Integrators by name."""
SWINGING = tuple(name for name in INTEGRATORS if name != "euler")
"""Integrators with which a load may hang from the vehicle: explicit Euler adds energy to its swing."""
