"""Effects of real cameras on images: pure functions of a key and a batch of images.

Depth is planar, m, (n, h, w). 0 is a hole, where nothing was measured. Other images have values in [0, 1].
"""

import dataclasses
import math
import zlib
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray, UInt

from e2efly.config import CameraConfig, ImageNoiseConfig
from e2efly.config.registry import load
from e2efly.config.storage import array_of

_STRENGTHS = [field.name for field in dataclasses.fields(ImageNoiseConfig) if field.type == float | None]
_STATIC = [field.name for field in dataclasses.fields(ImageNoiseConfig) if field.name not in _STRENGTHS]
jax.tree_util.register_dataclass(ImageNoiseConfig, data_fields=_STRENGTHS, meta_fields=_STATIC)

Image = Float[Array, "n h w *c"]
Depth = Float[Array, "n h w"]
Strength = float | Float[Array, ""]

BASELINE, DISPARITY_DEVIATION = 0.05, 0.08
"""For a D435i: distance between its imagers, m, and standard deviation of a disparity, in pixels of its 848-pixel wide
depth image."""
NATIVE_WIDTH = 848
REDWOOD_SIZE = (640, 480)
"""Width and height of the image for which the Redwood model was measured."""
REDWOOD_FOCAL_BASELINE = 35.130
"""Focal length times baseline of that camera, in the unit of its disparity, m."""
REDWOOD_DISPARITY_DEVIATION = 0.027778
"""Standard deviation of the disparity, in its unit."""
SYNTHETIC = "synthetic"
"""Name of `synthetic_distortion` in a configuration."""
BEYOND = 20.0
"""Objects at the end of a camera's reach count as at least this far away, m. A D435i cannot measure that far."""


def add_image_noise(config: ImageNoiseConfig, key: PRNGKeyArray, image: Image, camera: CameraConfig) -> Image:
    """Add all noises of a configuration to a camera's images, in the order of its fields.

    Depth and range pass through `OF_DEPTH` in m and then, as shares of the farthest value, through `OF_VALUES`. Holes
    stay holes, except for salt. Other images have values in [0, 1]. The name of a noise determines its random stream,
    so switching one on changes no other.

    Args:
        config: the noises (static) and their strengths (leaves); see `check`.
        key: key of all noises.
        image: the camera's image: depth or range in m, (n, h, w); or values in [0, 1], (n, h, w) or (n, h, w, 3).
        camera: the camera, static.

    Returns:
        An image of the same kind and unit, within the camera's reach.
    """
    noises = chosen(config)

    def through(table: dict[str, Noise], noisy: Image) -> Image:
        for name, noise in table.items():
            if name in noises:
                stream = jax.random.fold_in(key, zlib.crc32(name.encode()))
                noisy = noise(stream, noisy, noises[name], camera)
        return noisy

    if camera.sees not in ("depth", "range"):
        return jnp.clip(through(OWN, through(OF_VALUES, image)), 0.0, 1.0)
    near, far = camera.reach
    depth = through(OF_DEPTH, jnp.where(image >= far, max(far, BEYOND), image))
    noisy = jnp.clip(through(OWN, far * through(OF_VALUES, jnp.minimum(depth / far, 1.0))), 0.0, far)
    return jnp.where(noisy < near, 0.0, noisy)


def chosen(config: ImageNoiseConfig) -> dict[str, Any]:
    """The noises that are switched on, with their options, by field."""
    return {name: value for name, value in vars(config).items() if value is not None and value is not False}


