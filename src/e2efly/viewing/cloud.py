"""The points that a LiDAR measures."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.ticker import MaxNLocator

from e2efly.viewing.image_plots import ImageSight, resolution
from e2efly.viewing.style import SPEED, VERMILLION, figure

SHOWN = 20.0
"""Largest distance at which points of a LiDAR are drawn, m."""


def cloud(sight: ImageSight) -> np.ndarray:
    """The points that a LiDAR measures, (m, 3), world, m."""
    metres = sight.images["range"]
    met = (metres > 0) & (metres < sight.camera.reach[1])
    return sight.origin + metres[met][:, None] * sight.directions[met]


def write_cloud(sight: ImageSight, path: Path, where: str) -> None:
    """Draw a LiDAR's points, in 3D and from above, coloured by height.

    Args:
        sight: what the LiDAR sees.
        path: the PNG file.
        where: a line under the title.
    """
    points = cloud(sight)
    shown = _nearby(sight, points)
    norm = _height(shown)
    note = [f"{where}, {resolution(sight.camera)}; {len(points)} points met, shown within {SHOWN:g} m"]
    with figure(path, "LiDAR", 5.4, note, free=True) as fig:
        ax: Any = fig.add_axes((0.0, 0.0, 0.56, 0.92), projection="3d")
        ax.scatter(*shown.T, c=shown[:, 2], cmap=SPEED, norm=norm, s=4.0, linewidths=0, depthshade=False)
        ax.plot(*sight.origin[:, None], marker="o", color=VERMILLION, linestyle="")
        ax.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)")
        size = np.ptp(shown, axis=0) if len(shown) else np.ones(3)
        ax.set_box_aspect(np.maximum(size, 0.1 * size.max()), zoom=1.1)
        ax.view_init(elev=32, azim=-110)
        for axis, few in ((ax.xaxis, 5), (ax.yaxis, 5), (ax.zaxis, 3)):
            axis.set_pane_color((1, 1, 1, 0))
            axis.set_major_locator(MaxNLocator(few))
        plan = fig.add_axes((0.62, 0.14, 0.29, 0.66))
        plan_of(plan, sight)
        bar = fig.colorbar(ScalarMappable(norm, SPEED), cax=fig.add_axes((0.935, 0.14, 0.012, 0.66)))
        bar.set_label("height (m)")
        bar.outline.set_visible(False)
        bar.ax.grid(False)


def _nearby(sight: ImageSight, points: np.ndarray) -> np.ndarray:
    return points[np.linalg.norm(points - sight.origin, axis=1) < SHOWN]


def _height(points: np.ndarray) -> Normalize:
    low = points[:, 2].min(initial=np.inf) if len(points) else 0.0
    return Normalize(low, max(points[:, 2].max(initial=-np.inf), low + 1.0))


def plan_of(ax: Axes, sight: ImageSight, title: str = "From above") -> None:
    """Draw a LiDAR's points from above, on axes, coloured by height. Higher points cover lower ones."""
    points = _nearby(sight, cloud(sight))
    points = points[np.argsort(points[:, 2])]
    ax.scatter(*points.T[:2], c=points[:, 2], cmap=SPEED, norm=_height(points), s=2.0, linewidths=0, zorder=2)
    ax.plot(*sight.origin[:2, None], marker="o", color=VERMILLION, linestyle="", markersize=5)
    ax.set_aspect("equal", adjustable="datalim")
    ax.set(xlabel="x (m)", ylabel="y (m)")
    ax.set_title(title)
