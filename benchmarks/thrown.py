"""Catching a thrown vehicle by every algorithm: success while learning, and of the shipped policy over 1000 starts.

    python benchmarks/thrown.py [--algos ppo bptt shac abpt foppo] [--seeds 5] [--json FILE]

Full runs of the preset `thrown`, each a process with an empty cache. The curves are in the JSON file, and drawn in
docs/thrown.png by `make docs`: success over 250 starts of 10 s.
"""

import csv
import json
import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from common import arguments, table, with_earlier, write


def run(algo: str, seed: int) -> tuple[dict[str, Any], dict[str, list[float]]]:
    """The summary of a run, and its curve: steps, seconds from process start, success."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "run"
        command = [
            sys.executable, "-m", "e2efly", "train", "hover", "--preset", "thrown", "--algo", algo, "--seed", str(seed),
            "--out", str(out), "--no-plots", "--device", "cpu",
        ]  # fmt: skip
        empty = os.environ | {"XDG_CACHE_HOME": f"{folder}/cache"}
        subprocess.run(command, env=empty, stdout=subprocess.DEVNULL, check=True)
        with (out / "metrics.csv").open() as file:
            rows = [row for row in csv.DictReader(file) if row["seconds"]]
        names = {"steps": "steps", "seconds": "seconds", "success": "eval/hover/success"}
        curve = {name: [float(row[column]) for row in rows] for name, column in names.items()}
        return json.loads((out / "summary.json").read_text()), curve


def main() -> None:
    """Train, print a table, write JSON."""
    options = arguments(__doc__ or "", algos=["ppo", "bptt", "shac", "abpt", "foppo"], seeds=5)
    rows, curves = [], []
    for algo in options.algos:
        summaries, found = zip(*(run(algo, seed) for seed in range(options.seeds)), strict=True)
        curves.append({"algorithm": algo, "seeds": found})
        success = [s["shipped"]["hover"]["success"] for s in summaries]
        rows.append(
            {
                "algorithm": algo,
                "success, every seed, %": " ".join(f"{100 * share:.1f}" for share in success),
                "mean": f"{100 * statistics.mean(success):.2f}",
                "last policy": " ".join(f"{100 * s['last']['hover']['success']:.1f}" for s in summaries),
                "million steps": f"{summaries[0]['env_steps'] / 1e6:.1f}",
                "trained, s": " ".join(f"{s['seconds_trained_from_process_start']:.0f}" for s in summaries),
            }
        )
        print(rows[-1], flush=True)
        whole = with_earlier("thrown", options.json, "table", ("algorithm",), rows)
        every = with_earlier("thrown", options.json, "curves", ("algorithm",), curves)
        write("thrown", options.json, {"table": whole, "curves": every})
    print(table(rows))


if __name__ == "__main__":
    main()
