"""What real cameras do to images: pure functions of a key and a batch of images.

Depth is planar, m, (n, h, w); 0 is a hole, where nothing was measured. Other images have values in [0, 1].
"""

import math
from functools import lru_cache
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import CameraConfig, ImageNoiseConfig

STRENGTHS = ("inverse_depth", "speckle", "poisson", "gaussian", "salt_and_pepper")
"""Fields of `ImageNoiseConfig` that are numbers: leaves."""

jax.tree_util.register_dataclass(ImageNoiseConfig, data_fields=list(STRENGTHS), meta_fields=["d435i", "redwood"])

Image = Float[Array, "n h w *c"]
Depth = Float[Array, "n h w"]
Strength = float | Float[Array, ""]

BASELINE, DISPARITY_DEVIATION = 0.05, 0.08
"""Of a D435i: between its imagers, m; of a disparity, pixels of the 848 that its depth image is wide."""
NATIVE_WIDTH = 848
REDWOOD_SIZE = (640, 480)
"""Width and height of the image that the Redwood model was measured on."""
REDWOOD_FOCAL_BASELINE = 35.130
"""Focal length times baseline of that camera, in its disparity's unit, m."""
REDWOOD_DISPARITY_DEVIATION = 0.027778
"""Of the disparity, in its unit."""
SYNTHETIC = "synthetic"
"""The name of `synthetic_distortion` in a configuration."""
BEYOND = 20.0
"""What lies at the end of a camera's reach counts as this far at least, m: beyond what a D435i measures."""


def add_image_noise(config: ImageNoiseConfig, key: PRNGKeyArray, image: Image, camera: CameraConfig) -> Image:
    """Everything that a configuration says a camera does to its image, in the order of its fields.

    Depth and range go through the depth noises in m and then, as shares of the farthest, through the image noises;
    holes stay holes but for salt. Other images have values in [0, 1]. A noise draws the same whatever others are in.

    Args:
        config: which noises (static) and how strong (leaves); see `check`.
        key: of the noise.
        image: what the camera sees: depth or range in m, (n, h, w); or values in [0, 1], (n, h, w) or (n, h, w, 3).
        camera: static.

    Returns:
        An image of the same kind and unit, within the camera's reach.
    """
    keys = {name: jax.random.fold_in(key, i) for i, name in enumerate(ImageNoiseConfig.__dataclass_fields__)}
    if camera.sees not in ("depth", "range"):
        return _on_values(config, keys, image, holes=False)
    near, far = camera.reach
    depth = jnp.where(image >= far, max(far, BEYOND), image)
    if config.inverse_depth is not None:
        depth = inverse_depth(keys["inverse_depth"], depth, config.inverse_depth)
    if config.d435i:
        depth = d435i(keys["d435i"], depth, camera.fov[0])
    if config.redwood is not None:
        depth = redwood(keys["redwood"], depth, distortion(config.redwood))
    share = jnp.minimum(depth / far, 1.0)
    noisy = far * _on_values(config, keys, share, holes=True)
    return jnp.where(noisy < near, 0.0, noisy)


def _on_values(config: ImageNoiseConfig, keys: dict[str, PRNGKeyArray], image: Image, holes: bool) -> Image:
    """The noises of images in [0, 1]; where there are holes, 0 stays 0 but for salt."""
    noisy = image
    if config.speckle is not None:
        noisy = speckle(keys["speckle"], noisy, config.speckle)
    if config.poisson is not None:
        noisy = poisson(keys["poisson"], noisy, config.poisson)
    if config.gaussian is not None:
        noisy = gaussian(keys["gaussian"], noisy, config.gaussian)
    if holes:
        noisy = jnp.where(image > 0, noisy, 0.0)
    if config.salt_and_pepper is not None:
        noisy = salt_and_pepper(keys["salt_and_pepper"], noisy, config.salt_and_pepper)
    return noisy


