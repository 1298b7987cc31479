"""`e2efly sweep`: train a task over seeds and options, with many runs in parallel on Ray.

Each run is a process of `e2efly train` in its own folder. A finished run is not trained again. An interrupted run
continues when the sweep is started again, or, through Ray, after the loss of a worker.
"""

import dataclasses
import fcntl
import itertools
import logging
import math
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro
from rich.console import Console

from e2efly.commands import train
from e2efly.commands.terminal import Terminal, console_table, markdown
from e2efly.config import TrainConfig
from e2efly.config.budget import check_time
from e2efly.config.storage import held, write_atomically, write_json
from e2efly.runs import presets
from e2efly.runs.rundir import RunDirectory
from e2efly.simulation.device import cores
from e2efly.tasks import TASKS

RUN_S = 5.0
"""Minimum duration of a run, s; on one core alone."""
_GIVEN = ("seed", "out", "resume", "algo", "preset", "device", "devices", "plots", "no-plots")
"""Options of `e2efly train` that a sweep sets itself."""
_ALONE = {
    "RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER": "0",  # otherwise Ray replaces 127.0.0.1 by the machine's outward address
    # Ray asks a cloud's metadata service which cloud this is, even with its usage statistics off: close the way there
    "http_proxy": "http://127.0.0.1:9",
    "no_proxy": "127.0.0.1,localhost",
}
"""Environment variables that keep a local Ray on this machine only."""


@dataclass(frozen=True)
class Sweep:
    """Train a task over seeds and options, with many runs in parallel on Ray (pip install 'e2efly[ray]')."""

    task: tyro.conf.Positional[Annotated[str, tyro.conf.arg(metavar="TASK")]]
    """The task to learn."""
    algo: str | None = None
    """Learning algorithm. If omitted, the one that learns the task best."""
    preset: str | None = None
    """Source of all options that are not varied. If omitted, robust if the task has it, otherwise nominal."""
    seeds: int = 5
    """Number of runs per variant, with seeds 0, 1, ..."""
    vary: tuple[str, ...] = ()
    """Options of `e2efly train` with their values: algo.learning-rate=1e-3,4e-3 steps=500000. All combinations are
    run."""
    out: Path | None = None
    """Folder for the runs and the table. If omitted, runs/sweep-TASK-ALGO. All machines of a cluster must share it."""
    cores: int = 1
    """Cores per run. Without GPUs, each core is one device."""
    gpus: int = 0
    """GPUs per run; each GPU is one device. 0: the run computes on the CPU."""
    address: str | None = None
    """Address of a Ray cluster, or auto. If omitted, only this machine is used, bound to the loopback interface."""

    @property
    def algorithm(self) -> str:
        """`algo`, or the algorithm that learns the task best."""
        return presets.completed(self.task, self.algo)[0]

    @property
    def defaults(self) -> str:
        """`preset`, or the one that `e2efly train` uses."""
        return presets.completed(self.task, self.algo, self.preset)[1]

    @property
    def folder(self) -> Path:
        """`out`, or a folder named after task and algorithm."""
        return self.out or Path("runs") / f"sweep-{TASKS.find(self.task).name}-{self.algorithm}"


@dataclass(frozen=True)
class Trial:
    """One run."""

    variant: str
    """The options that all its seeds share."""
    seed: int
    arguments: tuple[str, ...]
    """Arguments of `e2efly train`."""
    out: Path

    def ended(self) -> dict[str, Any] | None:
        """The summary of the run, if it has finished."""
        if not (self.out / "summary.json").exists():
            return None
        found = RunDirectory(self.out).read_json("summary.json")
        return found if found.get("finished") else None


