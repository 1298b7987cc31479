"""The solids of worlds in plots: in 3D, and as outlines from above."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import Normalize
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from e2efly.scenes.faces import Body, bodies
from e2efly.scenes.scene import Scene
from e2efly.view.flights import Flights
from e2efly.view.style import FAILURE, GREY, MARK, SPEED, START, WIDTH, figure


def draw_plan(ax: Axes, things: Sequence[Body]) -> None:
    """Add solids to axes x, y in m: filled outlines from above, dotted where they move."""
    outlines = [body.outline for body in things]
    faces = [_pale(body.colour, 0.35) for body in things]
    ax.add_collection(PolyCollection(outlines, facecolors=faces, edgecolors=GREY, linewidths=0.6, zorder=1.6))
    ways = [body.path[:, :2] for body in things if body.path is not None]
    ax.add_collection(LineCollection(ways, colors=GREY, linewidths=0.8, linestyles=":", zorder=1.7))


def draw_space(ax: Any, things: Sequence[Body]) -> None:
    """Add solids to 3D axes in m, light enough to see a path behind them."""
    for body in things:
        faces = Poly3DCollection(list(body.quads), facecolors=[_pale(body.colour, 0.3)], shade=True, zorder=1.6)
        faces.set_alpha(0.35)
        ax.add_collection3d(faces, autolim=False)
        if body.path is not None:
            way = Line3DCollection([body.path], colors=GREY, linewidths=0.8, linestyles=":", zorder=1.7)
            ax.add_collection3d(way, autolim=False)


def plot_flights_in_worlds(flights: Flights, scene: Scene, path: str | Path, title: str, count: int = 6) -> None:
    """Draw flights from above, each in its own world as that was when the flight ended, coloured by speed.

    Args:
        flights: n episodes.
        scene: n worlds, that of each episode; or one, that of all.
        path: the PNG file.
        title: of the figure.
        count: how many flights, those without success first.
    """
    order = np.argsort(flights.success, kind="stable")
    shown = sorted([int(i) for i in order if flights.length[i] > 0][:count])
    worlds = [bodies(scene, i if scene.worlds > 1 else 0, float(flights.time[flights.length[i] - 1])) for i in shown]
    tracks = [flights.position[: flights.length[i], i] for i in shown]
    low, high = _bounds(tracks, worlds)
    size = high - low
    columns = max(1, min(len(shown), 3, round(math.sqrt(1.5 * len(shown) * size[1] / size[0]))))
    rows = max(1, math.ceil(len(shown) / columns))
    panel = (WIDTH - 1.6) / columns
    height = min(max(rows * (panel * size[1] / size[0] + 0.45) + 1.3, 4.5), 14.0)
    fastest = max((flights.speed[: flights.length[i], i].max() for i in shown), default=0.0)
    norm = Normalize(0.0, max(float(fastest), 0.1))
    failed = int(np.sum(~flights.success[shown].astype(bool)))
    note = [f"From above, {len(shown)} of {len(flights.length)} flights, each in its own world"]
    with figure(path, title, height, note) as fig:
        axes = fig.subplots(rows, columns, squeeze=False, sharex=True, sharey=True)
        for ax, i, world, track in zip(axes.flat, shown, worlds, tracks, strict=False):
            draw_plan(ax, world)
            speed = flights.speed[: len(track), i]
            lines = LineCollection(
                list(np.stack([track[:-1, :2], track[1:, :2]], axis=1)), array=(speed[:-1] + speed[1:]) / 2,
                cmap=SPEED, norm=norm, linewidths=2.0, zorder=3, capstyle="round",
            )  # fmt: skip
            ax.add_collection(lines)
            ax.plot(*flights.goal[len(track) - 1, i, :2, None], marker="*", **MARK, zorder=2.5)
            ax.plot(*track[0, :2, None], **START, zorder=4)
            good = bool(flights.success[i])
            if not good:
                ax.plot(*track[-1, :2, None], **FAILURE, zorder=5)
            word = "success" if good else "no success"
            ax.set_title(f"{word}, {flights.time[len(track) - 1]:.1f} s, top {speed.max():.1f} m/s", size=9)
            ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
            ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
            ax.yaxis.set_major_locator(MaxNLocator(5, steps=[1, 2, 5, 10]))
            ax.grid(False)
        for ax in axes.flat[len(shown) :]:
            ax.set_axis_off()
        for ax in axes[-1]:
            ax.set_xlabel("x (m)")
        for ax in axes[:, 0]:
            ax.set_ylabel("y (m)")
        bar = fig.colorbar(ScalarMappable(norm, SPEED), ax=axes, fraction=0.025, pad=0.01, aspect=40)
        bar.set_label("speed (m/s)")
        bar.outline.set_visible(False)
        handles = [Line2D([], [], label="start", **START), Line2D([], [], label="goal at the end", marker="*", **MARK)]
        if failed:
            handles.append(Line2D([], [], label=f"no success ({failed} of {len(shown)})", **FAILURE))
        fig.legend(handles=handles, loc="outside lower center", ncols=3)


def _bounds(tracks: list[np.ndarray], worlds: list[list[Body]]) -> tuple[np.ndarray, np.ndarray]:
    """Corners of a level rectangle about all that is drawn, with a margin."""
    points = [track[:, :2] for track in tracks]
    points += [body.quads[..., :2].reshape(-1, 2) for world in worlds for body in world]
    whole = np.concatenate([*points, np.zeros((0, 2))])
    whole = whole if len(whole) else np.zeros((1, 2))
    low, high = whole.min(axis=0), whole.max(axis=0)
    margin = np.maximum(0.03 * (high - low).max(), 0.3)
    return low - margin, high + margin


def _pale(colour: np.ndarray, share: float) -> tuple[float, ...]:
    """A colour mixed with a share of white."""
    return tuple((1 - share) * colour + share)
