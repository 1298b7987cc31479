"""Flights in space: in 3D and from above."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Polygon
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox
from mpl_toolkits.mplot3d import proj3d
from mpl_toolkits.mplot3d.art3d import Line3DCollection, Poly3DCollection

from e2efly.config import TaskConfig
from e2efly.config.drawing import INK, Face, Line, Mark, Thing
from e2efly.simulation.scenes.faces import FacesBody
from e2efly.viewing.flights import Flights
from e2efly.viewing.objects import scene
from e2efly.viewing.style import FAILURE, MARK, PALE, SPEED, START, figure, in_space
from e2efly.viewing.worlds import draw_plan, draw_space

Corner = Float[np.ndarray, "3"]
Solid = Any
"""An `Axes3D`. Matplotlib has no types for it."""

_TEXT: dict[str, Any] = {
    "color": INK, "ha": "center", "va": "center", "weight": "bold", "zorder": 6,
    "path_effects": [withStroke(linewidth=3, foreground="white")],
}  # fmt: skip


def plot_flights(
    task: TaskConfig, flights: Flights, path: str | Path, title: str, solids: Sequence[FacesBody] = (),
    notes: Sequence[str] = (),
) -> None:  # fmt: skip
    """Draw episodes in 3D and from above, coloured by speed, with the objects of the task.

    Args:
        task: the options of the task.
        flights: the episodes.
        path: the PNG file.
        title: title of the figure.
        solids: the solids of the world in which all of them fly.
        notes: lines under the title.
    """
    things = scene(task, flights)
    tracks = [flights.position[:k, i] for i, k in enumerate(flights.length)]
    low, high = bounds(tracks, things, solids)
    speeds = _paths(flights)[1]
    fastest = speeds[np.isfinite(speeds)].max(initial=0.0)
    norm = Normalize(0.0, max(fastest, 0.1))
    with figure(path, title, 4.8 if _is_flat(high - low) else 5.8, notes, free=True) as fig:
        solid: Solid = fig.add_axes((0.01, 0.10, 0.55, 0.83), projection="3d", computed_zorder=False)
        draw_flights(solid, flights, things, low, high, norm)
        fit_box(fig, solid, low, high, Bbox.from_extents(0.012, 0.09, 0.55, 0.91))
        draw_space(solid, solids)
        plan = fig.add_axes((0.63, 0.21, 0.275, 0.65))
        _plan(plan, flights, things, low, high, norm)
        draw_plan(plan, solids)
        bar_axes = fig.add_axes((0.928, 0.21, 0.014, 0.65))
        bar = fig.colorbar(ScalarMappable(norm, SPEED), cax=bar_axes)
        bar.set_label("speed (m/s)")
        bar_axes.grid(False)
        bar.outline.set_visible(False)
        fig.legend(handles=_legend(flights, things), loc="lower center", bbox_to_anchor=(0.5, 0.0), ncols=6)


def fit_box(fig: Figure, ax: Solid, low: Corner, high: Corner, room: Bbox) -> None:
    """Zoom and shift 3D axes so that their box and labels fill `room`, in fractions of the figure."""
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    zoom = 1.0

    def measured() -> Bbox:
        fig.draw_without_rendering()
        x, y, _ = proj3d.proj_transform(corners[:, 0], corners[:, 1], corners[:, 2], ax.get_proj())
        boxes = [axis.get_tightbbox() for axis in (ax.xaxis, ax.yaxis, ax.zaxis)]
        flat = Bbox.null()
        flat.update_from_data_xy(ax.transData.transform(np.stack([x, y], axis=-1)))
        return Bbox.union([flat, *(box for box in boxes if box)]).transformed(fig.transFigure.inverted())

    for _ in range(2):
        box = measured()
        zoom *= min(room.width / box.width, room.height / box.height)
        ax.set_box_aspect(high - low, zoom=zoom)
    box, at = measured(), ax.get_position(original=True)
    shift = ((room.x0 + room.x1 - box.x0 - box.x1) / 2, (room.y0 + room.y1 - box.y0 - box.y1) / 2)
    ax.set_position((at.x0 + shift[0], at.y0 + shift[1], at.width, at.height))


def bounds(tracks: list[np.ndarray], things: list[Thing], solids: Sequence[FacesBody]) -> tuple[Corner, Corner]:
    """Two corners of a box around everything that is drawn, with the ground and a margin, at least 0.6 m wide."""
    points = [np.atleast_2d(thing.point if isinstance(thing, Mark) else thing.points) for thing in things]
    points += [body.quads.reshape(-1, 3) for body in solids]
    whole = np.concatenate([*tracks, *points]) if tracks or points else np.zeros((1, 3))
    whole = whole[np.isfinite(whole).all(axis=1)]
    whole = whole if len(whole) else np.zeros((1, 3))
    low, high = whole.min(axis=0), whole.max(axis=0)
    middle, half = (low + high) / 2, np.maximum((high - low) / 2 * 1.04, [0.6, 0.6, 0.0])
    return np.array([*(middle - half)[:2], min(low[2], 0.0)]), np.array([*(middle + half)[:2], max(high[2], 0.6)])


def _is_flat(size: Corner) -> bool:
    return bool(size[2] < 0.4 * np.max(size[:2]))


def _paths(flights: Flights) -> tuple[np.ndarray, np.ndarray]:
    """The segments (s, 2, 3) of all flights up to their ends, and the speed on each segment."""
    paths = [flights.position[:k, i] for i, k in enumerate(flights.length)]
    segments = [np.stack([path[:-1], path[1:]], axis=1) for path in paths]
    speeds = [(flights.speed[: max(k - 1, 0), i] + flights.speed[1:k, i]) / 2 for i, k in enumerate(flights.length)]
    return np.concatenate([np.zeros((0, 2, 3)), *segments]), np.concatenate([np.zeros(0), *speeds])


def _ends(flights: Flights) -> tuple[np.ndarray, np.ndarray]:
    """The positions at which the flights begin, (n, 3), and at which failed flights end."""
    kept = np.flatnonzero(flights.length > 0)
    last = flights.position[flights.length[kept] - 1, kept]
    return flights.position[0, kept], last[~flights.success[kept].astype(bool)]


def draw_flights(ax: Solid, flights: Flights, things: list[Thing], low: Corner, high: Corner, norm: Normalize) -> None:
    """Draw episodes in 3D axes, coloured by speed, with their shadows and the objects of the task, between corners."""
    (x0, y0, z0), (x1, y1, _) = low, high
    ground = np.array([[x0, y0, 0], [x1, y0, 0], [x1, y1, 0], [x0, y1, 0]])
    ax.add_collection3d(Poly3DCollection([ground], facecolors="#EFEFEC", edgecolors="none", zorder=0))
    segments, speeds = _paths(flights)
    shadow = segments * [1, 1, 0]
    ax.add_collection3d(Line3DCollection(shadow, colors=PALE, linewidths=1.0, zorder=1), autolim=False)
    for thing in things:
        if isinstance(thing, Line):
            ax.plot(*thing.points.T, color=thing.color, linewidth=thing.width, zorder=2, solid_capstyle="butt")
        elif isinstance(thing, Face):
            ax.add_collection3d(Poly3DCollection([thing.points], facecolors=thing.color, edgecolors="none", zorder=2))
        elif thing.text:
            ax.text(*thing.point, thing.text, **_TEXT)
        else:
            ax.plot(*thing.point[:, None], marker=thing.marker, **MARK, zorder=5)
    lines = Line3DCollection(segments, array=speeds, cmap=SPEED, norm=norm, linewidths=1.5, zorder=3)
    lines.set_capstyle("round")
    ax.add_collection3d(lines, autolim=False)
    starts, failures = _ends(flights)
    ax.plot(*starts.T, **START, zorder=4)
    ax.plot(*failures.T, **FAILURE, zorder=7)
    ax.set_xlim(x0, x1)
    ax.set_ylim(y0, y1)
    ax.set_zlim(z0, high[2])
    ax.set_box_aspect(high - low)
    ax.set_proj_type("persp", focal_length=1.4)
    flat = _is_flat(high - low)
    ax.view_init(elev=34 if flat else 24, azim=-58)
    in_space(ax, (6, 6, 3 if flat else 6))


def draw_flat(ax: Axes, things: list[Thing], axes: tuple[int, int]) -> None:
    """Draw the objects of a task projected onto two of the world's axes."""
    columns = list(axes)
    for thing in things:
        if isinstance(thing, Line):
            points = thing.points[:, columns].T
            ax.plot(*points, color=thing.color, linewidth=thing.width, zorder=2, solid_capstyle="butt")
        elif isinstance(thing, Face):
            ax.add_patch(Polygon(thing.points[:, columns], facecolor=thing.color, edgecolor=thing.color, linewidth=2.5))
        elif thing.text:
            x, y = thing.point[columns]
            ax.text(x, y, thing.text, **_TEXT)
        else:
            ax.plot(*thing.point[columns, None], marker=thing.marker, **MARK, zorder=5)


