"""The loads that episodes draw."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import PRNGKeyArray

from e2efly.config import PayloadConfig
from e2efly.simulation.physics import Load, State
from e2efly.simulation.physics.cable import hung
from e2efly.tasks.task import between, uniform

jax.tree_util.register_dataclass(
    PayloadConfig, data_fields=[field.name for field in dataclasses.fields(PayloadConfig)], meta_fields=[]
)


def draw(config: PayloadConfig, key: PRNGKeyArray, vehicles: State, mass: Any) -> Load:
    """The loads of n episodes, at the start.

    Args:
        config: the ranges of the loads and of their cables.
        key: the random key.
        vehicles: the vehicles from which they hang, at their starts.
        mass: mass of a vehicle, kg: one number, or (n,).
    """
    n, dtype = vehicles.position.shape[0], vehicles.position.dtype
    u = uniform(key, n, 4).astype(dtype)
    angle, azimuth = config.swing * jnp.sqrt((u[:, 2] + 1) / 2), jnp.pi * u[:, 3]
    aside = jnp.sin(angle)
    direction = jnp.stack([aside * jnp.cos(azimuth), aside * jnp.sin(azimuth), -jnp.cos(angle)], axis=-1)
    return hung(
        vehicles.position,
        vehicles.velocity,
        vehicles.quaternion,
        direction,
        mass * between(config.mass, u[:, 0]),
        between(config.length, u[:, 1]),
        jnp.full(n, config.hook, dtype),
    )