def check(config: ImageNoiseConfig, camera: CameraConfig) -> None:
    """Check the noise of a camera.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    noises = chosen(config)
    if noises and camera.sees in ("normal", "instance"):
        first = next(iter(noises))
        raise ValueError(f"camera.noise.{first} is on; accepted where camera.sees is depth, range, mask, label or rgb")
    planar = camera.sees == "depth" and camera.projection == "pinhole"
    for name in [name for name in OF_DEPTH if name in noises]:
        if name == "inverse_depth" and camera.sees not in ("depth", "range"):
            raise ValueError(
                f"camera.noise.{name} is {noises[name]}; accepted: None where camera.sees is {camera.sees}"
            )
        if name != "inverse_depth" and not planar:
            raise ValueError(
                f"camera.noise.{name} is on; accepted with camera.sees depth and camera.projection pinhole"
            )
    if config.redwood is not None:
        distortion(config.redwood)
    if config.own is not None:
        _check_own(config.own, camera)


def _check_own(reference: str, camera: CameraConfig) -> None:
    """Test a user's own function on the shape of an image, before anything compiles."""
    own = load(reference)
    image = jax.ShapeDtypeStruct((2, camera.height, camera.width, *(3,) * (camera.sees == "rgb")), jnp.float32)
    try:
        out = jax.eval_shape(lambda key, x: own(key, x, camera), jax.random.key(0), image)
    except Exception as error:  # any error of the user's code
        raise ValueError(f"camera.noise.own is {reference}, which fails: {type(error).__name__}: {error}") from None
    if getattr(out, "shape", None) != image.shape:
        raise ValueError(f"camera.noise.own is {reference}, which returns {out}; accepted: an image of {image.shape}")


def _hashed(x: UInt[Array, "*n"]) -> UInt[Array, "*n"]:
    """A hash of words: one step of PCG and its output (Jarzynski and Olano 2020, JCGT 9(3))."""
    x = x * jnp.uint32(747796405) + jnp.uint32(2891336453)
    x = ((x >> ((x >> 28) + 4)) ^ x) * jnp.uint32(277803737)
    return (x >> 22) ^ x


def _uniform(key: PRNGKeyArray, image: Array) -> Array:
    """Random numbers of an image's shape, in (0, 1).

    The key's generator draws one word for each image, and this word is hashed with the number of the pixel. On a CPU
    XLA's generator would take more time for the pixels than the image takes.
    """
    n, *size = image.shape
    words = jax.random.bits(key, (n, *(1 for _ in size)))
    bits = _hashed(words + _hashed(jnp.arange(math.prod(size), dtype=jnp.uint32)).reshape(1, *size))
    return ((bits >> 9).astype(image.dtype) + 0.5) * 2.0**-23


def _normal(key: PRNGKeyArray, image: Array) -> Array:
    """Standard normal numbers of an image's shape, of at most 5.3."""
    return math.sqrt(2) * jax.lax.erf_inv(2 * _uniform(key, image) - 1)


def gaussian(key: PRNGKeyArray, image: Image, deviation: Strength, mean: Strength = 0.0) -> Image:
    """I + mean + deviation N, clipped to [0, 1]."""
    return jnp.clip(image + mean + deviation * _normal(key, image), 0.0, 1.0)


def speckle(key: PRNGKeyArray, image: Image, deviation: Strength, mean: Strength = 0.0) -> Image:
    """I + I (mean + deviation N), clipped to [0, 1]."""
    return jnp.clip(image * (1 + mean + deviation * _normal(key, image)), 0.0, 1.0)


def salt_and_pepper(key: PRNGKeyArray, image: Image, amount: Strength, salt: Strength = 0.5) -> Image:
    """Replace a share `amount` of the pixels. A share `salt` of these becomes 1, and the others become 0."""
    u = _uniform(key, image)
    return jnp.where(u < amount * salt, 1.0, jnp.where(u < amount, 0.0, image))


def poisson(key: PRNGKeyArray, image: Image, levels: Strength) -> Image:
    """Shot noise: Pois(I v) / v with v = 2^ceil(log2 levels), for an image with `levels` levels, clipped to [0, 1]."""
    most = 2.0 ** jnp.ceil(jnp.log2(jnp.asarray(levels, image.dtype)))
    data = jax.random.key_data(key).reshape(-1)[:2]
    counts = jax.random.poisson(jax.random.wrap_key_data(data, impl="threefry2x32"), image * most, image.shape)
    return jnp.clip(counts.astype(image.dtype) / most, 0.0, 1.0)


