"""The tasks flown by sight: trained, then flown in every row of the stress, of the vehicle and of its eyes.

    python benchmarks/visual_tasks.py [--cases land_visual avoid ...] [--algos bptt ppo] [--seeds 3] [--episodes 1000]

A case is a task, with the name of a vehicle other than the VIS-R behind a colon; its preset is the one that `train`
takes by itself. Seconds are from the start of the training process, with an empty compilation cache. What is flown is
policy.onnx, from unseen starts and in unseen worlds. Rows of the file that are not measured anew stay.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from common import arguments, table, with_earlier, write

from e2efly.environment.episodes import summary
from e2efly.environment.stress_rows import ALL
from e2efly.runs.rundir import RunDirectory
from e2efly.validation.stress import stress

CASES = ["land_visual", "avoid", "race_clutter", "race_clutter:vis_h"]
NOISE = "noise of a D435i"


def train(case: str, algo: str, seed: int, out: Path) -> dict[str, Any]:
    """The summary of a full run of the preset."""
    task, _, vehicle = case.partition(":")
    command = [
        sys.executable, "-m", "e2efly", "train", task, "--algo", algo, "--seed", str(seed), "--out", str(out),
        "--no-plots", "--device", "cpu", *(["--vehicle", vehicle] if vehicle else []),
    ]  # fmt: skip
    with tempfile.TemporaryDirectory() as cache:
        subprocess.run(command, env=os.environ | {"XDG_CACHE_HOME": cache}, stdout=subprocess.DEVNULL, check=True)
    return RunDirectory(out).read_json("summary.json")


def run(case: str, algo: str, seed: int, episodes: int) -> dict[str, Any]:
    """One training, and its policy in all rows: a summary by row and criterion."""
    with tempfile.TemporaryDirectory() as folder:
        told = train(case, algo, seed, Path(folder) / "run")
        found = stress(Path(folder) / "run", episodes).trained
    flown = {row: {name: summary(e) for name, e in of.items()} for row, of in found.flown.items()}
    return {"case": case, **told, "flown": flown}


def row(case: str, algo: str, criterion: str, runs: list[dict[str, Any]]) -> dict[str, str]:
    """A line of the table: what each seed came to."""

    def each(show: Any) -> str:
        return " ".join(show(one["flown"], one) for one in runs)

    def percent(of: str) -> str:
        return each(lambda flown, _: f"{100 * flown[of][criterion]['success']:.1f}" if of in flown else "-")

    def worst(flown: dict[str, Any], _: Any) -> str:
        return f"{100 * min(found[criterion]['success'] for name, found in flown.items() if name != ALL):.1f}"

    def nominal(of: str, digits: int = 1) -> str:
        return each(lambda flown, _: f"{flown['nominal'][criterion][of] or float('nan'):.{digits}f}")

    return {
        "algorithm": algo,
        "task": case if criterion == case.partition(":")[0] else f"{case}, {criterion}",
        "nominal, %": percent("nominal"),
        "with a D435i's noise, %": percent(NOISE),
        "worst row, %": each(worst),
        "all at once, %": percent(ALL),
        "time of a success, s": nominal("seconds_of_success"),
        "mean speed, m/s": nominal("mean_speed_m_s"),
        "top speed, m/s": nominal("top_speed_m_s"),
        "trained, s": each(lambda _, one: f"{one['seconds_trained_from_process_start']:.0f}"),
        "steps, M": each(lambda _, one: f"{one['env_steps'] / 1e6:.1f}"),
    }


def main() -> None:
    """Train, print a table, write JSON."""
    options = arguments(__doc__ or "", cases=CASES, algos=["bptt", "ppo"], seeds=3, episodes=1000)
    rows = []
    for algo in options.algos:
        for case in options.cases:
            runs = [run(case, algo, seed, options.episodes) for seed in range(options.seeds)]
            rows += [row(case, algo, criterion, runs) for criterion in runs[0]["flown"]["nominal"]]
            print(rows[-1], flush=True)
            whole = with_earlier("visual_tasks", options.json, "table", ("algorithm", "task"), rows)
            every = with_earlier("visual_tasks", options.json, "runs", ("algorithm", "case"), runs)
            write("visual_tasks", options.json, {"table": whole, "runs": every})
    print(table(rows))


if __name__ == "__main__":
    main()
