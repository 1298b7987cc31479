"""An expert's command: how to fly at a velocity that requires knowledge of the whole world.

The task chooses the velocity. The flight controller's cascade converts it to thrust and body rates. They are computed
for the moment when an action that is chosen now takes effect. Until then, the vehicle follows the actions under way.
"""

import dataclasses
from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.control import Quat, Vec3
from e2efly.control.cascade import reach
from e2efly.simulation.physics import State
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

RESERVE = 1.15
"""The expert tilts only so far that its rotors have to carry at most this times its weight."""

DAMPED = 0.6
"""The expert's attitude gains are at most this, divided by the lag of the body rates."""


@dataclass(frozen=True)
class ExpertMotion:
    """What the cascade knows of the vehicle."""

    position: Vec3
    velocity: Vec3
    attitude: Quat


def ahead(
    vehicle: Vehicle,
    state: State,
    commands: Float[Array, "n k 4"],
    latency: Float[Array, " n"],
    period: float,
) -> ExpertMotion:
    """Where a vehicle will be when the command that is chosen now takes effect.

    Body rates follow with a single lag for the rate loop and the motors. The thrust follows at once.

    Args:
        vehicle: the vehicle that flies.
        state: the current state.
        commands: collective thrusts, m/s^2, and body rates, rad/s, under way, newest first.
        latency: the time from a command to its effect, s.
        period: the time between two commands, s.
    """
    position, velocity = Vec3.of(state.position), Vec3.of(state.velocity)
    attitude, rate = Quat.of(state.quaternion), Vec3.of(state.body_rate)
    lag = _lag(vehicle)
    for i in reversed(range(commands.shape[1])):
        time = jnp.clip(latency - i * period, 0.0, period)
        commanded = Vec3.of(commands[:, i, 1:])
        left = Vec3.of(jnp.exp(-time[:, None] / lag))
        error = rate - commanded
        middle = commanded + error.times((left + Vec3(1.0, 1.0, 1.0)) * 0.5)
        attitude = (attitude + attitude.derivative(middle) * time).normalized()
        rate = commanded + error.times(left)
        acceleration = attitude.z_axis() * commands[:, i, 0] - Vec3(0.0, 0.0, GRAVITY)
        position = position + velocity * time + acceleration * (time**2 / 2)
        velocity = velocity + acceleration * time
    return ExpertMotion(position, velocity, attitude)


def command(
    vehicle: Vehicle,
    largest: Float[Array, ""],
    motion: ExpertMotion,
    velocity: Float[Array, "n 3"],
    yaw: Float[Array, " n"],
) -> Float[Array, "n 4"]:
    """Collective thrust, m/s^2, and body rates, rad/s, towards a velocity in the world, m/s, and a yaw, rad.

    Args:
        vehicle: the vehicle that flies. Its own limits of tilt and acceleration are not used.
        largest: the largest collective thrust of all rotors over mass, m/s^2.
        motion: the motion of the vehicle.
        velocity: the desired velocity.
        yaw: the desired yaw.
    """
    tilt = jnp.arccos(jnp.clip(RESERVE * GRAVITY / largest, 0.0, 1.0))
    level = GRAVITY * jnp.tan(tilt)
    pilot = dataclasses.replace(
        vehicle,
        tilt_max=tilt,
        acceleration_max=jnp.stack([level, level, jnp.full_like(level, GRAVITY)], axis=-1),
        attitude_gain=jnp.minimum(vehicle.attitude_gain, DAMPED / _lag(vehicle)[..., jnp.array([0, 2])]),
    )
    out = reach(pilot, motion, Vec3.of(velocity), yaw)
    return jnp.concatenate([out.thrust[:, None], out.rate.stack()], axis=-1)


def _lag(vehicle: Vehicle) -> Array:
    """Lag of the body rates behind the commanded ones, one value per axis, s."""
    return 1 / jnp.asarray(vehicle.rate_gain) + jnp.asarray(vehicle.motor_time_constant)[..., None]
