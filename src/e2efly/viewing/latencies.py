"""A histogram of latencies, with the important quantiles."""

from pathlib import Path

import numpy as np

from e2efly.viewing.style import BLUE, GREY, figure


def plot_latencies(seconds: np.ndarray, rate: float, path: str | Path) -> None:
    """Draw the latencies from the newest pose to the image.

    Args:
        seconds: (n,) latency of each image, s.
        rate: rate of the images, Hz.
        path: the PNG file.
    """
    ms = 1e3 * np.asarray(seconds)
    middle, late = np.quantile(ms, (0.5, 0.99))
    said = f"{len(ms)} images at {rate:.1f} Hz; median {middle:.1f} ms, p99 {late:.1f} ms, largest {ms.max():.1f} ms"
    with figure(path, "From the newest pose to the image", 3.5, [said]) as fig:
        axes = fig.subplots()
        axes.hist(ms, bins=np.linspace(0, max(ms.max(), 1e-3), 61), color=BLUE)
        for value, name in ((middle, "median"), (late, "p99")):
            axes.axvline(value, color=GREY, linestyle="--")
            axes.annotate(name, (value, 0.95), (3, 0), ("data", "axes fraction"), textcoords="offset points")
        axes.set(xlabel="from the pose's arrival to the published image (ms)", ylabel="images", xlim=(0, None))
