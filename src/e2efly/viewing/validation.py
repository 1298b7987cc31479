"""Plots of the same starts flown in two places, drawn over each other."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from e2efly.config.drawing import Thing
from e2efly.config.storage import make_folder
from e2efly.control import COMMAND_MODES
from e2efly.policy.runtime import Acting
from e2efly.validation.fleet import FleetFlight, FleetMission, fly_all
from e2efly.validation.plant_validation import Validation
from e2efly.validation.reality import Reality
from e2efly.validation.task_verdict import judge
from e2efly.vehicles.loading import load_vehicle
from e2efly.viewing.flights import Flights
from e2efly.viewing.kept import PLACES, Pair
from e2efly.viewing.objects import scene
from e2efly.viewing.space import draw_flat
from e2efly.viewing.style import BLUE, GREY, VERMILLION, figure

_LOOKS: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "linewidth": 2.8, "alpha": 0.5},
    {"color": VERMILLION, "linewidth": 1.2},
)
"""Line styles: the first place is wide and pale, the second thin and on top. Where they agree, both are visible."""
DRAWN = 6
"""Number of starts that are drawn for each criterion."""
_FAILED: dict[str, Any] = {"marker": "X", "markersize": 8, "markeredgecolor": "white", "linestyle": ""}


def plot_overlay(task: Any, flown: Mapping[str, Flights], path: str | Path, title: str) -> None:
    """Draw all flights from above and from the side, and the first of them over time: speed, height and commands.

    Args:
        task: the options of the task.
        flown: flights of the same starts in the same order, by the name of the place. There are two places.
        path: the PNG file.
        title: title of the figure.

    Raises:
        ValueError: when there are not two places with equally many flights.
    """
    counts = [flights.position.shape[1] for flights in flown.values()]
    if len(counts) != 2 or counts[0] != counts[1] or not counts[0]:
        raise ValueError(
            f"flights of {dict(zip(flown, counts, strict=True))}; accepted: as many of either of two places"
        )
    places = list(zip(flown.items(), _LOOKS, strict=True))
    mode = COMMAND_MODES[next(iter(flown.values())).command_mode]
    shown = f"{counts[0]} starts in space; over time the first of them"
    with figure(path, title, 10.6, [f"{shown}; commands are drawn when the policy gives them"]) as fig:
        grid = fig.add_gridspec(4, 2, height_ratios=[2.2, 1.0, 1.0, 1.0])
        things = scene(task, next(iter(flown.values())))
        for column, (name, axes, labels) in enumerate(
            (("From above", (0, 1), ("x (m)", "y (m)")), ("From the side", (0, 2), ("x (m)", "z (m)")))
        ):
            ax = fig.add_subplot(grid[0, column])
            _space(ax, places, things, axes)
            ax.set_title(name)
            ax.set_xlabel(labels[0])
            ax.set_ylabel(labels[1])
        panels = [fig.add_subplot(grid[1 + i // 2, i % 2]) for i in range(6)]
        for (_, flights), look in places:
            steps = int(flights.length[0])
            time = flights.time[:steps]
            asked = time - flights.time[0]
            panels[0].plot(time, flights.speed[:steps, 0], **look)
            panels[1].plot(time, flights.position[:steps, 0, 2], **look)
            for i, ax in enumerate(panels[2:]):
                ax.plot(asked, flights.command[:steps, 0, i], drawstyle="steps-post", **look)
        commands = [f"{f.replace('_', ' ')}\n({unit})" for f, unit in zip(mode.fields, mode.units, strict=True)]
        for ax, label in zip(panels, ["speed (m/s)", "height (m)", *commands], strict=True):
            ax.set_ylabel(label)
        for ax in panels[4:]:
            ax.set_xlabel("time (s)")
        handles = [Line2D([], [], label=name, **look) for (name, _), look in places]
        handles.append(Line2D([], [], color=GREY, label="no success", **_FAILED))
        fig.legend(handles=handles, loc="outside lower center", ncols=len(handles))


def _space(ax: Axes, places: list, things: list[Thing], axes: tuple[int, int]) -> None:
    """Draw all flights projected onto two of the world's axes, over the objects of the task."""
    draw_flat(ax, things, axes)
    for (_, flights), look in places:
        for i, length in enumerate(flights.length):
            track = flights.position[:length, i][:, axes]
            ax.plot(*track.T, **look)
            if length and not flights.success[i]:
                ax.plot(*track[-1, :, None], color=look["color"], zorder=7, **_FAILED)
    ax.set_aspect("equal", adjustable="datalim")


