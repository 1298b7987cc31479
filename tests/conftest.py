"""Fixtures of the whole suite. The package computes in float32; a test that needs float64 asks for `x64`."""

from collections.abc import Callable, Iterator

import jax
import jax.numpy as jnp
import numpy as np
import pytest

Jacobians = Callable[..., tuple[np.ndarray, np.ndarray]]


@pytest.fixture
def x64() -> Iterator[None]:
    with jax.enable_x64(True):
        yield


@pytest.fixture(scope="session")
def jacobians() -> Jacobians:
    """(f, points (b, p), step) -> Jacobians (b, o, p) of `f: (p,) -> (o,)`, by reverse mode and central differences."""

    def both(f: Callable[[jax.Array], jax.Array], points: jax.Array, step: float = 1e-5) -> tuple:
        exact = jax.jit(jax.vmap(jax.jacrev(f)))(points)
        offsets = step * jnp.eye(points.shape[1])
        moved = jnp.stack([points[:, None] + offsets, points[:, None] - offsets])
        ahead, behind = jax.jit(jax.vmap(jax.vmap(jax.vmap(f))))(moved)
        return np.asarray(exact), np.asarray(jnp.swapaxes(ahead - behind, 1, 2) / (2 * step))

    return both
