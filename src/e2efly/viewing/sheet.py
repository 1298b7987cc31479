"""A contact sheet: every sensor and every noise side by side."""

import dataclasses
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import PRNGKeyArray
from matplotlib.axes import Axes

from e2efly.config import CameraConfig, ImageNoiseConfig
from e2efly.simulation.scenes.faces import bodies
from e2efly.simulation.scenes.scene import Scene
from e2efly.simulation.sensors.image_noise import SYNTHETIC, add_image_noise
from e2efly.viewing.cloud import plan_of
from e2efly.viewing.image_plots import SENSORS, ImageSight, classes, scale, shape_of, show
from e2efly.viewing.places import ScenePlace
from e2efly.viewing.style import VERMILLION, WIDTH, figure, say
from e2efly.viewing.tour import Tour
from e2efly.viewing.worlds import draw_plan

DEPTH_NOISES = {
    "Inverse depth, 0.01 1/m": ImageNoiseConfig(inverse_depth=0.01),
    "D435i": ImageNoiseConfig(d435i=True),
    "Redwood (synthetic)": ImageNoiseConfig(redwood=SYNTHETIC),
}
IMAGE_NOISES = {
    "Gaussian, 0.1": ImageNoiseConfig(gaussian=0.1),
    "Speckle, 0.2": ImageNoiseConfig(speckle=0.2),
    "Poisson, 32 levels": ImageNoiseConfig(poisson=32.0),
    "Salt and pepper, 0.05": ImageNoiseConfig(salt_and_pepper=0.05),
}
BAR = {"pad": 0.01, "fraction": 0.03, "aspect": 12}
"""Layout of the colour bar beside a row."""


def noised(config: ImageNoiseConfig, key: PRNGKeyArray, image: np.ndarray, camera: CameraConfig) -> np.ndarray:
    """One image, (h, w) or (h, w, 3), with noise."""

    @jax.jit  # as one program, which is kept on disk
    def seen(key: PRNGKeyArray, image: jax.Array) -> jax.Array:
        return add_image_noise(config, key, image, camera)

    return np.asarray(seen(key, jnp.asarray(image, jnp.float32)[None]))[0]


def write_sheet(
    sight: ImageSight,
    lidar: ImageSight,
    place: ScenePlace,
    tour: Tour,
    key: PRNGKeyArray,
    path: Path,
    title: str,
    where: str,
) -> None:
    """Draw the contact sheet.

    Args:
        sight: what the camera sees.
        lidar: what a LiDAR sees from the same place.
        place: the world.
        tour: the flight through it.
        key: random key of the noise.
        path: the PNG file.
        title: title of the figure.
        where: a line under the title.
    """
    camera = sight.camera
    high, wide = shape_of(camera)
    flat = camera.projection == "pinhole"
    row = float(np.clip((WIDTH / 4 - 0.2) * high / wide, 1.2, 2.6)) + 0.35
    with figure(path, title, 4 * row + 2.1, [where]) as fig:
        heights = [row + 0.55, row + 0.75, row + 0.25, row + 0.25]
        first, second, depths, lower = fig.subfigures(4, 1, height_ratios=heights)  # pyright: ignore[reportGeneralTypeIssues]
        _sensors(first, second, sight, lidar, place, tour)
        sees = "depth" if flat else "range"
        measured = dataclasses.replace(camera, sees=sees)
        _head(depths, f"Noise of {sees}")
        axes = depths.subplots(1, 4)
        clean = sight.images[sees]
        show(axes[0], sees, clean, measured, "None")
        for ax, (name, config) in zip(axes[1:], DEPTH_NOISES.items(), strict=True):
            if not flat and config.inverse_depth is None:
                ax.set_axis_off()
                ax.set_title(name)
                say(ax, "cameras only")
                continue
            show(ax, sees, noised(config, key, clean, measured), measured, name)
        scale(depths, axes, camera.reach[1], **BAR)
        _head(lower, "Noise of images in [0, 1]")
        colour = dataclasses.replace(camera, sees="rgb")
        for ax, (name, config) in zip(lower.subplots(1, 4), IMAGE_NOISES.items(), strict=True):
            show(ax, "rgb", noised(config, key, sight.images["rgb"], colour), colour, name)


def _head(fig: Any, title: str) -> None:
    fig.suptitle(title, x=0.012, ha="left", weight="bold", size=11)


def _sensors(first: Any, second: Any, sight: ImageSight, lidar: ImageSight, place: ScenePlace, tour: Tour) -> None:
    """Two rows: the sensors, a LiDAR's points, and a map."""
    _head(first, "Sensors")
    upper, lower = first.subplots(1, 4), second.subplots(1, 4)
    short = {"depth": "Depth", "range": "Range"}
    for ax, name in zip((*upper, *lower), SENSORS, strict=False):
        camera = dataclasses.replace(sight.camera, sees=name)
        show(ax, name, sight.images[name], camera, short.get(name, SENSORS[name]))
    scale(first, upper, sight.camera.reach[1], **BAR)
    seen = classes(sight.images["label"])
    upper[1].legend(
        handles=seen, loc="upper center", bbox_to_anchor=(0.5, 0.0), ncols=3, fontsize=8, handlelength=1.0,
        columnspacing=0.8,
    )  # fmt: skip
    plan_of(lower[2], lidar, "LiDAR from above")
    plan = lower[3]
    _ground_plan(plan, place, float(sight.origin[2]))
    plan.plot(*tour.position.T[:2], linewidth=1.2)
    plan.plot(*sight.origin[:2, None], marker="o", color=VERMILLION, markersize=5, linestyle="", zorder=4)
    plan.set_title("Map, and the flight")
    plan.set(xlabel="x (m)", ylabel="y (m)")
    plan.set_aspect("equal", adjustable="datalim")


def _ground_plan(ax: Axes, place: ScenePlace, height: float) -> None:
    """Draw the objects of a world from above. For a world of triangles, the solid areas at a height, m."""
    if isinstance(place.scene, Scene):
        draw_plan(ax, bodies(place.scene))
        return
    low, high = place.scene.bounds
    x, y = (np.linspace(low[i], high[i], 200) for i in (0, 1))
    points = np.stack([*np.meshgrid(x, y), np.full((200, 200), height)], axis=-1).reshape(-1, 3)
    gap = np.array(place.clearance(jnp.asarray(points, jnp.float32))).reshape(200, 200)
    gap[[0, -1]] = gap[:, [0, -1]] = 1.0  # the way is kept within the edges; nothing stands there
    ax.contourf(x, y, gap, levels=[-1e3, 0.1], colors=["#A9A29A"], zorder=1.6)
