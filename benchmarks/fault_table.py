"""What the benchmarks of faults share: a hover policy, and one line a fault."""

import math
import os
import subprocess
import sys
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


def report(name: str, file: str | None, rows: list[dict[str, Any]], took: float) -> None:
    """Write the figures, print the table, and end with status 1 when any row has problems."""
    lines = summary(rows)
    write(name, file, {"table": lines, "faults": rows, "took_s": took})
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
