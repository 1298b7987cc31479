"""Plots of runs and flights as PNG files, by matplotlib's object interface: no window, no global state."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import matplotlib
import numpy as np
from jaxtyping import PRNGKeyArray
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from e2efly.env import Env
from e2efly.evaluate import Act, Episodes, trace, wilson
from e2efly.tasks import Race, Task, Track

COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#999999")
"""Okabe and Ito's palette, safe for colour-blind readers."""
SPEED = "viridis"

matplotlib.rcParams.update(
    {"axes.spines.top": False, "axes.spines.right": False, "axes.grid": True, "grid.alpha": 0.25}
)


@dataclass(frozen=True)
class Flights:
    """States and commands of n flights at t control steps, NumPy."""

    time: np.ndarray
    """(t,) s."""
    position: np.ndarray
    """(t, n, 3) world, m."""
    velocity: np.ndarray
    """(t, n, 3) world, m/s."""
    quaternion: np.ndarray
    """(t, n, 4) wxyz, body to world."""
    body_rate: np.ndarray
    """(t, n, 3) body, rad/s."""
    rotor_speed: np.ndarray
    """(t, n, 4) rad/s."""
    command: np.ndarray
    """(t, n, 4) in the units of the command mode."""
    goal: np.ndarray
    """(t, n, 3) where to be, world, m."""
    length: np.ndarray
    """(n,) steps until the episode ended."""
    success: np.ndarray
    """(n,) whether it met the criterion."""


def fly(env: Env, act: Act, key: PRNGKeyArray, n: int, steps: int) -> Flights:
    """Fly `n` episodes of at most `steps` control steps and keep everything."""
    states, actions, goals, out = jax.tree.map(
        np.asarray, jax.jit(lambda env, key: trace(env, act, key, n, steps))(env, key)
    )
    done = out.terminated | out.truncated
    length = np.where(done.any(0), done.argmax(0) + 1, steps)
    low, half = np.asarray(env.center) - np.asarray(env.half), np.asarray(env.half)
    return Flights(
        time=env.control_period * np.arange(1, steps + 1),
        position=states.position,
        velocity=states.velocity,
        quaternion=states.quaternion,
        body_rate=states.body_rate,
        rotor_speed=states.rotor_speed,
        command=low + (np.clip(actions, -1, 1) + 1) * half,
        goal=goals,
        length=length,
        success=np.array([bool(out.success[k - 1, i]) for i, k in enumerate(length)]),
    )


def plot_learning(rows: list[dict[str, float]], path: Path, title: str) -> None:
    """Learning curves against seconds from the start of the process and against environment steps."""
    figure = Figure(figsize=(12, 7), layout="constrained")
    axes = figure.subplots(2, 2, sharey="row")
    seen = [row for row in rows if "seconds" in row]
    names = [key for key in (seen[0] if seen else {}) if key.endswith("/success")]
    for column, (key, label, scale) in enumerate(
        (("seconds", "time from process start, s", 1.0), ("steps", "environment steps, millions", 1e-6))
    ):
        x = [row[key] * scale for row in seen]
        for name, color in zip(names, COLORS, strict=False):
            axes[0, column].plot(
                x, [100 * row[name] for row in seen], "o-", ms=3, color=color, label=name.split("/")[1]
            )
        axes[1, column].plot(x, [row["reward"] for row in seen], "o-", ms=3, color=COLORS[2], label="reward")
        axes[1, column].set_xlabel(label)
        for axis in axes[:, column]:
            axis.set_xlim(left=0)
    axes[0, 0].set(ylabel="success, %", ylim=(-3, 103))
    axes[1, 0].set_ylabel("mean reward a step")
    if names:
        axes[0, 0].legend(frameon=False)
    figure.suptitle(f"{title}: learning")
    figure.savefig(path, dpi=110)


def plot_flights(task: Task, flights: Flights, path: Path, title: str) -> None:
    """Trajectories coloured by speed, in space and from above, with what the task flies to."""
    figure = Figure(figsize=(12, 5.6), layout="constrained")
    space, top = figure.add_subplot(1, 2, 1, projection="3d"), figure.add_subplot(1, 2, 2)
    top_speed = max(
        1.0, max(np.linalg.norm(flights.velocity[:k, i], axis=-1).max() for i, k in enumerate(flights.length))
    )
    norm = Normalize(0, top_speed)
    for i, k in enumerate(flights.length):
        p, v = flights.position[:k, i], np.linalg.norm(flights.velocity[:k, i], axis=-1)
        if k > 1:
            pieces = np.stack([p[:-1], p[1:]], axis=1)
            space.add_collection3d(Line3DCollection(list(pieces), array=v[1:], cmap=SPEED, norm=norm, lw=1.4))
            top.add_collection(LineCollection(list(pieces[..., :2]), array=v[1:], cmap=SPEED, norm=norm, lw=1.4))
        space.scatter(*p[0], color=COLORS[7], s=10)
        top.scatter(*p[0, :2], color=COLORS[7], s=12, label="start" if i == 0 else None, zorder=3)
        if not flights.success[i]:
            top.scatter(*p[-1, :2], color=COLORS[1], marker="x", s=40, zorder=4)
    _scenery(task, flights, space, top)
    points = np.concatenate([flights.position[:k, i] for i, k in enumerate(flights.length)])
    low, high = points.min(0) - 0.3, points.max(0) + 0.3
    low[2] = min(low[2], 0.0)
    space.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    space.set_box_aspect(high - low)
    space.set(xlabel="x, m", ylabel="y, m", zlabel="z, m")
    top.set(xlabel="x, m", ylabel="y, m", aspect="equal", xlim=(low[0], high[0]), ylim=(low[1], high[1]))
    top.legend(frameon=False, loc="upper right")
    mappable = ScalarMappable(norm, SPEED)
    figure.colorbar(mappable, ax=top, label="speed, m/s", shrink=0.8)
    figure.suptitle(f"{title}: {flights.success.sum()} of {len(flights.success)} flights drawn succeeded")
    figure.savefig(path, dpi=110)