def run(options: Sweep) -> int:
    """Run every variant with every seed. Write sweep.json and a table. The exit status is 1 if a run failed.

    Raises:
        ValueError: for options that cannot be varied, and for a folder with runs of another configuration.
        OSError: when the folder cannot be written, or when the cluster cannot be reached.
    """
    console, trials = Terminal(), list(trials_of(options))
    if len({trial.out for trial in trials}) < len(trials):
        raise ValueError(f"--vary {' '.join(options.vary)}: two variants share a folder; accepted: values that differ")
    configs = {trial.variant: train.parse(list(trial.arguments)).config for trial in trials if not trial.seed}
    for trial in trials:
        _check(trial, dataclasses.replace(configs[trial.variant], seed=trial.seed))
    with held(options.folder):
        return _sweep(options, trials, console)


def _sweep(options: Sweep, trials: list[Trial], console: Console) -> int:
    """Run the sweep in a folder that no other process uses."""
    from e2efly.learning.judge import rates

    found = {trial.out: summary for trial in trials if (summary := trial.ended())}
    console.print(
        f"{len(trials)} runs of {options.task} by {options.algorithm.upper()}, {len(found)} of them there already"
    )
    left, failed = [trial for trial in trials if trial.out not in found], 0
    for trial, how in _run(left, options) if left else ():
        summary = trial.ended()
        if summary is None:
            failed += 1
            console.print("failed:", style="bold red", end=" ")
            console.print(f"{trial.out.name}: {how}")
            continue
        found[trial.out] = summary
        told = ", ".join(f"{rate:.1%} ({name})" for name, rate in rates(summary).items())
        seconds = summary["seconds_trained_from_process_start"]
        console.print(f"{len(found)} of {len(trials)}: {trial.out.name}: success {told} in {seconds:.0f} s")
    _report(options, trials, found, console)
    return 1 if failed else 0


def trials_of(options: Sweep) -> Iterator[Trial]:
    """Every combination of the values of the varied options, with every seed.

    Raises:
        ValueError: naming the option and what is accepted.
    """
    for name, least in (("seeds", 1), ("cores", 1), ("gpus", 0)):
        if getattr(options, name) < least:
            raise ValueError(f"--{name} is {getattr(options, name)}; accepted: {least} or more")
    varied: dict[str, list[str]] = {}
    for item in options.vary:
        option, equals, values = item.partition("=")
        option = option.lstrip("-").replace("_", "-")
        if not equals or not values or option in _GIVEN or option.startswith("hosts"):
            raise ValueError(
                f"--vary {item!r}; accepted: OPTION=VALUE,VALUE,... with an option of `e2efly train` such as "
                f"algo.learning-rate, but not hosts, {', '.join(_GIVEN)}"
            )
        if option in varied:
            raise ValueError(f"--vary {option} twice; accepted: all of its values behind one")
        varied[option] = values.split(",")
    runs = float(options.seeds) * math.prod(map(len, varied.values()))
    check_time({f"--seeds is {options.seeds}, {runs:g} runs": runs * RUN_S}, f"at {RUN_S:g} s each")
    for values in itertools.product(*varied.values()):
        chosen = dict(zip(varied, values, strict=True))
        told = [f"{option} {value}" for option, value in chosen.items() if len(varied[option]) > 1]
        variant = ", ".join(told) or options.defaults
        given = [part for option, value in chosen.items() for part in (f"--{option}", *value.split())]
        for seed in range(options.seeds):
            folder = re.sub(r"[^\w.+-]", "-", "_".join([*told, f"seed {seed}"]))
            arguments = (
                options.task, "--algo", options.algorithm, "--preset", options.defaults, "--seed", str(seed),
                "--no-plots", "--devices", str(options.gpus or options.cores),
                "--device", "gpu" if options.gpus else "cpu", *given,
            )  # fmt: skip
            yield Trial(variant, seed, arguments, (options.folder / folder).absolute())


def train_trial(trial: Trial) -> int:
    """Run `e2efly train` in a folder, or continue the run in it. The output goes to train.log in this folder."""
    trial.out.mkdir(parents=True, exist_ok=True)
    with (trial.out / "train.log").open("ab") as log:
        fcntl.flock(log, fcntl.LOCK_EX)  # the process holds it, too: one that outlives its worker is waited for
        if trial.ended():
            return 0
        again = ["--resume"] if RunDirectory(trial.out).began else []
        command = [sys.executable, "-m", "e2efly", "train", *trial.arguments, "--out", str(trial.out), *again]
        return subprocess.run(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, check=False).returncode


