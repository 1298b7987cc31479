"""The flights of docs/paper.md, drawn as the paper draws its own, flown by the policies of the zoo on VIS-R.

    python docs/paper_flights.py [scenarios] [landing] [racing]

scenarios: the paper's benchmark training scenarios. landing: visual landing on the three shapes of pad, with what the
camera saw. racing: the three tracks with obstacles.
"""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator
from matplotlib.transforms import Bbox
from paper_curves import DOCS, smaller

from e2efly.config import CameraConfig
from e2efly.config.drawing import INK, Thing
from e2efly.environment import UNSEEN, random_key
from e2efly.simulation.device import prepare
from e2efly.simulation.physics.rotation import to_matrix
from e2efly.simulation.scenes.faces import FacesBody, bodies
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import SEED, act_of, drawn_by
from e2efly.viewing.flights import Flights, fly
from e2efly.viewing.image_plots import show
from e2efly.viewing.objects import scene
from e2efly.viewing.space import bounds, draw_flights, fit_box
from e2efly.viewing.style import GREY, PALE, SPEED, figure
from e2efly.viewing.worlds import draw_space

TRACKS = {"s_shaped": "S-shaped", "circle_3d": "3D circle", "j_shaped": "J-shaped"}
PADS = {2.0: "triangle", 0.0: "disc", 1.0: "square"}
"""In the paper's order, by the number that an episode draws."""
EPISODES = 12
POSES, IMAGES, BEFORE = 7, 5, 0.88
"""Poses and images of a landing, and the share of it at which the last image is: on the pad nothing else is seen."""
ARMS = 0.11 * np.array([[1.0, 1, 0], [-1, -1, 0], [1, -1, 0], [-1, 1, 0]])
"""Ends of the two arms as they are drawn, body, m."""


@dataclass(frozen=True)
class Flown:
    """Flights of a policy from unseen starts, and the world of the first of them."""

    flights: Flights
    things: list[Thing]
    world: list[FacesBody]
    cameras: tuple[CameraConfig, ...]
    drawn: dict[str, np.ndarray]
    """What each episode drew."""


def only(flights: Flights, which: Sequence[int]) -> Flights:
    """Some of the flights."""
    columns = ("position", "velocity", "quaternion", "body_rate", "rotor_speed", "command", "goal")
    rows = ("length", "success")
    kept = {name: getattr(flights, name)[:, which] for name in columns}
    kept |= {name: getattr(flights, name)[which] for name in rows}
    late = None if flights.late is None else flights.late[which]
    return replace(flights, **kept, late=late, images=tuple(x[:, which] for x in flights.images))


def flown(policy: str, criterion: str = "", pick: Callable[[Flights], int] | None = None) -> Flown:
    """Fly a policy of the zoo. If one flight is to be picked, it alone is kept, with its world."""
    found = candidate(policy)
    suites = found.task.criteria()
    suite = suites[criterion or next(iter(suites))]
    env, act, key = found.environment(suite), act_of(found.policy), random_key(SEED, UNSEEN, 0)
    flights = fly(env, act, key, EPISODES, env.episode_steps)
    memory = env.reset(key, EPISODES)[0].memory
    drawn = {name: np.asarray(x) for name, x in drawn_by(env.task, memory).items()}
    if pick is None:
        return Flown(flights, scene(suite, flights), [], env.cameras, drawn)
    index = pick(flights)
    world = bodies(env.task.scene(memory), index, float(flights.time[flights.length[index] - 1]))
    one = only(flights, [index])
    return Flown(one, [], world, env.cameras, drawn)


def fastest(flights: Flights) -> int:
    """The success with the highest speed."""
    top = [flights.speed[: flights.length[i], i].max() if flights.success[i] else -1.0 for i in range(EPISODES)]
    return int(np.argmax(top))


def space(fig: Any, known: Flown, room: Bbox, title: str, norm: Normalize) -> None:
    """Flights in 3D axes that fill a part of a figure."""
    ax: Any = fig.add_axes(room.bounds, projection="3d", computed_zorder=False)
    tracks = [known.flights.position[:k, i] for i, k in enumerate(known.flights.length)]
    low, high = bounds(tracks, known.things, known.world)
    draw_flights(ax, known.flights, known.things, low, high, norm)
    draw_space(ax, known.world)
    ax.set(xlabel="", ylabel="", zlabel="")
    for axis, few in ((ax.xaxis, 4), (ax.yaxis, 3), (ax.zaxis, 2)):
        axis.set_major_locator(MaxNLocator(few, steps=[1, 2, 5, 10]))
        axis.set_tick_params(labelsize=7, pad=-2)
    fit_box(fig, ax, low, high, room)
    fig.text(room.x0 + 0.01, room.y1, title, size=11, va="bottom")


