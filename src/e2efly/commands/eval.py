"""`e2efly eval`."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import tyro
from rich.table import Table

from e2efly.commands.options import parse as parse_options
from e2efly.commands.policies import named_first, values, with_task
from e2efly.commands.rows import check_stress, report_stress
from e2efly.config import EnvConfig, TaskConfig
from e2efly.config.train import TIMED
from e2efly.storage import write_json
from e2efly.terminal import Terminal, seconds
from e2efly.vehicles import Controller
from e2efly.zoo import beside

if TYPE_CHECKING:
    from e2efly.evaluation import Candidate


@dataclass(frozen=True)
class Eval:
    """Fly a policy from unseen starts and report how it did."""

    policy: tyro.conf.Positional[Path]
    """A run directory, a policy.onnx, or a task: the zoo's policy of it. That is --vehicle's where the zoo has such a
    vehicle, and else VIS-R's; `any/hover` is that of any vehicle."""
    episodes: int = 1000
    """Starts of each criterion."""
    json: Path | None = None
    """Write the report, with a row for every start, to this file."""
    plots: Path | None = None
    """Folder of the plots; RUN/plots, or the folder of the policy, when left out."""
    seed: int = 1_000_000
    """Seed of the starts."""
    vehicle: str | None = None
    """What flies, a name or a .toml file; left out: the policy's own vehicle, or of a family another one in every
    episode. The policy is not changed."""
    baseline: str | None = None
    """What flies in place of the policy, under its contract: a hover controller, pid, geometric, indi, mpc, or one of
    your own, path/to/file.py:Name. For hover, hover_aware, land, track and race."""
    controller: Controller = "policy"
    """The vehicle that the flight controller believes in: the policy's own, whatever flies (policy), or the one that
    flies (plant)."""
    stress: bool = False
    """Fly vehicles, air and sensors that are not those of the training, row by row; see docs/robustness.md."""
    rows: tuple[str, ...] = ()
    """Rows of --stress; all of them when left out."""
    least: float | None = None
    """Exit status 1 when a row of --stress succeeds less often than this, such as 0.97."""
    device: Literal["cpu", "gpu"] | None = None
    """Where to compute."""
    task: TaskConfig = TaskConfig()
    """What the policy is to fly, in place of what its run or its contract says: options of its task, as `train` has
    them (--task.track four_gates)."""
    env: EnvConfig = EnvConfig()
    """What the policy meets, in place of what its run or its contract says; not with --stress. What the contract fixes
    is refused: the vehicle (see --vehicle), commands, rate, past actions, what the cameras' images are."""


@dataclass(frozen=True)
class Asked:
    """What `e2efly eval` is asked to do."""

    options: Eval
    """As given."""
    env: dict[str, Any]
    """Values of `--env`, by dotted name, that are not the policy's own."""
    task: dict[str, Any]
    """The same of `--task`."""


def parse(arguments: list[str]) -> Asked:
    """The options of `eval`; the defaults of `--env` and `--task` are what the policy's run or contract says.

    Raises:
        ValueError: for unknown names, and for a policy that is not there.
    """
    given = [argument for argument in arguments if argument.startswith(("--env.", "--task."))]
    if not given or "--help" in arguments:
        return Asked(parse_options(Eval, "eval", arguments), {}, {})
    found = named_first("eval", arguments, given[0])
    from e2efly.evaluation import pinned

    own = pinned(found.env, found.policy)
    empty = dataclasses.replace(own, randomize={})  # a filled dictionary would take no new names
    kind = with_task(Eval, found.task)
    options = parse_options(kind, "eval", arguments, default=kind(tyro.MISSING, env=empty, task=found.task))
    if options.stress:
        raise ValueError(f"{given[0]} is given with --stress; accepted: one of them, as the rows say what is met")
    env = options.env
    if not any(argument.startswith("--env.randomize") for argument in given):
        env = dataclasses.replace(env, randomize=own.randomize)
    return Asked(options, values(own, env), values(found.task, options.task))


def run(asked: Asked) -> int:
    """Fly the ONNX file itself from unseen starts; print a table, write the report and the plots.

    Returns:
        0, or 1 when a row of the stress succeeds less often than `least`.
    """
    options = asked.options
    check_stress(options.stress, options.rows, options.least)
    if options.stress:
        return _stress(options)
    from e2efly.evaluation import ROW, evaluate
    from e2efly.view.evaluation import plot_evaluation

    o, console = options, Terminal()
    found = evaluate(o.policy, o.episodes, env=asked.env, task=asked.task, **_flies(o), kept=ROW if o.json else 0)
    for note in found.candidate.notes:
        console.print(note, style="dim")
    console.print(_table(found.flown, o.episodes, found.candidate.task.precision not in TIMED))
    if o.json:
        write_json(o.json, found.as_json())
        console.print(f"Report: {o.json}")
    folder = _folder(o, found.candidate)
    plot_evaluation(found, folder)
    console.print(f"Plots: {folder}")
    return 0


def _stress(o: Eval) -> int:
    from e2efly.stress import stress

    found = stress(o.policy, o.episodes, rows=o.rows, **_flies(o))
    return report_stress(found, Terminal(), o.json, _folder(o, found.candidate) / "stress.png", o.least)


def _flies(o: Eval) -> dict[str, Any]:
    """What flies, and where that is computed."""
    flies = {"vehicle": o.vehicle, "controller": o.controller, "baseline": o.baseline}
    return flies | {"seed": o.seed, "device": o.device}


def _folder(o: Eval, flew: "Candidate") -> Path:
    """Of the plots."""
    return o.plots or (flew.run.plots if flew.run else beside(flew.file) / "plots")


def _table(flown: dict[str, Any], episodes: int, errs: bool) -> Table:
    """Success, then failures by their cause, then how well; `errs`: the distance from the goal says something."""
    from e2efly.episodes import summary

    found = {name: summary(e) for name, e in flown.items()}
    table = Table(f"of {episodes} starts", *found, box=None, header_style="bold", pad_edge=False)

    def row(heading: str, show: Callable[[dict[str, Any]], str]) -> None:
        table.add_row(heading, *(show(s) for s in found.values()))

    row("success", lambda s: f"{s['success']:.2%}")
    row("95 % interval", lambda s: "{:.2%} to {:.2%}".format(*s["success_interval_95"]))
    if any(s["success"] < 1 for s in found.values()):
        row("crashed or left", lambda s: str(s["crashed"]))
        row("out of time", lambda s: str(round(s["episodes"] * (1 - s["success"])) - s["crashed"]))
    if errs:
        row("final error", lambda s: f"{100 * s['final_error_m']:.2f} cm")
        row("mean error", lambda s: f"{100 * s['mean_error_m']:.2f} cm")
    row("time of a success", lambda s: seconds(s["seconds_of_success"]))
    row("mean speed", lambda s: "-" if s["mean_speed_m_s"] is None else f"{s['mean_speed_m_s']:.1f} m/s")
    row("top speed", lambda s: f"{s['top_speed_m_s']:.1f} m/s")
    row("roughness", lambda s: f"{s['roughness']:.3f}")
    return table
