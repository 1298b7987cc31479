"""`e2efly validate`."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from e2efly.budget import check_time
from e2efly.commands.evaluate import ROW, check_observation, config_from_contract, fly_suites
from e2efly.commands.terminal import Terminal
from e2efly.commands.validation_report import Validation, write_report
from e2efly.config import EnvConfig, RewardConfig, TaskConfig
from e2efly.deploy.policy import Policy, load_policy
from e2efly.deploy.runtime import check
from e2efly.device import compute_at_once, prepare
from e2efly.learn.rundir import run_of
from e2efly.validate.plant import plant_kind
from e2efly.vehicles import load_vehicle
from e2efly.zoo import beside, policy_path

EPISODES = {"betaflight": 20}
"""Starts of each criterion unless told, where they are not 200: the firmware takes seconds for each."""
SAMPLE = 136
"""Bytes of a control step of a flight on a plant, of which all are kept."""
WHOLE_S = 1.0
"""The least that a whole flight through the firmware takes, s."""
DRAWN = 6
"""Starts of the overlay."""


def validate_command(
    policy: Path,
    plant: str,
    episodes: int | None = None,
    out: Path | None = None,
    max_drop: float = 2.0,
    json: Path | None = None,
    seed: int = 1_000_000,
    vehicle: str | None = None,
    flights: int = 3,
    quiet: bool = False,
) -> int:
    """Fly policy.onnx by the bridge's runtime on another plant, from the starts of `e2efly eval`.

    Args:
        policy: a policy.onnx, a run directory, or a task: the zoo's.
        plant: a name of `PLANTS`.
        episodes: starts of each criterion; left out: `EPISODES` of the plant.
        out: folder of the plots; RUN/validation, or the folder `validation` beside the policy, when left out.
        max_drop: points of success by which the plant may lie under the training simulator.
        json: write a report, with a row for every start, to this file.
        seed: of the starts.
        vehicle: what the plant simulates, where it is not what the policy was trained on: a name or a .toml file.
        flights: with the firmware, whole flights besides, from take-off to landing.
        quiet: print nothing.

    Returns:
        0, or 1 when success drops by more than `max_drop` in any criterion, or a whole flight is not complete.

    Raises:
        ValueError: naming the option or the field, what it is and what is accepted.
    """
    plant_kind(plant)
    episodes = EPISODES.get(plant, 200) if episodes is None else episodes
    if flights < 0:
        raise ValueError(f"--flights is {flights}; accepted: 0 or more")
    check_time({f"--flights is {flights}": flights * WHOLE_S}, f"at {WHOLE_S:g} s each")
    if episodes <= 0:
        raise ValueError(f"--episodes is {episodes}; accepted: more than 0")
    if not (math.isfinite(max_drop) and max_drop >= 0):
        raise ValueError(f"--max-drop is {max_drop}; accepted: 0 or more points of success")
    policy = policy_path(policy, vehicle)
    run = run_of(policy)
    loaded = load_policy(run.policy if run else policy)
    compute_at_once()
    prepare("cpu")  # the plants compute there, one vehicle at a time
    config = run.config(names_vehicle=vehicle is not None) if run else None
    task, env_config = (config.task, config.env) if config else config_from_contract(loaded, vehicle)
    if reasons := check(loaded.contract, load_vehicle(env_config.vehicle)):
        raise ValueError("\n".join(reasons))
    console = Terminal(quiet=quiet)
    for note in _notes(loaded, plant, env_config, vehicle):
        console.print(note, style="dim")
    path = run.policy if run else policy
    found = _validate(path, loaded, plant, task, env_config, vehicle, episodes, seed, console)
    console.print(_table(found, plant))
    folder = out or (run.path if run else beside(path)) / "validation"
    _draw(found, loaded, path, plant, task, env_config, folder)
    console.print(f"Plots: {folder}")
    if json:
        write_report(json, found, path, loaded, plant, seed, max_drop, vehicle or env_config.vehicle)
        console.print(f"Report: {json}")
    whole = _whole_flights(loaded, plant, vehicle or env_config.vehicle, flights, console)
    worst = max(found, key=lambda name: found[name].drop)
    if found[worst].drop > max_drop + 1e-9:
        console.print(f"{worst}: success drops by {found[worst].drop:.1f} points", style="bold red", end=", ")
        console.print(f"{max_drop:g} are allowed")
        return 1
    return 0 if whole else 1


def _whole_flights(policy: Policy, plant: str, vehicle: str, count: int, console: Console) -> bool:
    """Fly them, where the plant is the firmware and the vehicle the policy's; whether all were complete."""
    body = load_vehicle(vehicle)
    if plant != "betaflight" or not count or body.hash != policy.contract.vehicle_hash:
        return True
    from e2efly.commands.rehearsals import flights_table, fly_whole

    flights = fly_whole(policy, body, count, console)
    console.print(flights_table(flights))
    return all(flight.complete for flight in flights)


