"""Random worlds: pure functions of a key. Each world of the batch is drawn separately."""

import dataclasses
import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from e2efly.config import CLUTTER, ClutterConfig, ForestConfig
from e2efly.simulation.scenes.scene import WALL, Solids
from e2efly.simulation.scenes.shapes import SHAPES

TRIES = 8
"""Number of places that are tried for an obstacle. If none is clear, the obstacle is left out."""


def _between(key: PRNGKeyArray, shape: tuple[int, ...], bounds: tuple[float, float] | Array) -> Array:
    return bounds[0] + (bounds[1] - bounds[0]) * jax.random.uniform(key, shape)


def forest(key: PRNGKeyArray, n: int, config: ForestConfig, start: Array, goal: Array) -> Solids:
    """Upright trunks, uniformly distributed over a lane that begins at the start and follows x.

    Start and goal (world, m) are kept clear.

    Returns:
        Cylinders. Their mean number follows from `config.density`. A trunk that would stand in a clear place is left
        out.
    """
    place, thick, tall, many = jax.random.split(key, 4)
    shape = (n, config.room)
    u = jax.random.uniform(place, (*shape, 2))
    middle = (start + goal)[:, None, :2] / 2
    xy = middle + (u - 0.5) * jnp.stack([jnp.asarray(config.length), jnp.asarray(config.width)])
    radius, height = _between(thick, shape, config.radius), _between(tall, shape, config.height)
    wanted = config.density * config.length * config.width
    there = jnp.arange(config.room) < jnp.minimum(jnp.floor(wanted + jax.random.uniform(many, (n, 1))), config.room)
    centre = jnp.concatenate([xy, height[..., None] / 2], axis=-1)
    for point in (start, goal):
        there &= jnp.linalg.norm(xy - point[:, None, :2], axis=-1) - radius > config.clear
    return Solids.of(
        "cylinder", centre, jnp.stack([radius, height / 2], axis=-1), active=there, colour=(0.36, 0.25, 0.17)
    )


def clutter(
    key: PRNGKeyArray,
    n: int,
    config: ClutterConfig,
    path: Float[Array, "n p 3"],
    keep: Float[Array, "n c 3"],
    radius: Array | float,
    legs: Int[Array, " n"] | None = None,
) -> dict[str, Solids]:
    """Obstacles of all kinds around a polyline, clear of some points.

    The corners of the polyline are in the world, m. Each world has `legs` of its straight segments (None: all). The
    space around each point of `keep`, world, m, is clear within `radius` in addition to `config.clear`, m.

    Returns:
        Solids by kind, with their centres above the ground.
    """
    each = config.room // len(CLUTTER)
    lines = path.shape[1] - 1 if legs is None else legs[:, None, None]
    found = {}
    for index, kind in enumerate(CLUTTER):
        keys = jax.random.split(jax.random.fold_in(key, index), 8)
        shape = (n, each)
        tries = (*shape, TRIES)
        leg = jax.nn.one_hot(jax.random.randint(keys[0], tries, 0, lines), path.shape[1] - 1)
        along = jax.random.uniform(keys[1], (*tries, 1))
        on_path = sum(
            share * jnp.einsum("nkcp,npi->nkci", leg, ends)
            for share, ends in ((1 - along, path[:, :-1]), (along, path[:, 1:]))
        )
        places = on_path + config.sideways * jax.random.uniform(keys[2], (*tries, 3), minval=-1.0, maxval=1.0)
        size = _between(keys[3], (*shape, 3), config.size)
        there = jax.random.uniform(keys[4], shape) < config.obstacles / config.room
        swings = jax.random.uniform(keys[5], shape) < config.moving
        way = jax.random.normal(keys[6], (*shape, 3))
        way = way / jnp.linalg.norm(way, axis=-1, keepdims=True) * swings[..., None] * config.swing
        yaw, rate = (
            _between(jax.random.fold_in(keys[7], i), shape, b) for i, b in enumerate(((0.0, math.pi), (0.5, 2.0)))
        )
        reach = SHAPES[kind].reach(jnp.pad(size, [(0, 0), (0, 0), (0, 1)])) + jnp.linalg.norm(way, axis=-1)
        clear = is_clear(places, reach, keep, radius + config.clear) & (places[..., 2] > 0.0)
        chosen = jax.nn.one_hot(jnp.argmax(clear, axis=-1), TRIES)
        centre = jnp.einsum("nkc,nkci->nki", chosen, places)
        there &= jnp.any(clear, axis=-1)
        solids = Solids.of(kind, centre, size, yaw=yaw, active=there)
        found[kind] = dataclasses.replace(solids, cosine=way, rate=rate * swings)
    return found


def is_clear(
    places: Float[Array, "n k c 3"], reach: Float[Array, "n k"], points: Float[Array, "n p 3"], room: Array | float
) -> Bool[Array, "n k c"]:
    """Whether balls at these places are farther than `room` from all points."""
    away = jnp.linalg.norm(places[..., None, :] - points[:, None, None], axis=-1)
    return jnp.all(away - reach[..., None, None] > room, axis=-1)


def room(n: int, length: Array | float, width: Array | float, height: Array | float, thick: float = 0.1) -> Solids:
    """Four walls about the origin and a ceiling, as thin boxes."""
    x, y, z, t = (jnp.broadcast_to(jnp.asarray(v, jnp.float32), (n,)) for v in (length, width, height, thick))
    zero = jnp.zeros(n)
    centre = [[x / 2, zero, z / 2], [-x / 2, zero, z / 2], [zero, y / 2, z / 2], [zero, -y / 2, z / 2], [zero, zero, z]]
    half = [[t / 2, y / 2, z / 2]] * 2 + [[x / 2, t / 2, z / 2]] * 2 + [[x / 2, y / 2, t / 2]]
    return Solids.of("box", _stack(centre), _stack(half), label=WALL)


def corridor(n: int, length: Array | float, width: Array | float, height: Array | float, thick: float = 0.1) -> Solids:
    """Two walls along x, from the origin on."""
    x, y, z, t = (jnp.broadcast_to(jnp.asarray(v, jnp.float32), (n,)) for v in (length, width, height, thick))
    centre = [[x / 2, y / 2, z / 2], [x / 2, -y / 2, z / 2]]
    return Solids.of("box", _stack(centre), _stack([[x / 2, t / 2, z / 2]] * 2), label=WALL)


def _stack(rows: list[list[Array]]) -> Float[Array, "n k 3"]:
    return jnp.stack([jnp.stack(row, axis=-1) for row in rows], axis=1)
