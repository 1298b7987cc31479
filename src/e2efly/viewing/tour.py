"""A smooth flight through a world, clear of solids, and the attitude of a vehicle on it."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.optimize import minimize
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra
from scipy.spatial.transform import Rotation

from e2efly.vehicles.gravity import GRAVITY

CLEAR, WANTED = 0.3, 0.9
"""`CLEAR`: minimum distance from solids in the search for a path, m. `WANTED`: the path is pushed away from solids that
are closer than this, m."""
AROUND = 4.0
"""Distance around the corners in which a path is searched, m."""
NODES = 20_000
"""Approximate number of nodes of the search grid."""
ACCELERATION = 4.0
"""Largest acceleration, along the path and in its curves, m/s^2."""

Clearance = Callable[[Float[Array, "n 3"]], Float[Array, " n"]]


@dataclass(frozen=True)
class Tour:
    """A flight, frame by frame."""

    time: Float[np.ndarray, " t"]
    """Times, s."""
    position: Float[np.ndarray, "t 3"]
    """World, m."""
    quaternion: Float[np.ndarray, "t 4"]
    """Body to world, wxyz."""

    @staticmethod
    def of(position: Float[np.ndarray, "t 3"], period: float) -> "Tour":
        """A flight along positions at intervals of `period` seconds, with the attitudes from `attitudes`."""
        return Tour(period * np.arange(len(position)), position, attitudes(position, period))


def attitudes(position: Float[np.ndarray, "t 3"], period: float) -> Float[np.ndarray, "t 4"]:
    """The attitude of a quadrotor that flies this path: thrust along acceleration minus gravity, heading along the
    velocity.

    Differential flatness (Mellinger and Kumar 2011) with the heading of docs/conventions.md. Where the horizontal speed
    is very low, the heading does not change.

    Args:
        position: positions, world, m.
        period: time from one position to the next, s.

    Returns:
        Quaternions, body to world, wxyz.
    """
    velocity = np.gradient(position, period, axis=0)
    thrust = gaussian_filter1d(np.gradient(velocity, period, axis=0), 0.1 / period, axis=0)
    thrust[:, 2] += GRAVITY
    moves = np.hypot(velocity[:, 0], velocity[:, 1]) > 0.1
    known = np.flatnonzero(moves)
    yaw = np.zeros(len(position))
    if len(known):
        angle = np.unwrap(np.arctan2(velocity[known, 1], velocity[known, 0]))
        yaw = np.interp(np.arange(len(position)), known, angle)
    up = thrust / np.linalg.norm(thrust, axis=1, keepdims=True)
    left = np.cross(up, np.column_stack([np.cos(yaw), np.sin(yaw), np.zeros_like(yaw)]))
    left = left / np.linalg.norm(left, axis=1, keepdims=True)
    xyzw = Rotation.from_matrix(np.stack([np.cross(left, up), left, up], axis=-1)).as_quat()
    return np.roll(xyzw, 1, axis=1)


def plan(
    clearance: Clearance, route: Float[np.ndarray, "k 3"], straight: np.ndarray, period: float, seconds: float = 9.0
) -> Tour:
    """A flight along a route: the shortest collision-free path on a grid, then smoothed.

    Args:
        clearance: points (n, 3) -> signed distance to the nearest solid, m; differentiable.
        route: corners, world, m.
        straight: (k - 1,) whether a leg is flown in a straight line, through a gate.
        period: time between frames, s.
        seconds: approximate duration, s. The speed is between 1.5 and 6 m/s.
    """
    polyline = _clear_way(clearance, route, straight)
    length = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(polyline, axis=0), axis=1)))
    count = int(np.clip(length[-1] / 0.3, 30, 300))
    even = np.stack([np.interp(np.linspace(0, length[-1], count), length, x) for x in polyline.T], axis=1)
    gates = route[:-1][straight] / 2 + route[1:][straight] / 2
    return Tour.of(_timed(_smooth(clearance, even, gates), period, seconds), period)


def _clear_way(clearance: Clearance, route: np.ndarray, straight: np.ndarray) -> np.ndarray:
    """The path from corner to corner by Dijkstra's algorithm, on a grid that stays clear of solids where possible."""
    margin = np.array([AROUND, AROUND, 1.0])
    low, high = route.min(axis=0) - margin, route.max(axis=0) + margin
    cell = max(0.3, float(np.prod(high - low) / NODES) ** (1 / 3))
    shape = tuple(np.ceil((high - low) / cell).astype(int) + 1)
    index = np.stack(np.unravel_index(np.arange(np.prod(shape)), shape), axis=1)
    points = low + cell * index
    gap = np.asarray(jax.jit(clearance)(jnp.asarray(points, jnp.float32)), float)
    cost = 1.0 + 3.0 * np.maximum(WANTED - gap, 0.0)
    free = gap > CLEAR
    rows, columns, weights = [], [], []
    for step in itertools.product((-1, 0, 1), repeat=3):
        if step <= (0, 0, 0):
            continue
        inside = np.all((index + step >= 0) & (index + step < shape), axis=1)
        a = np.flatnonzero(inside)
        b = np.ravel_multi_index((index[a] + step).T, shape)
        a, b = np.stack([a, b])[:, free[a] & free[b]]
        rows.append(a)
        columns.append(b)
        weights.append(cell * np.linalg.norm(step) * (cost[a] + cost[b]) / 2)
    edges = (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns)))
    graph = coo_array(edges, shape=(len(points), len(points))).tocsr()
    way = [route[:1]]
    for start, end, as_it_is in zip(route[:-1], route[1:], straight, strict=True):
        if not as_it_is and np.any(free):
            first, last = (int(np.argmin(np.linalg.norm(points - p, axis=1) + 1e3 * ~free)) for p in (start, end))
            found: Any = dijkstra(graph, directed=False, indices=first, return_predecessors=True)
            before = found[1]
            chain = [last]
            while before[chain[-1]] >= 0:
                chain.append(int(before[chain[-1]]))
            if chain[-1] == first:
                way.append(points[chain[::-1]])
        way.append(end[None])
    whole = np.concatenate(way)
    return whole[np.append(True, np.linalg.norm(np.diff(whole, axis=0), axis=1) > 1e-6)]


