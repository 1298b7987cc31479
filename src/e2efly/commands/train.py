"""`e2efly train`. Its options are those of the task and the algorithm. Their defaults come from a preset."""

import dataclasses
import os
import shlex
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import tyro
from rich.console import Console

from e2efly.commands.helping import asks_help
from e2efly.commands.options import parse as parse_options
from e2efly.commands.options import peek
from e2efly.commands.terminal import Terminal, TerminalProgress, console_table, seconds
from e2efly.config import ALGORITHMS, EnvConfig, NetworkConfig, RewardConfig, TrainConfig
from e2efly.config.run import TIMED
from e2efly.config.storage import read_json
from e2efly.learning.supervised import is_watched, watched
from e2efly.runs import presets
from e2efly.simulation.device import Hosts, device_kind, prepare
from e2efly.tasks import TASKS

if TYPE_CHECKING:
    from e2efly.runs.rundir import RunDirectory
    from e2efly.viewing.watch.beside import Beside

_FLOWN = {"nominal": "best", "stress": "best", "shipped": "best", "last": "last"}
"""Parts of a summary that hold evaluations of a policy, and whether it is the best or the last."""
_POLICY = "a policy: a task of the zoo, a run, or a policy.onnx"
_OWN = "or one of your own: path/to/file.py:Name"


@dataclass(frozen=True)
class Train:
    """What `e2efly train` is asked to do."""

    config: TrainConfig
    """Everything that determines the result."""
    preset: str
    """Name of the preset that gives the defaults."""
    out: Path
    """The run directory."""
    resume: bool
    """Continue the run in the run directory."""
    overwrite: bool
    """Delete the run in the run directory."""
    device: str | None
    """Device to compute on."""
    plots: bool
    """Evaluate the policy and draw plots at the end."""
    hosts: Hosts
    """The processes of the run."""
    watch: int | None
    """Port of the page on which the run can be watched. None: there is no page."""
    arguments: list[str]
    """The arguments as given. A run on several hosts passes them to its process."""


def run(options: Train) -> int:
    """Train, export the best policy, evaluate it and draw plots.

    Returns:
        0, or 130 when the user stopped it.
    """
    o, again = options, _again(options)
    if o.hosts.count > 1 and not is_watched():
        return watched([sys.executable, "-m", "e2efly", "train", *o.arguments], lambda reason: f"{reason}; {again}")
    prepare(o.device, o.hosts)
    from e2efly.learning.hosts import LostHostError

    try:
        return _train(o, again, Terminal(quiet=o.hosts.index > 0))
    except (LostHostError, ValueError, OSError, FloatingPointError) as error:
        if o.hosts.count == 1:
            raise
        print(f"error: {error}{f'; {again}' if isinstance(error, LostHostError) else ''}", file=sys.stderr, flush=True)
        os._exit(2)  # JAX would wait for the others, and abort


def parse(arguments: list[str]) -> Train:
    """The options of `train`.

    Raises:
        ValueError: for unknown names, for options that contradict each other, and for a run that does not exist.
    """
    from e2efly.runs.rundir import run_folder

    arguments = _with_folder(arguments)
    named = not (arguments and arguments[0].startswith("-")) or asks_help(arguments)
    file, goes_on = peek(arguments, "--config"), "--resume" in arguments and not named
    defaults, preset = _of_file(file) if file else _of_run(arguments) if goes_on else _of_preset(arguments)
    options, values = _options(defaults, preset)
    task = [] if named or not (file or goes_on) else [defaults.task.name]
    o = parse_options(options, "train", [*task, *arguments], default=values)
    for option, said, known in (
        ("TASK", o.task_name, defaults.task.name), ("--algo", o.algo_name, defaults.algo.name),
        ("--preset", o.preset, preset),
    ):  # fmt: skip
        if (file or goes_on) and said != known:
            told = f"--config {file} gives the defaults ({known})" if file else f"{o.out} goes on as it began ({known})"
            raise ValueError(f"{option} is {said}, but {told}; accepted: to leave it out")
    config = presets.changed(defaults, _given(o, defaults))
    if o.resume and o.overwrite:
        raise ValueError("--resume and --overwrite are both given; accepted: one of them")
    sized_for_gpu = not (file or goes_on) and device_kind(o.device) == "gpu"  # then nothing else will do
    return Train(
        config, o.preset, o.out or run_folder(config), o.resume, o.overwrite, "gpu" if sized_for_gpu else o.device,
        o.plots, o.hosts, o.watch, arguments,
    )  # fmt: skip


