"""Seconds from process start to the criterion, cold (empty compilation cache) and warm, a new process each.

    python benchmarks/time_to_criterion.py [--tasks hover ...] [--algos ppo bptt] [--seeds 5] [--json FILE]

A run stops once 250 watched starts and then 1000 other starts meet the criterion: 99 % of success, race 95 %.
Hover from thrown starts (its preset's name) also to 99.9 %. A run that ended short of its goal stands as nan, and
counts as inf. The warm run repeats the seed with the cache that the cold one left. Each pair is written as it is
measured, and a script that was stopped goes on where it was.
"""

import json
import math
import os
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

from common import arguments, measured, median, training

GOALS = {
    "hover": ("hover", "nominal", 0.99),
    "land": ("land", "nominal", 0.99),
    "track": ("track", "nominal", 0.99),
    "race": ("race", "nominal", 0.95),
    "land_visual": ("land_visual", "nominal", 0.99),
    "thrown": ("hover", "thrown", 0.99),
    "thrown_strictly": ("hover", "thrown", 0.999),
}
"""Task, preset and success of each goal."""
EVERY = ("shac", "abpt", "foppo")
"""Further algorithms, for thrown starts."""
PAPER = {  # seconds on an RTX 4090, E2E-Fly, table of training times
    "ppo": {"hover": 2500, "land": 5000, "track": 2500, "race": 6600},
    "bptt": {"hover": 750, "land": 750, "track": 800, "race": 2500},
}


def command(goal: str, algo: str) -> str:
    """The command of a goal, but for its seed and its folder."""
    name, preset, success = GOALS[goal]
    return f"train {name} --algo {algo} --preset {preset} --stop-at {success}"


def run(command: str, seed: int, cache: Path, device: str = "cpu") -> dict[str, float]:
    """One process; seconds and environment steps at the criterion (NaN when it was not reached), and peak memory."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        options = ["--seed", str(seed), "--out", str(out), "--no-plots", "--device", device]
        whole = [sys.executable, "-m", "e2efly", *command.split(), *options]
        process = subprocess.Popen(
            whole, env={**os.environ, "XDG_CACHE_HOME": str(cache)}, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        _, errors = process.communicate()
        if process.returncode:
            raise SystemExit(f"{' '.join(whole)} failed:\n{errors.decode()}")
        summary = json.loads((out / "summary.json").read_text())
    reached = summary["reached_criterion"] or {"seconds": float("nan"), "steps": float("nan")}
    return {**reached, "peak_memory_gb": summary["peak_memory_gb"]}


def both(goal: str, algo: str, seed: int) -> dict[str, dict[str, float]]:
    """The run with an empty cache, and the same again."""
    with tempfile.TemporaryDirectory() as cache:
        return {when: run(command(goal, algo), seed, Path(cache)) for when in ("cold", "warm")}


def number(x: float | None) -> float:
    """A figure as JSON keeps it: null for NaN."""
    return math.nan if x is None else x


def rows(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The table: one row per command."""
    table = []
    for told in dict.fromkeys(run["command"] for run in runs):
        of = [run for run in runs if run["command"] == told]
        algo, goal = of[0]["algo"], of[0]["task"]
        cold, warm = ([number(run[when]["seconds"]) for run in of] for when in ("cold", "warm"))
        table.append({
            "algorithm": algo,
            "task": f"{goal}, {100 * GOALS[goal][2]:g}%",
            "preset": of[0]["preset"],
            "cold, s (median)": f"{median(cold):.1f}",
            "cold, s (all)": " ".join(f"{x:.1f}" for x in cold),
            "warm, s (median)": f"{median(warm):.1f}",
            "million steps": f"{median([number(run['cold']['steps']) for run in of]) / 1e6:.2f}",
            "memory, GB": f"{max(run['cold']['peak_memory_gb'] for run in of):.2f}",
            "paper, s": PAPER.get(algo, {}).get(goal, "-"),
            "measured": max(run["date"] for run in of),
            "configuration": of[0]["configuration"],
        })  # fmt: skip
    return table


def main() -> None:
    """Measure, and write JSON."""
    options = arguments(__doc__ or "", tasks=list(GOALS), algos=["ppo", "bptt"], seeds=5)
    for goal in options.tasks:
        for algo in (*options.algos, *(EVERY if GOALS[goal][1] == "thrown" else ())):
            for seed in range(options.seeds):
                about = {"task": goal, "algo": algo, "seed": seed, **training(command(goal, algo))}
                measured("time_to_criterion", options.json, about, partial(both, goal, algo, seed), rows)


if __name__ == "__main__":
    main()
