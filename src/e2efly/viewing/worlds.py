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
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from e2efly.config.drawing import INK
from e2efly.control import Quat
from e2efly.simulation.scenes.faces import FacesBody, bodies
from e2efly.simulation.scenes.scene import Scene
from e2efly.viewing.flights import Flights
from e2efly.viewing.style import FAILURE, GREY, MARK, SPEED, START, WIDTH, figure

HEADINGS = 12
"""Number of times at which the heading of a flight is drawn."""
APART, MANY = 0.3, 40
"""`APART`: a goal that jumps by more than this, m, is a new goal. `MANY`: with more jumps than this, it is one moving
goal."""
NUMBER: dict[str, Any] = {
    "color": INK, "size": 8, "weight": "bold", "zorder": 6,
    "path_effects": [withStroke(linewidth=2, foreground="white")],
}  # fmt: skip
"""Style of the number of a goal."""


def draw_plan(ax: Axes, things: Sequence[FacesBody]) -> None:
    """Add solids to axes x, y in m: filled outlines from above, dotted for solids that move."""
    outlines = [body.outline for body in things]
    faces = [_pale(body.colour, 0.35) for body in things]
    ax.add_collection(PolyCollection(outlines, facecolors=faces, edgecolors=GREY, linewidths=0.6, zorder=1.6))
    ways = [body.way[:, :2] for body in things if body.way is not None]
    ax.add_collection(LineCollection(ways, colors=GREY, linewidths=0.8, linestyles=":", zorder=1.7))


def draw_space(ax: Any, things: Sequence[FacesBody]) -> None:
    """Add solids to 3D axes in m, light enough to see a path behind them."""
    for body in things:
        faces = Poly3DCollection(list(body.quads), facecolors=[_pale(body.colour, 0.3)], shade=True, zorder=1.6)
        faces.set_alpha(0.35)
        ax.add_collection3d(faces, autolim=False)
        if body.way is not None:
            way = Line3DCollection([body.way], colors=GREY, linewidths=0.8, linestyles=":", zorder=1.7)
            ax.add_collection3d(way, autolim=False)


