"""Random pictures of landing pads from above, with the mask of each: what the network of `mask:onnx` learns from.

A pad is a prism of random outline, height, marking, colours and size on a ground of random texture, under random light
and shadows, with clutter that is no pad (strips, pebbles, stains), seen by a camera of random height, tilt and field of
view, with blur and noise. `UNSEEN` has outlines, markings and grounds that `SEEN` lacks.
"""

from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, PRNGKeyArray, UInt8

from e2efly.simulation.scenes.textures import hashed, smooth, texture
from e2efly.simulation.sensors.image_noise import gaussian, speckle

SIDE = 64
"""Rows and columns of a picture."""
FINE = 3
"""Rays across a pixel: colours are their mean, and a pixel shows the pad where half of its rays meet it."""
LEVELS = 4
"""Heights at which the outline of a prism is looked at: between them the mantle shows."""


@dataclass(frozen=True)
class Variety:
    """Which outlines, markings and grounds are drawn; numbers are those of `_outline`, `_marking` and `texture`."""

    outlines: tuple[int, ...]
    markings: tuple[int, ...]
    grounds: tuple[int, ...]


SEEN = Variety((0, 1, 2, 3), (0, 1, 2, 3, 4), (0, 1, 2, 3))
"""Disc, square, triangle, hexagon; plain, H, ring, checker, rim; noise, tiles, planks, checker."""
UNSEEN = Variety((4, 5, 6), (5, 6), (4, 5))
"""Pentagon, octagon, square with round corners; cross, sectors; shifted plates, speckled gravel."""


def _polygon(corners: int, radius: Array, angle: Array) -> Array:
    step = 2 * jnp.pi / corners
    return radius * jnp.cos((angle + step / 2) % step - step / 2) * (1.25 if corners == 3 else 1.05)


def _outline(which: Array, x: Array, y: Array) -> Array:
    """Signed size of a point: below 1 inside of an outline of half width about 1."""

    def polar(x: Array, y: Array) -> tuple[Array, Array]:
        return jnp.sqrt(x * x + y * y + 1e-9), jnp.arctan2(y, x)

    return jax.lax.switch(
        which,
        [
            lambda x, y: polar(x, y)[0],
            lambda x, y: jnp.maximum(jnp.abs(x), jnp.abs(y)),
            *(lambda x, y, n=n: _polygon(n, *polar(x, y)) for n in (3, 6, 5, 8)),
            lambda x, y: (x**4 + y**4) ** 0.25,
        ],
        x,
        y,
    )


def _marking(which: Array, x: Array, y: Array, size: Array, scale: Array) -> Array:
    """Where a pad has its second colour, of a point of its frame."""
    bar, cells = 0.1 + 0.1 * scale, jnp.floor(3 + 4 * scale)
    middle = jnp.minimum(jnp.abs(x), jnp.abs(y))
    return jax.lax.switch(
        which,
        [
            lambda: jnp.zeros(x.shape, bool),
            lambda: (jnp.abs(jnp.abs(x) - 0.35) < bar) & (jnp.abs(y) < 0.5) | (jnp.abs(y) < bar) & (jnp.abs(x) < 0.35),
            lambda: jnp.abs(jnp.sqrt(x * x + y * y + 1e-9) - 0.55) < bar,
            lambda: hashed(jnp.floor(x * cells), jnp.floor(y * cells), scale * 7.0) < 0.5,
            lambda: size > 1 - 1.5 * bar,
            lambda: (middle < bar) & (size < 0.7),
            lambda: (jnp.floor(jnp.arctan2(y, x) / (jnp.pi / 4)) % 2 < 1) & (size < 0.8),
        ],
    )


def _turned(x: Array, y: Array, angle: Array) -> tuple[Array, Array]:
    return jnp.cos(angle) * x + jnp.sin(angle) * y, jnp.cos(angle) * y - jnp.sin(angle) * x


def _between(u: Array, low: float, high: float) -> Array:
    return low + (high - low) * u


def _pick(key: PRNGKeyArray, choice: tuple[int, ...]) -> Array:
    return jnp.array(choice)[jax.random.randint(key, (), 0, len(choice))]


def _colours(key: PRNGKeyArray, n: int) -> Float[Array, "n 3"]:
    """Grey ones more often than others."""
    a, b, c = jax.random.split(key, 3)
    grey = jax.random.uniform(a, (n, 1), minval=0.05)
    return jnp.clip(grey + jax.random.uniform(b, (n, 1)) * jax.random.uniform(c, (n, 3), minval=-0.6, maxval=0.6), 0, 1)


