"""Success over 1000 unseen starts of the shipped policy of the nominal presets, for every task, algorithm and seed.

python benchmarks/success.py [--tasks hover ...] [--algos ppo bptt] [--seeds 5] [--json FILE]

Rows that are not measured anew stay.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from common import arguments, table, with_earlier, write

TASKS = ["hover", "land", "track", "race"]


def run(task: str, algo: str, seed: int) -> dict:
    """The summary of a full run of the preset."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        command = [
            sys.executable, "-m", "e2efly", "train", task, "--algo", algo, "--preset", "nominal", "--seed", str(seed),
            "--out", str(out), "--no-plots", "--device", "cpu",
        ]  # fmt: skip
        subprocess.run(command, env=os.environ, stdout=subprocess.DEVNULL, check=True)
        return json.loads((out / "summary.json").read_text())


def main() -> None:
    """Train, print a table, write JSON."""
    options = arguments(__doc__ or "", tasks=TASKS, algos=["ppo", "bptt"], seeds=5)
    rows, every = [], []
    for algo in options.algos:
        for task in options.tasks:
            runs = [run(task, algo, seed) for seed in range(options.seeds)]
            every += runs
            for criterion in (name for name in runs[0]["shipped"] if name != "update"):
                of = [r["shipped"][criterion] for r in runs]
                rows.append(
                    {
                        "algorithm": algo,
                        "criterion": criterion,
                        "success, every seed": " ".join(f"{100 * d['success']:.1f}" for d in of),
                        "final error, cm": " ".join(f"{100 * d['final_error_m']:.1f}" for d in of),
                        "mean error, cm": " ".join(f"{100 * d['mean_error_m']:.1f}" for d in of),
                        "time of a success, s": " ".join(f"{d['seconds_of_success']:.2f}" for d in of),
                        "top speed, m/s": " ".join(f"{d['top_speed_m_s']:.1f}" for d in of),
                        "trained, s": " ".join(f"{r['seconds_trained_from_process_start']:.0f}" for r in runs),
                        "last policy": " ".join(f"{100 * r['last'][criterion]['success']:.1f}" for r in runs),
                    }
                )
                print(rows[-1], flush=True)
            whole = with_earlier("success", options.json, "table", ("algorithm", "criterion"), rows)
            runs = with_earlier("success", options.json, "runs", ("algorithm", "task"), every)
            write("success", options.json, {"table": whole, "runs": runs})
    print(table(rows))


if __name__ == "__main__":
    main()