def _scenery(task: Task, flights: Flights, space: Any, top: Axes) -> None:
    """Gates, reference, or target."""
    if isinstance(task, Race):
        g = task.gates
        for i, (c, cos, sin, half) in enumerate(zip(g.position[:-1], g.cos, g.sin, g.half, strict=True)):
            left = np.array([-sin, cos, 0.0])
            corners = [
                c + a * half[0] * left + b * half[1] * np.array([0, 0, 1.0])
                for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1))
            ]
            corners = np.array(corners)
            space.plot(*corners.T, color=COLORS[1], lw=2)
            top.plot(*corners[:, :2].T, color=COLORS[1], lw=3, label="gate" if i == 0 else None)
            top.annotate(str(i + 1), c[:2] + 0.3, color=COLORS[1])
        return
    for i, k in enumerate(flights.length):
        goal, label = flights.goal[:k, i], "target" if i == 0 else None
        if isinstance(task, Track):
            space.plot(*goal.T, color=COLORS[7], lw=0.6, ls="--")
            top.plot(*goal[:, :2].T, color=COLORS[7], lw=0.8, ls="--", label="reference" if i == 0 else None)
        elif i == 0:
            space.scatter(*goal[0], color=COLORS[1], s=40)
            top.scatter(*goal[0, :2], color=COLORS[1], s=40, label=label, zorder=5)


def plot_time(flights: Flights, index: int, path: Path, title: str) -> None:
    """One flight over time: states, and the commands beside the response."""
    k = int(flights.length[index])
    t = flights.time[:k]
    q = flights.quaternion[:k, index]
    w, x, y, z = q.T
    tilt = np.degrees(np.arccos(np.clip(1 - 2 * (x * x + y * y), -1, 1)))
    heading = np.degrees(np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))
    figure = Figure(figsize=(12, 9), layout="constrained")
    axes = figure.subplots(3, 2, sharex=True).ravel()
    for i, name in enumerate("xyz"):
        axes[0].plot(t, flights.position[:k, index, i], color=COLORS[i], label=name)
        axes[0].plot(t, flights.goal[:k, index, i], color=COLORS[i], ls=":", lw=1)
        axes[1].plot(t, flights.velocity[:k, index, i], color=COLORS[i], label=name)
        axes[3].plot(t, flights.body_rate[:k, index, i], color=COLORS[i], label=("roll", "pitch", "yaw")[i])
        axes[3].step(t, flights.command[:k, index, i + 1], color=COLORS[i], ls=":", lw=1, where="pre")
    axes[2].plot(t, tilt, color=COLORS[0], label="tilt")
    axes[2].plot(t, heading, color=COLORS[1], label="heading")
    axes[4].step(t, flights.command[:k, index, 0] / 9.81, color=COLORS[0], where="pre")
    for i, name in enumerate(("rear right", "front right", "rear left", "front left")):
        axes[5].plot(t, flights.rotor_speed[:k, index, i], color=COLORS[i], label=name)
    labels = (
        "position (dotted: goal), m", "velocity, m/s", "angle, deg", "body rate (dotted: command), rad/s",
        "first command / 9.81 (ctbr: thrust in g)", "rotor speed, rad/s",
    )  # fmt: skip
    for axis, label in zip(axes, labels, strict=True):
        axis.set_ylabel(label)
        if axis.get_legend_handles_labels()[0]:
            axis.legend(frameon=False, ncols=4, fontsize=8, loc="best")
    for axis in axes[-2:]:
        axis.set_xlabel("time, s")
    figure.suptitle(f"{title}: one flight")
    figure.savefig(path, dpi=110)


def plot_errors(episodes: dict[str, Episodes], path: Path, title: str) -> None:
    """Distributions over all starts of the final error, the mean error, the duration and the top speed."""
    figure = Figure(figsize=(12, 7), layout="constrained")
    axes = figure.subplots(2, 2).ravel()
    columns = (("final_error", "final error, m", True), ("mean_error", "mean error, m", True),
               ("duration", "duration, s", False), ("top_speed", "top speed, m/s", False))  # fmt: skip
    notes = []
    for (name, e), color in zip(episodes.items(), COLORS, strict=False):
        ok = np.asarray(e.success)
        low, high = wilson(int(ok.sum()), len(ok))
        notes.append(f"{name} {ok.mean():.1%} ({low:.1%} to {high:.1%})")
        for axis, (column, label, logarithmic) in zip(axes, columns, strict=True):
            values = np.sort(np.asarray(getattr(e, column), np.float64))
            if logarithmic:
                values = np.maximum(values, 1e-5)
                axis.set_xscale("log")
            axis.plot(values, 100 * np.arange(1, len(values) + 1) / len(values), color=color, label=name)
            axis.set(xlabel=label, ylabel="starts at or below, %", ylim=(0, 101))
    if episodes:
        axes[0].legend(frameon=False)
    figure.suptitle(f"{title}: success {', '.join(notes)}")
    figure.savefig(path, dpi=110)
