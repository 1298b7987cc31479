"""What the preset `robust` gives: seconds from process start, cold, and success in every row of the stress.

    python benchmarks/robust.py [--tasks hover ...] [--algos bptt] [--vehicle vis_r] [--seeds 5] [--episodes 1000]

Rows that are not measured anew stay. The seconds are those of the whole training; the report comes after.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from common import arguments, table, with_earlier, write

from e2efly.environment.stress_rows import ALL, rows_for
from e2efly.validation.stress import stress

TASKS = ["hover", "land", "track", "race"]


def run(task: str, algo: str, vehicle: str, seed: int, episodes: int) -> dict[str, Any]:
    """One training in a process of its own, and its policy in all rows."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        command = [
            sys.executable, "-m", "e2efly", "train", task, "--algo", algo, "--preset", "robust", "--vehicle", vehicle,
            "--seed", str(seed), "--out", str(out), "--no-plots", "--device", "cpu",
        ]  # fmt: skip
        cold = {**os.environ, "XDG_CACHE_HOME": str(Path(folder) / "cache")}
        subprocess.run(command, env=cold, stdout=subprocess.DEVNULL, check=True)
        summary = json.loads((out / "summary.json").read_text())
        found = stress(out, episodes, rows=rows_for(()))
    success = found.success
    apart = {row: share for row, share in success.items() if row != ALL}
    worst = min(apart, key=lambda row: apart[row])
    error = {row: max(float(np.mean(e.final_error)) for e in of.values()) for row, of in found.flown.items()}
    nominal = list(found.flown["nominal"].values())
    return {
        "task": task, "algo": algo, "vehicle": vehicle, "seed": seed,
        "seconds": summary["seconds_trained_from_process_start"],
        "nominal": success["nominal"], "worst": apart[worst], "worst_row": worst, "all": success[ALL],
        "final_error_m": error,
        "lap_s": float(np.mean(np.concatenate([e.duration[e.success] for e in nominal]))),
    }  # fmt: skip


def main() -> None:
    """Train, fly, print a table, write JSON."""
    options = arguments(__doc__ or "", tasks=TASKS, algos=["bptt"], vehicle="vis_r", seeds=5, episodes=1000)
    for algo in options.algos:
        for task in options.tasks:
            runs = [run(task, algo, options.vehicle, seed, options.episodes) for seed in range(options.seeds)]
            apart = [{r: x for r, x in one["final_error_m"].items() if r != ALL} for one in runs]
            row = {
                "task": task,
                "algorithm": algo,
                "vehicle": options.vehicle,
                "trained, s": " ".join(f"{one['seconds']:.0f}" for one in runs),
                "nominal, %": " ".join(f"{100 * one['nominal']:.1f}" for one in runs),
                "worst row, %": " ".join(f"{100 * one['worst']:.1f}" for one in runs),
                "all at once, %": " ".join(f"{100 * one['all']:.1f}" for one in runs),
                "end error nominal / worst row, cm": " ".join(
                    f"{100 * of['nominal']:.1f}/{100 * max(of.values()):.1f}" for of in apart
                ),
                "time, s": " ".join(f"{one['lap_s']:.2f}" for one in runs),
            }
            print(row, flush=True)
            keys = "task", "algorithm", "vehicle"
            whole = with_earlier("robust", options.json, "table", keys, [row])
            every = with_earlier("robust", options.json, "runs", ("task", "algo", "vehicle"), runs)
            write("robust", options.json, {"table": whole, "runs": every})
    print(table(whole))


if __name__ == "__main__":
    main()
