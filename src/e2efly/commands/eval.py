"""`e2efly eval`."""

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro
from rich.table import Table

from e2efly.commands.helping import asks_help
from e2efly.commands.options import parse as parse_options
from e2efly.commands.policies import Asked, named_first, values, with_task
from e2efly.commands.rows import check_stress, report_stress
from e2efly.commands.terminal import Terminal, headed, seconds
from e2efly.config import EnvConfig, TaskConfig
from e2efly.config.run import TIMED
from e2efly.config.storage import write_json
from e2efly.policy.zoo import beside
from e2efly.vehicles.vehicle import Controller

if TYPE_CHECKING:
    from e2efly.validation.candidate import Candidate
    from e2efly.validation.evaluation import Evaluation


@dataclass(frozen=True)
class Eval:
    """Fly a policy from unseen starts and report the results."""

    policy: tyro.conf.Positional[Annotated[Path, tyro.conf.arg(metavar="POLICY")]]
    """A run directory, a policy.onnx, or a task. A task selects its policy in the zoo: the one for --vehicle if the zoo
    has that vehicle, otherwise of the nearest mass. `any/hover` is the policy for any vehicle."""
    episodes: int = 1000
    """Number of starts per criterion."""
    json: Path | None = None
    """Write the report to this file, with one row for every start."""
    plots: Path | None = None
    """Folder for the plots. If omitted, RUN/plots, or the folder of the policy."""
    seed: int = 1_000_000
    """Seed of the starts."""
    vehicle: str | None = None
    """The vehicle that flies: a name or a .toml file. If omitted, the policy's own vehicle; a policy for a family flies
    another vehicle of the family in every episode. The policy is not changed."""
    baseline: str | None = None
    """Controller that flies in place of the policy, under the policy's contract: a hover controller (pid, geometric,
    indi, mpc), or your own, path/to/file.py:Name. For hover, hover_aware, land, track and race."""
    controller: Controller = "policy"
    """The vehicle for which the flight controller is tuned. policy: the policy's own vehicle, whatever flies. plant:
    the vehicle that flies."""
    rival: Path | None = None
    """Race against another policy, from unseen starts: for policies of race_duel, and of race, which see no others."""
    stress: bool = False
    """Test robustness, row by row, with vehicles, air and sensors that differ from the training. See
    docs/robustness.md."""
    rows: tuple[str, ...] = ()
    """Names of the rows of --stress. If omitted, all rows."""
    least: float | None = None
    """Return exit status 1 if the success rate in any row of --stress is below this, such as 0.97."""
    device: Literal["cpu", "gpu"] | None = None
    """Device to compute on."""
    task: TaskConfig = TaskConfig()
    """Options of the policy's task, as in `train` (--task.track four_gates). They replace the values from the run or
    the contract."""
    env: EnvConfig = EnvConfig()
    """Options of the environment. They replace the values from the run or the contract. Not with --stress. Options that
    the contract fixes are refused: the vehicle (use --vehicle), commands, rate, past actions, and the format of the
    cameras' images."""


def parse(arguments: list[str]) -> Asked:
    """The options of `eval`. The defaults of `--env` and `--task` come from the policy's run or contract.

    Raises:
        ValueError: for unknown names, and for a policy that does not exist.
    """
    given = [argument for argument in arguments if argument.startswith(("--env.", "--task."))]
    if not given or asks_help(arguments):
        return Asked(parse_options(Eval, "eval", arguments), {})
    found = named_first("eval", arguments, given[0])
    from e2efly.validation.candidate import pinned

    own = pinned(found.env, found.policy)
    empty = dataclasses.replace(own, randomize={})  # a filled dictionary would take no new names
    kind = with_task(Eval, found.task)
    options = parse_options(kind, "eval", arguments, default=kind(tyro.MISSING, env=empty, task=found.task))
    if options.stress:
        raise ValueError(f"{given[0]} is given with --stress; accepted: one of them, as the rows say what is met")
    env = options.env
    if not any(argument.startswith("--env.randomize") for argument in given):
        env = dataclasses.replace(env, randomize=own.randomize)
    return Asked(options, values(found.task, options.task), values(own, env))


def run(asked: Asked) -> int:
    """Fly the ONNX file itself from unseen starts. Print a table; write the report and the plots.

    Returns:
        0, or 1 when a row of the stress succeeds less often than `least`.
    """
    options = asked.options
    check_stress(options.stress, options.rows, options.least)
    if options.rival is not None:
        return _duel(options, options.rival, asked)
    if options.stress:
        return _stress(options)
    from e2efly.validation.evaluation import ROW, evaluate
    from e2efly.viewing.evaluation_plots import plot_evaluation

    o, console = options, Terminal()
    found = evaluate(o.policy, o.episodes, env=asked.env, task=asked.task, **_flies(o), kept=ROW if o.json else 0)
    for note in found.candidate.notes:
        console.print(note, style="dim")
    console.print(_table(found, o.episodes))
    if o.json:
        write_json(o.json, found.as_json())
        console.print(f"Report: {o.json}")
    folder = _folder(o, found.candidate)
    plot_evaluation(found, folder)
    console.print(f"Plots: {folder}")
    return 0


def _stress(o: Eval) -> int:
    from e2efly.validation.stress import stress

    found = stress(o.policy, o.episodes, rows=o.rows, **_flies(o))
    return report_stress(found, Terminal(), o.json, _folder(o, found.candidate) / "stress.png", o.least)


def _duel(o: Eval, rival: Path, asked: Asked) -> int:
    from e2efly.validation.duels import duel

    other = {
        "--vehicle": o.vehicle, "--baseline": o.baseline, "--env": asked.env, "--plots": o.plots,
        "--controller": o.controller != "policy", "--stress": o.stress,
    }  # fmt: skip
    if wrong := [name for name, value in other.items() if value]:
        raise ValueError(
            f"{', '.join(wrong)} is given with --rival; accepted: --task, --episodes, --seed, --device and --json"
        )
    console = Terminal()
    found = duel(str(o.policy), str(rival), o.episodes, task=asked.task, seed=o.seed, device=o.device).as_json()
    table = headed(f"of {o.episodes} races", "policy", "rival")
    table.add_row("won", f"{found['won']:.1%}", f"{found['lost']:.1%}")
    table.add_row("95 % interval", "{:.1%} to {:.1%}".format(*found["won_interval_95"]), "")
    table.add_row("out at a gate", f"{found['out']:.1%}", f"{found['rival_out']:.1%}")
    table.add_row("touched another", f"{found['touched']:.1%}", "")
    table.add_row("time at the finish", seconds(found["seconds"]), seconds(found["rival_seconds"]))
    console.print(table)
    if o.json:
        write_json(o.json, found)
        console.print(f"Report: {o.json}")
    return 0


def _flies(o: Eval) -> dict[str, Any]:
    """What flies, and the device on which it is computed."""
    flies = {"vehicle": o.vehicle, "controller": o.controller, "baseline": o.baseline}
    return flies | {"seed": o.seed, "device": o.device}


def _folder(o: Eval, flew: "Candidate") -> Path:
    """The folder for the plots."""
    return o.plots or (flew.run.plots if flew.run else beside(flew.file) / "plots")


def _table(evaluated: "Evaluation", episodes: int) -> Table:
    """Success, then failures by cause, then quality."""
    from e2efly.environment.episodes import summary

    found = {name: summary(e) for name, e in evaluated.flown.items()}
    errs = evaluated.candidate.task.precision not in TIMED  # the distance from the goal is meaningful
    table = headed(f"of {episodes} starts, {evaluated.candidate.vehicles}", *found)

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
