"""The expert pilot, which knows every ball in the air: it compares ways out by simulating a vehicle that follows with a
lag.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.control.vectors import safe_sqrt
from e2efly.tasks.task import Flier
from e2efly.vehicles.gravity import GRAVITY

WAYS, HASTE = 12, 4.0
"""Number of compared directions, all across the ball's way, and the speed that is commanded along them, m/s."""
STEPS, STEP = 18, 0.03
"""Number of simulation steps, and the duration of a step, s."""
FOLLOWING, PROMPT = 0.25, 0.05
"""The commanded acceleration is the error of the velocity divided by the first time, s. The second one is the lag of
the thrust, s."""
ENOUGH = 0.3
"""Distance at which a ball may pass, m. More is no better."""
AWAY = 0.1
"""Cost of the distance from the place at the end of the simulation, m per m."""
BACK, HOMING = 2.5, 2.0
"""Speed towards the place divided by the distance from it, 1/s, and its largest value, m/s."""

Balls = Callable[[Float[Array, " n"]], tuple[Float[Array, "n k 3"], Float[Array, "n k 3"], Float[Array, "n k"]]]
"""Time (n,), s -> where balls are, world, m, how fast they fly, m/s, and the distance that must be kept from each, m:
negative where there is none."""


def passing(first: Float[Array, "*n 3"], last: Float[Array, "*n 3"]) -> Float[Array, "*n"]:
    """Smallest distance from the origin of a point that moves straight from the first to the last place, m."""
    way = last - first
    share = -jnp.sum(first * way, axis=-1) / jnp.maximum(jnp.sum(way**2, axis=-1), 1e-9)
    return safe_sqrt(jnp.sum((first + jnp.clip(share, 0.0, 1.0)[..., None] * way) ** 2, axis=-1))


def way_out(balls: Balls, flier: Flier, place: Float[Array, "n 3"]) -> Float[Array, "n 3"]:
    """The velocity, world, m/s, with which to let balls pass and to come back to a place. It has no gradient.

    Args:
        balls: the balls in the air.
        flier: the motion from which to fly on.
        place: where to be, world, m.
    """
    away = place - flier.position
    far = jnp.linalg.norm(away, axis=-1, keepdims=True)
    home = away * jnp.minimum(BACK, HOMING / jnp.maximum(far, 1e-6))
    _, flying, keep = balls(flier.time)
    coming = jnp.sum(jnp.where(keep[..., None] > 0, flying, 0.0), axis=1) + jnp.array([1e-3, 0.0, 0.0])
    ahead = coming / jnp.linalg.norm(coming, axis=-1, keepdims=True)
    side = jnp.stack([-ahead[:, 1], ahead[:, 0], jnp.zeros_like(far[:, 0])], axis=-1)
    side = side / jnp.maximum(jnp.linalg.norm(side, axis=-1, keepdims=True), 1e-6)
    turn = 2 * jnp.pi * jnp.arange(WAYS) / WAYS
    across = jnp.cos(turn)[:, None] * side[:, None] + jnp.sin(turn)[:, None] * jnp.cross(ahead, side)[:, None]
    commands = jnp.concatenate([home[:, None], HASTE * across], axis=1)
    # the thrust that carries the largest tilt lifts upwards, too
    lift = jnp.sqrt(GRAVITY**2 + flier.acceleration_max**2)[:, None] - GRAVITY
    most, lag = flier.acceleration_max[:, None, None], flier.lag[:, None, None]
    fade, prompt = jnp.exp(-STEP / lag), jnp.exp(-STEP / PROMPT)

    def step(carry: tuple[Array, ...], index: Array) -> tuple[tuple[Array, ...], None]:
        position, velocity, pushed, clear = carry
        wanted = (commands - velocity) / FOLLOWING
        level = wanted[..., :2]
        level = level * jnp.minimum(1.0, most / jnp.maximum(jnp.linalg.norm(level, axis=-1, keepdims=True), most))
        up = jnp.clip(wanted[..., 2], -0.8 * GRAVITY, lift)[..., None]
        left = jnp.concatenate([jnp.broadcast_to(fade, level.shape), jnp.full_like(up, prompt)], axis=-1)
        wanted = jnp.concatenate([level, up], axis=-1)
        pushed = wanted + (pushed - wanted) * left
        moved, velocity = position + STEP * velocity + STEP**2 / 2 * pushed, velocity + STEP * pushed
        (first, _, keep), (last, _, _) = (balls(flier.time + STEP * (index + i)) for i in (0, 1))
        gap = passing(position[:, :, None] - first[:, None], moved[:, :, None] - last[:, None]) - keep[:, None]
        near = jnp.min(jnp.where(keep[:, None] > 0, gap, ENOUGH), axis=-1)
        return (moved, velocity, pushed, jnp.minimum(clear, near)), None

    spread = [jnp.broadcast_to(x[:, None], commands.shape) for x in (flier.position, flier.velocity)]
    pushed = jnp.broadcast_to(jnp.pad(flier.acceleration, ((0, 0), (0, 1)))[:, None], commands.shape)
    begins = (*spread, pushed, jnp.full(commands.shape[:2], ENOUGH))
    (end, _, _, clear), _ = jax.lax.scan(step, begins, jnp.arange(STEPS, dtype=jnp.float32))
    score = clear - AWAY * jnp.linalg.norm(end - place[:, None], axis=-1)
    best = jax.nn.one_hot(jnp.argmax(score, axis=1), WAYS + 1)
    return jax.lax.stop_gradient(jnp.sum(best[..., None] * commands, axis=1))
