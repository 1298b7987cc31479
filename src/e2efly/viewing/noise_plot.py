"""Plot of the sensors' noise as a hover shows it, beside the noise of training."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from scipy.signal import welch

from e2efly.alignment.sensor_noise import MEASURED, SensorNoise
from e2efly.viewing.style import CYCLE, INK, figure, legend_of

POINTS = 256
"""Samples of each piece of the log whose spectra are averaged."""
_AXES = "xyz"


def plot_noise(path: Path, noises: Sequence[SensorNoise], trained: Mapping[str, float]) -> None:
    """Draw the spectrum of each sensor's noise, and the white noise that the training has at the sensor's rate.

    Args:
        path: the PNG file.
        noises: as measured, at least one.
        trained: standard deviations of the training, by sensor, in the sensor's unit.
    """
    notes = [
        "spectral density of what local parabolas leave over, from where motion and noise can be told apart",
        "dashed: the training's white noise at this sensor's rate. A flat spectrum is white noise, peaks are vibration",
    ]
    rows = -(-len(noises) // 2)
    with figure(path, "Noise of the sensors at hover", 1.0 + 2.6 * rows, notes) as fig:
        for place, noise in enumerate(noises, 1):
            ax = fig.add_subplot(rows, 2, place)
            frequency, density = welch(noise.rest, noise.rate, nperseg=min(len(noise.rest), POINTS), axis=0)
            shown = frequency > noise.slowest
            for i, axis in enumerate(_AXES):
                ax.loglog(frequency[shown], np.sqrt(density[shown, i]), color=CYCLE[i], linewidth=1.1, label=axis)
            if level := trained.get(noise.name, 0.0):
                white = level * np.sqrt(2 / noise.rate)  # one-sided
                ax.axhline(white, color=INK, linestyle="--", linewidth=1.2, label="training")
            ax.set_title(noise.name.replace("_", " "))
            ax.set_ylabel(f"{MEASURED[noise.name]}/√Hz".replace("^2", "²"))
            ax.set_xlabel("frequency (Hz)")
        legend_of(fig.axes[0], fig)
