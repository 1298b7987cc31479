"""The expert pilot, which knows every tree: it compares headings by simulating a vehicle that follows with a lag."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.simulation.scenes.scene import Solids

FAN, HEADINGS = 1.1, 15
"""Largest angle of a compared heading to each side, rad, and the number of headings."""
STEPS, STEP = 15, 0.08
"""Number of simulation steps along each heading, and the duration of a step, s."""
LAG, FASTEST = 0.35, 14.0
"""Lag with which the velocity follows the commanded velocity, s, and its largest acceleration, m/s^2."""
MARGIN, TOUCH = 0.5, 0.03
"""Distance from the vehicle within which an object adds cost, m, and distance within which it counts as a collision,
m."""
NEARNESS, COLLISION, TURN = 8.0, 6.0, 0.05
"""Weights of the cost: of a step within the margin, per m^2; of a collision, per second before the end; of a turn, per
rad. The cost is in seconds of flight at the commanded speed."""


def best_heading(
    trees: Solids,
    position: Float[Array, "n 2"],
    velocity: Float[Array, "n 2"],
    bearing: Float[Array, " n"],
    speed: Float[Array, " n"],
    radius: float | Array,
    side: float | Array,
) -> Float[Array, " n"]:
    """The heading that makes most progress towards a bearing, with distance to trunks and to the sides of the lane.

    Args:
        trees: cylinders, the trees.
        position: the start position, world, m.
        velocity: the velocity there, m/s.
        bearing: the direction to make progress in, rad from world x.
        speed: the commanded speed, m/s.
        radius: radius of the vehicle, m.
        side: largest |y| of the lane, which must not be passed, m.

    Returns:
        The heading, rad from world x. It has no gradient.
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
