"""`e2efly tune`."""

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from e2efly.commands import eval as evaluation
from e2efly.commands import identify, train
from e2efly.commands.identify import Identify
from e2efly.commands.log_options import LogOptions
from e2efly.commands.terminal import Terminal
from e2efly.config.storage import held, write_atomically, write_json
from e2efly.tasks import TASKS
from e2efly.vehicles.posterior import IDENTIFIED


@dataclass(frozen=True)
class Tune:
    """Make a policy for a vehicle from its logs: identify, train over the remaining uncertainty, evaluate with stress.

    It runs `identify flight LOG...`, `train TASK --preset identified` and `eval --stress`, one after the other.
    """

    logs: tyro.conf.Positional[Annotated[tuple[Path, ...], tyro.conf.arg(metavar="FILE [FILE ...]")]]
    """Logs of flights of the vehicle, as `e2efly identify flight` reads them."""
    task: str = "race"
    """The task to learn. It must have the preset `identified`."""
    vehicle: str = "vis_r"
    """The base vehicle: a name or a .toml file. The flight controller is assumed to have been tuned for it in the
    flights."""
    mass: tuple[float, float] | None = None
    """Mass of the vehicle and standard deviation of the scale, kg."""
    read: tyro.conf.OmitArgPrefixes[LogOptions] = LogOptions()
    out: Path = Path("tuned")
    """Folder for identified/ (the vehicle file and its plots), run/ (the training) and policy.onnx."""
    steps: int | None = None
    """Environment steps of the training. If omitted, those of the preset."""
    seed: int = 0
    """Seed of the training."""
    overwrite: bool = False
    """Delete the run that is in --out, and start again."""
    least: float | None = None
    """Return exit status 1 if the success rate in any row of the stress is below this, such as 0.9."""


def run(options: Tune) -> int:
    """Identify, train and evaluate. Write policy.onnx.

    Returns:
        0, or 1 when a row of the stress succeeds less often than `least`.

    Raises:
        ValueError: naming the option, the log or the parameter. Results of earlier steps stay in the folder.
    """
    o, learned = options, options.out / "run"
    kind = TASKS.find(o.task)
    if kind.best not in kind.robust:
        having = ", ".join(name for name, known in TASKS.items() if known.best in known.robust)
        raise ValueError(f"--task is {o.task}, which has no preset {IDENTIFIED}; accepted: {having}")
    if (learned / "config.json").exists() and not o.overwrite:
        raise ValueError(
            f"--out is {o.out}, which has a run; accepted: another folder, --overwrite, or `e2efly train --resume "
            f"{learned}` to go on with it"
        )
    with held(o.out):
        return _tune(o, o.out / "identified", learned)


def _tune(o: Tune, folder: Path, learned: Path) -> int:
    began, console, seconds = time.perf_counter(), Terminal(), {}

    def did(what: str) -> None:
        seconds[what] = time.perf_counter() - began - sum(seconds.values())

    console.rule(f"identify {', '.join(path.name for path in o.logs)}")
    identify.run(Identify(("flight", *map(str, o.logs)), o.vehicle, folder, o.read, o.mass))
    did("identify")
    console.rule(f"train {o.task} on what stays uncertain")
    steps = [] if o.steps is None else ["--steps", str(o.steps)]
    arguments = [
        o.task, "--vehicle", str(folder / "vehicle.toml"), "--preset", IDENTIFIED, "--seed", str(o.seed), "--out",
        str(learned), "--no-plots", *steps, *(["--overwrite"] if o.overwrite else []),
    ]  # fmt: skip
    if status := train.run(train.parse(arguments)):
        return status
    did("train")
    console.rule("evaluate with stress")
    least = [] if o.least is None else ["--least", str(o.least)]
    report = o.out / "stress.json"
    status = evaluation.run(evaluation.parse([str(learned), "--stress", "--json", str(report), *least]))
    did("evaluate")
    write_atomically(o.out / "policy.onnx", (learned / "policy.onnx").read_bytes())
    write_json(o.out / "tuned.json", {"seconds": seconds, "logs": [str(path) for path in o.logs], "task": o.task})
    took = ", ".join(f"{what} {s:.0f} s" for what, s in seconds.items())
    console.print(f"Policy: {o.out / 'policy.onnx'}; fly it with --vehicle {folder / 'vehicle.toml'}. Took: {took}.")
    return status
