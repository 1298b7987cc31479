"""Distances of points to a world of triangles: a grid of signed distances, computed once, read with gradients.

Lengths are exact distances to a few triangles: those in the surface cell nearest to the point.

Signs come from rays. From every point of the grid, rays go out in 6 directions, and in 8 more if these disagree. A ray
began inside a solid if it has crossed the backs of triangles more often than the fronts. A point is solid if more than
two thirds of the rays that meet anything began inside a solid. Holes do no harm: a ray that leaves through a hole meets
nothing, or is outvoted. The method needs triangles that face the free space: the outside of an object, the inside of a
room.

A single sheet that stands free in the air has no inside. The distance to it is positive on both sides.
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
from e2efly.simulation.device import cores
from e2efly.simulation.scenes.meshes.engine import needed
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene

MOST = 50_000_000
"""Largest number of values in a grid."""
_TRIED = 4
"""Number of triangles that are tested for a point: those nearest to the middle of the cell."""
_CROSSINGS = 12
"""Largest number of triangles through which a ray is followed."""
_STEP = 1e-4
"""Distance behind one triangle at which the search for the next begins, m."""
_SHARE = 2 / 3
_BATCH = 50_000
_AXES = np.array([axis for k in (1, 3) for axis in itertools.product((-1, 0, 1), repeat=3) if np.abs(axis).sum() == k])
_TURN = Rotation.from_rotvec([0.5, 0.3, 0.7]).as_matrix()
_DIRECTIONS = (_AXES / np.linalg.norm(_AXES, axis=1, keepdims=True) @ _TURN).astype(np.float32)
"""Directions through the 6 faces and the 8 corners of a cube, rotated so that none is parallel to usual walls or meets
their edges."""
_BEFORE, _LEAST = 6, 2
"""The first number of rays suffices if at least the second number of them meet something, and they agree."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class DistanceGrid:
    """Signed distances at the points of a grid; leaves."""

    values: Float[Array, "x y z"]
    """Distances, m, negative inside solids."""
    origin: Float[Array, "3"]
    """First point of the grid, world, m."""
    cell: Float[Array, ""]
    """Distance between neighbouring points, m."""

    @staticmethod
    def of(
        scene: MeshScene, cell: float = 0.2, margin: float = 1.0, box: tuple[Any, Any] | None = None
    ) -> "DistanceGrid":
        """The grid of a scene.

        Args:
            scene: the world.
            cell: distance between neighbouring points, m. The error of interpolated distances is below half of it, and
                smallest where surfaces are smooth.
            margin: distance by which the grid extends beyond the box, m. The grid does not contain anything outside it.
            box: lowest and highest corner, m. If left out: `scene.bounds`.

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
    """Signed distance of points (world) to the nearest surface, m, negative inside: `scene.clearance` for a grid.

    It is trilinear between the points of the grid, and differentiable. Outside the grid, the distance to the grid is
    added to the value at its border. The result may be too large there, but never too small. Nothing moves, so the time
    does not matter.
    """
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
    """Points distributed over the triangles that reach into the box, and the triangle of each point.

    Triangles are halved until their sides are at most two spacings long. Their corners and the middles of their sides
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
    """Distance of each point to its triangle.

    It is the distance to the plane if the point is above the triangle, otherwise to the nearest side.
    """
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
    with needed("mesh"):
        from e2efly.simulation.scenes.meshes.embree import Embree

    embree = Embree(scene.triangles, watertight=True)

    def crossed(start: np.ndarray, way: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """For rays: 1 if they first leave a solid, -1 if they first enter one, 0 without a hit; and its distance."""
        depth, face = embree.first(start, way)
        out = np.sign(_dot(scene.normal[face], way))
        return np.where(face >= 0, np.where(out == 0, -1, out), 0), depth

    def begins_in(start: np.ndarray, way: np.ndarray, sign: np.ndarray, depth: np.ndarray) -> np.ndarray:
        """For rays that first enter a solid: whether, at any place, they have left solids more often than entered."""
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
        """Number of rays that meet something, and number of these that began inside a solid."""
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
        return (inside > 1) & (inside > _SHARE * met)  # a single ray may have met a silhouette

    return _in_threads(some, points)