def _picture(key: PRNGKeyArray, variety: Variety) -> tuple[Float[Array, "h w 3"], Float[Array, "h w"]]:
    keys = jax.random.split(key, 16)
    u = jax.random.uniform(keys[0], (40,))
    # the camera, over the origin
    height = 0.3 * 12.0 ** u[0]  # of the camera over the pad's top, m: 0.3 to 3.6
    half = _between(u[1], 0.17, 0.4)
    thick = jnp.where(u[2] < 0.4, 0.005, _between(u[3], 0.0, 0.25))
    spread = jnp.tan(_between(u[4], 0.6, 0.9))
    tilt, way = _between(u[5] ** 2, 0.0, 0.45), 2 * jnp.pi * u[6]
    at = ((jnp.arange(SIDE * FINE) + 0.5) / (SIDE * FINE) * 2 - 1) * spread
    across, down = jnp.meshgrid(at, at)
    cos, sin = jnp.cos(tilt), jnp.sin(tilt)
    dx, dy, dz = across, -down * cos + sin, jnp.minimum(-cos - down * sin, -0.1)
    dx, dy = _turned(dx, dy, way)

    def meets(depth: Array) -> tuple[Array, Array]:
        """Where rays meet a plane so far under the camera."""
        return -dx / dz * depth, -dy / dz * depth

    # the pad, where the camera looks
    aim = spread * height * jnp.array([_between(u[7], -1.0, 1.0), _between(u[8], -1.0, 1.0)])
    aim += jnp.where(u[9] < 0.08, 50.0, 0.0)  # no pad at all
    aim_x, aim_y = _turned(aim[0], aim[1] + height * jnp.tan(tilt), way)
    outline, marking, ground = (
        _pick(k, c) for k, c in zip(keys[1:4], (variety.outlines, variety.markings, variety.grounds), strict=True)
    )

    def pad(depth: Array) -> tuple[Array, Array, Array]:
        x, y = meets(depth)
        x, y = _turned((x - aim_x) / half, (y - aim_y) / half, 2 * jnp.pi * u[10])
        return x, y, _outline(outline, x, y)

    x, y, size = pad(height)
    top = size < 1
    mantle = jnp.stack([pad(height + thick * k / (LEVELS - 1))[2] < 1 for k in range(1, LEVELS)]).any(0)
    # the ground, with clutter
    base, second, paint, mark, litter, _ = jnp.split(_colours(keys[4], 6), 6)
    second = base + _between(u[11], 0.1, 0.8) * (second - base)
    gx, gy = meets(height + thick)
    tx, ty = _turned(gx + 10 * u[12], gy + 10 * u[13], 2 * jnp.pi * u[14])
    share = texture(ground, tx, ty, jax.random.uniform(keys[5], (4,)))[..., None]
    colour = base[0] * (1 - share) + second[0] * share
    sx, _ = _turned(gx - aim_x, gy - aim_y, 2 * jnp.pi * u[15])
    strip = (jnp.abs(sx - _between(u[16], -1.5, 1.5)) < _between(u[17], 0.01, 0.06)) & (u[18] < 0.5)
    stain = (smooth(2 * tx, 2 * ty, u[19]) > 0.72) & (u[20] < 0.4)
    px, py = 5 * tx, 5 * ty
    i, j = jnp.floor(px), jnp.floor(py)
    away = jnp.sqrt((px - i - 0.5) ** 2 + (py - j - 0.5) ** 2)
    pebble = (away < 0.35 * hashed(i, j, u[21])) & (hashed(i, j, u[22]) < 0.2) & (u[23] < 0.4)
    colour = jnp.where((strip | stain | pebble)[..., None], 0.3 * colour + 0.7 * litter[0], colour)
    # the pad's shadow
    lx, ly = meets(height + thick)
    lx, ly = _turned((lx - aim_x) / half + thick / half * _between(u[24], -1, 1),
                     (ly - aim_y) / half + thick / half * _between(u[25], -1, 1), 2 * jnp.pi * u[10])  # fmt: skip
    colour = jnp.where((_outline(outline, lx, ly) < 1)[..., None], colour * _between(u[26], 0.35, 1.0), colour)
    # its colours: of some, those farthest from the ground's
    several = _colours(keys[6], 4)
    nearest = jnp.minimum(jnp.abs(several - base).max(-1), jnp.abs(several - second).max(-1))
    paint = several[jnp.argmax(nearest)]
    marked = _marking(marking, x, y, size, u[27])[..., None]
    dirt = 1 - 0.25 * u[28] * smooth(8 * x, 8 * y, u[29])[..., None]
    face = jnp.where(marked, mark[0], paint) * dirt
    colour = jnp.where(mantle[..., None], paint * _between(u[30], 0.3, 0.9), colour)
    colour = jnp.where(top[..., None], face, colour)
    # light
    cx, _ = _turned(gx, gy, 2 * jnp.pi * u[31])
    shade = jax.nn.sigmoid((cx - height * _between(u[32], -1, 1)) / (0.02 + 0.2 * u[33]))
    shade = jnp.where(u[34] < 0.4, 1 - shade * _between(u[35], 0.2, 0.7), 1.0)
    shade *= 1 + _between(u[36], -0.3, 0.3) * across / spread
    warm = 1 + _between(u[37], -0.12, 0.12) * jnp.array([1.0, 0.0, -1.0])
    colour = jnp.clip(colour * shade[..., None] * warm * _between(u[38], 0.35, 1.15), 0, 1)
    shown = (top | mantle).astype(jnp.float32)
    pixels = colour.reshape(SIDE, FINE, SIDE, FINE, 3).mean((1, 3))
    cells = shown.reshape(SIDE, FINE, SIDE, FINE).mean((1, 3))
    padded = jnp.pad(pixels, ((1, 1), (1, 1), (0, 0)), mode="edge")
    blurred = sum(padded[a : a + SIDE, b : b + SIDE] for a in range(3) for b in range(3)) / 9
    pixels += 0.7 * u[39] * (blurred - pixels)
    pixels = speckle(keys[7], pixels, 0.06 * jax.random.uniform(keys[8]))
    pixels = gaussian(keys[9], pixels, 0.04 * jax.random.uniform(keys[10]) ** 2)
    return pixels, (cells >= 0.5).astype(jnp.float32)


@partial(jax.jit, static_argnums=(1, 2))
def pictures(key: PRNGKeyArray, n: int, variety: Variety) -> tuple[UInt8[Array, "n h w 3"], UInt8[Array, "n h w"]]:
    """Colours, 255 for 1, and masks, 0 or 1."""
    colours, masks = jax.lax.map(lambda k: _picture(k, variety), jax.random.split(key, n))
    return jnp.round(255 * colours).astype(jnp.uint8), masks.astype(jnp.uint8)