def panels(path: str, title: str, notes: list[str], shown: dict[str, Flown], rows: int, height: float) -> None:
    """Panels of flights in 3D, with one colour bar for their speed."""
    columns = len(shown) // rows
    speeds = [x.flights.speed[:k, i].max() for x in shown.values() for i, k in enumerate(x.flights.length)]
    norm = Normalize(0.0, float(np.max(speeds)))
    with figure(DOCS / path, title, height, notes, free=True) as fig:
        wide, top = 0.91 / columns, 1 - (0.45 + 0.21 * len(notes)) / height
        high = top / rows
        for i, (name, known) in enumerate(shown.items()):
            x, y = wide * (i % columns), top - high * (i // columns + 1)
            space(fig, known, Bbox.from_bounds(x + 0.01, y + 0.01, wide - 0.02, high - 0.08), name, norm)
        bar = fig.add_axes((0.928, 0.2, 0.012, 0.6))
        fig.colorbar(ScalarMappable(norm, SPEED), cax=bar).set_label("speed (m/s)")
        bar.grid(False)
    smaller(DOCS / path)


def scenarios() -> None:
    """docs/paper_scenarios.png: flights of the paper's six tasks."""
    shown = {
        "Hovering": flown("hover"), "Landing": flown("land"), "Tracking": flown("track"), "Racing": flown("race"),
        "Visual landing": flown("land_visual", pick=fastest),
        "Racing with obstacles": flown("race_clutter", "s_shaped", pick=fastest),
    }  # fmt: skip
    notes = [f"{EPISODES} flights from unseen starts; of a task by sight one, as each has its own world; axes in m"]
    panels("paper_scenarios.png", "Training scenarios", notes, shown, 2, 7.2)


def racing() -> None:
    """docs/paper_racing.png: a flight on each of the three tracks, in the world that it saw."""
    shown = {title: flown("race_clutter", name, pick=fastest) for name, title in TRACKS.items()}
    for title in list(shown):
        flights = shown[title].flights
        k = int(flights.length[0])
        told = f"{title}: {flights.speed[:k, 0].max():.1f} m/s, {flights.time[k - 1]:.1f} s"
        shown[told] = shown.pop(title)
    notes = [f"of {EPISODES} unseen worlds the lap with the highest speed; that speed, and its time; axes in m"]
    panels("paper_racing.png", "Racing with obstacles", notes, shown, 1, 3.6)


def landing() -> None:
    """docs/paper_landing.png: from the side, poses on the way to each shape of pad; beside them what the camera saw."""
    known = flown("land_visual")
    flights, outline = known.flights, known.drawn["pad_outline"]
    notes = ["one policy; left: poses from the side, coloured by speed; right: the segmentation that it saw"]
    with figure(DOCS / "paper_landing.png", "Vision-based landing", 7.6, notes) as fig:
        axes = fig.subplots(3, 1 + IMAGES, width_ratios=[1.7, *[1.0] * IMAGES])
        for row, (number, name) in zip(axes, PADS.items(), strict=True):
            i = next(i for i in range(EPISODES) if outline[i] == number and flights.success[i])
            k = int(flights.length[i])
            poses(row[0], flights, i, float(known.drawn["pad_width_m"][i]))
            row[0].set_title(f"{name}, {100 * known.drawn['pad_width_m'][i]:.0f} cm wide")
            for ax, t in zip(row[1:], np.linspace(0, BEFORE * (k - 1), IMAGES).round().astype(int), strict=True):
                image = np.repeat(flights.images[0][t, i][..., None], 3, axis=-1)
                show(ax, "mask", image, known.cameras[0], f"{flights.time[t]:.1f} s")
                for spine in ax.spines.values():
                    spine.set(visible=True, color=PALE)
        axes[-1, 0].set_xlabel("distance from the pad (m)")
    smaller(DOCS / "paper_landing.png")


def poses(ax: Any, flights: Flights, i: int, size: float) -> None:
    """The way down in the vertical plane of its start, with the attitude at some times and the pad at the origin."""
    k = int(flights.length[i])
    places, start = flights.position[:k, i], flights.position[0, i, :2]
    along = start / max(float(np.linalg.norm(start)), 1e-6)
    ax.plot(places[:, :2] @ along, places[:, 2], color=GREY, linewidth=1.0)
    norm = Normalize(0.0, float(flights.speed[:k, i].max()))
    for t in np.linspace(0, k - 1, POSES).round().astype(int):
        ends = places[t] + ARMS @ np.asarray(to_matrix(flights.quaternion[t, i])).T
        for a, b in ((0, 1), (2, 3)):
            ax.plot(ends[[a, b], :2] @ along, ends[[a, b], 2], color=SPEED(norm(flights.speed[t, i])), linewidth=3)
    ax.add_patch(Rectangle((-size / 2, 0.0), size, 0.2, color=INK, alpha=0.35, linewidth=0))
    ax.axhline(0.0, color=PALE)
    ax.set(ylabel="height (m)", ylim=(-0.05, None))
    ax.set_aspect("equal", adjustable="datalim")


PICTURES = {"scenarios": scenarios, "landing": landing, "racing": racing}


def main() -> None:
    """Draw those that are named, or all."""
    prepare("cpu")
    for name in sys.argv[1:] or PICTURES:
        PICTURES[name]()
        print(name, flush=True)


if __name__ == "__main__":
    main()
