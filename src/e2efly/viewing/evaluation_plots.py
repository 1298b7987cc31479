"""The plots of an evaluation."""

from pathlib import Path
from typing import Any

import jax
import numpy as np

from e2efly.config.run import criterion
from e2efly.config.storage import make_folder
from e2efly.environment import UNSEEN, Env, random_key
from e2efly.environment.episodes import Episodes
from e2efly.learning.judge import REPORTED
from e2efly.learning.setup import Setup
from e2efly.policy.loader import load_policy
from e2efly.runs.rundir import RunDirectory
from e2efly.validation.evaluation import Evaluation, act_of
from e2efly.viewing import plots
from e2efly.viewing.flights import Flights
from e2efly.viewing.seen import plot_seen
from e2efly.viewing.worlds import plot_flights_in_worlds

DRAWN = 12
"""Number of flights that are drawn for each criterion."""


def plot_evaluation(found: Evaluation, folder: Path) -> None:
    """Draw flights of each criterion, all errors and, if the policy is in the folder of its run, its learning curves.

    Raises:
        OSError: when the folder cannot be created.
    """
    make_folder(folder, "the folder of the plots")
    flew = found.candidate
    contract, suites = flew.policy.contract, flew.task.criteria()
    title, key = f"{contract.task} on {contract.vehicle}", random_key(found.seed, UNSEEN, 0)
    for name, suite in suites.items():
        env, tag = flew.environment(suite), f"{title}: {name}" if len(suites) > 1 else title
        flights = plots.fly(env, act_of(flew.policy), key, DRAWN, env.episode_steps)
        _flights(flights, suite, env, key, folder, name, tag, f"{env.vehicles}, seed {found.seed}")
    plots.plot_errors(found.flown, folder / "errors.png", f"{title}, {flew.vehicles}", plots.limits(suites))
    if flew.run:
        config = flew.run.config(names_vehicle=True)
        vehicles = Env.of(config.task, config.reward, config.env).vehicles
        _learned(flew.run, folder, title, criterion(config.stop_at, vehicles), vehicles)


def plot_run(run: RunDirectory, setup: Setup, flown: dict[str, Episodes]) -> None:
    """Draw the same plots for a run that has just ended, into its folder. Its flights are not flown again.

    Raises:
        OSError: when the folder cannot be created.
    """
    folder, config = run.plots, setup.config
    title = f"{config.task.name} on {setup.env.physics.nominal.name}"
    make_folder(folder, "the folder of the plots")
    suites, act = config.task.criteria(), act_of(load_policy(run.policy))
    for name, env in (setup.nominal or setup.judges).items():
        tag = f"{title}: {name}" if len(suites) > 1 else title
        key, steps = random_key(0, REPORTED, 0), env.episode_steps
        flights = plots.fly(env, act, key, DRAWN, steps)
        note = f"{env.vehicles}; trained by {config.algo.name}, seed {config.seed}"
        _flights(flights, suites[name], env, key, folder, name, tag, note)
    vehicles = next(iter((setup.nominal or setup.judges).values())).vehicles
    plots.plot_errors(flown, folder / "errors.png", f"{title}, {vehicles}", plots.limits(suites))
    _learned(run, folder, title, criterion(config.stop_at, setup.env.vehicles), setup.env.vehicles)


def _flights(flights: Flights, suite: Any, env: Env, key: Any, folder: Path, name: str, title: str, note: str) -> None:
    if env.cameras or suite.own_worlds:  # every flight has a world of its own
        begun = jax.jit(Env.reset, static_argnums=2)(env, key, len(flights.length))[0]
        scene = env.task.scene(begun.memory)
        plot_flights_in_worlds(flights, scene, folder / f"flights_{name}.png", title, notes=[note])
        if env.cameras:
            plot_seen(flights, env.cameras, folder / f"seen_{name}.png", title)
    else:
        course = "".join(f", {key} {value}" for key, value in suite.course().items() if isinstance(value, str))
        worlds = f" in {len(flights.length) // env.agents} worlds, drawn over each other" if env.agents > 1 else ""
        shown = f"{note}, {len(flights.length)} episodes{worlds}{course}"
        plots.plot_flights(suite, flights, folder / f"flights_{name}.png", title, notes=[shown])
    worst = int(np.argmin(flights.success))  # the first failed flight, or else the first flight
    plots.plot_time(flights, worst, folder / f"time_{name}.png", title, env.physics.nominal)


def _learned(run: RunDirectory, folder: Path, title: str, least: float, vehicles: str) -> None:
    """Draw the learning curves of a run, the success at which its task counts as learned, and the name of what flew."""
    if rows := run.rows():
        shipped = run.read_json("summary.json").get("shipped") if (run.path / "summary.json").exists() else None
        update = shipped.get("update") if isinstance(shipped, dict) else None
        plots.plot_learning(rows, folder / "learning.png", title, update, least, vehicles)
