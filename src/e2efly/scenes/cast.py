"""Rays against a batch of worlds: the first thing that each meets, exactly.

An image is cut into tiles; a solid is tried on a tile only if its ball reaches into the tile's cone. On a CPU one
camera's tile follows another, with a loop over the solids that skips what cannot be seen: XLA makes one machine
function of it, which works in the first-level cache. On an accelerator all rays try all solids side by side.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from e2efly.scenes.scene import COLOURS, GROUND, SKY, Scene, first_instance, to_world
from e2efly.scenes.shapes import FAR, SHAPES, SIZES

CHANNELS = ("depth", "label", "instance", "normal", "rgb")
"""What can be asked for."""
_BIAS = 1e-3
"""A shadow is looked for from this far over the surface, m."""
_SHADOW, _PARTS = 30.0, 3
"""Longest shadow, m, and the balls that it is held in to find the tiles that see it."""


@dataclass(frozen=True)
class Pattern:
    """Directions of the rays of a sensor, in its own frame, in tiles; static."""

    tiles: np.ndarray
    """(tiles, 3, rays of a tile) directions; a ray is where it starts plus depth times direction."""
    rim: np.ndarray
    """(tiles, c, 3) directions whose cone holds the tile."""
    layout: tuple[int, int, int, int]
    """Rows and columns of tiles, rows and columns of a tile."""

    @staticmethod
    def of(directions: np.ndarray, flat: bool, tile: tuple[int, int] | None = None) -> "Pattern":
        """Cut (height, width, 3) directions into tiles.

        Args:
            directions: of the rays.
            flat: whether they end in a plane, so that a tile lies in the cone of its corners.
            tile: rows and columns; of at most 16 when left out.
        """
        height, width, _ = directions.shape
        th, tw = tile or (_divisor(height, 16), _divisor(width, 16))
        rows, columns = height // th, width // tw
        cut = directions.reshape(rows, th, columns, tw, 3).transpose(0, 2, 1, 3, 4).reshape(-1, th, tw, 3)
        rim = cut[:, [0, 0, -1, -1], [0, -1, 0, -1]]
        if not flat:
            rim = np.concatenate([cut[:, 0], cut[:, -1], cut[:, :, 0], cut[:, :, -1]], axis=1)
        tiles = cut.reshape(len(cut), -1, 3).transpose(0, 2, 1)
        return Pattern(np.ascontiguousarray(tiles, np.float32), rim.astype(np.float32), (rows, columns, th, tw))

    @property
    def shape(self) -> tuple[int, int]:
        """Height and width of the image."""
        rows, columns, th, tw = self.layout
        return rows * th, columns * tw

    def image(self, tiles: Array) -> Array:
        """(n, tiles, rays of a tile) as images (n, height, width)."""
        rows, columns, th, tw = self.layout
        n = tiles.shape[0]
        return tiles.reshape(n, rows, columns, th, tw).transpose(0, 1, 3, 2, 4).reshape(n, *self.shape)


def _divisor(length: int, most: int) -> int:
    return next(size for size in range(min(length, most), 0, -1) if length % size == 0)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Light:
    """What makes colours of a scene; leaves."""

    sun: Float[Array | np.ndarray, "n 3"]
    """Unit vector to the sun, world."""
    strength: Float[Array | np.ndarray, " n"]
    """Of the sun, beside the ambient light `1 - strength`."""
    checker: Float[Array | np.ndarray, " n"]
    """Side of the squares on the ground, m; 0: plain."""


def usual_light(n: int) -> Light:
    """A sun 50 degrees high in the south-west, squares of a metre on the ground."""
    sun = np.array([-0.45, -0.45, 0.77], np.float32)
    sun = sun / np.linalg.norm(sun)
    return Light(np.tile(sun, (n, 1)), np.full(n, 0.65, np.float32), np.ones(n, np.float32))


def cast(
    scene: Scene,
    origin: Float[Array, "n 3"],
    matrix: Float[Array, "n 3 3"],
    pattern: Pattern,
    channels: tuple[str, ...] = ("depth",),
    light: Light | None = None,
) -> dict[str, Array]:
    """What a sensor in each world sees.

    Args:
        scene: n worlds, standing still (`Scene.at`).
        origin: where the rays start, world, m.
        matrix: sensor's frame to world; its columns may have any length, so that it also sets the field of view.
        pattern: directions of the rays.
        channels: of `CHANNELS`.
        light: for rgb.

    Returns:
        Images (n, h, w): `depth` along the ray's direction, `FAR` where nothing is met; `label`; `instance`; and
        (n, h, w, 3): `normal`, outward, world, zero in the sky; `rgb` in [0, 1].
    """
    if unknown := set(channels) - set(CHANNELS):
        raise ValueError(f"channels has {sorted(unknown)}; accepted: {', '.join(CHANNELS)}")
    camera = _seen_from(scene, origin, matrix, pattern, light if "rgb" in channels else None)
    tile = partial(_tile, channels=channels)
    tiles = jnp.asarray(pattern.tiles)

    def whole(seen: dict[str, Any], over: Callable) -> dict[str, Array]:
        return over(lambda j: tile(seen, j, tiles[j]), jnp.arange(tiles.shape[0]))

    if jax.default_backend() == "cpu":
        found = jax.lax.map(lambda seen: whole(seen, jax.lax.map), camera)
    else:
        found = jax.vmap(lambda seen: whole(seen, lambda f, j: jax.vmap(f)(j)))(camera)
    images = {name: pattern.image(value) for name, value in found.items()}
    return {name: _assembled(images, name) for name in channels}


def _assembled(images: dict[str, Array], name: str) -> Array:
    if name in images:
        image = images[name]
        return jnp.rint(image).astype(jnp.int32) if name in ("label", "instance") else image
    parts = {"normal": ("nx", "ny", "nz"), "rgb": ("r", "g", "b")}[name]
    return jnp.stack([images[part] for part in parts], axis=-1)


def _seen_from(scene: Scene, origin: Array, matrix: Array, pattern: Pattern, light: Light | None) -> dict[str, Any]:
    """Everything that one camera's loop needs, camera by camera: the solids as seen from it, and what can be seen."""
    rim = jnp.einsum("nij,tcj->ntci", matrix, pattern.rim)
    cones = _Cones.around(rim / jnp.linalg.norm(rim, axis=-1, keepdims=True))
    seen: dict[str, Any] = {"origin": origin, "matrix": matrix, "ground": scene.ground, "solids": {}}
    if light is not None:
        seen["light"] = light
    for kind in scene.kinds:
        s = scene.solids[kind]
        to_local = jnp.swapaxes(to_world(s), -1, -2)
        away = s.centre - origin[:, None]
        reach = SHAPES[kind].reach(s.size)
        first = first_instance(scene, kind)
        parts = {
            "size": s.size,
            "origin": -jnp.einsum("nkij,nkj->nki", to_local, away),
            "matrix": jnp.einsum("nkij,njl->nkil", to_local, matrix),
            "to_local": to_local,
            "centre": s.centre,
            "label": s.label.astype(jnp.float32),
            "instance": jnp.broadcast_to(jnp.arange(first, first + s.count, dtype=jnp.float32), s.label.shape),
            "colour": s.colour,
        }
        row = _ROW if light is not None else _ROW[:6]
        solids = {
            "next": _next(cones.touch(away, reach) & s.active[:, None]),
            "table": jnp.concatenate([parts[name].reshape(*reach.shape, -1) for name, _ in row], axis=-1),
        }
        if light is not None:
            shadows = _shadows(cones, away, reach, s.centre[..., 2] - scene.ground[:, None], jnp.asarray(light.sun))
            solids["next_shadow"] = _next(shadows & s.active[:, None])
        seen["solids"][kind] = solids
    return seen


