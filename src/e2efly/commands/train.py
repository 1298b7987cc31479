"""`e2efly train`."""

import os
import shlex
import sys
from pathlib import Path
from typing import Any

from rich.console import Console

from e2efly.commands.progress import TerminalProgress
from e2efly.commands.supervised import is_watched, watched
from e2efly.commands.tables import console_table
from e2efly.commands.terminal import Terminal
from e2efly.config import TrainConfig
from e2efly.device import Hosts, prepare
from e2efly.presets import algorithm_name

LEARNED = 0.95
"""Success by the worst criterion from which on a task counts as learned, where the user asks for no other."""


def train_command(
    config: TrainConfig,
    out: Path,
    resume: bool,
    device: str | None,
    plots: bool,
    hosts: Hosts,
    arguments: list[str],
) -> int:
    """Train, ship the best policy, evaluate it and draw plots; exit status 0, or 130 when the user stopped it.

    Args:
        config: everything that decides the outcome.
        out: the run directory.
        resume: go on with the run in it.
        device: where to compute.
        plots: evaluate and draw at the end.
        hosts: the processes of the run.
        arguments: of `e2efly train`, for the process that a run on several hosts is.
    """
    again = _again(out, device, plots, hosts)
    if hosts.count > 1 and not is_watched():
        return watched([sys.executable, "-m", "e2efly", "train", *arguments], lambda reason: f"{reason}; {again}")
    prepare(device, hosts)
    from e2efly.learn.hosts import LostHostError

    try:
        return _train(config, out, resume, plots, again, Terminal(quiet=hosts.index > 0))
    except (LostHostError, ValueError, OSError, FloatingPointError) as error:
        if hosts.count == 1:
            raise
        print(f"error: {error}{f'; {again}' if isinstance(error, LostHostError) else ''}", file=sys.stderr, flush=True)
        os._exit(2)  # JAX would wait for the others, and abort


def _again(out: Path, device: str | None, plots: bool, hosts: Hosts) -> str:
    """How to go on with a run that was stopped."""
    command = ["e2efly", "train", "--resume", str(out)]
    command += ["--device", device] if device else []
    command += [] if plots else ["--no-plots"]
    every = f", in all {hosts.count} processes and with their --hosts options" if hosts.count > 1 else ""
    return f"go on with: {shlex.join(command)}{every}"


def _train(config: TrainConfig, out: Path, resume: bool, plots: bool, again: str, console: Console) -> int:
    from e2efly.learn.programs import traced_folder
    from e2efly.learn.rundir import RunDirectory
    from e2efly.learn.runner import train

    task, algo = config.task.name, algorithm_name(config.algo)
    if resume and not RunDirectory(out).checkpoint.exists():
        console.print("There is no checkpoint yet: the run begins at its beginning.")
    with TerminalProgress(console, f"{task} by {algo}") as progress:
        summary = train(config, out, progress, resume, traced=traced_folder(config))
    _report(console, summary, config.stop_at)
    if summary["stopped_by_user"]:
        console.print(f"Stopped; {again}")
        return 130
    if plots and not console.quiet:
        from e2efly.commands.evaluate import eval_command

        eval_command(out, quiet=True)
        console.print(f"Plots: {out / 'plots'}")
    console.print(f"Policy: {out / 'policy.onnx'} (its contract is inside; `e2efly eval {out}` flies it again)")
    return 0


def _report(console: Console, summary: dict[str, Any], stop_at: float | None) -> None:
    rows = [
        {
            "policy": f"{name}, {called}",
            "update": summary[which]["update"],
            "success": f"{d['success']:.1%}",
            "final error": f"{100 * d['final_error_m']:.1f} cm",
            "mean error": f"{100 * d['mean_error_m']:.1f} cm",
            "time": "none" if d["seconds_of_success"] is None else f"{d['seconds_of_success']:.2f} s",
            "top speed": f"{d['top_speed_m_s']:.1f} m/s",
        }
        for which, called in (("shipped", "best"), ("last", "last"))
        for name, d in summary[which].items()
        if name != "update"
    ]
    seconds, steps = summary["seconds_trained_from_process_start"], summary["env_steps"] / 1e6
    console.print(
        f"\n{verdict(summary, stop_at)}, after {seconds:.1f} s from the start of the process ({steps:.2f} M "
        f"environment steps). Flown from {summary['episodes']} starts that it never saw:"
    )
    console.print(console_table(rows))


def verdict(summary: dict[str, Any], stop_at: float | None) -> str:
    """Whether a run learned its task: what `--stop-at` asks for, or most of the starts of its worst criterion."""
    what = f"{summary['task']} by {summary['algorithm'].upper()}"
    success = min(found["success"] for name, found in summary["shipped"].items() if name != "update")
    if summary["reached_criterion"] or success >= (stop_at or LEARNED):
        return f"Learned {what}: {success:.1%} success"
    if success == 0:
        return f"Did not learn {what}: no success"
    return f"Did not learn {what} reliably: {success:.1%} success"