def inverse_depth(key: PRNGKeyArray, depth: Depth, deviation: Strength) -> Depth:
    """1 / (1/d + deviation N): the effect of disparity noise on stereo depth; deviation in 1/m.

    At least a millimetre.
    """
    inverse = 1.0 / jnp.maximum(depth, 1e-3) + deviation * _normal(key, depth)
    return jnp.where(depth > 0, 1.0 / jnp.clip(inverse, 1e-3, 1e3), 0.0)


def d435i(key: PRNGKeyArray, depth: Depth, fov: float, least: float = 0.28, most: float = 10.0) -> Depth:
    """Intel D435i: noise of the disparity, the shadows of its second imager, and its range.

    The deviation of the depth is z^2 d / (f B): 4 mm at 1 m, 10 cm at 5 m. A pixel is a hole if something nearer hides
    it from the left imager (B to the side), and if it is nearer than `least` or farther than `most`, m. `fov` is the
    horizontal field of view, rad.
    """
    width = depth.shape[-1]
    native = NATIVE_WIDTH / 2 / math.tan(fov / 2)
    inverse = 1.0 / jnp.maximum(depth, 1e-3)
    noisy = 1.0 / jnp.maximum(inverse + DISPARITY_DEVIATION / (native * BASELINE) * _normal(key, depth), 1e-6)
    disparity = width / 2 / math.tan(fov / 2) * BASELINE * inverse
    hidden = jnp.zeros(depth.shape, bool)
    largest = math.ceil(width / 2 / math.tan(fov / 2) * BASELINE / least)
    for shift in range(1, min(largest, width - 1) + 1):  # points hidden by a larger shift lie outside the image
        nearer = jnp.pad(disparity[..., shift:], [(0, 0)] * (depth.ndim - 1) + [(0, shift)], mode="edge")
        hidden |= nearer - disparity > shift - 0.5
    measured = (depth > 0) & (noisy >= least) & (noisy <= most) & ~hidden
    return jnp.where(measured, noisy, 0.0)


def synthetic_distortion() -> Float[np.ndarray, "80 80 5"]:
    """A smooth substitute for the measured lens distortion of the Redwood model.

    Its range is 0.81 to 1.11, its mean 1.0009. Depth is divided by the factor at (x // 8, y // 6, depth bin) of a 640 x
    480 image, with bins at 1 m, 3 m, ...
    """
    x, y = np.meshgrid(np.linspace(-1, 1, 80), np.linspace(-1, 1, 80), indexing="ij")
    radius = x * x + y * y
    bins = np.linspace(0.4, 1.0, 5)
    wave = 0.02 * np.sin(5 * x + 1) * np.cos(4 * y)
    bend = (wave + 0.09 * np.exp(-4 * radius) - 0.055 * radius)[..., None] * bins
    factor = 1.0009 + bend - bend.mean()
    return np.clip(factor, 0.81, 1.11).astype(np.float32)


