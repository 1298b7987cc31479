"""Train the policy zoo: the default preset of each task for each vehicle, kept as package data with its success.

    python benchmarks/zoo.py [--vehicles vis_r ...] [--tasks hover ...] [--seeds 3]
    python benchmarks/zoo.py --digests

The best of at most `seeds` runs by each algorithm is kept, if it succeeds more often than not; none more is made once
one meets 99.5 %. What is best the runs' own reports say. The success that is stated is that of the ONNX file itself, of
the 1000 starts of `e2efly eval`, which nothing was chosen by.

`--digests` trains nothing: it gives the files that are there their digests, where they have none, and writes the digest
of each file into zoo.json.
"""

import hashlib
import itertools
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from common import arguments, table

from e2efly.deploy.onnx_file import is_sealed
from e2efly.storage import write_json
from e2efly.tasks import TASKS
from e2efly.vehicles import vehicle_names
from e2efly.zoo import FOLDER, USUAL, contents

BY_SIGHT = ("land_visual", "avoid", "race_clutter")
"""For the usual vehicle alone: what a camera sees depends little on who carries it, and they take minutes."""
ENOUGH, WORTH = 0.995, 0.5


def run(*command: str) -> None:
    """A command of ours."""
    subprocess.run([sys.executable, "-m", "e2efly", *command], stdout=subprocess.DEVNULL, check=True)


def algorithms(task: str) -> tuple[str, ...]:
    """What is tried, in this order."""
    return ("bptt", "foppo") if task in ("hover", "land", "track", "race") else (TASKS[task].best,)


def trained(vehicle: str, task: str, algo: str, seed: int, folder: Path) -> tuple[float, dict[str, Any]]:
    """A run in `folder`: its worst success by its own report, and what there is to say of its policy."""
    out, report = folder / f"{algo}{seed}", folder / "report.json"
    run("train", task, "--algo", algo, "--vehicle", vehicle, "--seed", str(seed), "--out", str(out), "--no-plots")
    run("eval", str(out / "policy.onnx"), "--json", str(report), "--plots", str(folder / "plots"))
    suites = json.loads(report.read_text())["criteria"]
    summary = json.loads((out / "summary.json").read_text())
    reported = min(suite["success"] for name, suite in summary["shipped"].items() if name != "update")
    return reported, {
        "algorithm": algo,
        "seed": seed,
        "env_steps": summary["env_steps"],
        "version": summary["versions"]["e2efly"],
        "success": {name: suite["success"] for name, suite in suites.items()},
    }


def write(zoo: dict[str, dict[str, dict[str, Any]]]) -> None:
    """zoo.json, with the digest of each file."""
    for vehicle, tasks in zoo.items():
        for task, about in tasks.items():
            about["sha256"] = hashlib.sha256((FOLDER / vehicle / f"{task}.onnx").read_bytes()).hexdigest()
    write_json(FOLDER / "zoo.json", json.loads(json.dumps(zoo, sort_keys=True)))


def main() -> None:
    """Train, keep the policies and zoo.json, print a table."""
    options = arguments(__doc__ or "", vehicles=vehicle_names(), tasks=list(TASKS), seeds=3, digests=False)
    if options.digests:
        for file in FOLDER.glob("*/*.onnx"):
            if not is_sealed(file.read_bytes()):
                run("export", str(file))
        write(contents())
        return
    rows = []
    for vehicle in options.vehicles:
        for task in options.tasks:
            if task in BY_SIGHT and vehicle != USUAL:
                continue
            with tempfile.TemporaryDirectory() as folder:
                highest, best = -1.0, {}
                for seed, algo in itertools.product(range(options.seeds), algorithms(task)):
                    reported, found = trained(vehicle, task, algo, seed, Path(folder))
                    if reported > highest:
                        highest, best = reported, found
                    if highest >= ENOUGH:
                        break
                if highest < WORTH:
                    print(f"{vehicle} {task}: {best['success']}, not kept", flush=True)
                    continue
                kept = FOLDER / vehicle / f"{task}.onnx"
                kept.parent.mkdir(exist_ok=True)
                shutil.copy(Path(folder) / f"{best['algorithm']}{best['seed']}" / "policy.onnx", kept)
            zoo = contents() if (FOLDER / "zoo.json").exists() else {}
            zoo.setdefault(vehicle, {})[task] = best
            write(zoo)
            success = " ".join(f"{100 * share:.1f}" for share in best["success"].values())
            rows.append({"vehicle": vehicle, "task": task, "success, %": success, "kB": kept.stat().st_size // 1000})
            print(rows[-1], flush=True)
    print(table(rows))


if __name__ == "__main__":
    main()
