"""How one who knows every tree would fly: headings compared by where they lead a vehicle that follows late."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.scenes.scene import Solids

FAN, HEADINGS = 1.1, 15
"""Headings that are compared reach this far to each side, rad; how many there are."""
STEPS, STEP = 15, 0.08
"""Each is followed for so many steps of so many seconds."""
LAG, FASTEST = 0.35, 14.0
"""The velocity follows the commanded one with this lag, s, and accelerates by this at most, m/s^2."""
MARGIN, TOUCH = 0.5, 0.03
"""What is nearer to the vehicle than the first costs, m; nearer than the second it counts as struck."""
NEARNESS, COLLISION, TURN = 8.0, 6.0, 0.05
"""What a step within the margin costs, a m^2; what a collision, a second that it is earlier than the end; what a turn,
a rad: in seconds of the way at the commanded speed."""


def best_heading(
    trees: Solids,
    position: Float[Array, "n 2"],
    velocity: Float[Array, "n 2"],
    bearing: Float[Array, " n"],
    speed: Float[Array, " n"],
    radius: float | Array,
    side: float | Array,
) -> Float[Array, " n"]:
    """The heading that leads farthest towards a bearing, and not too near to trunks and to the sides of the lane.

    Args:
        trees: cylinders.
        position: where from, world, m.
        velocity: that it has there, m/s.
        bearing: where to, rad from world x.
        speed: that is commanded, m/s.
        radius: of the vehicle, m.
        side: |y| that it must not pass, m.

    Returns:
        rad from world x; no gradient.
    """
    turns = jnp.linspace(-FAN, FAN, HEADINGS)
    heading = bearing[:, None] + turns
    commanded = speed[:, None, None] * jnp.stack([jnp.cos(heading), jnp.sin(heading)], axis=-1)
    tree_x, tree_y = (trees.centre[:, None, :, i] for i in range(2))
    reach = jnp.where(trees.active, trees.size[..., 0], -jnp.inf)[:, None] + radius

    def step(carry: tuple[Array, ...], time: Array) -> tuple[tuple[Array, ...], None]:
        place, moving, nearness, free = carry
        wanted = (commanded - moving) / LAG
        size = jnp.linalg.norm(wanted, axis=-1, keepdims=True)
        moving = moving + STEP * wanted * jnp.minimum(1.0, FASTEST / jnp.maximum(size, FASTEST))
        place = place + STEP * moving
        x, y = place[..., 0], place[..., 1]
        distance = jnp.sqrt((x[..., None] - tree_x) ** 2 + (y[..., None] - tree_y) ** 2)
        gap = jnp.minimum(jnp.min(distance - reach, axis=-1), side - jnp.abs(y) - radius)
        nearness = nearness + jnp.maximum(MARGIN - gap, 0.0) ** 2 / (1 + time / 2)
        free = jnp.where(gap < TOUCH, jnp.minimum(free, time), free)
        return (place, moving, nearness, free), None

    spread = (jnp.broadcast_to(x[:, None], commanded.shape) for x in (position, velocity))
    nothing, end = jnp.zeros_like(heading), STEPS * STEP
    times = STEP * jnp.arange(STEPS, dtype=jnp.float32)
    (place, _, nearness, free), _ = jax.lax.scan(step, (*spread, nothing, nothing + jnp.inf), times)
    gained = jnp.sum((place - position[:, None]) * jnp.stack([jnp.cos(bearing), jnp.sin(bearing)], -1)[:, None], -1)
    struck = jnp.where(jnp.isinf(free), 0.0, COLLISION * (end + 0.3 - free))
    score = gained / speed[:, None] - NEARNESS * nearness - struck - TURN * jnp.abs(turns)
    best = jax.nn.one_hot(jnp.argmax(score, axis=1), HEADINGS)
    return jax.lax.stop_gradient(jnp.sum(best * heading, axis=1))