def recorded(command: str) -> Train:
    """What a command that stands beside a figure is asked to do: on a CPU, unless it names a device itself."""
    words = shlex.split(command)[1:]
    return parse(words if "--device" in words else [*words, "--device", "cpu"])


def _again(o: Train) -> str:
    """How to continue a run that was stopped."""
    command = ["e2efly", "train", "--resume", str(o.out)]
    command += ["--device", o.device] if o.device else []
    command += [] if o.plots else ["--no-plots"]
    every = f", in all {o.hosts.count} processes and with their --hosts options" if o.hosts.count > 1 else ""
    return f"go on with: {shlex.join(command)}{every}"


def _train(o: Train, again: str, console: Console) -> int:
    from e2efly.learning.runner import train
    from e2efly.learning.setup import Setup
    from e2efly.learning.usage import since_process_start
    from e2efly.runs.rundir import RunDirectory

    setup = Setup.of(o.config)
    run = RunDirectory(o.out)
    page = _page(o)
    if o.resume and not run.checkpoint.exists():
        console.print("There is no checkpoint yet: the run begins at its beginning.")
    if page is not None:
        console.print(f"Watch it at {page.address} once it flies: the page has the time that the training leaves.")
    try:
        title = f"{setup.config.task.name} by {setup.config.algo.name}"
        with TerminalProgress(console, title) if page is None else _ShownTraining(console, title, page) as progress:
            summary = train(setup, run, progress, o.resume, o.overwrite, traced=True)
        _report(console, summary, setup.config)
        if summary["stopped_by_user"]:
            console.print(f"Stopped; {again}")
            return 130
        if o.plots and not console.quiet:
            _draw(console, run, progress)
        console.print(f"Policy: {run.policy} (its contract is inside; `e2efly eval {run.path}` flies it again)")
        console.print(f"All of this took {since_process_start():.1f} s.")
        if page is not None:
            console.print(f"Watch it at {page.address} (Ctrl-C ends it)")
            page.wait()
        return 0
    finally:
        if page is not None:
            page.close()


def _page(o: Train) -> "Beside | None":
    """The page of `--watch`."""
    if o.watch is None or o.hosts.index > 0:
        return None
    from e2efly.viewing.watch.beside import Beside

    return Beside(o.watch, str(o.out))


class _ShownTraining(TerminalProgress):
    """The progress in the terminal, and a page that begins with the first policy."""

    def __init__(self, console: Console, title: str, page: "Beside") -> None:
        super().__init__(console, title)
        self._page = page

    def progress(self, steps: int, total: int, rate: float, success: float, best: float, flown: str) -> None:
        self._page.begin()
        super().progress(steps, total, rate, success, best, flown)


def _draw(console: Console, run: "RunDirectory", progress: TerminalProgress) -> None:
    from e2efly.viewing.evaluation_plots import plot_run

    with console.status("Drawing plots"):
        plot_run(run, *progress.end)
    console.print(f"Plots: {run.plots}")


