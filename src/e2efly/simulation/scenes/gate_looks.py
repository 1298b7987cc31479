"""Colour images of gates with random looks: what a network that finds gates learns from, and is judged by.

Each class of surface has a texture of two colours, blotches of a third one, and a random light. `SEEN` and `KEPT_APART`
have no texture of a gate, of the ground or of the background in common, and the light of `KEPT_APART` is lower, warmer
or colder, its shadows are deeper, its lens is softer.
"""

import dataclasses
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, PRNGKeyArray, UInt8

from e2efly.config import CameraConfig
from e2efly.flight.sight.segment import opencv
from e2efly.simulation.scenes.camera import Mount, pattern, pose
from e2efly.simulation.scenes.cast import Light, cast
from e2efly.simulation.scenes.scene import COLOURS, GATE, GROUND, OBSTACLE, SKY, Scene
from e2efly.simulation.scenes.shapes import FAR
from e2efly.simulation.scenes.textures import hashed, smooth, texture, worn

PAINTS = 12
"""Colours from which those of a gate are chosen."""
CLASSES = (SKY, GROUND, OBSTACLE, GATE)
"""Rows of a look."""
CHANNELS = ("depth", "label", "instance", "normal", "rgb")


@dataclass(frozen=True)
class LookFamily:
    """What is drawn from: numbers of `texture`, and intervals."""

    gate: tuple[int, ...]
    around: tuple[int, ...]
    """Of background, ground and obstacles."""
    sun: tuple[float, float]
    """Height of the sun, rad."""
    strength: tuple[float, float]
    """Of the sun."""
    exposure: tuple[float, float]
    tint: tuple[float, float]
    """How much more red than blue, or less."""
    blur: tuple[float, float]
    """Standard deviation of the lens's blur, pixels at 640 columns."""
    paint: tuple[tuple[float, float, float], tuple[float, float, float]] | None = None
    """RGB of the two colours of a gate's texture. None: in each world those that are unlike what is around."""


_OTHERS = (10, 11, 12, 13, 14, 15, 16)
"""Cells, marble, waves, blocks, ramps, crosses, camouflage."""
SEEN = LookFamily(
    (0, 1, 3, 6, 7, *_OTHERS), (0, 1, 2, 3, 7, *_OTHERS), (0.5, 1.5), (0.0, 0.6), (0.5, 1.3), (0.0, 0.12), (0.4, 1.3)
)
"""Gates of noise, tiles, checker, plain, stripes; around them noise, tiles, planks, checker, stripes; and others."""
TRIED = dataclasses.replace(SEEN, gate=(17, 18, 19), around=(17, 18, 19))
"""Triangles, rings, weave: to see, while a network is made, what it finds in looks that it has not learned."""
KEPT_APART = LookFamily((2, 5, 8, 9), (4, 5, 8, 9), (0.2, 0.5), (0.6, 0.75), (0.6, 1.1), (0.12, 0.18), (0.5, 1.5))
"""Gates of planks, gravel, spots, diagonal bands; around them plates, gravel, spots, diagonal bands. For judging."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Look:
    """Looks of n worlds. The second axis is that of the classes: background, ground, obstacles, gates."""

    texture: Int[Array, "n 4"]
    number: Float[Array, "n 4 4"]
    """`texture` reads these."""
    colour: Float[Array, "n 4 3 3"]
    """RGB of the two colours of the texture, and of its blotches."""
    light: Light
    tone: Float[Array, "n 3"]
    """Factors on red, green and blue."""
    blur: Float[Array, " n"]
    """Standard deviation of the lens's blur, pixels at 640 columns."""
    noise: Float[Array, "n 2"]
    """Standard deviations of the noise, of values and relative to them."""
    motion: Float[Array, " n"]
    """Most pixels that an exposure smears, at 640 columns."""


def drawn(key: PRNGKeyArray, n: int, family: LookFamily) -> Look:
    """Looks of n worlds."""
    keys = iter(jax.random.split(key, 16))

    def uniform(*shape: int, of: tuple[float, float] = (0.0, 1.0)) -> Array:
        return jax.random.uniform(next(keys), (n, *shape), minval=of[0], maxval=of[1])

    around, gate = (
        jnp.asarray(c)[jax.random.randint(next(keys), (n, k), 0, len(c))]
        for c, k in ((family.around, 3), (family.gate, 1))
    )
    grey, colourful = uniform(4, 3, 1, of=(0.05, 1.0)), uniform(4, 3, 1) ** 2
    colour = jnp.clip(grey + colourful * uniform(4, 3, 3, of=(-0.7, 0.7)), 0, 1)
    paint = uniform(PAINTS, 3)
    if family.paint is not None:
        colour = colour.at[:, 3, :2].set(jnp.asarray(family.paint))
    else:  # it is painted to be seen: of some colours, those farthest from what is around it
        away = jnp.abs(paint[:, :, None] - colour[:, :3, :2].reshape(n, 1, 6, 3)).max(-1).min(-1)
        best = jnp.argsort(-away, axis=1)[:, :3]
        colour = colour.at[:, 3].set(jnp.take_along_axis(paint, best[..., None], axis=1))
    turn, height = uniform(of=(0.0, 2 * jnp.pi)), uniform(of=family.sun)
    sun = jnp.stack([jnp.cos(turn) * jnp.cos(height), jnp.sin(turn) * jnp.cos(height), jnp.sin(height)], axis=-1)
    tint = uniform(of=family.tint) * jnp.sign(uniform() - 0.5)
    tone = uniform(of=family.exposure)[:, None] * (1 + tint[:, None] * jnp.array([1.0, 0.0, -1.0]))
    return Look(
        jnp.concatenate([around, gate], axis=1), uniform(4, 4), colour,
        Light(sun, uniform(of=family.strength), jnp.zeros(n)), tone, uniform(of=family.blur),
        uniform(2) ** 2 * jnp.array([0.05, 0.08]), 6.0 * uniform() ** 2,
    )  # fmt: skip


