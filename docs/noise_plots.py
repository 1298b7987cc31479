"""Plots of noise: its effect on depth, on colours and on a mask, and the Allan deviation of an IMU."""

import dataclasses
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, PRNGKeyArray
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize

from e2efly.config import ImuConfig
from e2efly.config.drawing import INK
from e2efly.simulation.physics import State
from e2efly.simulation.sensors.imu import ImuState, measure
from e2efly.vehicles.loading import load_vehicle
from e2efly.viewing.image_plots import ImageSight, scale, show
from e2efly.viewing.sheet import BAR, DEPTH_NOISES, IMAGE_NOISES, noised
from e2efly.viewing.style import BLUE, GREY, VERMILLION, figure


def plot_depth_noise(sight: ImageSight, key: PRNGKeyArray, path: str | Path) -> None:
    """Draw each noise of depth, and below it the error, for a pinhole camera."""
    camera = dataclasses.replace(sight.camera, sees="depth")
    clean = sight.images["depth"]
    error = Normalize(-0.3, 0.3)
    with figure(path, "Noise of depth", 4.1, [f"Depth to {camera.reach[1]:g} m, and its error; holes are grey"]) as fig:
        axes = fig.subplots(2, 4)
        show(axes[0, 0], "depth", clean, camera, "None")
        axes[1, 0].set_axis_off()
        for above, below, (name, config) in zip(axes[0, 1:], axes[1, 1:], DEPTH_NOISES.items(), strict=True):
            noisy = noised(config, key, clean, camera)
            show(above, "depth", noisy, camera, name)
            off = np.ma.masked_where((noisy <= 0) | (noisy >= camera.reach[1]), noisy - clean)
            below.imshow(off, cmap="RdBu", norm=error, interpolation="nearest")
            below.set(xticks=[], yticks=[], facecolor="#BDBDBD")
            below.grid(False)
            below.spines[:].set_visible(False)
        scale(fig, axes[0], camera.reach[1], **BAR)
        bar: Any = fig.colorbar(ScalarMappable(error, "RdBu"), ax=axes[1], **BAR)
        bar.set_label("error (m)")
        bar.outline.set_visible(False)
        bar.ax.grid(False)


def plot_image_noise(sight: ImageSight, mask: Float[np.ndarray, "h w"], key: PRNGKeyArray, path: str | Path) -> None:
    """Draw each noise of values in [0, 1]: on colours, and on a mask of 0 and 1."""
    colour, label = (dataclasses.replace(sight.camera, sees=sees) for sees in ("rgb", "label"))
    with figure(path, "Noise of images in [0, 1]", 4.1, ["Of colours, and of a mask of 0 and 1"]) as fig:
        for column, (name, config) in zip(fig.subplots(2, 4).T, IMAGE_NOISES.items(), strict=True):
            show(column[0], "rgb", noised(config, key, sight.images["rgb"], colour), colour, name)
            grey = np.repeat(noised(config, key, mask, label)[..., None], 3, axis=-1)
            show(column[1], "rgb", grey, label, "")


def allan_deviation(signal: Float[np.ndarray, "t *n"], group: int) -> float:
    """Root of half the mean square of the differences between neighbouring means over `group` samples."""
    count = len(signal) // group
    means = signal[: count * group].reshape(count, group, -1).mean(axis=1)
    return float(np.sqrt(np.mean(np.diff(means, axis=0) ** 2) / 2))


def rest(config: ImuConfig, key: PRNGKeyArray, seconds: float, rate: float, n: int) -> ImuState:
    """The measurements of n IMUs at rest: leaves (t, n, ...), NumPy."""

    @jax.jit
    def program(key: PRNGKeyArray) -> ImuState:
        still = State.hovering(load_vehicle("vis_r"), jnp.zeros((n, 3)))

        def one(state: ImuState, i: Any) -> tuple[ImuState, ImuState]:
            state = measure(config, jax.random.fold_in(key, i), state, still, still, 1 / rate)
            return state, state

        return jax.lax.scan(one, ImuState.at(still), jnp.arange(round(seconds * rate)))[1]

    return jax.tree.map(np.asarray, program(key))


def plot_imu(config: ImuConfig, key: PRNGKeyArray, path: str | Path, seconds: float = 20_000.0) -> None:
    """Draw the Allan deviation of both sensors at rest, and the values that the configuration predicts."""
    rate = 50.0
    record = rest(config, key, seconds, rate, 2)
    groups = np.unique(np.geomspace(1, len(record.gyroscope) // 8, 40).astype(int))
    tau = groups / rate
    sensors = (
        ("Gyroscope", record.gyroscope, config.gyro_noise, config.gyro_bias, config.gyro_tau, "rad/s"),
        ("Accelerometer", record.accelerometer, config.accel_noise, config.accel_bias, config.accel_tau, "m/s²"),
    )
    with figure(path, "Allan deviation of the IMU at rest", 4.2) as fig:
        for ax, (name, signal, noise, bias, time, unit) in zip(fig.subplots(1, 2), sensors, strict=True):
            found = [allan_deviation(np.asarray(signal, np.float64), int(m)) for m in groups]
            walk = bias / np.sqrt(time)
            ax.loglog(tau, noise / np.sqrt(tau), "--", color=BLUE, label="white noise, N / √τ")
            ax.loglog(tau, walk * np.sqrt(tau / 3), "--", color=VERMILLION, label="bias, B √(τ / 3T)")
            ax.loglog(tau, np.hypot(noise / np.sqrt(tau), walk * np.sqrt(tau / 3)), color=GREY, label="both")
            ax.loglog(tau, found, "o", color=INK, markersize=3.5, label="simulated, 6 axes")
            ax.set_ylim(0.3 * min(found), 3 * max(found))
            ax.set_title(name)
            ax.set_xlabel("averaging time τ (s)")
            ax.set_ylabel(f"Allan deviation ({unit})")
            ax.legend(loc="upper right")