@lru_cache(maxsize=4)
def distortion(name: str) -> Float[np.ndarray, "80 80 5"]:
    """The table of the Redwood model: the synthetic one, or that of a .npy file.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    if name == SYNTHETIC:
        return synthetic_distortion()
    accepted = f"accepted: {SYNTHETIC}, or a .npy file of positive numbers, (80, 80, 5)"
    try:
        with Path(name).open("rb") as file:
            table = array_of(file.read(1 << 20))
    except (OSError, ValueError) as error:
        raise ValueError(f"camera.noise.redwood is {name!r}: {error}; {accepted}") from None
    if table.shape != (80, 80, 5) or table.dtype.kind != "f":
        raise ValueError(f"camera.noise.redwood is {name!r}, of {table.shape}; {accepted}")
    if not (np.isfinite(table).all() and (table > 0).all()):
        raise ValueError(f"camera.noise.redwood is {name!r}, with numbers that are not positive; {accepted}")
    return table.astype(np.float32)


def redwood(key: PRNGKeyArray, depth: Depth, table: Float[Array | np.ndarray, "80 80 5"]) -> Depth:
    """Depth as PrimeSense-like cameras measure it (Choi, Zhou, Koltun 2015; distortion after Teichman et al. 2013).

    Pixels are jittered by a quarter of a pixel times depth, and read at every second one. Depth of 10 m and more is a
    hole. Depth is divided by the distortion (`synthetic_distortion`). After noise, the disparity is rounded to eighths.
    """
    n, height, width = depth.shape
    *jitter_keys, noise_key = jax.random.split(key, 3)
    jitter = [0.25 * _normal(jitter_key, depth) * depth for jitter_key in jitter_keys]
    columns, rows = (
        jnp.arange(k, dtype=depth.dtype) * full / k for k, full in zip((width, height), REDWOOD_SIZE, strict=True)
    )
    u = 2 * jnp.floor(jnp.clip(columns + jitter[0] + 0.5, 0, REDWOOD_SIZE[0] - 1) / 2)
    v = 2 * jnp.floor(jnp.clip(rows[:, None] + jitter[1] + 0.5, 0, REDWOOD_SIZE[1] - 1) / 2)
    x, y = (u * width / REDWOOD_SIZE[0]).astype(jnp.int32), (v * height / REDWOOD_SIZE[1]).astype(jnp.int32)
    z = depth[jnp.arange(n)[:, None, None], y, x]
    entry = jnp.asarray(table)[(u / 8).astype(jnp.int32), jnp.clip((v / 6).astype(jnp.int32), 0, 79)]
    place = jnp.clip((z - 1.0) / 2.0, 0.0, 4.0)
    weight = jnp.maximum(1.0 - jnp.abs(place[..., None] - jnp.arange(5.0)), 0.0)
    z = jnp.where((z > 0) & (z < 10.0), z / jnp.sum(weight * entry, axis=-1), 0.0)
    noise = REDWOOD_DISPARITY_DEVIATION * _normal(noise_key, depth)
    eighths = jnp.rint((REDWOOD_FOCAL_BASELINE / jnp.maximum(z, 1e-3) + noise) * 8.0)
    return jnp.where((z > 0) & (eighths > 0), REDWOOD_FOCAL_BASELINE * 8.0 / jnp.maximum(eighths, 1.0), 0.0)


def _except_holes(noise: Callable[[PRNGKeyArray, Image, Strength], Image]) -> "Noise":
    """A noise of values that does not change zeros in images where 0 is a hole."""

    def applied(key: PRNGKeyArray, image: Image, strength: Strength, camera: CameraConfig) -> Image:
        noisy = noise(key, image, strength)
        return jnp.where(image > 0, noisy, 0.0) if camera.sees in ("depth", "range") else noisy

    return applied


Noise = Callable[[PRNGKeyArray, Array, Any, CameraConfig], Array]
"""A change of images: a function of a key, the images, the option of `ImageNoiseConfig` and the camera."""
OF_DEPTH: dict[str, Noise] = {
    "inverse_depth": lambda key, depth, deviation, _: inverse_depth(key, depth, deviation),
    "d435i": lambda key, depth, _, camera: d435i(key, depth, camera.fov[0]),
    "redwood": lambda key, depth, table, _: redwood(key, depth, distortion(table)),
}
"""Noises of depth and range in m, in their order, by field of `ImageNoiseConfig`."""
OF_VALUES: dict[str, Noise] = {
    "speckle": _except_holes(speckle),
    "poisson": _except_holes(poisson),
    "gaussian": _except_holes(gaussian),
    "salt_and_pepper": lambda key, image, amount, _: salt_and_pepper(key, image, amount),
}
"""Noises of values in [0, 1], in their order, by field of `ImageNoiseConfig`."""
OWN: dict[str, Noise] = {"own": lambda key, image, reference, camera: load(reference)(key, image, camera)}
"""The user's noise of images in their own unit. It is applied last."""