@dataclass(frozen=True)
class _Cones:
    """Of the tiles of each camera."""

    axis: Float[Array, "n t 3"]
    cos: Float[Array, "n t"]
    sin: Float[Array, "n t"]

    @staticmethod
    def around(rim: Float[Array, "n t c 3"]) -> "_Cones":
        """The cones that hold unit vectors."""
        axis = jnp.sum(rim, axis=2)
        axis = axis / jnp.linalg.norm(axis, axis=-1, keepdims=True)
        cos = jnp.min(jnp.einsum("ntci,nti->ntc", rim, axis), axis=-1) - 1e-5
        return _Cones(axis, cos, jnp.sqrt(jnp.maximum(1 - cos**2, 0.0)))

    def touch(self, away: Float[Array, "n k 3"], reach: Float[Array, "n k"]) -> Bool[Array, "n t k"]:
        """Whether balls reach into them: the angle to the axis is at most the sum of the half-angles."""
        distance = jnp.maximum(jnp.linalg.norm(away, axis=-1), 1e-6)
        sine = jnp.minimum(reach / distance, 1.0)
        cosine = jnp.sqrt(1 - sine**2)
        along = jnp.einsum("nki,nti->ntk", away / distance[..., None], self.axis)
        limit = self.cos[..., None] * cosine[:, None] - self.sin[..., None] * sine[:, None]
        return (along >= limit) | (distance <= reach)[:, None]


