"""Inertial measurement unit: white noise and bias random walk of gyroscope and accelerometer."""

from dataclasses import dataclass

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import ImuConfig
from e2efly.control.vectors import unrotate
from e2efly.simulation.physics import State
from e2efly.vehicles.gravity import GRAVITY

jax.tree_util.register_dataclass(
    ImuConfig, data_fields=[f for f in ImuConfig.__annotations__ if f != "observed"], meta_fields=["observed"]
)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ImuState:
    """Biases of an IMU, and its last measurement."""

    gyro_bias: Float[Array, "*n 3"]
    """Bias of the gyroscope, body, rad/s."""
    accel_bias: Float[Array, "*n 3"]
    """Bias of the accelerometer, body, m/s^2."""
    gyroscope: Float[Array, "*n 3"]
    """Measured angular velocity, body, rad/s."""
    accelerometer: Float[Array, "*n 3"]
    """Measured specific force, body, m/s^2."""

    @staticmethod
    def at(state: State) -> "ImuState":
        """Zero bias, and the measurement of a vehicle that does not accelerate."""
        zero = jnp.zeros_like(state.position)
        up = jnp.zeros_like(state.position).at[..., 2].set(GRAVITY)
        return ImuState(zero, zero, state.body_rate, unrotate(state.quaternion, up))


def measure(
    imu: ImuConfig, key: PRNGKeyArray, state: ImuState, before: State, after: State, dt: float | Array
) -> ImuState:
    """Measure the mean specific force during a step of `dt` seconds, and the body rate at its end.

    White noise of density N has the standard deviation N / sqrt(dt) per sample; a bias moves by B sqrt(dt / tau) per
    step.
    """
    draw = jax.random.normal(key, (4, *after.position.shape), after.position.dtype)
    gyro_bias = state.gyro_bias + imu.gyro_bias * jnp.sqrt(dt / imu.gyro_tau) * draw[0]
    accel_bias = state.accel_bias + imu.accel_bias * jnp.sqrt(dt / imu.accel_tau) * draw[1]
    pull = (after.velocity - before.velocity) / dt + jnp.array([0.0, 0.0, GRAVITY], after.position.dtype)
    return ImuState(
        gyro_bias,
        accel_bias,
        after.body_rate + gyro_bias + imu.gyro_noise / jnp.sqrt(dt) * draw[2],
        unrotate(after.quaternion, pull) + accel_bias + imu.accel_noise / jnp.sqrt(dt) * draw[3],
    )