@partial(jax.jit, static_argnames="config")
def coloured(
    config: CameraConfig, scene: Scene, mount: Mount, position: Float[Array, "n 3"], quaternion: Float[Array, "n 4"],
    look: Look,
) -> tuple[Float[Array, "n h w 3"], Int[Array, "n h w"]]:  # fmt: skip
    """Colours in [0, 1], as a perfect camera has them, and labels. See `camera.look`."""
    rays = pattern(config)
    origin, matrix = pose(mount, position, quaternion)
    white = {kind: dataclasses.replace(s, colour=jnp.ones_like(s.colour)) for kind, s in scene.solids.items()}
    seen = cast(dataclasses.replace(scene, solids=white), origin, matrix, rays, CHANNELS, look.light)
    way = jnp.moveaxis(jnp.asarray(rays.directions), -1, 0)

    def world(given: tuple[dict[str, Array], Array, Array, Look]) -> Array:
        found, origin, matrix, look = given
        label, normal = found["label"], jnp.moveaxis(found["normal"], -1, 0)
        ahead = [sum(matrix[i, j] * way[j] for j in range(3)) for i in range(3)]  # a product of matrices takes longer
        point = [o + found["depth"] * direction for o, direction in zip(origin, ahead, strict=True)]
        level = jnp.abs(normal[2]) > 0.7
        along = point[1] * normal[0] - point[0] * normal[1]
        sky = label == SKY
        x = jnp.where(sky, 3 * jnp.arctan2(ahead[1], ahead[0]), jnp.where(level, point[0], along))
        y = jnp.where(sky, 3 * ahead[2] / jnp.hypot(ahead[0], ahead[1]), jnp.where(level, point[1], point[2]))
        row = jnp.select([label == which for which in CLASSES], list(range(len(CLASSES))))
        share = jnp.zeros(label.shape)
        for k, which in enumerate(CLASSES):
            here = label == which
            kind = partial(texture, look.texture[k], x, y, look.number[k])
            share = jnp.where(here, jax.lax.cond(here.any(), kind, lambda: 0 * x), share)
        number = look.number[row]
        own, second, third = jnp.moveaxis(look.colour[row], 2, 0)
        share = worn(share, x, y, number)[..., None]
        colour = own * (1 - share) + second * share
        blotch = (smooth(1.3 * x, 1.7 * y, number[..., 1]) > 0.7) & (label != GATE)
        colour = jnp.where(blotch[..., None], 0.4 * colour + 0.6 * third, colour)
        instance = found["instance"]  # obstacles: each another one
        tone = jnp.stack([hashed(instance, instance + k, look.number[2, 2]) for k in range(3)], axis=-1)
        colour = jnp.where((label == OBSTACLE)[..., None], 0.5 * colour + 0.5 * tone, colour)
        # of `cast`'s colours, only the brightness
        red = jnp.where(label == SKY, COLOURS[SKY, 0], jnp.where(label == GROUND, COLOURS[GROUND, 0], 1.0))
        bright = found["rgb"][..., 0] / red
        return jnp.clip(colour * bright[..., None] * look.tone, 0, 1)

    near = seen | {"depth": jnp.minimum(seen["depth"], FAR / 1e3)}
    return jax.lax.map(world, (near, origin, matrix, look)), seen["label"]


def photographed(
    colours: Float[np.ndarray, "h w 3"], look: Look, scale: float, random: np.random.Generator
) -> UInt8[np.ndarray, "h w 3"]:
    """Colours as a camera delivers them, 255 for 1: its lens's blur, its exposure's smear and its noise.

    Args:
        colours: in [0, 1].
        look: of which the first world's camera is used.
        scale: pixels of the image for one of an image of 640 columns.
        random: draws the noise and the smear, which has any direction and length. Its middle stays where it is.

    Raises:
        ValueError: if OpenCV is not installed.
    """
    blur, motion = (scale * float(leaf[0]) for leaf in (look.blur, look.motion))
    noise = np.asarray(look.noise[0])
    cv2 = opencv()
    image = cv2.GaussianBlur(np.asarray(colours, np.float32), (0, 0), max(blur, 0.1))
    angle, length = random.uniform(0, np.pi), motion * random.uniform()
    if length > 1:
        half = int(np.ceil(length / 2))
        y, x = np.mgrid[-half : half + 1, -half : half + 1]
        along, across = x * np.cos(angle) + y * np.sin(angle), y * np.cos(angle) - x * np.sin(angle)
        kernel = np.clip(1 - np.abs(across), 0, 1) * np.clip(length / 2 + 0.5 - np.abs(along), 0, 1)
        image = cv2.filter2D(image, -1, (kernel / kernel.sum()).astype(np.float32), borderType=cv2.BORDER_REPLICATE)
    image += np.hypot(noise[0], noise[1] * image) * random.standard_normal(image.shape, dtype=np.float32)
    return np.clip(np.round(255 * image), 0, 255).astype(np.uint8)
