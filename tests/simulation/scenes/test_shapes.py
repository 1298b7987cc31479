"""Shapes: rays and distances are two independent formulas of one solid, and must tell the same."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import cKDTree

from e2efly.courses.solids import DISC, SQUARE, TRIANGLE
from e2efly.simulation.scenes.shapes import FAR, SHAPES

SIZED = {
    "box": [(0.5, 0.3, 0.2)],
    "sphere": [(0.4,)],
    "cylinder": [(0.3, 0.6), (0.6, 0.1)],
    "capsule": [(0.25, 0.5)],
    "gate": [(0.5, 0.4, 0.1, 0.05), (0.3, 0.5, 0.2, 0.3)],
    "pad": [(0.25, 0.1, DISC), (0.25, 0.1, SQUARE), (0.25, 0.1, TRIANGLE)],
}
CASES = [pytest.param(kind, size, id=f"{kind}{i}") for kind, sizes in SIZED.items() for i, size in enumerate(sizes)]
RAYS = 4000


def padded(size: tuple[float, ...]) -> jax.Array:
    return jnp.asarray([*size, *[0.0] * (4 - len(size))], jnp.float32)


def directions(rng: np.random.Generator, n: int) -> np.ndarray:
    d = rng.standard_normal((n, 3))
    return (d / np.linalg.norm(d, axis=1, keepdims=True)).astype(np.float32)


def enter(kind: str, size: jax.Array, o: np.ndarray, d: np.ndarray) -> np.ndarray:
    return np.asarray(SHAPES[kind].enter(size, tuple(jnp.asarray(o).T), tuple(jnp.asarray(d).T)))


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("kind", "size"), CASES)
def test_a_ray_enters_where_marching_by_the_distance_ends(kind: str, size: tuple[float, ...]) -> None:
    rng = np.random.default_rng(1)
    o = 1.5 * directions(rng, RAYS)
    d = -0.8 * o + 0.6 * directions(rng, RAYS)
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    t = enter(kind, padded(size), o, d)
    marched = np.zeros(RAYS)
    for _ in range(400):
        marched += np.asarray(SHAPES[kind].distance(padded(size), jnp.asarray(o + marched[:, None] * d)))
        marched = np.minimum(marched, 10.0)
    hit = t < FAR
    away = np.asarray(SHAPES[kind].distance(padded(size), jnp.asarray(o + marched[:, None] * d)))
    assert 0.02 < np.mean(hit) < 0.98
    clear = np.abs(marched - t) < 2e-3
    assert np.mean(np.where(hit, clear, away > 1e-4)) > 0.998  # what is left grazes an edge
    assert np.all(marched[hit] < t[hit] + 2e-3)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("kind", "size"), CASES)
def test_the_distance_is_that_of_the_nearest_point_that_rays_find(kind: str, size: tuple[float, ...]) -> None:
    rng = np.random.default_rng(2)
    o = 1.5 * directions(rng, 60_000)
    d = rng.uniform(-0.8, 0.8, o.shape).astype(np.float32) - o
    t = enter(kind, padded(size), o, d)
    surface = (o + t[:, None] * d)[t < FAR]
    p = rng.uniform(-1.5, 1.5, (400, 3)).astype(np.float32)
    distance, gradient = jax.vmap(jax.value_and_grad(lambda q: SHAPES[kind].distance(padded(size), q)))(p)
    outside = np.asarray(distance) > 0.01
    nearest = cKDTree(surface).query(p)[0]
    assert np.all(nearest[outside] > distance[outside] - 1e-4)
    assert np.quantile((nearest - distance)[outside], 0.9) < 0.01
    np.testing.assert_allclose(np.linalg.norm(gradient, axis=1)[outside], 1.0, atol=1e-3)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("kind", "size"), CASES)
def test_normals_are_the_gradient_of_the_distance(kind: str, size: tuple[float, ...]) -> None:
    rng = np.random.default_rng(3)
    o = 1.5 * directions(rng, RAYS)
    d = -o / 1.5 + 0.2 * directions(rng, RAYS)
    t = enter(kind, padded(size), o, d)
    hit = t < FAR
    at = (o + t[:, None] * d)[hit]
    x, y, z = SHAPES[kind].normal(padded(size), tuple(jnp.asarray(at).T))
    normal = np.stack([np.broadcast_to(part, x.shape) for part in (x, y, z)], axis=-1)
    gradient = jax.vmap(jax.grad(lambda q: SHAPES[kind].distance(padded(size), q)))(at + 1e-3 * normal)
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0, atol=1e-3)
    assert np.mean(np.sum(normal * np.asarray(gradient), axis=1) > 0.99) > 0.98


@pytest.mark.parametrize(("kind", "size"), CASES)
def test_inside_a_ray_has_entered_and_the_distance_is_negative(kind: str, size: tuple[float, ...]) -> None:
    rng = np.random.default_rng(4)
    p = rng.uniform(-0.8, 0.8, (RAYS, 3)).astype(np.float32)
    distance = np.asarray(SHAPES[kind].distance(padded(size), jnp.asarray(p)))
    t = enter(kind, padded(size), p, directions(rng, RAYS))
    clear = np.abs(distance) > 1e-4
    np.testing.assert_array_equal((t == 0)[clear], (distance < 0)[clear])
    assert 0.005 < np.mean(distance < 0) < 0.6


@pytest.mark.parametrize(("kind", "size"), CASES)
def test_everything_inside_is_within_reach(kind: str, size: tuple[float, ...]) -> None:
    rng = np.random.default_rng(5)
    p = rng.uniform(-1.0, 1.0, (20_000, 3)).astype(np.float32)
    inside = np.asarray(SHAPES[kind].distance(padded(size), jnp.asarray(p))) < 0
    reach = float(SHAPES[kind].reach(padded(size)))
    farthest = np.linalg.norm(p[inside], axis=1).max()
    assert farthest <= reach < 1.4 * farthest + 0.05


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("kind", "size"), CASES)
def test_gradients_of_the_distance_against_differences_and_at_the_centre(kind: str, size: tuple[float, ...]) -> None:
    rng = np.random.default_rng(6)
    p = rng.uniform(-1.0, 1.0, (200, 3)).astype(np.float32)
    f = jax.jit(jax.vmap(lambda q: SHAPES[kind].distance(padded(size), q)))
    gradient = np.asarray(jax.vmap(jax.grad(lambda q: SHAPES[kind].distance(padded(size), q)))(p))
    step = 2e-3
    numeric = np.stack([(f(p + step * e) - f(p - step * e)) / (2 * step) for e in np.eye(3, dtype=np.float32)], axis=1)
    assert np.mean(np.abs(numeric - gradient).max(axis=1) < 0.02) > 0.95  # the others straddle a corner
    for point in ([0.0, 0.0, 0.0], [0.0, 0.0, 2.0], list(padded(size)[:3])):
        assert np.all(np.isfinite(jax.grad(lambda q: SHAPES[kind].distance(padded(size), q))(jnp.asarray(point))))


def test_the_sides_of_a_triangle_are_as_long_as_the_square_is_wide() -> None:
    corners = np.array([[-0.25, -0.25 / np.sqrt(3)], [0.25, -0.25 / np.sqrt(3)], [0.0, 0.5 / np.sqrt(3)]])
    on = SHAPES["pad"].distance(padded((0.25, 0.1, TRIANGLE)), jnp.asarray(np.pad(corners, [(0, 0), (0, 1)])))
    np.testing.assert_allclose(on, 0.0, atol=1e-6)
