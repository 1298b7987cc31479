"""Camera rays against one world of triangles. The call is that of `scenes.cast.cast`, computed by an engine.

Triangles are surfaces. They are visible from both sides, and nothing is inside them. A camera inside an object sees the
object's inner side. This differs from a solid of `e2efly.simulation.scenes.scene`, where all depth is 0.
"""

import functools
from concurrent.futures import ThreadPoolExecutor

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from e2efly.simulation.device import cores
from e2efly.simulation.scenes.cast import CHANNELS, Light, Pattern
from e2efly.simulation.scenes.meshes.engine import Engine
from e2efly.simulation.scenes.meshes.engines import engine
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import COLOURS, SKY

_BIAS = 1e-3
"""Distance above the surface from which a shadow is looked for, m."""
_KINDS = {"depth": np.float32, "label": np.int32, "instance": np.int32, "normal": np.float32, "rgb": np.float32}


def cast(
    scene: MeshScene,
    origin: Float[Array, "n 3"],
    matrix: Float[Array, "n 3 3"],
    pattern: Pattern,
    channels: tuple[str, ...] = ("depth",),
    light: Light | None = None,
) -> dict[str, Array]:
    """The images of n sensors in the one world, also inside compiled programs. Images have no gradient.

    The arguments are those of `e2efly.simulation.scenes.cast.cast`. The squares of the light are not drawn, because the
    file gives the ground's colour.

    Returns:
        Images (n, h, w): `depth` along the ray's direction, `FAR` without a hit; `label`; `instance`; and (n, h, w, 3):
        `normal`, towards the sensor, world, zero in the sky; `rgb` in [0, 1].

    Raises:
        ValueError: naming the channel and those accepted, or the package that is missing.
    """
    if unknown := set(channels) - set(CHANNELS):
        raise ValueError(f"channels has {sorted(unknown)}; accepted: {', '.join(CHANNELS)}")
    n, (height, width) = origin.shape[0], pattern.shape
    rays = _rays(pattern)
    follow = functools.partial(_images, scene, engine(scene), rays, channels)
    shapes = {name: jax.ShapeDtypeStruct((n, rays.shape[1], *_more(name)), _KINDS[name]) for name in channels}
    sun = [light.sun, light.strength] if light is not None and "rgb" in channels else []
    given = [jax.lax.stop_gradient(jnp.asarray(x, jnp.float32)) for x in (origin, matrix, *sun)]
    found = jax.pure_callback(follow, shapes, *given, vmap_method="broadcast_all")
    return {name: image.reshape(n, height, width, *_more(name)) for name, image in found.items()}


def _more(name: str) -> tuple[int, ...]:
    return (3,) if name in ("normal", "rgb") else ()


def _rays(pattern: Pattern) -> Float[np.ndarray, "3 r"]:
    """Directions of the rays in the order of the image's pixels."""
    return np.ascontiguousarray(pattern.directions.reshape(-1, 3).T, np.float32)


@functools.cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(cores(), "e2efly-rays")


def _images(
    scene: MeshScene, engine: Engine, rays: np.ndarray, channels: tuple[str, ...], *given: Array
) -> dict[str, np.ndarray]:
    """The callback: images of cameras, which may have more leading axes, with the work shared among threads."""
    batch = given[0].shape[:-1]
    flat = [np.asarray(x).reshape(-1, *x.shape[len(batch) :]) for x in given]
    count = len(flat[0])
    found = {name: np.empty((count, rays.shape[1], *_more(name)), _KINDS[name]) for name in channels}

    def some(part: slice) -> None:
        for name, image in _seen(scene, engine, rays, channels, *(x[part] for x in flat)).items():
            found[name][part] = image

    size = max(1, count // (4 * engine.threads)) if engine.threads > 1 else max(1, count)
    list(_pool().map(some, [slice(i, i + size) for i in range(0, count, size)]))
    return {name: image.reshape(*batch, *image.shape[1:]) for name, image in found.items()}


def _seen(
    scene: MeshScene,
    engine: Engine,
    rays: np.ndarray,
    channels: tuple[str, ...],
    origin: np.ndarray,
    matrix: np.ndarray,
    *light: np.ndarray,
) -> dict[str, np.ndarray]:
    if channels == ("depth",):
        return {"depth": engine.depth(origin, matrix, rays)}
    hits = engine.hits(origin, matrix, rays)
    met = hits.face >= 0
    found: dict[str, np.ndarray] = {"depth": hits.depth}
    for name, known in (("label", scene.label), ("instance", scene.instance)):
        if name in channels:
            found[name] = np.where(met, known[hits.face], SKY)
    if "normal" in channels or "rgb" in channels:
        direction = np.matmul(matrix, rays).transpose(0, 2, 1)
        normal = np.where(met[..., None], scene.normal[hits.face], np.float32(0))
        away = np.einsum("crj,crj->cr", normal, direction) > 0
        found["normal"] = np.where(away[..., None], -normal, normal)
        if "rgb" in channels:
            point = origin[:, None] + (np.where(met, hits.depth, 0) * (1 - _BIAS))[..., None] * direction
            rgb = np.broadcast_to(COLOURS[SKY], point.shape).copy()
            rgb[met] = scene.colours(hits.face[met], hits.u[met], hits.v[met])
            rgb[met] *= _brightness(engine, point, found["normal"], met, *light)[:, None]
            found["rgb"] = rgb
    return {name: found[name] for name in channels}


def _brightness(
    engine: Engine, point: np.ndarray, normal: np.ndarray, met: np.ndarray, sun: np.ndarray, strength: np.ndarray
) -> Float[np.ndarray, " m"]:
    """Brightness of the points that are hit: in the sun, or in the shadow of an obstacle."""
    towards = np.broadcast_to(sun[:, None], point.shape)[met]
    shade = np.maximum(np.einsum("mj,mj->m", normal[met], towards), 0)
    bright = shade > 0
    start = (point[met] + _BIAS * towards)[bright]
    shade[bright] *= ~engine.blocked(np.ascontiguousarray(start), np.ascontiguousarray(towards[bright]))
    share = np.broadcast_to(strength[:, None], met.shape)[met]
    return 1 - share + share * shade
