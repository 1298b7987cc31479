"""Which way is open among upright trunks: a look at all of them, for a reward; policies have to see them."""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.scenes.scene import Solids

FAN, HEADINGS = 1.2, 25
"""Headings that are compared reach this far to each side, rad; how many there are."""
VIEW = 6.0
"""How far each is followed, m."""
TURNING = 0.3
"""What a turn costs, metres a rad."""


def open_heading(
    trees: Solids,
    position: Float[Array, "n 2"],
    bearing: Float[Array, " n"],
    room: float | Array,
    side: float | Array = math.inf,
) -> Float[Array, "n 2"]:
    """The heading that gains most towards a bearing before it comes too near to a trunk.

    Args:
        trees: cylinders.
        position: from where, world, m.
        bearing: where to, rad from world x.
        room: to keep from the trunks' surfaces, m.
        side: |y| that is not to be passed, m.

    Returns:
        Unit vectors; no gradient.
    """
    turns = jnp.linspace(-FAN, FAN, HEADINGS)
    angle = bearing[:, None] + turns
    x, y = jnp.cos(angle), jnp.sin(angle)
    ex, ey = (trees.centre[:, None, :, i] - position[:, None, None, i] for i in range(2))
    along = x[..., None] * ex + y[..., None] * ey
    beside = x[..., None] * ey - y[..., None] * ex
    square = (trees.size[:, None, :, 0] + room) ** 2 - beside**2
    meets = (square > 0) & (along > 0) & trees.active[:, None]
    free = jnp.min(jnp.where(meets, along - jnp.sqrt(jnp.maximum(square, 0.0)), VIEW), axis=-1)
    out = (side - jnp.sign(y) * position[:, 1:]) / jnp.maximum(jnp.abs(y), 1e-3)
    free = jnp.clip(jnp.minimum(free, out), 0.0, VIEW)
    best = jax.nn.one_hot(jnp.argmax(free * jnp.cos(turns) - TURNING * jnp.abs(turns), axis=1), HEADINGS)
    return jax.lax.stop_gradient(jnp.stack([jnp.sum(best * x, axis=1), jnp.sum(best * y, axis=1)], axis=-1))