def plot_flights_in_worlds(
    flights: Flights, scene: Scene, path: str | Path, title: str, count: int = 6, notes: Sequence[str] = ()
) -> None:
    """Draw flights, each in its own world as it was at the end of the flight, coloured by speed: from above with the
    heading at some times, and the height over the distance flown. Vehicles of the same world are drawn together.

    Args:
        flights: n episodes.
        scene: n worlds, one for each episode, or one world for all.
        path: the PNG file.
        title: title of the figure.
        count: number of worlds, failed ones first.
        notes: lines under the title.
    """
    a = flights.agents
    order = a * np.argsort(flights.success[::a], kind="stable")
    shown = [int(i) for i in order if flights.length[i] > 0][:count]  # of each world its first vehicle
    worlds = [bodies(scene, i if scene.worlds > 1 else 0, float(flights.time[flights.length[i] - 1])) for i in shown]
    tracks = [flights.position[: flights.length[i], i + j] for i in shown for j in range(a)]
    low, high = _bounds(tracks, worlds)
    size = high - low
    columns = max(1, min(len(shown), 3, round(math.sqrt(1.5 * len(shown) * size[1] / size[0]))))
    rows = max(1, math.ceil(len(shown) / columns))
    panel = max((WIDTH - 1.6) / columns * size[1] / size[0], 0.5)
    height = min(max(rows * (panel + 1.35) + 1.3, 4.5), 10.8)
    fastest = max((flights.speed[: flights.length[i], i : i + a].max() for i in shown), default=0.0)
    norm = Normalize(0.0, max(float(fastest), 0.1))
    top = max((float(np.nanmax(track[:, 2])) for track in tracks), default=1.0)
    number = f"{len(shown)} of {len(flights.length) // a} flights, each in its own world"
    number += f" with {a} vehicles" if a > 1 else ""
    with figure(path, title, height, [*notes, f"{number}, from above and by their height"]) as fig:
        axes = fig.subplots(2 * rows, columns, squeeze=False, height_ratios=[panel, 0.55] * rows)
        for k, (i, world) in enumerate(zip(shown, worlds, strict=True)):
            plan, side = axes[2 * (k // columns) : 2 * (k // columns) + 2, k % columns]
            draw_plan(plan, world)
            until, longest = flights.length[i], 0.1
            for row in range(i, i + a):
                track, speed = flights.position[:until, row], flights.speed[:until, row]
                _path(plan, track[:, :2], speed, norm)
                _headings(plan, track, flights.quaternion[:until, row], 0.025 * float(size.max()))
                way = np.insert(np.cumsum(np.linalg.norm(np.diff(track, axis=0), axis=1)), 0, 0.0)
                _path(side, np.stack([way, track[:, 2]], axis=1), speed, norm)
                _goals(plan, side, flights.goal[:until, row], way)
                plan.plot(*track[0, :2, None], **START, zorder=4)
                if not flights.success[row]:
                    plan.plot(*track[-1, :2, None], **FAILURE, zorder=5)
                longest = max(longest, way[-1])
            ended = f"{flights.ending(i)}, {flights.time[until - 1]:.1f} s"
            plan.set_title(f"{ended}, top {flights.speed[:until, i : i + a].max():.1f} m/s", size=9)
            plan.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
            side.set(xlim=(0, longest), ylim=(0, 1.15 * max(top, 0.5)), xlabel="flown (m)")
            for ax in (plan, side):
                ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
                ax.yaxis.set_major_locator(MaxNLocator(5 if ax is plan else 2, steps=[1, 2, 5, 10]))
                ax.grid(False)
            if k % columns == 0:
                plan.set_ylabel("y (m)")
                side.set_ylabel("z (m)")
        for k in range(len(shown), rows * columns):
            for ax in axes[2 * (k // columns) : 2 * (k // columns) + 2, k % columns]:
                ax.set_axis_off()
        bar = fig.colorbar(ScalarMappable(norm, SPEED), ax=axes, fraction=0.025, pad=0.01, aspect=40)
        bar.set_label("speed (m/s)")
        bar.outline.set_visible(False)
        handles = [
            Line2D([], [], label="start", **START),
            Line2D([], [], label="goal (several: by number)", marker="*", **MARK),
            Line2D([], [], color=INK, linewidth=1.0, label="heading"),
        ]
        if failed := int(np.sum(~flights.success[shown].astype(bool))):
            handles.append(Line2D([], [], label=f"no success ({failed} of {len(shown)})", **FAILURE))
        fig.legend(handles=handles, loc="outside lower center", ncols=4)


def _path(ax: Axes, points: np.ndarray, speed: np.ndarray, norm: Normalize) -> None:
    """Draw a path, (m, 2), coloured by speed."""
    lines = LineCollection(
        list(np.stack([points[:-1], points[1:]], axis=1)), array=(speed[:-1] + speed[1:]) / 2,
        cmap=SPEED, norm=norm, linewidths=2.0, zorder=3, capstyle="round",
    )  # fmt: skip
    ax.add_collection(lines)


def _headings(ax: Axes, track: np.ndarray, quaternion: np.ndarray, length: float) -> None:
    """Draw the direction of the vehicle's nose at uniform times, as lines of a length, m."""
    at = np.unique(np.linspace(0, len(track) - 1, HEADINGS).round().astype(int))
    yaw = Quat.of(quaternion[at]).yaw()
    ends = track[at, :2] + length * np.stack([np.cos(yaw), np.sin(yaw)], axis=-1)
    ax.add_collection(
        LineCollection(list(np.stack([track[at, :2], ends], axis=1)), colors=INK, linewidths=1.0, zorder=3.5)
    )


def _goals(plan: Axes, side: Axes, goal: np.ndarray, way: np.ndarray) -> None:
    """Draw one goal as a star. Draw several goals as their numbers, in order, and mark where each was reached."""
    changes = np.flatnonzero(np.linalg.norm(np.diff(goal, axis=0), axis=1) > APART)
    if not 0 < len(changes) <= MANY:
        plan.plot(*goal[-1, :2, None], marker="*", **MARK, zorder=2.5)
        return
    reached = [*changes, *([len(goal) - 1] if len(goal) - 1 - changes[-1] > 1 else [])]
    for number, k in enumerate(reached, 1):
        plan.annotate(str(number), (goal[k, 0], goal[k, 1]), (5, 5), textcoords="offset points", **NUMBER)
    for number, k in enumerate(changes, 1):
        side.axvline(way[k], color=GREY, linewidth=0.8, zorder=1)
        side.annotate(str(number), (way[k], goal[k, 2]), (3, 3), textcoords="offset points", **NUMBER)


def _bounds(tracks: list[np.ndarray], worlds: list[list[FacesBody]]) -> tuple[np.ndarray, np.ndarray]:
    """Corners of a horizontal rectangle around the flights and the centres of the solids, with a margin. Of a long
    wall, only the part near the flights is visible.
    """
    points = [track[:, :2] for track in tracks]
    points += [body.outline.mean(axis=0, keepdims=True) for world in worlds for body in world]
    whole = np.concatenate([*points, np.zeros((0, 2))])
    whole = whole if len(whole) else np.zeros((1, 2))
    low, high = whole.min(axis=0), whole.max(axis=0)
    margin = np.maximum(0.03 * (high - low).max(), 0.5)
    return low - margin, high + margin


def _pale(colour: np.ndarray, share: float) -> tuple[float, ...]:
    """A colour mixed with a fraction of white."""
    return tuple((1 - share) * colour + share)