def _notes(policy: Policy, plant: str, env_config: EnvConfig, vehicle: str | None) -> list[str]:
    """What the training simulator has and the plants do not."""
    notes = []
    random = [
        name
        for name, here in (
            ("randomised vehicles", bool(env_config.randomize)),
            ("wind", env_config.wind > 0),
            ("noise", env_config.noise != type(env_config.noise)()),
            ("late observations", policy.contract.observation_latency_range_s[1] > 0),
        )
        if here
    ]
    if random:
        notes.append(f"Trained with {', '.join(random)}: there in `training`, not on the plant.")
    low, high = policy.contract.latency_range_s
    if low < high:
        notes.append(
            f"Trained with a latency of {low:g} to {high:g} s; the plant flies with {policy.contract.latency_s:g} s."
        )
    if (own := plant_kind(plant).latency) > policy.contract.latency_s:
        notes.append(f"The plant itself takes {own:g} s from command to rate loop, longer than that.")
    if vehicle is not None and load_vehicle(vehicle).hash != policy.contract.vehicle_hash:
        notes.append(f"The plant is a {vehicle}, flown by the policy of a {policy.contract.vehicle}.")
    return notes


def _validate(
    path: Path,
    policy: Policy,
    plant: str,
    task: TaskConfig,
    env_config: EnvConfig,
    vehicle: str | None,
    episodes: int,
    seed: int,
    console: Console,
) -> dict[str, Validation]:
    from e2efly.env import Env
    from e2efly.validate.fleet import Mission, fly_all
    from e2efly.validate.judge import judge
    from e2efly.validate.starts import draw_starts

    nominal, simulated = load_vehicle(env_config.vehicle), load_vehicle(vehicle or env_config.vehicle)
    longest = max(float(suite.episode_s) for suite in task.criteria().values())
    kept = ROW + SAMPLE * int(longest * policy.contract.control_rate_hz)
    trained, _ = fly_suites(policy, task, env_config, episodes, seed, kept)
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    found = {}
    with Progress(*columns, console=console, transient=True) as progress:
        for name, suite in task.criteria().items():
            env = Env.of(suite, RewardConfig({"prog2": 1.0}), env_config)
            check_observation(policy, env)
            bar = progress.add_task(f"{name} on {plant}", total=episodes)
            starts = draw_starts(env, episodes, seed)
            mission = Mission(path, plant, nominal, simulated, float(suite.episode_s), policy.contract.latency_s)
            pairs = list(zip(starts.states, starts.goals, strict=True))
            flights = fly_all(mission, pairs, lambda count: progress.update(bar, completed=count))  # noqa: B023
            verdicts = judge(env, starts, flights, float(getattr(suite, "settle_s", 0.0)))
            found[name] = Validation(trained[name], verdicts, starts, flights)
    return found


