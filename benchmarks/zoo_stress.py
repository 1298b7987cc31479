"""The zoo under stress, and beside it VIS-R's policies by BPTT's preset `nominal`, which have no memory.

    python benchmarks/zoo_stress.py [--tasks hover land track race]
    python benchmarks/zoo_stress.py --tasks gap hover_aware
    python benchmarks/zoo_stress.py --by-sight

Percent of 250 starts in each row, of the worst criterion. The last rows are from laws that no training draws from. The
zoo's figures are those of zoo.json, which `benchmarks/zoo.py` has measured; the others are trained here (seed 0), for
the usual four tasks. `--by-sight`: the tasks with cameras.
"""

import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from common import arguments, table, write
from zoo import PER_ROW

import e2efly
from e2efly.environment.stress_rows import ROWS, rows_for
from e2efly.policy.zoo import contents
from e2efly.tasks import TASKS
from e2efly.validation.stress import stress
from e2efly.validation.stress_laws import LAWS
from e2efly.vehicles.loading import vehicle_names


def _by_criterion(columns: Iterable[str], called: str, of: Callable[[Any], dict[str, float]], scale: float) -> Any:
    """A line of the table: a figure of each criterion, in the nominal world."""
    zoo, row = contents(), {"row": f"{called}, each criterion"}
    for name in columns:
        task, vehicle = name.split(", ")
        row[name] = ", ".join(f"{criterion} {scale * x:.1f}" for criterion, x in of(zoo[vehicle][task]).items())
    return row


def main() -> None:
    """Train what has no memory, print the table, write the figures."""
    usual = ["hover", "land", "track", "race"]
    options = arguments(__doc__ or "", tasks=usual, by_sight=False)
    zoo, columns = contents(), {}
    for task in [task for task in TASKS if TASKS[task].cameras] if options.by_sight else options.tasks:
        for vehicle in vehicle_names():
            if "stress" in zoo[vehicle].get(task, {}):
                about = zoo[vehicle][task]
                columns[f"{task}, {vehicle}"] = about["stress"] | about.get("untrained", {})
        if task in usual:
            with tempfile.TemporaryDirectory() as folder:
                e2efly.train(task, "bptt", preset_name="nominal", out=Path(folder) / "run")
                columns[f"{task}, vis_r, preset nominal"] = stress(Path(folder) / "run", PER_ROW).success
    rows = [
        {"row": row} | {name: f"{100 * found[row]:.1f}" if row in found else "-" for name, found in columns.items()}
        for row in (*(ROWS if options.by_sight else rows_for(())), *LAWS)
    ]
    if options.by_sight:
        rows += [_by_criterion(columns, "success of 1000 starts", lambda about: about["success"], 100)]
        rows += [_by_criterion(columns, "mean speed, m/s", lambda about: about["mean_speed_m_s"], 1)]
    name = "zoo_stress" if options.tasks == usual else f"zoo_stress_{'_'.join(options.tasks)}"
    name = "zoo_stress_by_sight" if options.by_sight else name
    write(name, options.json, {"table": rows, "success": columns})
    print(table(rows))


if __name__ == "__main__":
    main()
