"""The appearance of hits: labels, normals, and colours under a sun that casts shadows."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.simulation.scenes.nearest_hits import Form, Kinds, TileSight, number, over, turned
from e2efly.simulation.scenes.scene import COLOURS, GROUND, SKY
from e2efly.simulation.scenes.shapes import FAR, SHAPES, Components

ODD = 0.5
"""Value for instance 1, the ground, on every other square of the ground."""
_DARK = 0.75
"""Brightness of these squares."""
_BIAS = 1e-3
"""Distance above the surface from which a shadow is looked for, m."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Light:
    """The light of a scene; leaves."""

    sun: Float[Array | np.ndarray, "n 3"]
    """Unit vector to the sun, world."""
    strength: Float[Array | np.ndarray, " n"]
    """Strength of the sun. The ambient light is `1 - strength`."""
    checker: Float[Array | np.ndarray, " n"]
    """Side of the squares on the ground, m. 0: the ground is plain."""


def usual_light(n: int) -> Light:
    """A sun 50 degrees high in the south-west, and squares of one metre on the ground."""
    sun = np.array([-0.45, -0.45, 0.77], np.float32)
    sun = sun / np.linalg.norm(sun)
    return Light(np.tile(sun, (n, 1)), np.full(n, 0.65, np.float32), np.ones(n, np.float32))


def squares(seen: TileSight, light: Light, d: Float[Array, "3 r"], t: Float[Array, " r"]) -> Float[Array, " r"]:
    """The instance on the ground, with `ODD` on every other square, and that of the sky."""
    world = turned(seen.matrix.reshape(9), d)
    scale = jnp.where(light.checker > 0, 1.0 / jnp.where(light.checker > 0, light.checker, 1.0), 0.0)
    half = sum(jnp.floor((seen.origin[i] + t * world[i]) * scale) for i in (0, 1)) / 2.0
    return jnp.where(t < FAR, 1.0 - (half - jnp.floor(half)) * 2.0 * (1.0 - ODD), 0.0)


@dataclass(frozen=True)
class Hits:
    """The hits of the rays of one tile of one camera."""

    seen: TileSight
    kinds: Kinds
    tile: Array
    d: Float[Array, "3 r"]
    t: Float[Array, " r"]
    who: Float[Array, " r"]
    """Instance number, or `ODD`."""

    def looks(self, channels: tuple[str, ...], light: Light | None) -> dict[str, Array]:
        """Planes of `channels`: label; nx, ny, nz; r, g, b."""
        if self.seen.looks is None:
            return {}
        t, who, table = self.t, self.who, self.seen.looks
        ground, zero = who > 0, jnp.zeros_like(t)
        planes: dict[str, Array] = {}
        if "label" in channels:
            planes["label"] = jnp.where(ground, float(GROUND), float(SKY))
        if "normal" in channels:
            planes |= {"nx": zero, "ny": zero, "nz": jnp.where(ground, 1.0, 0.0)}
        if light is not None:
            for c, name in enumerate("rgb"):
                tone = jnp.where(who == ODD, _DARK, 1.0) * COLOURS[GROUND, c]
                planes[name] = jnp.where(ground, tone, COLOURS[SKY, c])
            planes["bright"] = jnp.where(ground, _brightness(light, light.sun[2]), 1.0)

        def added(kind: str, i: Array, planes: dict[str, Array]) -> dict[str, Array]:
            row = table[:, i]
            form = Form.of(self.seen, i)
            point = tuple(o + t * v for o, v in zip(form.origin, form.direction(self.d), strict=True))
            normal = SHAPES[kind].normal(form.size, point)  # pyright: ignore
            x, y, z = turned(row[4:13].reshape(3, 3).T.reshape(9), normal)
            new = {"label": row[0], "r": row[1], "g": row[2], "b": row[3], "nx": x, "ny": y, "nz": z}
            if light is not None:
                new["bright"] = _brightness(light, _dot(normal, turned(row[4:13], light.sun)))
            return {name: jnp.where(who == number(i), new[name], plane) for name, plane in planes.items()}

        following = self.seen.following[self.tile]
        planes = over(self.kinds, lambda i: following[i + 1], added, planes)
        if light is not None:
            bright = self._shadowed(light, planes.pop("bright"), table)
            planes |= {name: planes[name] * bright for name in "rgb"}
        return planes

    def _shadowed(self, light: Light, bright: Array, table: Array) -> Array:
        """The brightness, without the sun's part where an obstacle casts a shadow."""
        if self.seen.shading is None:
            return bright
        near, dark, shading = self.t * (1.0 - _BIAS), 1.0 - light.strength, self.seen.shading[self.tile]

        def darkened(kind: str, i: Array, bright: Array) -> Array:
            form, sun = Form.of(self.seen, i), turned(table[4:13, i], light.sun)
            x, y, z = (
                o + near * v + _BIAS * s for o, v, s in zip(form.origin, form.direction(self.d), sun, strict=True)
            )
            return jnp.where(SHAPES[kind].enter(form.size, (x, y, z), sun) < FAR, dark, bright)

        return jnp.where(self.t < FAR, over(self.kinds, lambda i: shading[i + 1], darkened, bright), bright)


def _brightness(light: Light, cosine: Array) -> Array:
    """Brightness of a surface in the sun, from the cosine of the angle between the sun and the normal."""
    strength = jnp.asarray(light.strength)
    return 1.0 - strength + strength * jnp.maximum(cosine, 0.0)


def _dot(a: Components, b: Any) -> Array:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
