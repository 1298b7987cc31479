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
            9 diagonal bands, 10 cells, 11 marble, 12 waves, 13 blocks, 14 ramps, 15 crosses, 16 camouflage,
            17 triangles, 18 rings, 19 weave.
        x: of the point on the surface, m.
        y: likewise.
        u: numbers in [0, 1): the logarithm of the scale, and seeds.
    """
    scale = 2.0 ** (3 * u[0])  # 1 to 8 a metre
    x, y = x * scale, y * scale
    i, j = jnp.floor(x), jnp.floor(y)
    right, up = x - i - 0.5, y - j - 0.5

    def tiles() -> Array:
        joint = jnp.maximum(jnp.abs(right), jnp.abs(up)) > 0.46
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
        return 1.0 * (right**2 + up**2 < (0.15 + 0.3 * hashed(i, j, u[1])) ** 2)

    def cells() -> Array:
        nearest, value = jnp.full_like(x, jnp.inf), jnp.zeros_like(x)
        for a in (-1, 0, 1):
            for b in (-1, 0, 1):
                m, n = i + a, j + b
                away = (m + hashed(m, n, u[1]) - x) ** 2 + (n + hashed(m, n, u[2]) - y) ** 2
                value = jnp.where(away < nearest, hashed(m, n, u[3]), value)
                nearest = jnp.minimum(away, nearest)
        return value

    def blocks() -> Array:
        return jnp.where(hashed(i // 3, j // 2, u[1]) > 0.5, hashed(i, j, u[2]) > 0.4, hashed(i, j // 3, u[3]))

    def crosses() -> Array:
        thin, long = jnp.minimum(jnp.abs(right), jnp.abs(up)), jnp.maximum(jnp.abs(right), jnp.abs(up))
        return 1.0 * ((thin < 0.1) & (long < 0.2 + 0.25 * hashed(i, j, u[1])))

    kinds = [
        noise, tiles, planks, lambda: (i + j) % 2, plates, gravel, lambda: 0 * x, lambda: i % 2, spots,
        lambda: jnp.floor(1.4 * (x + y)) % 2, cells, lambda: 0.5 + 0.5 * jnp.sin(4 * x + 9 * smooth(x, y, u[1])),
        lambda: jnp.floor(y + 0.4 * jnp.sin(4 * x)) % 2, blocks, lambda: y - j, crosses,
        lambda: jnp.round(1.5 * smooth(2 * x, 2 * y, u[1]) + 0.5 * smooth(5 * x, 5 * y, u[3])) / 2,
        lambda: (right + up > 0) * hashed(i, j, u[1]), lambda: jnp.floor(5 * jnp.hypot(right, up)) % 2,
        lambda: jnp.floor(4 * jnp.where((i + j) % 2 > 0, x, y)) % 2,
    ]  # fmt: skip
    return jax.lax.switch(which, kinds)


def worn(share: Array, x: Array, y: Array, u: Float[Array, "... 4"]) -> Array:
    """A texture that is no longer even. `u` is that of the texture, of all points or of each."""
    scale = 3.1 * 2.0 ** (3 * u[..., 0])
    return 0.8 * share + 0.2 * smooth(scale * x, scale * y, u[..., 2])
