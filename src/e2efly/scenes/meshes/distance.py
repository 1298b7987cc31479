"""How far points are from a world of triangles: a grid of signed distances, made once, read with gradients.

Lengths are exact distances to a few triangles, those in the cell of the surface that is nearest to the point.
Signs come from rays: from every point of the grid they go out in 6 directions, and in 8 more where these disagree.
Where a ray has come out through backs of triangles more often than it has gone in through fronts, it began in something
solid; a point is solid if more than two thirds of the rays that meet anything say so. Holes do no harm: a ray that
leaves through one meets nothing or is outvoted. It needs triangles that face where one can fly: an object's outside, a
room's inside.
A single sheet that stands free in the air has no inside: the distance to it is positive on both sides.
"""

import itertools
import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int
from scipy import ndimage
from scipy.spatial.transform import Rotation

from e2efly.control.vectors import safe_sqrt
from e2efly.device import cores
from e2efly.scenes.meshes.engine import needed
from e2efly.scenes.meshes.scene import MeshScene

MOST = 50_000_000
"""Values of a grid."""
_TRIED = 4
"""Triangles that are tried for a point: the nearest to the middle of the cell."""
_CROSSINGS = 12
"""Triangles that a ray is followed through."""
_STEP = 1e-4
"""How far behind one triangle the next is looked for, m."""
_SHARE = 2 / 3
_BATCH = 50_000
_AXES = np.array([axis for k in (1, 3) for axis in itertools.product((-1, 0, 1), repeat=3) if np.abs(axis).sum() == k])
_TURN = Rotation.from_rotvec([0.5, 0.3, 0.7]).as_matrix()
_DIRECTIONS = (_AXES / np.linalg.norm(_AXES, axis=1, keepdims=True) @ _TURN).astype(np.float32)
"""Through the 6 faces and the 8 corners of a cube, turned so that none lies along usual walls or meets their edges."""
_BEFORE, _LEAST = 6, 2
"""If of the first so many rays at least so many meet something and agree, they suffice."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class DistanceGrid:
    """Signed distances at the points of a grid; leaves."""

    values: Float[Array, "x y z"]
    """m, negative in what is solid."""
    origin: Float[Array, "3"]
    """Its first point, world, m."""
    cell: Float[Array, ""]
    """From point to point, m."""

    @staticmethod
    def of(
        scene: MeshScene, cell: float = 0.2, margin: float = 1.0, box: tuple[Any, Any] | None = None
    ) -> "DistanceGrid":
        """The grid of a scene.

        Args:
            scene: the world.
            cell: from point to point, m. Interpolated distances are wrong by less than half of it, least where
                surfaces are smooth.
            margin: how far the grid reaches beyond the box, m. What lies outside of it is unknown to the grid.
            box: lowest and highest corner, m; `scene.bounds` when left out.

        Raises:
            ValueError: naming what is wrong and what is accepted, or the package that is missing.
        """
        if not (cell > 0 and margin >= 0):
            raise ValueError(
                f"cell and margin are {cell} and {margin} m; accepted: a positive number, and one of 0 or more"
            )
        low, high = (np.asarray(corner, np.float64) for corner in box or scene.bounds)
        if low.shape != (3,) or high.shape != (3,) or not np.all(low <= high):
            raise ValueError(
                f"box is {low.tolist()} to {high.tolist()}; accepted: lowest and highest corner, 3 numbers each"
            )
        low, high = low - margin, high + margin
        shape = np.maximum(np.ceil((high - low) / cell), 1).astype(int) + 1
        if math.prod(shape.tolist()) > MOST:
            least = cell * (math.prod(shape.tolist()) / MOST) ** (1 / 3)
            raise ValueError(
                f"cell is {cell} m: a grid of {' x '.join(map(str, shape))}; accepted: from {least:.2g} m on"
            )
        axes = [low[i] + cell * np.arange(shape[i]) for i in range(3)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3).astype(np.float32)
        away, solid = _away(scene, points, low, cell, tuple(shape)), _solid(scene, points)
        values = np.where(solid, -away, away).reshape(shape)
        return DistanceGrid(jnp.asarray(values), jnp.asarray(low, jnp.float32), jnp.float32(cell))


def clearance(
    grid: DistanceGrid, position: Float[Array, "n 3"], time: Float[Array, " n"] | None = None
) -> Float[Array, " n"]:
    """Signed distance of points to what is nearest, m; negative inside: `e2efly.scenes.scene.clearance` of a grid.

    Trilinear between the grid's points; differentiable. Outside of the grid, the distance to it is added to what its
    border says, which may be too far, never too near.

    Args:
        grid: of the one world.
        position: world, m.
        time: not looked at; nothing moves.
    """
    del time
    most = jnp.asarray(grid.values.shape) - 1
    place = (position - grid.origin) / grid.cell
    inside = jnp.clip(place, 0.0, most)
    first = jnp.clip(jnp.floor(jax.lax.stop_gradient(inside)), 0, most - 1).astype(jnp.int32)
    share = inside - first
    found = jnp.zeros(position.shape[:-1])
    for corner in itertools.product((0, 1), repeat=3):
        i, j, k = (first[..., axis] + corner[axis] for axis in range(3))
        weight = jnp.prod(jnp.where(jnp.asarray(corner) == 1, share, 1 - share), axis=-1)
        found = found + weight * grid.values[i, j, k]
    beyond = (place - inside) * grid.cell
    return found + safe_sqrt(jnp.sum(beyond**2, axis=-1))


def _in_threads(work: Callable[..., np.ndarray], *points: np.ndarray) -> np.ndarray:
    parts = [[each[i : i + _BATCH] for i in range(0, len(points[0]), _BATCH)] for each in points]
    with ThreadPoolExecutor(cores()) as pool:
        return np.concatenate(list(pool.map(work, *parts)))


def _away(
    scene: MeshScene, points: np.ndarray, low: np.ndarray, cell: float, shape: tuple[int, ...]
) -> Float[np.ndarray, " n"]:
    """Unsigned distances of the points of a grid."""
    samples, owner = _samples(scene.triangles, cell, (low, low + cell * (np.array(shape) - 1)))
    place = np.rint((samples - low) / cell).astype(np.int64)
    within = np.all((place >= 0) & (place < shape), axis=1)
    if not np.any(within):
        raise ValueError("box: there is nothing of the scene in it; accepted: one that something reaches into")
    surface = np.ravel_multi_index(tuple(place[within].T), shape)
    pairs = np.unique(surface * len(scene.triangles) + owner[within])
    surface, face = np.divmod(pairs, len(scene.triangles))
    order = np.lexsort((to_triangles(points[surface], scene.triangles[face]), surface))
    surface, face = surface[order], face[order]
    cells, first, counts = np.unique(surface, return_index=True, return_counts=True)
    empty = np.ones(math.prod(shape), bool)
    empty[cells] = False
    nearest: Any = ndimage.distance_transform_edt(empty.reshape(shape), return_distances=False, return_indices=True)
    number: Any = np.searchsorted(cells, np.ravel_multi_index(tuple(nearest.reshape(3, -1)), shape))

    def some(part: np.ndarray, number: np.ndarray) -> np.ndarray:
        best = np.full(len(part), np.inf, np.float32)
        for i in range(_TRIED):
            has = np.flatnonzero(counts[number] > i)
            found = to_triangles(part[has], scene.triangles[face[first[number[has]] + i]])
            best[has] = np.minimum(best[has], found)
        return best

    return _in_threads(some, points, number)


def _samples(
    triangles: Float[np.ndarray, "f 3 3"], spacing: float, box: tuple[Any, Any]
) -> tuple[Float[np.ndarray, "s 3"], Int[np.ndarray, " s"]]:
    """Points all over the triangles that reach into the box, and the triangle of each.

    Triangles are halved until their sides are two spacings long at most; their corners and the middles of their sides
    are the points.
    """
    pieces, owner, done = triangles.astype(np.float32), np.arange(len(triangles)), []
    while len(pieces):
        within = np.all((pieces.max(axis=1) >= box[0]) & (pieces.min(axis=1) <= box[1]), axis=1)
        pieces, owner = pieces[within], owner[within]
        sides = np.linalg.norm(pieces - np.roll(pieces, -1, axis=1), axis=2)
        small = sides.max(axis=1) <= 2 * spacing
        done.append((pieces[small], owner[small]))
        pieces, owner, longest = pieces[~small], owner[~small], sides[~small].argmax(axis=1)
        row = np.arange(len(pieces))
        a, b, c = (pieces[row, (longest + i) % 3] for i in range(3))
        middle = (a + b) / 2
        pieces = np.concatenate([np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
        owner = np.concatenate([owner, owner])
    small = np.concatenate([piece for piece, _ in done])
    points = np.concatenate([small, (small + np.roll(small, -1, axis=1)) / 2], axis=1)
    return points.reshape(-1, 3), np.repeat(np.concatenate([which for _, which in done]), 6)


def to_triangles(p: Float[np.ndarray, "n 3"], triangles: Float[np.ndarray, "n 3 3"]) -> Float[np.ndarray, " n"]:
    """Distance of each point to its triangle: to the plane over it, else to the nearest side."""
    corners = [triangles[:, i] for i in range(3)]
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    plane = np.abs(_dot(p - corners[0], normal)) / np.sqrt(_dot(normal, normal))
    over, nearest = np.ones(len(p), bool), np.full(len(p), np.inf, np.float32)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        side, from_a = corners[b] - corners[a], p - corners[a]
        over &= _dot(np.cross(side, from_a), normal) >= 0
        along = np.clip(_dot(from_a, side) / _dot(side, side), 0, 1)
        gap = from_a - along[:, None] * side
        nearest = np.minimum(nearest, _dot(gap, gap))
    return np.where(over, plane, np.sqrt(nearest))


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ni,ni->n", a, b)


def _solid(scene: MeshScene, points: Float[np.ndarray, "n 3"]) -> Bool[np.ndarray, " n"]:
    """Whether points are in something."""
    with needed("mesh"):
        from e2efly.scenes.meshes.embree import Embree

    embree = Embree(scene.triangles, watertight=True)

    def crossed(start: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of rays: 1 where they come out first, -1 where they go in, 0 for nothing; and how far that is."""
        depth, face = embree.first(start, way)
        out = np.sign(_dot(scene.normal[face], way))
        return np.where(face >= 0, np.where(out == 0, -1, out), 0), depth

    def begins_in(start: np.ndarray, way: np.ndarray, sign: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """Of rays that go in first: whether they come out more often anywhere on their way."""
        balance, result, left = np.full(len(start), -1), np.zeros(len(start), bool), np.arange(len(start))
        for _ in range(_CROSSINGS):
            start = start + (depth + _STEP)[:, None] * way
            sign, depth = crossed(start, way)
            balance[left] += sign.astype(int)
            result[left] |= balance[left] > 0
            on = (sign != 0) & ~result[left]
            start, way, depth, left = start[on], way[on], depth[on], left[on]
        return result

    def voted(part: np.ndarray, ways: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How many of the rays meet something, and how many of these began in something."""
        spread = [np.broadcast_to(way, part.shape) for way in ways]
        first, depth = (np.stack(each) for each in zip(*(crossed(part, way) for way in spread), strict=True))
        out = first > 0
        mixed = np.any(out, axis=0) & np.any(first < 0, axis=0)
        for i, way in enumerate(spread):
            unsure = np.flatnonzero(mixed & (first[i] < 0))
            out[i, unsure] = begins_in(part[unsure], way[unsure], first[i, unsure], depth[i, unsure])
        return np.abs(first).sum(axis=0), out.sum(axis=0)

    def some(part: np.ndarray) -> np.ndarray:
        met, inside = voted(part, _DIRECTIONS[:_BEFORE])
        unsure = np.flatnonzero((met < _LEAST) | ((inside > 0) & (inside < met)))
        more, more_inside = voted(part[unsure], _DIRECTIONS[_BEFORE:])
        met[unsure] += more
        inside[unsure] += more_inside
        return (inside > 1) & (inside > _SHARE * met)  # one alone may have met a silhouette

    return _in_threads(some, points)
