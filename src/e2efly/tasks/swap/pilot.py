"""The expert pilot, which compares velocities by when each would bring it near another vehicle.

Reciprocal velocity obstacles (van den Berg, Lin and Manocha, ICRA 2008): each expects of the other that it does half.
"""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.policy.others import Others
from e2efly.tasks.task import Flier

PACE = 0.55
"""Largest speed, as a share of `SwapConfig.speed`."""
DIRECTIONS, SHARES, FLAT = 48, (1 / 3, 2 / 3, 1.0), 0.6
"""Compared directions, and speeds as shares of the largest one. Vertical speeds are this share of level ones."""
HOMING = 1.5
"""Speed towards the place divided by the distance from it, 1/s."""
REACH, HORIZON = 0.6, 3.0
"""Distance between two centres that is to be kept, m, and the time within which it counts, s."""
HASTE = 3.0
"""Cost of coming that near, m, divided by the time until then."""
LEAVING = 5.0
"""Cost of approaching a vehicle that is already nearer, per m/s."""
STEADY, RIGHT, MOST = 0.2, 0.3, 0.5
"""Cost of a change of velocity. Gain of passing on the right, which both do, up to a speed to the right, m/s."""
SOFT = 0.05
"""Costs that differ by this, m/s, count e times as much or as little in the mean."""


def compared() -> Float[np.ndarray, "c 3"]:
    """Velocities as shares of the largest speed: at rest, and in directions all around (points of a Fibonacci
    lattice).
    """
    i = np.arange(DIRECTIONS) + 0.5
    up, turn = 1 - 2 * i / DIRECTIONS, np.pi * (1 + 5**0.5) * i
    level = np.sqrt(1 - up**2)
    around = np.stack([level * np.cos(turn), level * np.sin(turn), FLAT * up], axis=-1)
    return np.concatenate([np.zeros((1, 3)), *(share * around for share in SHARES)])


def nearest_of(others: Others, position: Float[Array, "n 3"], count: int) -> Others:
    """So many of the others, those nearest to a position, world, m."""
    away = jnp.sum((others.position - position[:, None]) ** 2, axis=-1)
    which = jnp.argsort(away, axis=1)[:, :count, None]
    return Others(*(jnp.take_along_axis(x, which, axis=1) for x in (others.position, others.velocity)))


def until_near(
    velocity: Float[Array, "n c 3"], others: Others, flier: Flier
) -> tuple[Float[Array, "n c"], Float[Array, "n c"]]:
    """Time until the first of the others is within `REACH`, s, if it does as much as the vehicle to avoid that; and how
    fast the vehicle approaches those that are, times how far they are inside, m^2/s.
    """
    expected = 2 * velocity - flier.velocity[:, None]
    apart, relative = (  # by components, which is faster than vectors of three
        [there[:, None, :, c] - here[:, :, None, c] for c in range(3)]
        for there, here in ((others.position, flier.position[:, None]), (others.velocity, expected))
    )
    closing = -sum(x * v for x, v in zip(apart, relative, strict=True))
    square = sum(v**2 for v in relative) + 1e-6
    outside = sum(x**2 for x in apart) - REACH**2
    root = closing**2 - square * outside
    meets = (closing > 0) & (root > 0)
    time = jnp.where(meets, (closing - jnp.sqrt(jnp.maximum(root, 0.0))) / square, jnp.inf)
    time = jnp.where(outside > 0, time, jnp.where(closing > 0, 0.0, jnp.inf))
    inside = jnp.maximum(REACH - jnp.sqrt(outside + REACH**2), 0.0)
    return jnp.min(time, axis=-1), jnp.sum(inside * jnp.maximum(closing, -1.0), axis=-1)


def way(others: Others, flier: Flier, place: Float[Array, "n 3"], speed: float | Array) -> Float[Array, "n 3"]:
    """The velocity, world, m/s, with which to fly to a place among others. It has no gradient.

    It is the mean of the compared velocities, weighted by their costs, because a command that jumps between two of them
    is hard to imitate.

    Args:
        others: the others that count.
        flier: the motion from which to fly on.
        place: where to go, world, m.
        speed: the largest speed, m/s.
    """
    away = place - flier.position
    wanted = away * jnp.minimum(HOMING, speed / jnp.maximum(jnp.linalg.norm(away, axis=-1, keepdims=True), 1e-6))
    ways = jnp.asarray(compared(), wanted.dtype)
    ways = jnp.concatenate([jnp.broadcast_to(speed * ways, (len(wanted), *ways.shape)), wanted[:, None]], axis=1)
    time, inside = until_near(ways, others, flier)
    right = jnp.stack([wanted[:, 1], -wanted[:, 0], jnp.zeros_like(wanted[:, 0])], axis=-1)
    right = right / jnp.maximum(jnp.linalg.norm(right, axis=-1, keepdims=True), 1e-6)
    cost = jnp.where(time < HORIZON, HASTE / (time + 0.1), 0.0) + LEAVING * inside
    cost += jnp.linalg.norm(ways - wanted[:, None], axis=-1)
    cost += STEADY * jnp.linalg.norm(ways - flier.velocity[:, None], axis=-1)
    cost -= RIGHT * jnp.minimum(jnp.sum(ways * right[:, None], axis=-1), MOST)
    share = jax.nn.softmax(-cost / SOFT, axis=1)
    return jax.lax.stop_gradient(jnp.sum(share[..., None] * ways, axis=1))
