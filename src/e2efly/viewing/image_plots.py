"""The images of cameras and LiDARs, as pictures with titles, scales and legends."""

import dataclasses
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from e2efly.config import CameraConfig
from e2efly.courses.solids import CLASSES
from e2efly.simulation.scenes.camera import mount, pattern, pose
from e2efly.simulation.scenes.cast import CHANNELS, cast, usual_light
from e2efly.simulation.scenes.meshes import mesh_cast as meshes
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import COLOURS, Scene
from e2efly.viewing.style import GREY, WIDTH, figure

DISTANCE = colormaps["turbo_r"].with_extremes(bad="#BDBDBD")
"""Near is warm, far is cold, holes are grey."""
SENSORS = {
    "rgb": "Colour",
    "label": "Semantic class",
    "depth": "Depth along the optical axis",
    "range": "Range along each ray",
    "instance": "Instance",
    "normal": "Surface normal",
}
"""Titles of the images by sensor."""
DARK, BRIGHT, LONGEST = 0.25, 0.4, 3.0
"""`DARK`: median of the colours below which a world is dark. `BRIGHT`: median to which its pictures are then exposed.
`LONGEST`: largest exposure factor."""
TILE = 16
"""Rows and columns of images are multiples of this, the size of the ray caster's tiles."""


@dataclass(frozen=True)
class ImageSight:
    """The view of one camera at one moment."""

    camera: CameraConfig
    images: dict[str, np.ndarray]
    """Images by a name of `SENSORS`, (h, w) or (h, w, 3). Depth and range are as the camera measures them, m."""
    directions: np.ndarray
    """(h, w, 3) unit vectors of the rays, world."""
    origin: np.ndarray
    """(3,) origin of the rays, world, m."""


@partial(jax.jit, static_argnums=0, static_argnames="channels")
def _solids(
    camera: CameraConfig, scene: Scene, time: Array, position: Array, quaternion: Array, channels: tuple[str, ...]
) -> tuple[dict[str, Array], Array, Array]:
    return _followed(camera, partial(cast, scene.at(time[None])), position, quaternion, channels)


@partial(jax.jit, static_argnums=(0, 1), static_argnames="channels")
def _triangles(
    camera: CameraConfig, scene: MeshScene, position: Array, quaternion: Array, channels: tuple[str, ...]
) -> tuple[dict[str, Array], Array, Array]:
    return _followed(camera, partial(meshes.cast, scene), position, quaternion, channels)


def _followed(
    camera: CameraConfig, follow: Callable, position: Array, quaternion: Array, channels: tuple[str, ...]
) -> tuple[dict[str, Array], Array, Array]:
    """The images, the directions of the rays and their origin."""
    rays = pattern(camera)
    origin, matrix = pose(mount(camera, 1), position[None], quaternion[None])
    images = follow(origin, matrix, rays, channels, usual_light(1) if "rgb" in channels else None)
    directions = jnp.einsum("ij,tjr->itr", matrix[0], rays.tiles)
    return images, jnp.stack([rays.image(d[None])[0] for d in directions], axis=-1), origin[0]


def sized(camera: CameraConfig, columns: int, width: int | None, height: int | None) -> CameraConfig:
    """The camera with `columns` columns, or with `width` if given. Without `height`, its pixels are square. A LiDAR
    keeps its rays.
    """
    if camera.projection == "spherical":
        return dataclasses.replace(camera, width=width or camera.width, height=height or camera.height)
    width = width or columns
    square = width * math.tan(camera.fov[1] / 2) / math.tan(camera.fov[0] / 2)
    return dataclasses.replace(camera, width=width, height=height or max(TILE * round(square / TILE), TILE))


def look_around(
    camera: CameraConfig,
    scene: Scene | MeshScene,
    time: float,
    position: np.ndarray,
    quaternion: np.ndarray,
    channels: tuple[str, ...] = CHANNELS,
    exposed: float = 1.0,
) -> ImageSight:
    """Everything that a camera on a vehicle in a world sees.

    Args:
        camera: the camera of the vehicle.
        scene: one world.
        time: time for moving objects, s.
        position: position of the vehicle, world, m.
        quaternion: attitude of the vehicle, body to world.
        channels: names of `CHANNELS`. With depth, range is also given.
        exposed: factor on the colours. Values above white become white.
    """
    when, *place = (jnp.asarray(x, jnp.float32) for x in (time, position, quaternion))
    if isinstance(scene, MeshScene):
        found = _triangles(camera, scene, *place, channels=channels)
    else:
        found = _solids(camera, scene, when, *place, channels=channels)
    images, rays, origin = jax.tree.map(np.asarray, found)
    images = {name: image[0] for name, image in images.items()}
    length = np.linalg.norm(rays, axis=-1)
    if "rgb" in images:
        images["rgb"] = np.minimum(exposed * images["rgb"], 1.0)
    if "depth" in images:
        near, far = camera.reach
        for name, metres in (("range", images["depth"] * length), ("depth", images["depth"])):
            images[name] = np.where(metres < near, 0.0, np.minimum(metres, far))
    return ImageSight(camera, images, rays / length[..., None], origin)