def check(config: ImageNoiseConfig, camera: CameraConfig) -> None:
    """Check the noise of a camera.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    for name in STRENGTHS:
        value = getattr(config, name)
        low, high = {"salt_and_pepper": (0.0, 1.0), "poisson": (2.0, 65536.0)}.get(name, (0.0, math.inf))
        if value is not None and not (math.isfinite(value) and low <= value <= high):
            accepted = f"{low:g} or more" if high == math.inf else f"a number in [{low:g}, {high:g}]"
            raise ValueError(f"camera.noise.{name} is {value}; accepted: {accepted}, or None to leave it out")
    chosen = [name for name, value in vars(config).items() if value is not None and value is not False]
    if chosen and camera.sees in ("normal", "instance"):
        raise ValueError(f"camera.noise.{chosen[0]} is on; accepted where camera.sees is depth, range, label or rgb")
    if config.inverse_depth is not None and camera.sees not in ("depth", "range"):
        raise ValueError(
            f"camera.noise.inverse_depth is {config.inverse_depth}; accepted: None where camera.sees is {camera.sees}"
        )
    planar = camera.sees == "depth" and camera.projection == "pinhole"
    for name in ("d435i", "redwood"):
        if getattr(config, name) and not planar:
            raise ValueError(
                f"camera.noise.{name} is on; accepted with camera.sees depth and camera.projection pinhole"
            )
    if config.redwood is not None:
        distortion(config.redwood)


def _normal(key: PRNGKeyArray, image: Array) -> Array:
    return jax.random.normal(key, image.shape, image.dtype)


def gaussian(key: PRNGKeyArray, image: Image, deviation: Strength, mean: Strength = 0.0) -> Image:
    """I + mean + deviation N, clipped to [0, 1]."""
    return jnp.clip(image + mean + deviation * _normal(key, image), 0.0, 1.0)


def speckle(key: PRNGKeyArray, image: Image, deviation: Strength, mean: Strength = 0.0) -> Image:
    """I + I (mean + deviation N), clipped to [0, 1]."""
    return jnp.clip(image * (1 + mean + deviation * _normal(key, image)), 0.0, 1.0)


def salt_and_pepper(key: PRNGKeyArray, image: Image, amount: Strength, salt: Strength = 0.5) -> Image:
    """A share `amount` of the pixels is replaced, `salt` of them by 1 and the others by 0."""
    u = jax.random.uniform(key, image.shape, image.dtype)
    return jnp.where(u < amount * salt, 1.0, jnp.where(u < amount, 0.0, image))


def poisson(key: PRNGKeyArray, image: Image, levels: Strength) -> Image:
    """Shot noise: Pois(I v) / v with v = 2^ceil(log2 levels), of an image with so many levels, clipped to [0, 1]."""
    most = 2.0 ** jnp.ceil(jnp.log2(jnp.asarray(levels, image.dtype)))
    data = jax.random.key_data(key).reshape(-1)[:2]
    counts = jax.random.poisson(jax.random.wrap_key_data(data, impl="threefry2x32"), image * most, image.shape)
    return jnp.clip(counts.astype(image.dtype) / most, 0.0, 1.0)


def inverse_depth(key: PRNGKeyArray, depth: Depth, deviation: Strength) -> Depth:
    """1 / (1/d + deviation N): what noise of the disparity does to stereo depth; 1/m. Not under a millimetre."""
    inverse = 1.0 / jnp.maximum(depth, 1e-3) + deviation * _normal(key, depth)
    return jnp.where(depth > 0, 1.0 / jnp.clip(inverse, 1e-3, 1e3), 0.0)


def d435i(key: PRNGKeyArray, depth: Depth, fov: float, least: float = 0.28, most: float = 10.0) -> Depth:
    """Intel D435i: noise of the disparity, the shadows of its second imager, and its range.

    The deviation of the depth is z^2 d / (f B): 4 mm at 1 m, 10 cm at 5 m. A pixel that something nearer hides from
    the left imager (B to the side) is a hole, and so is what is nearer than `least` or farther than `most`.

    Args:
        key: of the noise.
        depth: planar, m, (n, h, w).
        fov: horizontal, rad.
        least: nearest depth that it measures, m.
        most: farthest, m.
    """
    width = depth.shape[-1]
    native = NATIVE_WIDTH / 2 / math.tan(fov / 2)
    inverse = 1.0 / jnp.maximum(depth, 1e-3)
    noisy = 1.0 / jnp.maximum(inverse + DISPARITY_DEVIATION / (native * BASELINE) * _normal(key, depth), 1e-6)
    disparity = width / 2 / math.tan(fov / 2) * BASELINE * inverse
    hidden = jnp.zeros(depth.shape, bool)
    for shift in range(1, math.ceil(width / 2 / math.tan(fov / 2) * BASELINE / least) + 1):
        nearer = jnp.pad(disparity[..., shift:], [(0, 0)] * (depth.ndim - 1) + [(0, shift)], mode="edge")
        hidden |= nearer - disparity > shift - 0.5
    measured = (depth > 0) & (noisy >= least) & (noisy <= most) & ~hidden
    return jnp.where(measured, noisy, 0.0)


def synthetic_distortion() -> Float[np.ndarray, "80 80 5"]:
    """A smooth stand-in for the measured lens distortion of the Redwood model, of its range: 0.81 to 1.11, mean 1.0009.

    Entries: depth is divided by the factor at (x // 8, y // 6, depth bin) of a 640 x 480 image, bins at 1 m, 3 m, ...
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
        table = np.load(Path(name), allow_pickle=False)
    except (OSError, ValueError, EOFError) as error:
        raise ValueError(f"camera.noise.redwood is {name!r}: {error}; {accepted}") from None
    if not isinstance(table, np.ndarray) or table.shape != (80, 80, 5) or table.dtype.kind != "f":
        raise ValueError(f"camera.noise.redwood is {name!r}, of {getattr(table, 'shape', 'arrays')}; {accepted}")
    if not (np.isfinite(table).all() and (table > 0).all()):
        raise ValueError(f"camera.noise.redwood is {name!r}, with numbers that are not positive; {accepted}")
    return table.astype(np.float32)


def redwood(key: PRNGKeyArray, depth: Depth, table: Float[Array | np.ndarray, "80 80 5"]) -> Depth:
    """Depth as PrimeSense-like cameras measure it (Choi, Zhou, Koltun 2015; distortion after Teichman et al. 2013).

    Pixels are jittered by a quarter of a pixel times depth and read at every second one; depth of 10 m and more is a
    hole; depth is divided by the distortion; the disparity is rounded to eighths after noise.

    Args:
        key: of the noise.
        depth: planar, m, (n, h, w).
        table: distortion factors, see `synthetic_distortion`.
    """
    n, height, width = depth.shape
    jitter_key, noise_key = jax.random.split(key)
    jitter = jax.random.normal(jitter_key, (2, *depth.shape), depth.dtype) * 0.25 * depth
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
