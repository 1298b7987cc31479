"""`e2efly train`."""

import os
import sys
from pathlib import Path
from typing import Any

from rich.console import Console

from e2efly.commands.progress import TerminalProgress
from e2efly.commands.tables import console_table
from e2efly.commands.terminal import Terminal
from e2efly.config import TrainConfig
from e2efly.device import Hosts, cache_folder, prepare
from e2efly.presets import algorithm_name, task_name

LEARNED = 0.95
"""Success by the worst criterion from which on a task counts as learned, where the user asks for no other."""


def train_command(
    config: TrainConfig,
    out: Path,
    resume: bool,
    device: str | None,
    plots: bool,
    hosts: Hosts,
) -> int:
    """Train, ship the best policy, evaluate it and draw plots; exit status 0, or 130 when the user stopped it."""
    prepare(device, hosts)
    from e2efly.learn.hosts import LostHostError

    try:
        return _train(config, out, resume, plots, Terminal(quiet=hosts.index > 0))
    except (LostHostError, ValueError, OSError, FloatingPointError) as error:
        if hosts.count == 1:
            raise
        lost = isinstance(error, LostHostError)
        again = f"; start all {hosts.count} again with --out {out} --resume" if lost else ""
        print(f"error: {error}{again}", file=sys.stderr, flush=True)
        os._exit(2)  # JAX would wait for the others, and abort


def _train(config: TrainConfig, out: Path, resume: bool, plots: bool, console: Console) -> int:
    from e2efly.learn.runner import train

    task, algo = task_name(config.task), algorithm_name(config.algo)
    with TerminalProgress(console, f"{task} by {algo}") as progress:
        summary = train(config, out, progress, resume, traced=cache_folder() / "traced")
    _report(console, summary, config.stop_at)
    if summary["stopped_by_user"]:
        console.print(f"Stopped. Go on with: e2efly train {task} --algo {algo} --out {out} --resume")
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
            "time": f"{d['seconds_of_success']:.2f} s" if d["success"] else "none",
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
