"""The expert pilot, which knows every tree: it compares manoeuvres by simulating a vehicle that follows with a lag."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.policy.others import Others
from e2efly.simulation.scenes.scene import Solids
from e2efly.tasks.task import Flier

FAN, HEADINGS = 1.1, 15
"""Largest angle of a compared heading to each side, rad, and the number of headings. Each is compared twice: flown on,
and left for the bearing ..."""
SWERVE = 0.35
"""... after this time, s, as when one passes a single tree."""
STEPS, STEP = 15, 0.08
"""Number of simulation steps along each heading, and the duration of a step, s."""
FOLLOWING = 0.25
"""The commanded acceleration is the error of the velocity divided by this time, s."""
MARGIN, TOUCH = 0.5, 0.03
"""Distance from the vehicle within which an object adds cost, m, and distance within which it counts as a collision,
m."""
NEARNESS, COLLISION, TURN = 14.0, 6.0, 0.05
"""Weights of the cost: of a step within the margin, per m^2; of a collision, per second before the end; of a turn, per
rad. The cost is in seconds of flight at the commanded speed."""


def best_heading(
    trees: Solids,
    flier: Flier,
    bearing: Float[Array, " n"],
    speed: Float[Array, " n"],
    radius: float | Array,
    side: float | Array,
    others: Others | None = None,
    swing: bool = False,
) -> Float[Array, " n"]:
    """The heading that makes most progress towards a bearing, with distance to trunks and to the sides of the lane.

    Args:
        trees: cylinders, the trees.
        flier: the motion from which to fly on.
        bearing: the direction to make progress in, rad from world x.
        speed: the commanded speed, m/s.
        radius: radius of the vehicle, m.
        side: largest |y| of the lane, which must not be passed, m.
        others: other vehicles of the same size, as they are now, which fly straight on.
        swing: whether trees move. The pilot knows where they will be.

    Returns:
        The heading, rad from world x. It has no gradient.
    """
    turns = jnp.tile(jnp.linspace(-FAN, FAN, HEADINGS), 2)
    lasting = jnp.repeat(jnp.array([jnp.inf, SWERVE]), HEADINGS)[:, None]
    heading = bearing[:, None] + turns
    commanded, straight = (speed[:, None, None] * _along(angle) for angle in (heading, bearing[:, None]))
    tree_x, tree_y = (trees.centre[:, None, :, i] for i in range(2))
    reach = jnp.where(trees.active, trees.size[..., 0], -jnp.inf)[:, None] + radius
    most, lag = flier.acceleration_max[:, None, None], flier.lag[:, None, None]
    kept = jnp.exp(-STEP / lag)
    kept_mean = (1 - kept) * lag / STEP

    def step(carry: tuple[Array, ...], time: Array) -> tuple[tuple[Array, ...], None]:
        place, moving, pushed, nearness, free = carry
        wanted = (jnp.where(time < lasting, commanded, straight) - moving) / FOLLOWING
        size = jnp.linalg.norm(wanted, axis=-1, keepdims=True)
        wanted = wanted * jnp.minimum(1.0, most / jnp.maximum(size, most))
        mean, pushed = wanted + (pushed - wanted) * kept_mean, wanted + (pushed - wanted) * kept
        place, moving = place + STEP * moving + STEP**2 / 2 * mean, moving + STEP * mean
        x, y, there_x, there_y = place[..., 0], place[..., 1], tree_x, tree_y
        if swing:
            there_x, there_y = (trees.position(flier.time + time + STEP)[:, None, :, i] for i in range(2))
        distance = jnp.sqrt((x[..., None] - there_x) ** 2 + (y[..., None] - there_y) ** 2)
        gap = jnp.minimum(jnp.min(distance - reach, axis=-1), side - jnp.abs(y) - radius)
        if others is not None:
            there = others.position[..., :2] + (time + STEP) * others.velocity[..., :2]
            apart = jnp.linalg.norm(place[:, :, None] - there[:, None], axis=-1)
            gap = jnp.minimum(gap, jnp.min(apart, axis=-1) - 2 * radius)
        nearness = nearness + jnp.maximum(MARGIN - gap, 0.0) ** 2 / (1 + time / 2)
        free = jnp.where(gap < TOUCH, jnp.minimum(free, time), free)
        return (place, moving, pushed, nearness, free), None

    begins = (flier.position[:, :2], flier.velocity[:, :2], flier.acceleration)
    spread = (jnp.broadcast_to(x[:, None], commanded.shape) for x in begins)
    nothing, end = jnp.zeros_like(heading), STEPS * STEP
    times = STEP * jnp.arange(STEPS, dtype=jnp.float32)
    (place, _, _, nearness, free), _ = jax.lax.scan(step, (*spread, nothing, nothing + jnp.inf), times)
    gained = jnp.sum((place - flier.position[:, None, :2]) * _along(bearing)[:, None], axis=-1)
    struck = jnp.where(jnp.isinf(free), 0.0, COLLISION * (end + 0.3 - free))
    score = gained / speed[:, None] - NEARNESS * nearness - struck - TURN * jnp.abs(turns)
    best = jax.nn.one_hot(jnp.argmax(score, axis=1), len(turns))
    return jax.lax.stop_gradient(jnp.sum(best * heading, axis=1))


def _along(angle: Array) -> Array:
    """The direction at an angle from world x."""
    return jnp.stack([jnp.cos(angle), jnp.sin(angle)], axis=-1)
