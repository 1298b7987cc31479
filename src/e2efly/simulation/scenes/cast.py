"""Rays against a batch of worlds: the first hit of each ray, exactly.

An image is cut into tiles. A solid is tested on a tile only if its bounding ball reaches into the tile's cone. On a CPU
the tiles of one camera are computed one after the other, and the image is assembled while they are in the cache. On an
accelerator all rays are computed in parallel.
"""

import math

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from e2efly.simulation.scenes.nearest_hits import Kinds, TileSight, depth, ground, hits, sight
from e2efly.simulation.scenes.scene import Scene
from e2efly.simulation.scenes.shade import Hits, Light, squares, usual_light
from e2efly.simulation.scenes.shapes import FAR
from e2efly.simulation.scenes.tiles import Pattern

CHANNELS = ("depth", "label", "instance", "normal", "rgb")
"""The channels that can be requested."""


def cast(
    scene: Scene,
    origin: Float[Array, "n 3"],
    matrix: Float[Array, "n 3 3"],
    pattern: Pattern,
    channels: tuple[str, ...] = ("depth",),
    light: Light | None = None,
    reach: float = math.inf,
) -> dict[str, Array]:
    """The images of one sensor in each world.

    Args:
        scene: n worlds, standing still (`Scene.at`).
        origin: start of the rays, world, m.
        matrix: map from the sensor's frame to the world. Its columns may have any length, so that it also sets the
            field of view.
        pattern: directions of the rays.
        channels: names from `CHANNELS`.
        light: light for rgb. If left out: `usual_light`.
        reach: solids that lie completely beyond this depth may be left out, m.

    Returns:
        Images (n, h, w): `depth` along the ray's direction, `FAR` without a hit; `label`; `instance`; and (n, h, w, 3):
        `normal`, outward, world, zero in the sky; `rgb` in [0, 1].

    Raises:
        ValueError: for an unknown channel.
    """
    if unknown := set(channels) - set(CHANNELS):
        raise ValueError(f"channels has {sorted(unknown)}; accepted: {', '.join(CHANNELS)}")
    if "rgb" not in channels:
        light = None
    elif light is None:
        light = usual_light(scene.worlds)
    looks = not set(channels).isdisjoint(("label", "normal", "rgb"))
    sun = None if light is None else jnp.asarray(light.sun)
    seen, kinds = sight(scene, origin, matrix, pattern, looks, sun, reach)
    tiles, indices = jnp.asarray(pattern.tiles), jnp.arange(pattern.tiles.shape[0])
    serial = jax.default_backend() == "cpu"

    def camera(given: tuple[TileSight, Light | None]) -> dict[str, Array]:
        def tile(index: Array) -> dict[str, Array]:
            return _tile(*given, kinds, index, tiles[index], channels)

        planes = jax.lax.map(tile, indices) if serial else jax.vmap(tile)(indices)
        return _assembled({name: pattern.image(plane) for name, plane in planes.items()}, channels)

    return jax.lax.map(camera, (seen, light)) if serial else jax.vmap(camera)((seen, light))


def _tile(
    seen: TileSight, light: Light | None, kinds: Kinds, index: Array, d: Float[Array, "3 r"], channels: tuple[str, ...]
) -> dict[str, Array]:
    """The channels of one tile as planes, with one value per ray."""
    if set(channels) == {"depth"}:
        return {"depth": depth(seen, kinds, index, d)}
    t = ground(seen, d)
    below = jnp.where(t < FAR, 1.0, 0.0) if light is None else squares(seen, light, d, t)
    t, who = hits(seen, kinds, index, d, below)
    found = {"depth": t, "instance": jnp.ceil(who)} | Hits(seen, kinds, index, d, t, who).looks(channels, light)
    return {name: plane for name, plane in found.items() if name in channels or name not in CHANNELS}


def _assembled(planes: dict[str, Array], channels: tuple[str, ...]) -> dict[str, Array]:
    whole = {"normal": ("nx", "ny", "nz"), "rgb": ("r", "g", "b")}
    return {
        name: jnp.stack([planes[part] for part in whole[name]], axis=-1)
        if name in whole
        else planes[name].astype(jnp.float32 if name == "depth" else jnp.int32)
        for name in channels
    }
