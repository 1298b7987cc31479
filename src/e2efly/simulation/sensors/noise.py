"""White noise on the observed state."""

import dataclasses

import jax
import jax.numpy as jnp
from jaxtyping import PRNGKeyArray

from e2efly.config import NoiseConfig
from e2efly.control.vectors import stack
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import multiply, normalize

jax.tree_util.register_dataclass(NoiseConfig)


def add_noise(noise: NoiseConfig, key: PRNGKeyArray, state: State) -> State:
    """The measured state: Gaussian noise on position, velocity and body rate, and a small random rotation."""
    draw = jax.random.normal(key, (*state.position.shape[:-1], 12), state.position.dtype)
    half_turn = noise.attitude * draw[..., 6:9] / 2
    # The rotation is normalised, not the product. Without noise, no bit of the attitude changes.
    turn = normalize(stack(jnp.ones_like(half_turn[..., 0]), *(half_turn[..., i] for i in range(3))))
    return dataclasses.replace(
        state,
        position=state.position + noise.position * draw[..., 0:3],
        velocity=state.velocity + noise.velocity * draw[..., 3:6],
        quaternion=multiply(state.quaternion, turn),
        body_rate=state.body_rate + noise.body_rate * draw[..., 9:12],
    )
