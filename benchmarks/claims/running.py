"""Runs of the paper's experiments, each training in a process of its own; what it came to, as JSON."""

import dataclasses
import hashlib
import json
import math
import os
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from claims.experiment import Flight, Run

LEVELS = (0.5, 0.9, 0.95, 0.99)
"""Success, over the starts that training watches, at which steps and seconds are noted."""
EVALUATED = ("success", "final_error", "reward")
"""What the evaluations of a training say of each criterion."""
CURVE = ("steps", "seconds", "reward", "return", "success", "error")
"""The columns of a curve."""
HELD = 5
"""Evaluations in a row over which success must stay at a level, for the level to be held."""
STOPPED = 130
"""Exit status of a training that Ctrl-C has stopped in order."""
POINTS = 40
"""Most points of a curve that are kept."""
SETTLED = 0.05
"""A reward has converged where it stays within this share of its whole rise."""
SMALL = {
    "ppo": ("--algo.envs", "8", "--algo.horizon", "8", "--algo.minibatch", "64", "--algo.epochs", "1"),
    "bptt": ("--algo.envs", "8", "--algo.horizon", "4"),
}
"""Sizes of the short version, by algorithm."""
SHORT = (
    "--steps",
    "256",
    "--fast-compile",
    "--chunk",
    "2",
    "--eval-episodes",
    "40",
    "--network.hidden",
    "8",
    "8",
    "--task.episode-s",
    "1",
)


@dataclasses.dataclass(frozen=True)
class How:
    """How runs are made."""

    folder: Path
    """Of the runs."""
    episodes: int = 1000
    """Starts of each flight."""
    short: bool = False
    """Whether in seconds, with figures that say nothing."""
    most: float = math.inf
    """Environment steps after which a training is stopped in order; a later command goes on with it."""
    stop: float | None = None
    """Success, held over `HELD` evaluations, at which a training is stopped in order. None: it takes all its steps."""
    device: str = "cpu"
    """Where to train."""


def wanted(run: Run, seed: int, seeds: int, known: Sequence[Mapping[str, Any]], how: How) -> bool:
    """Whether a run is to be made: it is not known, or was stopped earlier than it would be now."""
    for one in known:
        if key(one) == (run.task, run.algo, run.variant, seed):
            over = one["finished"] or one["steps"] >= how.most or one["held"].get(str(how.stop))
            return not over or (run.kind == "ablate" and one["seeds"] != seeds)
    return True


def key(one: Mapping[str, Any]) -> tuple[str, str, str, int]:
    """What names a run."""
    return one["task"], one["algo"], one["variant"], one["seed"]


def make(run: Run, seed: int, seeds: int, how: How) -> dict[str, Any]:
    """Make a run: its figures, and those of the flights of its policy."""
    about = {"task": run.task, "algo": run.algo, "variant": run.variant, "seed": seed}
    if run.kind == "ablate":
        return about | ablated(run, seeds, how)
    if run.kind == "zoo":
        return about | {"finished": True, "seconds": 0.0, "flights": flights(run.task, run.flights, how)}
    out = place(run, seed, how)
    told = trained(run, seed, out, how)
    told["flights"] = flights(out, run.flights, how)
    return about | told


def place(run: Run, seed: int, how: How) -> Path:
    """The folder of a training: that of all runs with the same options, so that none is trained twice."""
    told = hashlib.sha256(repr((run.options, how.short)).encode()).hexdigest()[:8]
    return how.folder / f"{run.task}-{run.algo}-{seed}-{told}"


def trained(run: Run, seed: int, out: Path, how: How) -> dict[str, Any]:
    """The figures of a training, which goes on where its folder has one that was stopped or killed. One that was killed
    has no summary: it goes on for an evaluation at least.
    """
    summary, before = out / "summary.json", points(out)
    told = json.loads(summary.read_text()) if summary.exists() else None
    if told is None or not (told["finished"] or enough(before, how)):
        if (out / "checkpoint.safetensors").exists():
            options = ["--resume", str(out)]
        else:
            short = (*SHORT, *SMALL[run.algo]) if how.short else ()
            options = [run.task, "--algo", run.algo, "--seed", str(seed), "--out", str(out), *run.options, *short]
        limited = not math.isinf(how.most) or how.stop is not None
        command = ["train", *options, "--no-plots", "--device", how.device]

        def over() -> bool:
            known = points(out)
            return limited and len(known) > len(before) and enough(known, how)

        process(command, out.with_suffix(".time"), over)
    return figures(out)


