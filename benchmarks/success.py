"""Success over 1000 unseen starts of the shipped policy of the nominal presets, for every task, algorithm and seed.

python benchmarks/success.py [--tasks hover ...] [--algos ppo bptt] [--seeds 5] [--json FILE]

Each run is written as it ends, and a script that was stopped goes on where it was.
"""

import json
import math
import subprocess
import sys
import tempfile
from functools import partial
from pathlib import Path
from typing import Any

from common import arguments, measured, training

TASKS = ["hover", "land", "track", "race"]


def run(command: str, seed: int) -> dict[str, Any]:
    """The summary of a full run of the preset."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        options = ["--seed", str(seed), "--out", str(out), "--no-plots", "--device", "cpu"]
        whole = [sys.executable, "-m", "e2efly", *command.split(), *options]
        subprocess.run(whole, stdout=subprocess.DEVNULL, check=True)
        return json.loads((out / "summary.json").read_text())


def rows(runs: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The table: one row per command and criterion."""
    table = []
    for command in dict.fromkeys(run["command"] for run in runs):
        these = [run for run in runs if run["command"] == command]
        for criterion in (name for name in these[0]["shipped"] if name != "update"):
            of = [run["shipped"][criterion] for run in these]
            table.append(
                {
                    "algorithm": these[0]["algorithm"],
                    "criterion": criterion,
                    "preset": these[0]["preset"],
                    "flown with": these[0]["vehicles"]["shipped"],
                    "success, every seed": " ".join(f"{100 * d['success']:.1f}" for d in of),
                    "final error, cm": " ".join(f"{100 * d['final_error_m']:.1f}" for d in of),
                    "mean error, cm": " ".join(f"{100 * d['mean_error_m']:.1f}" for d in of),
                    "time of a success, s": " ".join(f"{d['seconds_of_success'] or math.nan:.2f}" for d in of),
                    "top speed, m/s": " ".join(f"{d['top_speed_m_s']:.1f}" for d in of),
                    "trained, s": " ".join(f"{run['seconds_trained_from_process_start']:.0f}" for run in these),
                    "last policy": " ".join(f"{100 * run['last'][criterion]['success']:.1f}" for run in these),
                    "measured": max(run["date"] for run in these),
                    "configuration": these[0]["configuration"],
                }
            )
    return table


def main() -> None:
    """Train, and write JSON."""
    options = arguments(__doc__ or "", tasks=TASKS, algos=["ppo", "bptt"], seeds=5)
    for algo in options.algos:
        for task in options.tasks:
            about = training(f"train {task} --algo {algo} --preset nominal")
            for seed in range(options.seeds):
                measured("success", options.json, {**about, "seed": seed}, partial(run, about["command"], seed), rows)


if __name__ == "__main__":
    main()