def _shadows(cones: _Cones, away: Array, reach: Array, height: Array, sun: Array) -> Bool[Array, "n t k"]:
    """Whether the shadows that balls throw down to the ground, each in a few balls, reach into the cones."""
    length = jnp.clip((height + reach) / jnp.maximum(sun[:, None, 2], 0.05), 0.0, _SHADOW)
    found = cones.touch(away, reach)
    for part in range(_PARTS):
        middle = away - ((part + 0.5) / _PARTS * length)[..., None] * sun[:, None]
        found |= cones.touch(middle, reach + length / 2 / _PARTS)
    return found


def _next(visible: Bool[Array, "*n k"]) -> Int[Array, "*n k+1"]:
    """Of each place in a list, the first one from there on that is visible; k: none. It makes loops that skip."""
    k = visible.shape[-1]
    first = jax.lax.cummin(jnp.where(visible, jnp.arange(k), k), axis=visible.ndim - 1, reverse=True)
    return jnp.concatenate([first, jnp.full_like(first[..., :1], k)], axis=-1)


_ROW = (
    ("size", (SIZES,)), ("origin", (3,)), ("matrix", (3, 3)), ("label", ()), ("instance", ()), ("to_local", (3, 3)),
    ("centre", (3,)), ("colour", (3,)),
)  # fmt: skip
"""A solid seen from a camera as a row of a table: a loop that carries one table begins faster than one with ten."""


def _unpacked(row: Float[Array, " p"]) -> dict[str, Array]:
    """The entries of a row, as many as it has."""
    found, place = {}, 0
    for name, shape in _ROW:
        size = math.prod(shape)
        if place + size > row.shape[0]:
            break
        found[name] = row[place : place + size].reshape(shape)
        place += size
    return found


def _over(following: Int[Array, " k+1"], body: Callable[[Array, Any], Any], first: Any) -> Any:
    """Fold over the places of a list made by `_next`."""
    count = following.shape[0] - 1
    state = jax.lax.while_loop(lambda s: s[0] < count, lambda s: (following[s[0] + 1], body(*s)), (following[0], first))
    return state[1]


def _apart(vector: Array) -> tuple[Array, Array, Array]:
    return vector[0], vector[1], vector[2]


def _turned(matrix: Array, d: Any) -> tuple[Array, Array, Array]:
    x, y, z = (matrix[i, 0] * d[0] + matrix[i, 1] * d[1] + matrix[i, 2] * d[2] for i in range(3))
    return x, y, z