def _plan(ax: Axes, flights: Flights, things: list[Thing], low: Corner, high: Corner, norm: Normalize) -> None:
    ax.set_title("From above")
    draw_flat(ax, things, (0, 1))
    segments, speeds = _paths(flights)
    lines = LineCollection(list(segments[..., :2]), array=speeds, cmap=SPEED, norm=norm, linewidths=1.4, zorder=3)
    lines.set_capstyle("round")
    ax.add_collection(lines)
    starts, failures = _ends(flights)
    ax.plot(*starts.T[:2], **START, zorder=4)
    ax.plot(*failures.T[:2], **FAILURE, zorder=7)
    ax.set_xlim(low[0], high[0])
    ax.set_ylim(low[1], high[1])
    ax.set_aspect("equal", adjustable="box")
    ax.xaxis.set_major_locator(MaxNLocator(6, steps=[1, 2, 5, 10]))
    ax.yaxis.set_major_locator(MaxNLocator(8, steps=[1, 2, 5, 10]))
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")


def _legend(flights: Flights, things: list[Thing]) -> list[Line2D | Patch]:
    handles: list[Line2D | Patch] = [Line2D([], [], label="start", **START)]
    for thing in things:
        if not thing.label:
            continue
        if isinstance(thing, Line):
            handles.append(Line2D([], [], color=thing.color, linewidth=thing.width, label=thing.label))
        elif isinstance(thing, Face):
            handles.append(Patch(facecolor=thing.color, label=thing.label))
        else:
            handles.append(Line2D([], [], marker=thing.marker, label=thing.label, **MARK))
    failed = len(_ends(flights)[1])
    if failed:
        handles.append(Line2D([], [], label=f"no success ({failed} of {len(flights.length)})", **FAILURE))
    return [*handles, Line2D([], [], color=PALE, label="shadow on the ground")]