def _smooth(clearance: Clearance, points: np.ndarray, gates: np.ndarray) -> np.ndarray:
    """Smooth the path: less curvature, and away from solids. It still passes the gates, and its ends stay."""
    spacing = float(np.mean(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    met = np.argmin(np.linalg.norm(points[:, None] - gates[None], axis=2), axis=0) if len(gates) else np.zeros(0, int)

    def energy(inner: Array) -> Array:
        p = jnp.concatenate([points[:1], inner.reshape(-1, 3), points[-1:]])
        step, bend = jnp.diff(p, axis=0), jnp.diff(p, 2, axis=0)
        near = jnp.maximum(WANTED - clearance(p), 0.0)
        missed = jnp.sum((p[met] - gates) ** 2) if len(gates) else 0.0
        stiff = jnp.sum(bend**2) / spacing**3 + 0.3 * jnp.sum(step**2) / spacing
        return stiff + 30.0 * spacing * jnp.sum(near**2) + 300.0 * missed

    value = jax.jit(jax.value_and_grad(energy))

    def both(x: np.ndarray) -> tuple[float, np.ndarray]:
        e, slope = value(jnp.asarray(x, jnp.float32))
        return float(e), np.asarray(slope, float)

    found = minimize(both, points[1:-1].ravel(), jac=True, method="L-BFGS-B", options={"maxiter": 150})
    return np.concatenate([points[:1], found.x.reshape(-1, 3), points[-1:]])


def _timed(points: np.ndarray, period: float, seconds: float) -> np.ndarray:
    """Positions every `period` seconds: from rest to rest, slower in curves."""
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    curve = CubicSpline(s, points)
    fine = np.linspace(0, s[-1], 2000)
    bend = np.linalg.norm(curve(fine, 2), axis=1)
    top = float(np.clip(s[-1] / seconds * 1.2, 1.5, 6.0))
    square = np.minimum(top**2, ACCELERATION / np.maximum(bend, 1e-6))
    square = np.minimum(square, 2 * ACCELERATION / 2 * np.minimum(fine, s[-1] - fine))
    ds = fine[1]
    speed = np.sqrt(np.maximum(gaussian_filter1d(square, 0.5 / ds), 0.04))
    time = np.append(0.0, np.cumsum(2 * ds / (speed[1:] + speed[:-1])))
    return curve(np.interp(np.arange(0.0, time[-1], period), time, fine))