def _table(found: dict[str, Validation], plant: str) -> Table:
    from e2efly.evaluate import wilson

    table = Table(box=None, header_style="bold", pad_edge=False)
    for heading in (
        "criterion", "flown in", "success", "95 %", "end error", "mean", "time", "drop",
    ):  # fmt: skip
        table.add_column(heading, no_wrap=True)
    for name, v in found.items():
        for place, e, drop in (("training", v.trained, ""), (plant, v.flown, f"{v.drop:+.1f}")):
            ok = np.asarray(e.success)
            low, high = wilson(int(ok.sum()), len(ok))
            table.add_row(
                name,
                place,
                f"{ok.mean():.1%}",
                f"{100 * low:.1f}-{100 * high:.1f}",
                f"{100 * np.mean(e.final_error):.2f} cm",
                f"{100 * np.mean(e.mean_error):.2f} cm",
                f"{np.mean(np.asarray(e.duration)[ok]):.2f} s" if ok.any() else "none",
                drop,
            )
    return table


def _draw(
    found: dict[str, Validation],
    policy: Policy,
    path: Path,
    plant: str,
    task: TaskConfig,
    env_config: EnvConfig,
    folder: Path,
) -> None:
    """Fly some starts by the same runtime in the training simulator, and lay both over each other."""
    from e2efly.env import Env
    from e2efly.validate.fleet import Mission, fly_all
    from e2efly.validate.judge import judge
    from e2efly.view.validation import plot_overlay

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OSError(f"cannot make the folder of the plots {folder}: {error.strerror}") from error
    nominal = load_vehicle(env_config.vehicle)
    for name, suite in task.criteria().items():
        v = found[name]
        shown = [int(i) for i in np.argsort(v.flown.success, kind="stable")[:DRAWN]]  # failures first
        pairs = [(v.starts.states[i], v.starts.goals[i]) for i in shown]
        mission = Mission(path, "simulator", nominal, nominal, float(suite.episode_s), policy.contract.latency_s)
        again = fly_all(mission, pairs, processes=1)
        env = Env.of(suite, RewardConfig({"prog2": 1.0}), env_config)
        verdicts = judge(env, v.starts.of(shown), again)
        flown = {
            "training simulator": _flights(policy, again, pairs, verdicts.duration, verdicts.success),
            plant: _flights(
                policy, [v.flights[i] for i in shown], pairs, v.flown.duration[shown], v.flown.success[shown]
            ),
        }
        plot_overlay(suite, flown, folder / f"{plant}_{name}.png", f"{name} on {policy.contract.vehicle}: {plant}")


def _flights(policy: Policy, flights: list[Any], pairs: list[Any], duration: np.ndarray, success: np.ndarray) -> Any:
    """What the plots draw, until the episodes ended."""
    from e2efly.view.flights import Flights

    period = 1 / policy.contract.control_rate_hz
    length = np.rint(duration / period).astype(int)
    steps = max(int(length.max()), 1)
    time = period * np.arange(1, steps + 1)

    def column(name: str, first: int) -> np.ndarray:
        """(steps, n, ...): what is missing behind the end of a flight is not a number."""
        rows = [getattr(f, name)[first:][:steps] for f in flights]
        whole = np.full((steps, len(rows), *rows[0].shape[1:]), np.nan)
        for i, row in enumerate(rows):
            whole[: len(row), i] = row
        return whole

    def course(start: Any, goal: Any) -> np.ndarray:
        begun = goal.start(start.odometry(0.0), 0.0)
        return np.array([goal.position(begun, t) for t in time])

    moved = [column(name, 1) for name in ("position", "velocity", "quaternion", "body_rate")]
    return Flights(
        time,
        *moved,
        rotor_speed=np.full((steps, len(flights), 4), np.nan),
        command=column("command", 0),
        goal=np.stack([course(*pair) for pair in pairs], axis=1),
        length=length,
        success=success,
        command_mode=policy.contract.action.mode,
    )
