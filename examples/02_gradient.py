"""The gradient of a vehicle's final position with respect to its commands and its mass."""

import dataclasses

import jax
import jax.numpy as jnp

from e2efly.simulation.physics import Physics, State, step
from e2efly.vehicles.loading import load_vehicle

vehicle = load_vehicle("vis_r")
physics = Physics.of(vehicle)  # collective thrust and body rates
start = State.hovering(vehicle, jnp.zeros((1, 3)))


def height_after_one_second(command: jax.Array, mass: jax.Array) -> jax.Array:
    """Height, m, after 30 control steps of one command (m/s^2, rad/s)."""
    plant = dataclasses.replace(physics.nominal, mass=mass)
    end = jax.lax.scan(lambda s, _: (step(physics, plant, s, command), None), start, None, length=30)[0]
    return end.position[0, 2]


command = jnp.array([[10.5, 0.0, 0.0, 0.0]])
height, (by_command, by_mass) = jax.jit(jax.value_and_grad(height_after_one_second, argnums=(0, 1)))(
    command, jnp.float32(vehicle.mass)
)
print(f"height {height:.3f} m; d height / d command {by_command[0]}; d height / d mass {by_mass:.2f} m/kg")
