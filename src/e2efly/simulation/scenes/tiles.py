"""The rays of a sensor in tiles, and which balls each tile may contain."""

from dataclasses import dataclass
from typing import Any

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from e2efly.control.vectors import Vec3


@dataclass(frozen=True)
class Pattern:
    """Directions of the rays of a sensor, in its own frame, in tiles; static."""

    tiles: np.ndarray
    """(tiles, 3, rays of a tile) directions. A point on a ray is its start plus depth times direction."""
    rim: np.ndarray
    """(tiles, c, 3) directions whose cone contains the tile."""
    layout: tuple[int, int, int, int]
    """Rows and columns of tiles, and rows and columns of a tile."""

    @staticmethod
    def of(directions: np.ndarray, flat: bool, tile: tuple[int, int] | None = None) -> "Pattern":
        """Cut (height, width, 3) directions into tiles. Without `tile`, they have at most 16 rows and columns.

        `flat` directions end in a plane, so that a tile lies in the cone of its corners.
        """
        height, width, _ = directions.shape
        th, tw = tile or (_divisor(height, 16), _divisor(width, 16))
        rows, columns = height // th, width // tw
        cut = directions.reshape(rows, th, columns, tw, 3).transpose(0, 2, 1, 3, 4).reshape(-1, th, tw, 3)
        rim = cut[:, [0, 0, -1, -1], [0, -1, 0, -1]]
        if not flat:
            rim = np.concatenate([cut[:, 0], cut[:, -1], cut[:, :, 0], cut[:, :, -1]], axis=1)
        tiles = cut.reshape(len(cut), -1, 3).transpose(0, 2, 1)
        return Pattern(np.ascontiguousarray(tiles, np.float32), rim.astype(np.float32), (rows, columns, th, tw))

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the image."""
        rows, columns, th, tw = self.layout
        return rows * th, columns * tw

    @property
    def directions(self) -> np.ndarray:
        """Directions of the rays, (height, width, 3)."""
        return np.moveaxis(self.image(np.moveaxis(self.tiles, 1, 0)), 0, -1)

    def image(self, tiles: Any) -> Any:
        """Convert (*n, tiles, rays of a tile) to images (*n, height, width)."""
        n = tiles.shape[:-2]
        return tiles.reshape(*n, *self.layout).swapaxes(-3, -2).reshape(*n, *self.shape)


def _divisor(length: int, most: int) -> int:
    return next(size for size in range(min(length, most), 0, -1) if length % size == 0)


def seen_by_tiles(
    pattern: Pattern, matrix: Float[Array, "n 3 3"], away: Vec3, reach: Float[Array, "n k"]
) -> Bool[Array, "n t k"]:
    """Whether balls reach into the cones of tiles: the angle to the axis is at most the sum of the half-angles.

    Args:
        pattern: the tiles.
        matrix: map from the sensor's frame to the world.
        away: vectors from the sensor to the balls' centres, world, components (n, k), m.
        reach: the balls' radii, m.
    """
    rim = _unit(_rim(pattern, matrix))
    axis = _unit(Vec3(rim.x.sum(axis=1), rim.y.sum(axis=1), rim.z.sum(axis=1)))
    cos = jnp.min(rim.dot(Vec3(axis.x[:, None], axis.y[:, None], axis.z[:, None])), axis=1)[..., None] - 1e-5
    sin = jnp.sqrt(jnp.maximum(1 - cos**2, 0.0))
    distance = jnp.maximum(jnp.sqrt(away.dot(away)), 1e-6)
    sine = jnp.minimum(reach / distance, 1.0)
    along = sum(a[:, :, None] * (v / distance)[:, None] for a, v in zip(_parts(axis), _parts(away), strict=True))
    limit = cos * jnp.sqrt(1 - sine**2)[:, None] - sin * sine[:, None]
    return (along >= limit) | (distance <= reach)[:, None]


def longest(pattern: Pattern, matrix: Float[Array, "n 3 3"]) -> Float[Array, " n"]:
    """Largest length of one unit of depth along any ray, m."""
    rim = _rim(pattern, matrix)
    return jnp.sqrt(jnp.max(rim.dot(rim), axis=(1, 2)))


def _rim(pattern: Pattern, matrix: Float[Array, "n 3 3"]) -> Vec3:
    """Directions of the rims in the world, components (n, c, t)."""
    rim = np.moveaxis(pattern.rim, 0, -1)
    return Vec3(*(sum(matrix[:, i, j, None, None] * rim[:, j] for j in range(3)) for i in range(3)))


def _unit(v: Vec3) -> Vec3:
    return v * (1.0 / jnp.sqrt(v.dot(v)))


def _parts(v: Vec3) -> tuple[Array, Array, Array]:
    return v.x, v.y, v.z


def following(wanted: Bool[Array, "*n k"]) -> Int[Array, "*n k+1"]:
    """For each place in a list, the first wanted place at or after it; k without one.

    It allows loops that skip places.
    """
    k = wanted.shape[-1]
    before = [(0, 0)] * (wanted.ndim - 1)
    first = jnp.pad(jnp.where(wanted, jnp.arange(k, dtype=jnp.int32), k), [*before, (0, 1)], constant_values=k)
    step = 1
    while step <= k:
        first = jnp.minimum(first, jnp.pad(first[..., step:], [*before, (0, step)], constant_values=k))
        step *= 2
    return first