def exposure(pictures: Iterable[np.ndarray]) -> float:
    """The exposure factor of a camera in a world, the same for all its pictures. It is 1 if the world is not dark.

    Under a roof there is no sun, and the remaining light leaves most of a picture nearly black.

    Args:
        pictures: RGB in [0, 1], (h, w, 3), from several places in the world.
    """
    usual = float(np.median([picture.mean(axis=-1) for picture in pictures]))  # a median: sky in a window hardly counts
    return 1.0 if usual >= DARK else min(BRIGHT / max(usual, 1e-6), LONGEST)


def in_colours(name: str, image: np.ndarray, far: float) -> np.ndarray:
    """An image of a sensor as RGB in [0, 1], (h, w, 3).

    Args:
        name: a name of `SENSORS`.
        image: the image of this sensor.
        far: end of the scale of distances, m.
    """
    match name:
        case "depth" | "range":
            return DISTANCE(np.ma.masked_less_equal(image, 0.0) / far)[..., :3]
        case "label":
            return COLOURS[image]
        case "instance":
            return _distinct(int(image.max()) + 1)[image]
        case "normal":
            met = np.any(image != 0, axis=-1, keepdims=True)
            return np.where(met, np.clip((image + 1) / 2, 0, 1), 1.0)
        case _:
            return np.clip(image, 0.0, 1.0)


def _distinct(count: int) -> np.ndarray:
    """A colour for each instance: pale for sky and ground. Consecutive instances have very different hues."""
    index = np.arange(count)
    vivid = colormaps["hsv"]((index * 0.381966) % 1.0)[:, :3]
    colours = (0.25 + 0.65 * vivid) * np.where(index % 2, 0.75, 1.0)[:, None]
    colours[:2] = [COLOURS[0], [0.82, 0.82, 0.8]][: len(colours[:2])]
    return colours


def show(ax: Axes, name: str, image: np.ndarray, camera: CameraConfig, title: str) -> None:
    """Draw one sensor's image on axes, with pixels sized in proportion to their angles."""
    aspect = shape_of(camera)[0] / shape_of(camera)[1] * image.shape[1] / image.shape[0]
    ax.imshow(in_colours(name, image, camera.reach[1]), interpolation="nearest", aspect=aspect)
    ax.set(xticks=[], yticks=[])
    ax.set_title(title)
    ax.grid(False)
    for spine in ax.spines.values():
        spine.set_visible(False)


def shape_of(camera: CameraConfig) -> tuple[float, float]:
    """Height and width of a camera's picture, in the same unit."""
    if camera.projection == "spherical":
        return camera.fov[1], camera.fov[0]
    return math.tan(camera.fov[1] / 2), math.tan(camera.fov[0] / 2)


def scale(fig: Figure, ax: Any, far: float, **place: Any) -> None:
    """Draw the colour bar of distances beside axes."""
    bar = fig.colorbar(ScalarMappable(Normalize(0.0, far), DISTANCE), ax=ax, **place)
    bar.set_label("m")
    bar.outline.set_visible(False)
    bar.ax.grid(False)


def classes(image: np.ndarray) -> list[Patch]:
    """A legend of the classes in an image."""
    return [
        Patch(facecolor=tuple(COLOURS[i].tolist()), edgecolor=GREY, linewidth=0.5, label=CLASSES[i])
        for i in np.unique(image).tolist()
    ]


def write_pictures(sight: ImageSight, folder: Path, where: str) -> list[Path]:
    """Write one PNG file per sensor.

    Args:
        sight: what a camera sees.
        folder: the folder of the files.
        where: place of the picture, a line under the title.
    """
    written = []
    height, width = shape_of(sight.camera)
    inches = max((WIDTH - 0.9) * height / width, 1.2)
    for name in SENSORS:
        image, camera = sight.images[name], dataclasses.replace(sight.camera, sees=name)
        path = folder / f"{name}.png"
        below = name in ("label", "normal", "instance")
        with figure(path, SENSORS[name], inches + 0.8 + 0.35 * below, [f"{where}, {resolution(camera)}"]) as fig:
            ax = fig.add_subplot()
            show(ax, name, image, camera, "")
            if name in ("depth", "range"):
                scale(fig, ax, camera.reach[1], pad=0.01, fraction=0.03)
                if np.any(image == 0):
                    fig.legend(handles=[Patch(facecolor="#BDBDBD", label="hole")], loc="outside lower center")
            elif name == "label":
                fig.legend(handles=classes(image), loc="outside lower center", ncols=6)
            elif name == "normal":
                ax.set_xlabel("red, green, blue: world x, y, z of the normal, from -1 (dark) to 1")
            elif name == "instance":
                ax.set_xlabel(f"{len(np.unique(image))} instances; sky and ground pale")
        written.append(path)
    return written


def resolution(camera: CameraConfig) -> str:
    """Pixels and field of view, for people."""
    across, up = (math.degrees(angle) for angle in camera.fov)
    return f"{camera.width} x {camera.height} pixels, {across:.0f} x {up:.0f} degrees"
