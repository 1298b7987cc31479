"""`e2efly tune`."""

import signal
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from e2efly.commands import eval as evaluation
from e2efly.commands import identify, train
from e2efly.commands.identify import KINDS, Identify, files_of
from e2efly.commands.log_options import LogOptions
from e2efly.commands.terminal import Terminal
from e2efly.config.storage import held, write_atomically, write_json
from e2efly.flight.excitation import ExcitationOptions
from e2efly.flight.process import need_system
from e2efly.flight.settings import FlightSettings
from e2efly.tasks import TASKS
from e2efly.vehicles.posterior import IDENTIFIED

FLIGHT = "flight"
"""The kind of a source that is named without one."""
STARTS = 250
"""Starts per row of the stress."""


@dataclass(frozen=True)
class Tune:
    """Make a policy for a vehicle: identify it, train over the remaining uncertainty, evaluate with stress.

    It runs `identify`, `train TASK --preset identified` and `eval --stress`, one after the other. The stress has the
    rows that trainings draw from. With --link it first runs `fly excitation`, and identifies from the log of this
    flight, too.
    """

    sources: tyro.conf.Positional[Annotated[tuple[str, ...], tyro.conf.arg(metavar="[FILE ...]")]] = ()
    """What is known of the vehicle, each source as its kind and its files, as `e2efly identify` takes them: parts FILE,
    pendulum FILE, stand FILE, flight LOG..., step LOG... Files before the first kind are logs of flights."""
    task: str = "race"
    """The task to learn. It must have the preset `identified`."""
    vehicle: str = "vis_r"
    """The base vehicle: a name or a .toml file. The flight controller is assumed to have been tuned for it in the
    flights."""
    mass: tuple[float, float] | None = None
    """Mass of the vehicle and standard deviation of the scale, kg."""
    read: tyro.conf.OmitArgPrefixes[LogOptions] = LogOptions()
    link: str | None = None
    """Connection to the flight controller, as `e2efly fly` takes it. If it is given, the excitation is flown first, and
    its log is in --out/flights. The pilot's switches decide. See docs/flying.md before the first flight."""
    pose: str = "udp:9870"
    """Pose source of that flight, as `e2efly fly` takes it."""
    guard: Literal["switch", "filter"] = "switch"
    """What keeps that flight inside the fence, as in `e2efly fly`."""
    flight: FlightSettings = FlightSettings()
    """Heights, speeds, time-outs, fence, channels of that flight."""
    excitation: ExcitationOptions = ExcitationOptions()
    """Manoeuvres of that flight."""
    out: Path = Path("tuned")
    """Folder for flights/ (the logs of what it flies), identified/ (the vehicle file and its plots), run/ (the
    training) and policy.onnx."""
    steps: int | None = None
    """Environment steps of the training. If omitted, those of the preset."""
    seed: int = 0
    """Seed of the training."""
    overwrite: bool = False
    """Delete the run that is in --out, and start again."""
    least: float | None = None
    """Return exit status 1 if the success rate in any row of the stress is below this, such as 0.9."""


def run(options: Tune) -> int:
    """Fly the excitation if a link is given. Identify, train and evaluate. Write policy.onnx.

    Returns:
        0, or 1 when a row of the stress succeeds less often than `least`.

    Raises:
        ValueError: naming the option, the source or the parameter. Results of earlier steps stay in the folder.
    """
    o, learned = options, options.out / "run"
    kind = TASKS.find(o.task)
    if kind.best not in kind.robust:
        having = ", ".join(name for name, known in TASKS.items() if known.best in known.robust)
        raise ValueError(f"--task is {o.task}, which has no preset {IDENTIFIED}; accepted: {having}")
    sources = o.sources if not o.sources or o.sources[0] in KINDS else (FLIGHT, *o.sources)
    if sources or o.link is None:
        files_of(sources)  # what is wrong with them is told before anything flies
    if (learned / "config.json").exists() and not o.overwrite:
        raise ValueError(
            f"--out is {o.out}, which has a run; accepted: another folder, --overwrite, or `e2efly train --resume "
            f"{learned}` to go on with it"
        )
    with held(o.out):
        return _tune(o, sources, o.out / "identified", learned)


def _tune(o: Tune, sources: tuple[str, ...], folder: Path, learned: Path) -> int:
    console, seconds = Terminal(), {}
    began = time.perf_counter()

    def did(what: str) -> None:
        seconds[what] = time.perf_counter() - began - sum(seconds.values())

    if o.link is not None:
        console.rule("fly the excitation")
        sources = (*sources, FLIGHT, str(_excited(o, o.link)))
        did("fly")
    console.rule(f"identify from {' '.join(word if word in KINDS else Path(word).name for word in sources)}")
    identify.run(Identify(sources, o.vehicle, folder, o.read, o.mass))
    did("identify")
    console.rule(f"train {o.task} on what stays uncertain")
    steps = [] if o.steps is None else ["--steps", str(o.steps)]
    arguments = [
        o.task, "--vehicle", str(folder / "vehicle.toml"), "--preset", IDENTIFIED, "--seed", str(o.seed), "--out",
        str(learned), "--no-plots", *steps, *(["--overwrite"] if o.overwrite else []),
    ]  # fmt: skip
    training = train.parse(arguments)
    if status := train.run(training):
        return status
    did("train")
    console.rule("evaluate with stress")
    from e2efly.environment.stress_rows import rows_for

    asked = [
        str(learned), "--stress", "--episodes", str(STARTS), "--rows", *rows_for(training.config.env.cameras), "--json",
        str(o.out / "stress.json"), *([] if o.least is None else ["--least", str(o.least)]),
    ]  # fmt: skip
    status = evaluation.run(evaluation.parse(asked))
    did("evaluate")
    write_atomically(o.out / "policy.onnx", (learned / "policy.onnx").read_bytes())
    write_json(o.out / "tuned.json", {"seconds": seconds, "sources": list(sources), "task": o.task})
    took = ", ".join(f"{what} {s:.0f} s" for what, s in seconds.items())
    console.print(f"Policy: {o.out / 'policy.onnx'}; fly it with --vehicle {folder / 'vehicle.toml'}. Took: {took}.")
    return status


def _excited(o: Tune, link: str) -> Path:
    """Fly the excitation.

    Returns:
        the log of the flight.

    Raises:
        OSError: on a system on which `e2efly fly` does not run.
    """
    need_system("`e2efly tune --link`", "linux")
    from e2efly.commands import fly

    log = o.out / "flights" / time.strftime("%Y-%m-%d_%H-%M-%S.mcap")
    interrupt = signal.getsignal(signal.SIGINT)
    try:
        fly.run(
            fly.Fly(
                Path("excitation"), link=link, pose=o.pose, vehicle=o.vehicle, log=log, guard=o.guard, flight=o.flight,
                excitation=o.excitation,
            )
        )  # fmt: skip
    finally:
        signal.signal(signal.SIGINT, interrupt)  # in flight it lands; after it, it ends the process
    return log
