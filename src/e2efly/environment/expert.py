"""An expert's command: how to fly at a velocity that requires knowledge of the whole world.

The task chooses the velocity. The flight controller's cascade converts it to thrust and body rates. They are computed
for the moment when an action that is chosen now takes effect. Until then, the vehicle follows the actions under way.
"""

import dataclasses
import math
from dataclasses import dataclass

import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.control import Quat, Vec3
from e2efly.control.cascade import reach
from e2efly.simulation.physics import State
from e2efly.tasks.task import AGILE, Flier
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

RESERVE = 1.15
"""The expert tilts only so far that its rotors have to carry at most this times its weight."""

LEAST_TILT = 0.2
"""The expert may tilt so far, rad, even where the rotors hardly carry the weight."""

DAMPED = 0.6
"""The expert's attitude gains are at most this, divided by the lag of the body rates."""

FOLLOWS = 0.85
"""The lag of the acceleration, multiplied by the attitude gain."""

UPRIGHT = 0.3
"""The smallest cosine of the tilt with which the level acceleration is computed."""


@dataclass(frozen=True)
class ExpertMotion:
    """What the cascade knows of the vehicle."""

    position: Vec3
    velocity: Vec3
    attitude: Quat


@dataclass(frozen=True)
class CommandEffect:
    """What a drawn vehicle makes of a command. Its flight controller takes it for the vehicle of the file."""

    thrust: Float[Array, " n"]
    """Collective thrust over mass, divided by the commanded one."""
    rate_offset: Float[Array, "n 3"]
    """The body rate that the rate loop leaves beyond the commanded one, divided by the commanded thrust over mass,
    rad s/m. Rotors of unequal strength, or around another centre of mass, turn the vehicle."""

    @staticmethod
    def of(vehicle: Vehicle, plant: dict[str, Array], share: Float[Array, "n r"]) -> "CommandEffect":
        """The effect for a vehicle with these parameters, whose rotors give these shares of their thrust.

        A rate loop without an integral part comes to rest where its torque, J K times the rate error, is against that
        of the rotors. J is the inertia of the file, K the gain. The file's own arms are balanced by its mixer.
        """
        mass, mean = plant.get("mass", vehicle.mass) / vehicle.mass, jnp.mean(share, axis=-1)
        arm = jnp.asarray(vehicle.rotor_position)
        uneven = (plant.get("rotor_position", arm) * share[..., None] - arm)[..., :2]
        each = jnp.asarray(vehicle.mass / vehicle.lift)[..., None]
        torque = each * jnp.sum(uneven, axis=-2)[..., ::-1] * jnp.array([1.0, -1.0])
        offset = torque / (vehicle.inertia * vehicle.rate_gain)[..., :2] / mean[:, None]
        if vehicle.rate_integral_gain is not None:
            offset = 0.0 * offset
        return CommandEffect(mean / mass, jnp.pad(offset, ((0, 0), (0, 1))))

    def given(self, commands: Float[Array, "n k 4"]) -> Float[Array, "n k 4"]:
        """What commands give: thrust over mass, m/s^2, and body rates, rad/s."""
        thrust, rate = commands[..., :1], commands[..., 1:]
        return jnp.concatenate(
            [thrust * self.thrust[:, None, None], rate + thrust * self.rate_offset[:, None]], axis=-1
        )

    def needed(self, command: Float[Array, "n 4"]) -> Float[Array, "n 4"]:
        """The command that gives this one."""
        thrust, rate = command[:, :1] / self.thrust[:, None], command[:, 1:]
        return jnp.concatenate([thrust, rate - thrust * self.rate_offset], axis=-1)


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


def pilot(vehicle: Vehicle, largest: Float[Array, " n"]) -> Vehicle:
    """The vehicle with the limits of tilt and acceleration that its rotors carry, and attitude gains for its lag.

    Args:
        vehicle: the vehicle that flies. Its own limits are not used.
        largest: the largest collective thrust of all rotors over mass, m/s^2.
    """
    tilt = jnp.arccos(jnp.clip(RESERVE * GRAVITY / largest, 0.0, math.cos(LEAST_TILT)))
    level = GRAVITY * jnp.tan(tilt)
    return dataclasses.replace(
        vehicle,
        tilt_max=tilt,
        acceleration_max=jnp.stack([level, level, jnp.full_like(level, GRAVITY)], axis=-1),
        attitude_gain=jnp.minimum(vehicle.attitude_gain, DAMPED / _lag(vehicle)[..., jnp.array([0, 2])]),
    )


def flier(pilot: Vehicle, motion: ExpertMotion, time: Float[Array, " n"]) -> Flier:
    """What a task's expert knows of the motion at a time in the episode, s."""
    position, up = motion.position.stack(), motion.attitude.z_axis()
    per = GRAVITY / jnp.maximum(up.z, UPRIGHT)
    most = jnp.minimum(pilot.acceleration_max[..., 0], AGILE)
    lag = jnp.broadcast_to(FOLLOWS / pilot.attitude_gain[..., 0], most.shape)
    level = jnp.stack([per * up.x, per * up.y], axis=-1)
    return Flier(position, motion.velocity.stack(), level, most, lag, time, motion.attitude.yaw())


def command(
    pilot: Vehicle, motion: ExpertMotion, velocity: Float[Array, "n 3"], yaw: Float[Array, " n"]
) -> Float[Array, "n 4"]:
    """Collective thrust over mass, m/s^2, and body rates, rad/s, towards a velocity in the world, m/s, and a yaw, rad.

    Args:
        pilot: the vehicle, from `pilot`.
        motion: the motion of the vehicle.
        velocity: the desired velocity.
        yaw: the desired yaw.
    """
    out = reach(pilot, motion, Vec3.of(velocity), yaw)
    return jnp.concatenate([out.thrust[:, None], out.rate.stack()], axis=-1)


def _lag(vehicle: Vehicle) -> Array:
    """Lag of the body rates behind the commanded ones, one value per axis, s."""
    return 1 / jnp.asarray(vehicle.rate_gain) + jnp.asarray(vehicle.motor_time_constant)[..., None]