def enough(known: Sequence[Mapping[str, float]], how: How) -> bool:
    """Whether a training may be stopped after these evaluations."""
    return bool(known) and (known[-1]["steps"] >= how.most or first_held(known, how.stop) is not None)


def first_held(known: Sequence[Mapping[str, float]], level: float | None) -> Mapping[str, float] | None:
    """The first of `HELD` evaluations of the task itself in a row with at least this success. None: there are none."""
    good = [level is not None and p["final"] and p["success"] >= level for p in known]
    return next((known[i] for i in range(len(good) - HELD + 1) if all(good[i : i + HELD])), None)


def process(arguments: list[str], times: Path, over: Callable[[], bool] = lambda: False) -> None:
    """Run a command of e2efly; stop it in order once it is over. Its user and system seconds join a file: NaN for what
    an earlier process took that was killed, whose log is still there.

    Raises:
        SystemExit: with what it says, when it fails.
    """
    times.parent.mkdir(parents=True, exist_ok=True)
    before, log = resource.getrusage(resource.RUSAGE_CHILDREN), times.with_suffix(".log")
    if log.exists():
        with times.open("a") as file:
            file.write("nan\n")
    with log.open("w") as told:
        child = subprocess.Popen([sys.executable, "-m", "e2efly", *arguments], stdout=told, stderr=subprocess.STDOUT)
        accepted = (0,)
        try:
            while child.poll() is None:
                time.sleep(0.5)
                if over():
                    child.send_signal(signal.SIGINT)
                    child.wait()
                    accepted = (0, STOPPED)
        except BaseException:
            child.kill()
            raise
    if child.returncode not in accepted:
        raise SystemExit(f"e2efly {' '.join(arguments)} failed:\n{log.read_text()}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    with times.open("a") as file:
        file.write(f"{after.ru_utime - before.ru_utime:.2f} {after.ru_stime - before.ru_stime:.2f}\n")
    log.unlink()


def points(out: Path) -> list[dict[str, Any]]:
    """The evaluations of a training so far: steps, seconds, success and error of the worst criterion, the mean rewards
    of a step and of an episode, and whether the task itself was flown or an earlier stage of the curriculum.
    """
    from e2efly.runs.rundir import RunDirectory

    run = RunDirectory(out)
    rows = run.rows()
    stages = len(run.read_json("config.json")["curriculum"]) + 1 if rows else 1
    last = [i for i, row in enumerate(rows) if "seconds" in row]
    found = []
    for before, i in zip([-1, *last], last, strict=False):
        row = rows[i]
        flown = {part: [x for name, x in row.items() if name.endswith(f"/{part}")] for part in EVALUATED}
        found.append({
            "steps": row["steps"], "seconds": row["seconds"], "rate": row["rate"],
            "reward": float(np.mean([r["reward"] for r in rows[before + 1 : i + 1]])),
            "success": min(flown["success"]), "error": max(flown["final_error"]),
            "return": float(np.mean(flown["reward"])), "final": row.get("stage", stages) == stages,
        })  # fmt: skip
    return found


def figures(out: Path) -> dict[str, Any]:
    """What a run directory says: steps, seconds, curves, when levels were reached, how the best policy flew."""
    from e2efly.runs.rundir import RunDirectory

    summary, known = RunDirectory(out).read_json("summary.json"), points(out)
    times = out.with_suffix(".time")
    cpu = sum(map(float, times.read_text().split())) if times.exists() else math.nan
    shown = known[::-1][:: math.ceil(len(known) / POINTS)][::-1]
    task = [p for p in known if p["final"]]
    reached = {str(x): next((p for p in task if p["success"] >= x), None) for x in LEVELS}
    return {
        "finished": bool(summary["finished"]),
        "steps": summary["env_steps"],
        "seconds": summary["seconds_trained_from_process_start"],
        "cpu_seconds": None if math.isnan(cpu) else cpu,
        "rate": float(np.median([p["rate"] for p in known])),
        "cores": len(os.sched_getaffinity(0)),
        "reached": {x: moment(p) for x, p in reached.items()},
        "held": {str(x): moment(first_held(known, x)) for x in LEVELS},
        "converged": converged(known),
        "shipped": {name: told for name, told in summary["shipped"].items() if name != "update"},
        "curve": {name: numbers(p[name] for p in shown) for name in CURVE},
    }


def moment(point: Mapping[str, float] | None) -> dict[str, float] | None:
    """When an evaluation was."""
    return None if point is None else {name: point[name] for name in ("steps", "seconds")}


def converged(points: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """When the mean reward had come to its last value and stayed there, and that value: the mean of the last tenth."""
    reward = np.array([p["reward"] for p in points])
    final = float(reward[-max(1, len(reward) // 10) :].mean())
    away = np.flatnonzero(np.abs(reward - final) > SETTLED * abs(final - reward[0]))
    i = min(int(away[-1]) + 1, len(points) - 1) if len(away) else 0
    return {"steps": points[i]["steps"], "seconds": points[i]["seconds"], "reward": final}


def flights(policy: Path | str, asked: Mapping[str, Flight], how: How) -> dict[str, Any]:
    """How a policy flew in each of the flights, by criterion, or by what its episodes drew."""
    from e2efly import evaluate
    from e2efly.environment.episodes import summary

    flown = {}
    for name, flight in list(asked.items())[: 1 if how.short else None]:
        task, episodes = ({"episode_s": 1.0}, 4) if how.short else ({}, how.episodes)
        found = evaluate(policy, episodes, env=flight.env, task={**flight.task, **task}, device="cpu")
        if not flight.by:
            flown[name] = {criterion: summary(e) for criterion, e in found.flown.items()}
            continue
        for criterion, e in found.flown.items():
            drawn = np.asarray(found.drawn[criterion][flight.by])
            for value in np.unique(drawn):
                own = {f.name: np.asarray(getattr(e, f.name))[drawn == value] for f in dataclasses.fields(e)}
                flown.setdefault(name, {})[f"{value:g}"] = summary(dataclasses.replace(e, **own))
    return flown


def ablated(run: Run, seeds: int, how: How) -> dict[str, Any]:
    """The curves of an ablation: of each variant the last evaluation of each seed, and the mean over seeds."""
    out = how.folder / f"{run.task}-{run.algo}-{run.variant}-{seeds}"
    short = ("--steps", "40960") if how.short else ()
    command = ["ablate", run.task, "--algos", run.algo, "--seeds", str(seeds), "--by", "group", "--out", str(out)]
    process([*command, *run.options, *short, "--device", "cpu"], out.with_suffix(".time"))
    found = json.loads((out / f"{run.task}_{run.algo}.json").read_text())
    success = np.min(list(found["success"].values()), axis=0)
    error = np.max(list(found["error"].values()), axis=0)
    every = math.ceil(success.shape[-1] / POINTS)
    shown = np.arange(success.shape[-1])[::-1][::every][::-1]
    shutil.rmtree(out)
    out.with_suffix(".time").unlink()
    return {
        "finished": True, "seconds": 0.0, "seeds": seeds, "variants": found["variants"],
        "success": success[..., -1].tolist(), "error": error[..., -1].tolist(),
        "curve": {
            "steps": numbers(np.asarray(found["steps"])[shown]),
            "success": [numbers(x[shown]) for x in success.mean(axis=1)],
            "error": [numbers(x[shown]) for x in error.mean(axis=1)],
        },
        "flights": {},
    }  # fmt: skip


def numbers(values: Iterable[float]) -> str:
    """Numbers of a curve, in one line of the file."""
    return " ".join(f"{x:.5g}" for x in values)