def _tile(seen: dict[str, Any], index: Array, d: Float[Array, "3 r"], channels: tuple[str, ...]) -> dict[str, Array]:
    """The nearest hits of one tile's rays: ray component by ray component."""
    world = _turned(seen["matrix"], d)
    found = _ground(seen, world, channels)
    for kind, solids in seen["solids"].items():

        def tried(
            i: Array, found: dict[str, Array], kind: str = kind, table: Any = solids["table"]
        ) -> dict[str, Array]:
            one = _unpacked(table[i])
            t, normal = SHAPES[kind].enter(one["size"], _apart(one["origin"]), _turned(one["matrix"], d))
            new = {"t": t} | _looks(one, normal, channels, seen)
            nearer = t < found["t"]
            return {name: jnp.where(nearer, new[name], old) for name, old in found.items()}

        found = _over(solids["next"][index], tried, found)
    if "rgb" in channels:
        found |= _shaded(seen, index, found, world)
    return {"depth": found["t"]} | {name: value for name, value in found.items() if name not in ("t", "shade")}


def _looks(one: dict[str, Array], normal: Any, channels: tuple[str, ...], seen: dict[str, Any]) -> dict[str, Array]:
    """What is known of a solid where it is hit."""
    looks = {name: one[name] for name in ("label", "instance") if name in channels}
    if "normal" in channels or "rgb" in channels:
        to_world = one["to_local"].T
        x, y, z = _turned(to_world, normal)
        if "normal" in channels:
            looks |= {"nx": x, "ny": y, "nz": z}
        if "rgb" in channels:
            sun = seen["light"].sun
            looks |= {"r": one["colour"][0], "g": one["colour"][1], "b": one["colour"][2]}
            looks["shade"] = x * sun[0] + y * sun[1] + z * sun[2]
    return looks


def _ground(seen: dict[str, Any], d: Any, channels: tuple[str, ...]) -> dict[str, Array]:
    """The ground, or the sky over it."""
    height = seen["origin"][2] - seen["ground"]
    below = d[2] < -1e-6
    t = jnp.where(below, jnp.maximum(-height / jnp.where(below, d[2], 1.0), 0.0), FAR)
    hit = t < FAR / 2
    found = {"t": jnp.where(hit, t, FAR)}
    mask = hit.astype(jnp.float32)
    if "label" in channels:
        found["label"] = SKY + (GROUND - SKY) * mask
    if "instance" in channels:
        found["instance"] = mask
    if "normal" in channels:
        found |= {"nx": jnp.zeros_like(t), "ny": jnp.zeros_like(t), "nz": mask}
    if "rgb" in channels:
        light = seen["light"]
        side = jnp.where(light.checker > 0, light.checker, 1.0)
        x, y = (jnp.floor((seen["origin"][i] + jnp.where(hit, t, 0.0) * d[i]) / side) for i in (0, 1))
        odd = (x + y) - 2 * jnp.floor((x + y) / 2)
        tone = jnp.where(light.checker > 0, 1.0 - 0.25 * odd, 1.0)
        for i, name in enumerate("rgb"):
            found[name] = jnp.where(hit, COLOURS[GROUND, i] * tone, COLOURS[SKY, i])
        found["shade"] = jnp.where(hit, light.sun[2], 1.0)
    return found


def _shaded(seen: dict[str, Any], index: Array, found: dict[str, Array], d: Any) -> dict[str, Array]:
    """Colours under the sun, in the shadow where something stands before it."""
    light, t = seen["light"], found["t"]
    sun = _apart(light.sun)
    hit = t < FAR / 2
    depth = jnp.where(hit, t, 0.0) * (1 - _BIAS)
    point = tuple(seen["origin"][i] + depth * d[i] + _BIAS * sun[i] for i in range(3))
    lit = (hit & (found["shade"] > 0)).astype(jnp.float32)
    for kind, solids in seen["solids"].items():

        def darkened(i: Array, lit: Array, kind: str = kind, table: Any = solids["table"]) -> Array:
            one = _unpacked(table[i])
            relative = tuple(p - one["centre"][i] for i, p in enumerate(point))
            t, _ = SHAPES[kind].enter(one["size"], _turned(one["to_local"], relative), _turned(one["to_local"], sun))
            return jnp.where(t < FAR / 2, 0.0, lit)

        lit = _over(solids["next_shadow"][index], darkened, lit)
    brightness = jnp.where(hit, 1 - light.strength + light.strength * lit * found["shade"], 1.0)
    return {name: found[name] * brightness for name in "rgb"}