def _check(trial: Trial, config: TrainConfig) -> None:
    """Refuse numbers that cannot be used, and a folder that holds a run of another configuration."""
    presets.check(config)
    if (run := RunDirectory(trial.out)).began:
        run.check_same(config)


def _run(trials: list[Trial], options: Sweep) -> Iterator[tuple[Trial, str]]:
    """The trials in the order in which they end, with the result of each."""
    if options.address is None:
        os.environ.update(_ALONE)  # before the import, which reads it
    try:
        import ray
        from ray.exceptions import RayError
    except ModuleNotFoundError as error:
        raise ValueError(f"a sweep needs the package {error.name}: pip install 'e2efly[ray]'") from None
    here: dict[str, Any] = {"num_cpus": cores(), "include_dashboard": False, "_node_ip_address": "127.0.0.1"}
    where: dict[str, Any] = {"address": "local", **here} if options.address is None else {"address": options.address}
    try:
        ray.init(**where, log_to_driver=False, logging_level=logging.ERROR)
    except ConnectionError as error:
        raise OSError(f"--address {options.address}: {error}") from None
    try:
        machines = [node["Resources"] for node in ray.nodes() if node["Alive"]]
        if not any(m.get("CPU", 0) >= options.cores and m.get("GPU", 0) >= options.gpus for m in machines):
            known = "; ".join(f"{m.get('CPU', 0):g} cores and {m.get('GPU', 0):g} GPUs" for m in machines)
            raise ValueError(f"--cores {options.cores} --gpus {options.gpus}; accepted: what one machine has: {known}")
        remote = ray.remote(num_cpus=options.cores, num_gpus=options.gpus, max_retries=3)(train_trial)
        waiting = {remote.remote(trial): trial for trial in trials}
        while waiting:
            (done, *_), _ = ray.wait(list(waiting))
            trial = waiting.pop(done)
            try:
                status = ray.get(done)
            except RayError as error:
                yield trial, str(error)
            else:
                yield trial, f"status {status}: {_last_line(trial)}"
    finally:
        ray.shutdown()


def _last_line(trial: Trial) -> str:
    log = trial.out / "train.log"
    lines = log.read_text(errors="replace").strip().splitlines() if log.exists() else []
    return lines[-1] if lines else "it said nothing"


def _each(success: list[dict[str, float]], of: Callable[[list[float]], Any]) -> str:
    """A figure of the success rates of several runs, by the name of what flew."""
    columns = zip(success[0], *(one.values() for one in success), strict=True)
    return ", ".join(f"{of(rates):.1%} ({name})" for name, *rates in columns)


def _report(options: Sweep, trials: list[Trial], found: dict[Path, dict[str, Any]], console: Console) -> None:
    """One row per variant, and a file with every run."""
    from e2efly.learning.judge import rates

    rows = []
    for variant in dict.fromkeys(trial.variant for trial in trials):
        of = [found[trial.out] for trial in trials if trial.variant == variant and trial.out in found]
        success = [rates(summary) for summary in of]
        seconds = [summary["seconds_trained_from_process_start"] for summary in of]
        rows.append(
            {
                "variant": variant,
                "runs": len(of),
                "success": _each(success, np.mean) if of else "-",
                "worst seed": _each(success, min) if of else "-",
                "trained": f"{np.median(seconds):.0f} s" if of else "-",
            }
        )
    runs = [{**dataclasses.asdict(trial), "out": trial.out.name, "summary": found.get(trial.out)} for trial in trials]
    write_json(options.folder / "sweep.json", runs)
    write_atomically(options.folder / "sweep.md", ("\n".join(markdown(rows)) + "\n").encode())
    console.print(console_table(rows))
    console.print(f"Table: {options.folder / 'sweep.md'}   every run: {options.folder / 'sweep.json'}")
