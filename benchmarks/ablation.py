"""Seconds of `e2efly ablate`, the full presets, three seeds: from process start to the figure, with an empty cache.

python benchmarks/ablation.py [--tasks hover ...] [--algos bptt ppo] [--json FILE]
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from common import arguments, table, with_earlier, write

SEEDS = 3


def main() -> None:
    """Measure, print a table, write JSON."""
    options = arguments(__doc__ or "", tasks=["hover", "land", "track", "race"], algos=["bptt", "ppo"])
    rows = []
    for algo in options.algos:
        for task in options.tasks:
            with tempfile.TemporaryDirectory() as folder:
                command = [
                    sys.executable, "-m", "e2efly", "ablate", task, "--algos", algo, "--seeds", str(SEEDS),
                    "--out", f"{folder}/out", "--device", "cpu",
                ]  # fmt: skip
                began = time.perf_counter()
                empty = os.environ | {"XDG_CACHE_HOME": f"{folder}/cache"}
                subprocess.run(command, env=empty, stdout=subprocess.DEVNULL, check=True)
                seconds = time.perf_counter() - began
                curves = json.loads(Path(folder, "out", f"{task}_{algo}.json").read_text())
            steps, variants = curves["steps"][-1], len(curves["variants"])
            rows.append(
                {
                    "algorithm": algo,
                    "task": task,
                    "rewards x seeds": f"{variants} x {SEEDS}",
                    "million steps each": f"{steps / 1e6:.1f}",
                    "seconds": f"{seconds:.0f}",
                    "seconds, were it 8 x 3": f"{seconds * 8 / variants:.0f}",
                }
            )
            print(rows[-1], flush=True)
            write(
                "ablation",
                options.json,
                {"table": with_earlier("ablation", options.json, "table", ("algorithm", "task"), rows)},
            )
    print(table(rows))


if __name__ == "__main__":
    main()
