"""Integrators of one sub-step. The motor lag is exact in each; the rigid body is advanced by the named method.

The rotor commands follow from the state. A method asks for them at each of its stages, and lets the rotors follow a
mean that gives the lag of commands that change. Commands that do not change give the exact lag.
"""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from e2efly.control.vectors import Vec3
from e2efly.simulation.physics.airframe import Airframe, Rotors
from e2efly.simulation.physics.body import accelerations, derivative, reached
from e2efly.simulation.physics.state import Parts

Drive = Callable[[Parts, float], Rotors]
"""(state at a stage, its time after the start of the step in s) -> rotor speed commands, rad/s."""
Integrator = Callable[[Airframe, Parts, Drive, Vec3 | None, float], Parts]
"""(plant, state, rotor speed commands, wind, step in s) -> state one step later."""
HOLD = 0.00025
"""Time for which a flight controller holds its rotor commands, s: its rate loop runs at 4 kHz. Commands that change
within a step act half of that later, or half of the step where that is less."""


def lagged(
    speed: Rotors, command: Rotors, decay: Array | np.ndarray, decay_down: Array | np.ndarray | None = None
) -> Rotors:
    """Rotor speeds after some time of first-order lag towards a constant command: the exact solution, rad/s.

    `decay` is the fraction of the difference to the command that remains after that time. For a rotor that slows down,
    it is `decay_down`, unless that is None.
    """
    if decay_down is None:
        a, b, c, d = (u + (w - u) * decay for w, u in zip(speed, command, strict=True))
    else:
        a, b, c, d = (u + (w - u) * jnp.where(u < w, decay_down, decay) for w, u in zip(speed, command, strict=True))
    return a, b, c, d


def euler(plant: Airframe, parts: Parts, drive: Drive, wind: Vec3 | None, dt: float) -> Parts:
    """Explicit Euler: all derivatives and the rotor commands at the start of the step. First order."""
    speed = lagged(parts.rotor_speed, _told(plant, drive, parts), plant.decay, plant.decay_down)
    moved = _advance(parts, derivative(plant, parts, wind, _mean_change(plant, parts.rotor_speed, speed, dt)), dt)
    return _finish(moved, speed)


def semi_implicit(plant: Airframe, parts: Parts, drive: Drive, wind: Vec3 | None, dt: float) -> Parts:
    """Semi-implicit (symplectic) Euler: first the velocities, then poses from the new velocities.

    First order, most stable. The rotor commands are those at the start of the step.
    """
    speed = lagged(parts.rotor_speed, _told(plant, drive, parts), plant.decay, plant.decay_down)
    turning = dataclasses.replace(parts, rotor_speed=speed)
    linear, angular = accelerations(plant, turning, wind, _mean_change(plant, parts.rotor_speed, speed, dt))
    velocity = parts.velocity + linear * dt
    body_rate = parts.body_rate + angular * dt
    return Parts(
        position=parts.position + velocity * dt,
        velocity=velocity,
        attitude=(parts.attitude + parts.attitude.derivative(body_rate) * dt).normalized(),
        body_rate=body_rate,
        rotor_speed=speed,
    )


def rk3(plant: Airframe, parts: Parts, drive: Drive, wind: Vec3 | None, dt: float) -> Parts:
    """Kutta's method with the rotor speeds at the start, middle and end of the step. Third order.

    Source: W. Kutta, "Beitrag zur naeherungsweisen Integration totaler Differentialgleichungen", 1901.
    """
    told = _told(plant, drive, parts)
    k1 = _rate(plant, parts, told, wind)
    half = _half(plant, parts, drive, told, _advance(parts, k1, dt / 2), dt)
    k2 = _rate(plant, *half, wind)
    last = jax.tree.map(lambda x, a, b: x + (2 * b - a) * dt, parts, k1, k2)
    end = _end(plant, parts, drive, (told, half[1], half[1]), last, dt)
    k3 = _rate(plant, *end, wind)
    mean = jax.tree.map(lambda a, b, c: (a + 4 * b + c) / 6, k1, k2, k3)
    return _finish(_advance(parts, mean, dt), end[0].rotor_speed)


