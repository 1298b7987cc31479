"""The images of cameras on a flight, as a strip."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from e2efly.config import CameraConfig
from e2efly.viewing.flights import Flights
from e2efly.viewing.image_plots import show
from e2efly.viewing.style import PALE, WIDTH, figure

COLUMNS = 8
"""Number of images in a strip, at uniform times from the first to the last."""


def plot_seen(flights: Flights, cameras: Sequence[CameraConfig], path: str | Path, title: str, count: int = 3) -> None:
    """Draw the images that the policy saw on a few flights, failed ones first. Each camera of each flight has one row.

    Args:
        flights: the flights, with images.
        cameras: the cameras of the images, in order.
        path: the PNG file.
        title: title of the figure.
        count: number of flights.
    """
    order = np.argsort(flights.success, kind="stable")
    rows = [(int(i), k) for i in order[:count] for k in range(len(cameras))]
    side = (WIDTH - 0.4) / COLUMNS
    notes = ["what the policy was shown, at even times from the start to the end of a flight"]
    with figure(path, title, max(len(rows) * (side + 0.3) + 0.8, 4.2), notes) as fig:
        axes = fig.subplots(len(rows), COLUMNS, squeeze=False)
        for row, (i, k) in zip(axes, rows, strict=True):
            at = np.linspace(0, flights.length[i] - 1, COLUMNS).round().astype(int)
            for ax, t in zip(row, at, strict=True):
                image = flights.images[k][t, i]
                shown = np.repeat(image[..., None], 3, axis=-1) if cameras[k].sees == "mask" else image
                show(ax, cameras[k].sees, shown, cameras[k], "")
                ax.set_xlabel(f"{flights.time[t]:.1f} s", size=8)
                for spine in ax.spines.values():
                    spine.set(visible=True, color=PALE)
            row[0].set_title(f"{flights.ending(i)}, {cameras[k].sees}", size=9)
