"""Jacobians by reverse mode and by central differences, of functions that map rows to rows."""

from collections.abc import Callable

import jax
import jax.numpy as jnp

Rows = Callable[[jax.Array], jax.Array]
"""(n, p) -> (n, o), row by row."""


def reverse(f: Rows, points: jax.Array, outputs: int) -> jax.Array:
    """Jacobian of each row by reverse mode, (b, o, p): each row repeated, each of its outputs weighted once."""
    b, p = points.shape
    weights = jnp.tile(jnp.eye(outputs), (b, 1))
    gradient = jax.grad(lambda x: jnp.sum(f(x) * weights))(jnp.repeat(points, outputs, axis=0))
    return gradient.reshape(b, outputs, p)


def central(f: Rows, points: jax.Array, step: float = 1e-5) -> jax.Array:
    """Jacobian of each row by central differences, (b, o, p)."""
    b, p = points.shape
    moves = jnp.concatenate([jnp.eye(p), -jnp.eye(p)]) * step
    values = f((points[:, None] + moves).reshape(-1, p)).reshape(b, 2, p, -1)
    return jnp.swapaxes(values[:, 0] - values[:, 1], 1, 2) / (2 * step)