def rk4(plant: Airframe, parts: Parts, drive: Drive, wind: Vec3 | None, dt: float) -> Parts:
    """Classical Runge-Kutta method with the rotor speeds at the start, middle and end of the step.

    Fourth order; third where the rotor commands change within a step.
    """
    told = _told(plant, drive, parts)
    k1 = _rate(plant, parts, told, wind)
    half = _half(plant, parts, drive, told, _advance(parts, k1, dt / 2), dt)
    k2 = _rate(plant, *half, wind)
    again = _half(plant, parts, drive, told, _advance(parts, k2, dt / 2), dt)
    k3 = _rate(plant, *again, wind)
    end = _end(plant, parts, drive, (told, half[1], again[1]), _advance(parts, k3, dt), dt)
    k4 = _rate(plant, *end, wind)
    mean = jax.tree.map(lambda a, b, c, d: (a + 2 * b + 2 * c + d) / 6, k1, k2, k3, k4)
    return _finish(_advance(parts, mean, dt), end[0].rotor_speed)


def _told(plant: Airframe, drive: Drive, parts: Parts, time: float = 0.0) -> Rotors:
    """The speeds that the rotors approach at a stage, rad/s."""
    return reached(plant, parts.rotor_speed, drive(parts, time))


def _half(plant: Airframe, start: Parts, drive: Drive, told: Rotors, parts: Parts, dt: float) -> tuple[Parts, Rotors]:
    """The stage in the middle of a step, with its rotor speeds, and the speeds that the rotors approach there.

    `told` are those at the start. The rotors follow the mean of both, moved by the hold.
    """
    ahead = lagged(start.rotor_speed, told, plant.half_decay, plant.half_decay_down)
    now = _told(plant, drive, dataclasses.replace(parts, rotor_speed=ahead), dt / 2)
    share = 0.5 - jnp.minimum(HOLD / dt, 1.0)
    mean = _each(lambda u, v: u + (v - u) * share, told, now)
    speed = lagged(start.rotor_speed, mean, plant.half_decay, plant.half_decay_down)
    return dataclasses.replace(parts, rotor_speed=speed), now


def _end(
    plant: Airframe, start: Parts, drive: Drive, told: tuple[Rotors, Rotors, Rotors], parts: Parts, dt: float
) -> tuple[Parts, Rotors]:
    """The stage at the end of a step, with its rotor speeds, and the speeds that the rotors approach there.

    `told` are those at the start and, twice, in the middle. The rotors follow the mean by Simpson's rule of what is
    left of each at the end, moved by the hold.
    """
    first, early, late = told
    ahead = _each(lambda a, b: 2 * b - a, first, late)
    ahead = lagged(start.rotor_speed, ahead, plant.decay, plant.decay_down)
    now = _told(plant, drive, dataclasses.replace(parts, rotor_speed=ahead), dt)
    half, whole = plant.half_decay, plant.decay
    moved, total = jnp.minimum(HOLD / dt, 1.0) / 2, 1 / (whole + 4 * half + 1)
    middle, last = 2 * half * total, total - moved
    mean = _each(lambda u, v, w, z: u + (v - u + w - u) * middle + (z - u) * last, first, early, late, now)
    speed = lagged(start.rotor_speed, mean, plant.decay, plant.decay_down)
    return dataclasses.replace(parts, rotor_speed=speed), now


def _each(of: Callable[..., Array], *rotors: Rotors) -> Rotors:
    a, b, c, d = (of(*values) for values in zip(*rotors, strict=True))
    return a, b, c, d


def _rate(plant: Airframe, parts: Parts, told: Rotors, wind: Vec3 | None) -> Parts:
    change = None
    if plant.rotor_inertia is not None and plant.lag_rate is not None:
        up, down = plant.lag_rate, plant.lag_rate_down
        change = _each(
            lambda w, u: (u - w) * (up if down is None else jnp.where(u < w, down, up)), parts.rotor_speed, told
        )
    return derivative(plant, parts, wind, change)


def _mean_change(plant: Airframe, before: Rotors, after: Rotors, dt: float) -> Rotors | None:
    """Mean acceleration of the rotors over a step, rad/s^2, where the plant needs it.

    It gives the exact change of momentum.
    """
    if plant.rotor_inertia is None:
        return None
    a, b, c, d = ((end - start) / dt for start, end in zip(before, after, strict=True))
    return a, b, c, d


def _advance(parts: Parts, rate: Parts, dt: float) -> Parts:
    return jax.tree.map(lambda x, dx: x + dx * dt, parts, rate)


def _finish(parts: Parts, rotor_speed: Rotors) -> Parts:
    return dataclasses.replace(parts, attitude=parts.attitude.normalized(), rotor_speed=rotor_speed)


INTEGRATORS: dict[str, Integrator] = {"euler": euler, "semi_implicit": semi_implicit, "rk3": rk3, "rk4": rk4}
"""Integrators by name."""
