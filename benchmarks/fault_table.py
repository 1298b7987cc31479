"""What the benchmarks of faults share: a hover policy, and one line a fault."""

import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from common import table, write


def hover_policy(given: str | None, folder: Path) -> Path:
    """The policy given, or one of the hover preset, trained."""
    if given:
        return Path(given)
    run = folder / "hover"
    command = [sys.executable, "-m", "e2efly", "train", "hover", "--out", str(run), "--no-plots", "--device", "cpu"]
    subprocess.run(command, env=os.environ, stdout=subprocess.DEVNULL, check=True)
    return run / "policy.onnx"


def run(name: str, options: Any, fly: Callable[[Path, Path, int], list[dict[str, Any]]]) -> None:
    """Fly so many rounds, write the figures, print the table; exit status 1 when any row has problems.

    Args:
        name: of the benchmark.
        options: `times`, `policy` and `json`.
        fly: (policy, folder, seed) -> a row a fault.
    """
    began, rows = time.perf_counter(), []
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        policy = hover_policy(options.policy, folder)
        for seed in range(options.times):
            rows += fly(policy, folder, seed)
    took = time.perf_counter() - began
    lines = summary(rows)
    write(name, options.json, {"table": lines, "faults": rows, "took_s": took})
    print(table(lines))
    sys.exit(any(row["problems"] for row in rows))


def summary(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """One line a fault."""
    lines = []
    for name in dict.fromkeys(row["fault"] for row in rows):
        mine = [row for row in rows if row["fault"] == name]

        def worst(key: str, rows: list[dict[str, Any]] = mine) -> float:
            known = [row[key] for row in rows if math.isfinite(row.get(key, math.nan))]
            return max(known, default=math.nan)

        def shown(value: float, digits: int) -> str:
            return "" if math.isnan(value) else f"{value:.{digits}f}"

        lines.append(
            {
                "fault": name,
                "as documented": f"{sum(not row['problems'] for row in mine)} of {len(mine)}",
                "time to react, s": shown(worst("reaction"), 3),
                "allowed, s": shown(worst("allowed"), 3),
                "touch, m/s": shown(worst("touch_speed"), 2),
                "largest tilt, rad": shown(worst("largest_tilt"), 2),
            }
        )
    return lines
