"""Plots of a rehearsal of hardware in the loop."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.lines import Line2D

from e2efly.courses.origin import Origin
from e2efly.simulation.scenes.faces import FacesBody, bodies
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import Scene
from e2efly.validation.hil_lap import Lap
from e2efly.viewing.style import BLUE, FAILURE, GREY, START, VERMILLION, figure, say
from e2efly.viewing.worlds import draw_plan

_MARGIN = 0.8
"""Margin around the drawing, m."""
_MOST_TRIANGLES = 5000
"""Largest number of triangles of a scene in a plot."""


def plot_lap(lap: Lap, scene: Scene | MeshScene, origin: Origin, path: str | Path) -> None:
    """Draw one flight: in the room from above, and in the scene from above and from the side.

    Args:
        lap: the flight, with its true motion.
        scene: one world.
        origin: origin of the scene in the room.
        path: the PNG file.
    """
    title = f"Rehearsal in the world of seed {lap.seed}"
    with figure(path, title, 8.2, _notes(lap)) as fig:
        above, side, room = fig.subplots(3, 1, height_ratios=[1.25, 0.75, 1.25])
        if lap.truth is None or not len(lap.truth.time):
            for ax in (above, side, room):
                say(ax, "not recorded")
            return
        things, motion = bodies(scene) if isinstance(scene, Scene) else [], lap.truth
        local = origin.seen(motion.position)
        flown = (motion.time >= lap.window[0]) & (motion.time <= lap.window[1])
        if isinstance(scene, Scene):
            draw_plan(above, things)
            _draw_side(side, things)
        else:
            _draw_triangles(above, scene, (0, 1))
            _draw_triangles(side, scene, (0, 2))
        for ax, axes in ((above, (0, 1)), (side, (0, 2))):
            _track(ax, local[:, axes], flown)
            _fit(ax, local[:, axes], [body.quads[..., axes].reshape(-1, 2) for body in things])
        _track(room, motion.position[:, :2], flown)
        _fit(room, motion.position[:, :2], [])
        above.set(title="In the scene, from above", ylabel="y (m)")
        side.set(title="In the scene, from the side", xlabel="x (m)", ylabel="z (m)")
        room.set(title="In the room, from above", xlabel="x (m)", ylabel="y (m)")
        handles: list[Any] = [
            Line2D([], [], color=BLUE, label="take-off, hover, landing"),
            Line2D([], [], color=VERMILLION, label="policy"), Line2D([], [], label="start", **START),
        ]  # fmt: skip
        if not lap.good:
            end = local[flown][-1] if flown.any() else local[-1]
            above.plot(*end[:2, None], **FAILURE, zorder=5)
            handles.append(Line2D([], [], label="end of a policy without success", **FAILURE))
        fig.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def plot_times(laps: list[Lap], path: str | Path) -> None:
    """Draw the delays of all flights: one row of dots for each kind, with the 99 % quantile and the maximum.

    Args:
        laps: the flights.
        path: the PNG file.
    """
    kinds = {
        "pose to image": "pose_to_image", "age of images at the policy": "image_age", "age of poses": "pose_age",
        "control steps late": "lateness", "room behind real time": "behind",
    }  # fmt: skip
    with figure(
        path, "What came late", 3.6, ["of each flight: dot: 99 %; line: from the median to the maximum"]
    ) as fig:
        ax = fig.subplots()
        for row, name in enumerate(reversed(kinds.values())):
            for i, lap in enumerate(laps):
                spread, y = getattr(lap, name), row + 0.6 * ((i + 0.5) / len(laps) - 0.5)
                ms = 1e3 * np.array([spread.median, spread.p99, spread.largest])
                if np.isfinite(ms).all():
                    ax.plot(np.maximum(ms[[0, 2]], 0.01), [y, y], color=GREY, linewidth=1.0)
                    ax.plot(max(ms[1], 0.01), y, "o", color=BLUE, markersize=4)
        ax.set(xscale="log", xlabel="ms", yticks=range(len(kinds)), yticklabels=list(reversed(kinds)))
        ax.grid(visible=True, axis="x")


def _notes(lap: Lap) -> list[str]:
    killed = f"; {lap.kill} was killed" if lap.kill else ""
    verdict = "success" if lap.success else "no success"
    late = (
        f"pose to image {1e3 * lap.pose_to_image.p99:.1f} ms (p99), control steps late {1e3 * lap.lateness.p99:.1f} ms"
    )
    return [f"{verdict}: {lap.told}, top {lap.top_speed:.1f} m/s{killed}", late, *lap.problems[:2]]


def _track(ax: Axes, points: np.ndarray, flown: np.ndarray) -> None:
    """Draw a path (t, 2), and mark the part of it (t,) that the policy flew."""
    pieces = np.stack([points[:-1], points[1:]], axis=1)
    colours = [VERMILLION if policy else BLUE for policy in flown[1:]]
    ax.add_collection(LineCollection(list(pieces), colors=colours, linewidths=1.6, zorder=3))
    ax.plot(*points[0, :, None], **START, zorder=4)


def _draw_side(ax: Axes, things: list[FacesBody]) -> None:
    """Draw solids as seen along y, the far ones first."""
    order = sorted(things, key=lambda body: -body.quads[..., 1].mean())
    for body in order:
        faces = list(body.quads[..., [0, 2]])
        pale = tuple(0.65 * body.colour + 0.35)
        ax.add_collection(PolyCollection(faces, facecolors=[pale], edgecolors="none", alpha=0.35, zorder=1.6))


def _draw_triangles(ax: Axes, scene: MeshScene, axes: tuple[int, int]) -> None:
    """Draw the edges of a scene's triangles, as seen along the axis that is not in `axes`. If there are too many, only
    the largest triangles are drawn.
    """
    largest = np.argsort(-np.linalg.norm(np.ptp(scene.triangles, axis=1), axis=1))[:_MOST_TRIANGLES]
    flat = list(scene.triangles[largest][..., list(axes)])
    ax.add_collection(PolyCollection(flat, facecolors="none", edgecolors=GREY, linewidths=0.3, alpha=0.4, zorder=1.6))


def _fit(ax: Axes, points: np.ndarray, others: list[np.ndarray]) -> None:
    """Set the limits of the axes so that a path and the solids around it are visible, to scale."""
    low, high = points.min(axis=0) - _MARGIN, points.max(axis=0) + _MARGIN
    near = [x for x in others if (x.min(axis=0) < high + 2).all() and (x.max(axis=0) > low - 2).all()]
    if near:
        low = np.minimum(low, np.maximum(np.concatenate(near).min(axis=0), low - 2))
        high = np.maximum(high, np.minimum(np.concatenate(near).max(axis=0), high + 2))
    ax.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    ax.grid(visible=False)
