"""Random textures of surfaces, computed where they are looked at: pure functions of a point, JAX."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float


def hashed(i: Array, j: Array, seed: Array) -> Array:
    """A number in [0, 1) of a place of a lattice."""
    x = i.astype(jnp.int32).astype(jnp.uint32) * jnp.uint32(0x9E3779B1)
    x ^= j.astype(jnp.int32).astype(jnp.uint32) * jnp.uint32(0x85EBCA77) + (seed * 1e4).astype(jnp.uint32)
    x = (x ^ (x >> 15)) * jnp.uint32(0x2C1B3C6D)
    x = (x ^ (x >> 12)) * jnp.uint32(0x297A2D39)
    return (x ^ (x >> 15)).astype(jnp.float32) / 2.0**32


def smooth(x: Array, y: Array, seed: Array) -> Array:
    """Smooth noise in [0, 1), features of about 1."""
    i, j = jnp.floor(x), jnp.floor(y)
    u, v = (w * w * (3 - 2 * w) for w in (x - i, y - j))
    low, high = (hashed(i, j + k, seed) * (1 - u) + hashed(i + 1, j + k, seed) * u for k in (0, 1))
    return low * (1 - v) + high * v


def texture(which: Array, x: Array, y: Array, u: Float[Array, " 4"]) -> Array:
    """How much of its second colour a surface has, in [0, 1].

    Args:
        which: 0 noise, 1 tiles, 2 planks, 3 checker, 4 shifted plates, 5 gravel, 6 plain, 7 stripes, 8 spots,
            9 diagonal bands.
        x: of the point on the surface, m.
        y: likewise.
        u: numbers in [0, 1): the logarithm of the scale, and seeds.
    """
    scale = 2.0 ** (3 * u[0])  # 1 to 8 a metre
    x, y = x * scale, y * scale
    i, j = jnp.floor(x), jnp.floor(y)

    def tiles() -> Array:
        joint = jnp.maximum(jnp.abs(x - i - 0.5), jnp.abs(y - j - 0.5)) > 0.46
        return jnp.where(joint, 1.0, 0.4 * hashed(i, j, u[1]))

    def planks() -> Array:
        row = jnp.floor(2 * y)
        return 0.6 * hashed(0 * row, row, u[1]) + 0.4 * smooth(x, 14 * y, u[2])

    def plates() -> Array:
        row = jnp.floor(y / 0.866)
        shifted = x + 0.5 * (row % 2)
        at = jnp.floor(shifted)
        return 0.7 * hashed(at, row, u[1]) + 0.3 * (jnp.abs(shifted - at - 0.5) > 0.45)

    def gravel() -> Array:
        return (smooth(6 * x, 6 * y, u[1]) > 0.55) * hashed(jnp.floor(6 * x), jnp.floor(6 * y), u[2])

    def noise() -> Array:
        return 0.6 * smooth(x, y, u[1]) + 0.4 * smooth(9 * x, 9 * y, u[3])

    def spots() -> Array:
        away = (x - i - 0.5) ** 2 + (y - j - 0.5) ** 2
        return 1.0 * (away < (0.15 + 0.3 * hashed(i, j, u[1])) ** 2)

    kinds = [
        noise, tiles, planks, lambda: (i + j) % 2, plates, gravel, lambda: 0 * x, lambda: i % 2, spots,
        lambda: jnp.floor(1.4 * (x + y)) % 2,
    ]  # fmt: skip
    return 0.8 * jax.lax.switch(which, kinds) + 0.2 * smooth(3.1 * x, 3.1 * y, u[2])
