"""Where `e2efly train TASK`, as typed, spends its time: seconds of each part, from the start of a process to its end.

    python benchmarks/cold_start.py [--tasks hover race] [--seeds 3] [--steps N] [--json FILE]

Cold: an empty compilation cache. Later: the same command with the cache that the cold one left. Each command is a
process of its own, which this script times from outside, too. A part is the wall-clock time of the main thread:
compiling is the wait for XLA beside tracing. Each pair is written as it is measured, and a script that was stopped goes
on where it was.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any

from common import arguments, measured, median, training

from e2efly.config.env import FILE, RANDOM

PARTS = ("imports", "tracing", "compiling", "learning", "evaluating", "report", "export", "plots", "end")
"""What a training does, one after the other; learning and evaluating take turns."""


def watched(arguments: list[str]) -> dict[str, float]:
    """Run a training in this process, the time of its parts taken by functions put around them."""
    from e2efly.learning.usage import since_process_start

    seconds = dict.fromkeys(PARTS, 0.0)

    def around(module: Any, name: str, part: str, less: tuple[str, ...] = ()) -> None:
        inner = getattr(module, name)

        def timed(*args: Any, **kwargs: Any) -> Any:
            began, before = time.perf_counter(), sum(seconds[other] for other in less)
            out = inner(*args, **kwargs)
            seconds[part] += time.perf_counter() - began - (sum(seconds[other] for other in less) - before)
            return out

        setattr(module, name, timed)

    import e2efly.learning.runner as runner
    from e2efly.commands.cli import run
    from e2efly.simulation.device import prepare

    with suppress(ValueError):
        prepare("cpu")
    import jax

    from e2efly.learning import onnx_export
    from e2efly.viewing import evaluation_plots

    def traced(event: str, duration: float, **_: Any) -> None:
        if event in ("/jax/core/compile/jaxpr_trace_duration", "/jax/core/compile/jaxpr_to_mlir_module_duration"):
            seconds["tracing"] += duration * compiling

    compiling = 0.0
    jax.monitoring.register_event_duration_secs_listener(traced)
    inner: Callable[..., Any] = runner.Programs.compile

    def compile_all(*args: Any, **kwargs: Any) -> Any:
        nonlocal compiling
        seconds["imports"] = since_process_start()
        began, compiling = time.perf_counter(), 1.0
        out = inner(*args, **kwargs)
        compiling = 0.0
        seconds["compiling"] = time.perf_counter() - began - seconds["tracing"]
        return out

    runner.Programs.compile = staticmethod(compile_all)  # type: ignore[method-assign]
    around(onnx_export, "export_policy", "export")
    around(evaluation_plots, "plot_run", "plots")
    around(runner._Training, "finish", "report", ("export",))
    judge = runner.judge

    def judged(*args: Any, **kwargs: Any) -> Any:
        began, out = time.perf_counter(), judge(*args, **kwargs)
        seconds["evaluating"] += (time.perf_counter() - began) * looping
        return out

    looping, loop = 0.0, runner._Training.loop

    def looped(*args: Any, **kwargs: Any) -> Any:
        nonlocal looping
        began, looping = time.perf_counter(), 1.0
        out = loop(*args, **kwargs)
        looping = 0.0
        seconds["learning"] = time.perf_counter() - began - seconds["evaluating"]
        return out

    runner.judge, runner._Training.loop = judged, looped  # type: ignore[method-assign]
    status = run(arguments)
    if status:
        raise SystemExit(status)
    return seconds


def once(task: str, seed: int, steps: int, cache: Path) -> dict[str, Any]:
    """One command in a process of its own: seconds of each part; `end` is what its user waits besides. With the success
    of the policy with each kind of vehicles.
    """
    from e2efly.learning.judge import rates

    with tempfile.TemporaryDirectory() as folder:
        told, out = Path(folder) / "parts.json", Path(folder) / "run"
        command = [sys.executable, __file__, "--watch", str(told), *typed(task, steps).split(), "--seed", str(seed)]
        began = time.perf_counter()
        subprocess.run(
            [*command, "--out", str(out), "--device", "cpu"],
            env={**os.environ, "XDG_CACHE_HOME": str(cache)}, stdout=subprocess.DEVNULL, check=True,
        )  # fmt: skip
        whole = time.perf_counter() - began
        seconds, summary = json.loads(told.read_text()), json.loads((out / "summary.json").read_text())
    seconds["end"] = whole - sum(seconds[part] for part in PARTS if part != "end")
    return {**seconds, "whole": whole, "success": rates(summary)}


def both(task: str, seed: int, steps: int) -> dict[str, dict[str, Any]]:
    """The command with an empty cache, and the same again."""
    with tempfile.TemporaryDirectory() as cache:
        return {when: once(task, seed, steps, Path(cache)) for when in ("cold", "later")}


def typed(task: str, steps: int = 0) -> str:
    """The command."""
    return f"train {task}" + (f" --steps {steps}" if steps else "")


def rows(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The table: two rows per command."""
    table = []
    for told in dict.fromkeys(run["command"] for run in runs):
        of = [run for run in runs if run["command"] == told]
        for when in ("cold", "later"):
            parts = {part: f"{median([run[when][part] for run in of]):.1f}" for part in (*PARTS, "whole")}
            success = {
                f"{kind}, %": " ".join(f"{100 * run[when]['success'][kind]:.1f}" for run in of)
                if kind in of[0][when]["success"]
                else "-"
                for kind in (FILE, RANDOM)
            }
            about = {"measured": max(run["date"] for run in of), "configuration": of[0]["configuration"]}
            table.append({"task": of[0]["task"], "when": when, "preset": of[0]["preset"], **parts, **success, **about})
    return table


def main() -> None:
    """Measure, and write JSON."""
    if sys.argv[1:2] == ["--watch"]:
        Path(sys.argv[2]).write_text(json.dumps(watched(sys.argv[3:])))
        return
    options = arguments(__doc__ or "", tasks=["hover", "race"], seeds=3, steps=0)
    for task in options.tasks:
        for seed in range(options.seeds):
            about = {"task": task, "seed": seed, **training(typed(task, options.steps))}
            measured("cold_start", options.json, about, partial(both, task, seed, options.steps), rows)


if __name__ == "__main__":
    main()
