"""Policies of the PPO presets, flown by the bridge's runtime in MuJoCo and in our simulator, from the same starts.

python benchmarks/sim_to_sim.py [--tasks hover ...] [--plants mujoco simulator] [--episodes 200] [--runs FOLDER]
                                [--json FILE]

`--runs` names a folder of finished runs, FOLDER/TASK; left out, each task is trained anew (some 20 s).
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

from common import arguments, table, write

from e2efly.validation.plant_validation import validate

TASKS = ["hover", "land", "track", "race"]


def train(task: str, folder: Path) -> Path:
    """A run of the task's preset."""
    out = folder / task
    command = [
        sys.executable,
        "-m",
        "e2efly",
        "train",
        task,
        "--algo",
        "ppo",
        "--preset",
        "nominal",
        "--out",
        str(out),
        "--no-plots",
        "--device",
        "cpu",
    ]
    subprocess.run(command, env=os.environ, stdout=subprocess.DEVNULL, check=True)
    return out


def _both(a: dict, b: dict, name: str) -> str:
    return f"{100 * a[name]:.2f} / {100 * b[name]:.2f}"


def main() -> None:
    """Train, fly, print a table, write JSON; exit status 1 when success drops by more than 2 points anywhere."""
    options = arguments(__doc__ or "", tasks=TASKS, plants=["mujoco", "simulator"], episodes=200, runs=None)
    rows, reports, failed = [], [], False
    with tempfile.TemporaryDirectory() as folder:
        for task in options.tasks:
            run = Path(options.runs) / task if options.runs else train(task, Path(folder))
            for plant in options.plants:
                found = validate(run, plant, options.episodes)
                failed |= not found.passed
                report = found.as_json()
                for name, criterion in report["criteria"].items():
                    del criterion["starts"]
                    a, b = criterion["training"], criterion[plant]
                    rows.append(
                        {
                            "criterion": name,
                            "plant": plant,
                            "success in training's simulator": f"{100 * a['success']:.1f} %",
                            "on the plant": f"{100 * b['success']:.1f} %",
                            "drop, points": f"{criterion['drop']:.1f}",
                            "final error, cm": _both(a, b, "final_error_m"),
                            "mean error, cm": _both(a, b, "mean_error_m"),
                        }
                    )
                    print(rows[-1], flush=True)
                del report["policy"]
                reports.append(report)
    write("sim_to_sim", options.json, {"episodes": options.episodes, "table": rows, "reports": reports})
    print(table(rows))
    sys.exit(failed)


if __name__ == "__main__":
    main()