def flown_again(found: Validation) -> dict[str, Pair]:
    """Some starts of each criterion, failures first, flown on the plant and, with the same runtime, in the training
    simulator.
    """
    flew = found.candidate
    contract = flew.policy.contract
    nominal = flew.flown.body if contract.vehicle_ranges else load_vehicle(flew.env.vehicle)
    pairs = {}
    for name, suite in flew.task.criteria().items():
        v = found.criteria[name]
        home = Reality(nominal, contract.latency_of(nominal))
        env = flew.at_home.environment(suite)
        worlds = np.argsort(v.flown.success[:: env.agents], kind="stable")[: max(DRAWN // env.agents, 1)]
        shown = [int(world) * env.agents + i for world in worlds for i in range(env.agents)]
        sights = v.starts.sights(env, found.seed)
        asked = [FleetFlight(v.starts.states[i], v.starts.courses[i], home, sights[i]) for i in shown]
        mission = FleetMission(
            flew.file, "simulator", nominal, nominal, float(suite.episode_s), baseline=flew.baseline, agents=env.agents
        )
        again = fly_all(mission, asked, processes=1)
        verdicts = judge(env, v.starts.of(shown), again)
        there = [v.flights[i] for i in shown]
        flown = (
            _flights(flew.policy, again, verdicts.duration, verdicts.success),
            _flights(flew.policy, there, v.flown.duration[shown], v.flown.success[shown]),
        )
        pairs[name] = Pair(np.array(shown), dict(zip(PLACES, flown, strict=True)))
    return pairs


def plot_validation(found: Validation, pairs: Mapping[str, Pair], folder: Path) -> None:
    """Draw the flights of both places over each other, one plot per criterion.

    Args:
        found: the validation.
        pairs: the pairs from `flown_again`.
        folder: the folder of the plots. It is created if it does not exist.

    Raises:
        OSError: when the folder cannot be created.
    """
    make_folder(folder, "the folder of the plots")
    plant, vehicle = found.plant.name, found.candidate.policy.contract.vehicle
    for name, suite in found.candidate.task.criteria().items():
        flown = dict(zip(("training simulator", plant), pairs[name].flown.values(), strict=True))
        plot_overlay(suite, flown, folder / f"{plant}_{name}.png", f"{name} on {vehicle}: {plant}")


def _flights(policy: Acting, flights: list[Any], duration: np.ndarray, success: np.ndarray) -> Any:
    """The flights in the form that the plots need, up to the end of each episode."""
    period = 1 / policy.contract.control_rate_hz
    length = np.rint(duration / period).astype(int)
    steps = max(int(length.max()), 1)
    time = period * np.arange(1, steps + 1)

    def column(name: str, first: int) -> np.ndarray:
        """Values as (steps, n, ...). Values after the end of a flight are NaN."""
        rows = [getattr(f, name)[first:][:steps] for f in flights]
        whole = np.full((steps, len(rows), *rows[0].shape[1:]), np.nan)
        for i, row in enumerate(rows):
            whole[: len(row), i] = row
        return whole

    moved = [column(name, 1) for name in ("position", "velocity", "quaternion", "body_rate")]
    return Flights(
        time,
        *moved,
        rotor_speed=np.full((steps, len(flights), 4), np.nan),
        command=column("command", 0),
        goal=column("goal", 0),
        length=length,
        success=success,
        command_mode=policy.contract.action.mode,
    )