def _report(console: Console, summary: dict[str, Any], config: TrainConfig) -> None:
    from e2efly.learning.judge import verdict

    rows = [
        {
            "policy": f"{name}, {called}, {summary['vehicles'][which]}",
            "update": summary["last" if which == "last" else "shipped"]["update"],
            "success": f"{d['success']:.1%}",
            "crashed": d["crashed"],
            **(
                {}
                if config.task.precision in TIMED
                else {
                    "final error": f"{100 * d['final_error_m']:.1f} cm",
                    "mean error": f"{100 * d['mean_error_m']:.1f} cm",
                }
            ),
            "time": seconds(d["seconds_of_success"]),
            "top speed": f"{d['top_speed_m_s']:.1f} m/s",
        }
        for which, called in _FLOWN.items()
        for name, d in summary.get(which, {}).items()
        if name != "update"
    ]
    took, steps = summary["seconds_trained_from_process_start"], summary["env_steps"] / 1e6
    told = verdict(summary, config.stop_at)
    console.print(
        f"\n{told}, trained by {took:.1f} s after the start of the process ({steps:.2f} M "
        f"environment steps). Flown from {summary['episodes']} starts that it never saw:"
    )
    console.print(console_table(rows))


def _options(config: TrainConfig, preset: str) -> tuple[type, Any]:
    """The options of `train`: a dataclass and its defaults, which are those of a configuration."""
    task, algo = config.task.name, config.algo.name
    every: list[tuple[str, Any]] = [
        ("task_name", tyro.conf.Positional[_help(str, f"What to learn: {_join(TASKS)}, {_OWN}.", metavar="TASK")]),
        ("algo_name", _help(str, f"Algorithm: {_join(ALGORITHMS)}, {_OWN}.", name="algo")),
        (
            "config",
            _help(
                Path | None, "Take the defaults, the task too, from a file: the config.json of a run, or one like it."
            ),
        ),
        ("preset", _help(str, f"Where the defaults come from: {_join(presets.names())}.")),
        (
            "vehicle",
            _help(str, "A shipped vehicle, `any` for a family of vehicles, or the path of a .toml file of either."),
        ),
        ("seed", _help(int, "Seed of everything random.")),
        ("out", _help(Path | None, "Run directory. If omitted, runs/TASK-ALGO-SEED, or runs/TASK-ALGO-VEHICLE-SEED.")),
        ("resume", _help(bool, "Continue the run in --out. `e2efly train --resume DIR` is enough.")),
        ("start_from", _help(str | None, f"Start from {_POLICY}. If omitted, from fresh weights.", name="from")),
        ("overwrite", _help(bool, "Delete the run in --out, and start again.")),
        (
            "device",
            _help(
                Literal["cpu", "gpu"] | None,
                "Where to compute. The preset's sizes are those for this device. If omitted, on a GPU if there is one.",
            ),
        ),
        ("plots", _help(bool, "Evaluate and draw plots at the end.")),
        ("steps", _help(int, "Environment steps of the whole run.")),
        ("chunk", _help(int, "Updates between two evaluations (sets shapes).")),
        ("eval_episodes", _help(int, "Starts per evaluation during training (sets shapes).")),
        ("devices", _help(int | None, "Devices (on a CPU: cores) that share the environments.")),
        ("fast_compile", _help(bool, "Compile faster but run slower. Good for runs of a few seconds.")),
        ("curriculum", _help(bool, "Go through the stages of the preset's curriculum, if it has one.")),
        ("stop_at", _help(float | None, "Stop when the success rate on 1000 starts is at least this.")),
        (
            "watch",
            _help(int | None, "Serve a page with the policy in flight, as it learns, on this port of 127.0.0.1."),
        ),
        ("hosts", Hosts),
        ("env", EnvConfig),
        ("task", Annotated[type(config.task), tyro.conf.arg(name="task")]),
        ("algo", Annotated[type(config.algo), tyro.conf.arg(name="algo")]),
        ("network", NetworkConfig),
        ("reward", RewardConfig),
    ]
    options = dataclasses.make_dataclass("Train", every, frozen=True)
    origin = f"preset {preset}" if preset in presets.names() else preset
    weights = ", ".join(f"{name} {weight:g}" for name, weight in config.reward.weights.items())
    options.__doc__ = f"Train a policy ({task}, {algo}). The defaults are {origin}'s; reward: {weights}."
    top = {
        name: getattr(config, name)
        for name in ("seed", "steps", "chunk", "eval_episodes", "devices", "fast_compile", "stop_at")
    }
    parts = {name: getattr(config, name) for name in ("env", "task", "algo", "network")}
    # changes to the preset's; a filled dictionary would take no new names
    parts |= {"reward": RewardConfig(), "env": dataclasses.replace(config.env, randomize={})}
    defaults = options(
        task_name=tyro.MISSING, algo_name=algo, config=None, preset=preset, vehicle=config.env.vehicle, out=None,
        resume=False, start_from=config.start_from, overwrite=False, device=None, plots=True, curriculum=True,
        watch=None, hosts=Hosts(), **top, **parts,
    )  # fmt: skip
    return options, defaults


