"""Seconds from process start to the criterion, cold (empty compilation cache) and warm, a new process each.

    python benchmarks/time_to_criterion.py [--tasks hover ...] [--algos ppo bptt] [--seeds 5] [--json FILE]

A run stops once 250 watched starts and then 1000 other starts meet the criterion: 99 % of success, race 95 %.
Hover from thrown starts (its preset's name) also to 99.9 %. Rows that are not measured anew stay; a run that
ended short of its goal stands as nan, and counts as inf.
The warm run repeats the seed with the cache that the cold one left. Each line is printed as it is measured.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from common import arguments, median, table, with_earlier, write

GOALS = {
    "hover": ("hover", "nominal", 0.99),
    "land": ("land", "nominal", 0.99),
    "track": ("track", "nominal", 0.99),
    "race": ("race", "nominal", 0.95),
    "thrown": ("hover", "thrown", 0.99),
    "thrown_strictly": ("hover", "thrown", 0.999),
}
"""Task, preset and success of each goal."""
PAPER = {  # seconds on an RTX 4090, E2E-Fly, table of training times
    "ppo": {"hover": 2500, "land": 5000, "track": 2500, "race": 6600},
    "bptt": {"hover": 750, "land": 750, "track": 800, "race": 2500},
}


def run(goal: str, algo: str, seed: int, cache: Path) -> dict[str, float]:
    """One process; seconds and environment steps at the criterion (NaN when it was not reached), and peak memory."""
    name, preset, success = GOALS[goal]
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        command = [
            sys.executable, "-m", "e2efly", "train", name, "--algo", algo, "--preset", preset,
            "--seed", str(seed), "--out", str(out),
            "--stop-at", str(success), "--no-plots", "--device", "cpu",
        ]  # fmt: skip
        process = subprocess.Popen(
            command, env={**os.environ, "XDG_CACHE_HOME": str(cache)}, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE
        )
        _, errors = process.communicate()
        if process.returncode:
            raise SystemExit(f"{' '.join(command)} failed:\n{errors.decode()}")
        summary = json.loads((out / "summary.json").read_text())
    reached = summary["reached_criterion"] or {"seconds": float("nan"), "steps": float("nan")}
    return {**reached, "peak_memory_gb": summary["peak_memory_gb"]}


def main() -> None:
    """Measure, print a table, write JSON."""
    options = arguments(__doc__ or "", tasks=list(GOALS), algos=["ppo", "bptt"], seeds=5)
    rows, every = [], []
    for algo in options.algos:
        for task in options.tasks:
            cold, warm, steps, memory = [], [], [], []
            for seed in range(options.seeds):
                with tempfile.TemporaryDirectory() as cache:
                    first, second = (run(task, algo, seed, Path(cache)) for _ in range(2))
                cold.append(first["seconds"])
                warm.append(second["seconds"])
                steps.append(first["steps"])
                memory.append(first["peak_memory_gb"])
                every.append({"task": task, "algo": algo, "seed": seed, "cold": first, "warm": second})
                print(
                    f"{algo} {task} seed {seed}: cold {first['seconds']:.2f} s, warm {second['seconds']:.2f} s",
                    flush=True,
                )
            rows.append(
                {
                    "algorithm": algo,
                    "task": f"{task}, {100 * GOALS[task][2]:g}%",
                    "cold, s (median)": f"{median(cold):.1f}",
                    "cold, s (all)": " ".join(f"{x:.1f}" for x in cold),
                    "warm, s (median)": f"{median(warm):.1f}",
                    "million steps": f"{median(steps) / 1e6:.2f}",
                    "memory, GB": f"{max(memory):.2f}",
                    "paper, s": PAPER.get(algo, {}).get(task, "-"),
                }
            )
            whole = with_earlier("time_to_criterion", options.json, "table", ("algorithm", "task"), rows)
            runs = with_earlier("time_to_criterion", options.json, "runs", ("algo", "task"), every)
            write("time_to_criterion", options.json, {"table": whole, "runs": runs})
    print(table(rows))


if __name__ == "__main__":
    main()
