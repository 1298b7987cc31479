"""Fly VIS-R open loop and with position commands: only the physics, no learning."""

import jax
import jax.numpy as jnp

from e2efly.simulation.physics import Physics, State, step
from e2efly.vehicles.loading import load_vehicle

vehicle = load_vehicle("vis_r")
physics = Physics.of(vehicle, command_mode="position")
start = State.hovering(vehicle, jnp.zeros((4, 3)))  # four vehicles at the origin
goals = jnp.array([[0.0, 0, 1, 0], [1, 0, 1, 0], [0, 1, 1, 1.5], [-1, -1, 2, 0]])  # x, y, z in m, yaw in rad


@jax.jit
def fly(state: State) -> State:
    """Five seconds at 30 Hz."""
    return jax.lax.scan(lambda s, _: (step(physics, physics.nominal, s, goals), None), state, None, length=150)[0]


end = fly(start)
for goal, position in zip(goals, end.position, strict=True):
    print(f"asked for {goal[:3]}, reached {position}")