def _help(kind: Any, text: str, **names: Any) -> Any:
    return Annotated[kind, tyro.conf.arg(help=text, **names)]


def _given(o: Any, defaults: TrainConfig) -> TrainConfig:
    """The options as a configuration, for `presets.changed`."""
    shared = {f.name: getattr(o, f.name) for f in dataclasses.fields(defaults)}
    shared["curriculum"] = defaults.curriculum if o.curriculum else ()
    if o.vehicle != defaults.env.vehicle:
        shared["env"] = dataclasses.replace(o.env, vehicle=o.vehicle)
    return TrainConfig(**shared)


def _of_preset(arguments: list[str]) -> tuple[TrainConfig, str]:
    """The configuration that gives the defaults, and the name of its preset."""
    task = next((a for a in arguments[:1] if not a.startswith("-")), "hover")
    algo, preset = presets.completed(
        task, peek(arguments, "--algo"), peek(arguments, "--preset"), lambda name: peek(arguments, f"--task.{name}")
    )
    device = device_kind(peek(arguments, "--device"))
    config = presets.starting(task, algo, preset, _vehicle(arguments), peek(arguments, "--from"), device)
    if arguments[:1] != [task] and not asks_help(arguments):
        raise ValueError(f"train needs a task first: {_join(TASKS)}")
    return config, preset


def _of_file(path: str) -> tuple[TrainConfig, str]:
    """The same, for a configuration in a file."""
    from e2efly.runs.inputs import from_json

    return from_json(read_json(Path(path)), path), "the file"


def _of_run(arguments: list[str]) -> tuple[TrainConfig, str]:
    """The same, for a run that continues and no named task: everything comes from the run."""
    from e2efly.runs.rundir import RunDirectory

    out = peek(arguments, "--out")
    if out is None:
        raise ValueError("--resume names no run; accepted: the run's folder, as in `e2efly train --resume DIR`")
    _vehicle(arguments)
    return RunDirectory(Path(out)).config(), "the run"


def _vehicle(arguments: list[str]) -> str | None:
    """The requested vehicle, if one is requested."""
    given = [vehicle for flag in ("--vehicle", "--env.vehicle") if (vehicle := peek(arguments, flag))]
    if len(set(given)) > 1:
        raise ValueError(f"--vehicle is {given[0]} and --env.vehicle is {given[1]}; accepted: one of them alone")
    return given[0] if given else None


def _with_folder(arguments: list[str]) -> list[str]:
    """Rewrite `--resume DIR` as `--out DIR --resume`."""
    for i, argument in enumerate(arguments):
        if argument.startswith("--resume="):
            return [*arguments[:i], "--out", argument.removeprefix("--resume="), "--resume", *arguments[i + 1 :]]
        if argument == "--resume" and i + 1 < len(arguments) and not arguments[i + 1].startswith("-"):
            return [*arguments[:i], "--out", arguments[i + 1], "--resume", *arguments[i + 2 :]]
    return arguments


def _join(names: Any) -> str:
    return ", ".join(names)
