"""The paper's experiments: every table and figure that needs no vehicle, ours beside theirs, with a verdict a claim.

    python benchmarks/paper.py EXPERIMENT... [--seeds N] [--tasks hover ...] [--algos bptt ...] [--variants TEXT ...]
                               [--most STEPS] [--stop SUCCESS] [--device cpu|gpu] [--runs FOLDER] [--again] [--short]
                               [--add FILE ...] [--json FILE]
    python benchmarks/paper.py                # judges anew what is there already

Each training is a process of `e2efly train`. What a run came to is written at once. A finished run is not repeated but
with `--again`, and a training that was killed goes on from its checkpoint in --runs.

`--most` stops a training in order once it has taken so many steps. `--stop` stops it once its success has stayed at a
level for a few evaluations: that answers whether it learns and when, but not what its rewards come to after all its
steps. A run that was stopped counts with the steps that it has, and a later command without the option goes on.

`--short` makes the first run or two of each experiment in seconds, with sizes that teach nothing. Experiments, runs and
rules of the verdicts: `benchmarks/claims`.
"""

import argparse
import json
import math
import tempfile
from pathlib import Path
from typing import Any

from claims import EXPERIMENTS
from claims.experiment import Experiment, Run
from claims.found import Found
from claims.rule import judge
from claims.running import HELD, LEVELS, How, key, make, wanted
from common import RESULTS, machine, table, today, write_rows

from e2efly.config.storage import held

FILE = RESULTS / "paper.json"


def results(name: str) -> dict[str, Any] | None:
    """What another benchmark has measured."""
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text()) if path.exists() else None


def read(path: Path) -> dict[str, Any]:
    """By experiment: its runs, and the machine and the day of the last of them; null without any."""
    known = json.loads(path.read_text()) if path.exists() else {}
    nothing = {"machine": None, "date": None, "runs": []}
    return {name: {part: known.get(name, nothing)[part] for part in nothing} for name in EXPERIMENTS}


def joined(known: dict[str, Any], other: dict[str, Any]) -> dict[str, Any]:
    """All runs of two files; of one that both have, that of the other file. Machine and day are the newest."""
    out = {}
    for name, own in known.items():
        anew = {key(one) for one in other[name]["runs"]}
        kept = [one for one in own["runs"] if key(one) not in anew]
        newest = max(own, other[name], key=lambda part: part["date"] or "")
        out[name] = {**newest, "runs": [*kept, *other[name]["runs"]]}
    return out


def judged(experiment: Experiment, runs: list[Any]) -> dict[str, Any]:
    """What an experiment is, and what its runs come to: its claims with verdicts, and its table."""
    found = Found(runs, results)
    verdicts = [(claim, judge(claim, found)) for claim in experiment.claims]
    return {
        "title": experiment.title,
        "where": experiment.where,
        "about": experiment.about.strip(),
        "made_of": {name: known["date"] for name in experiment.made_of if (known := results(name))},
        "claims": [
            {
                "the paper": c.says,
                "theirs": c.theirs,
                "verdict": v.word,
                "why": v.why,
                "cases": v.cases,
                "invented": v.invented,
                **v.measured,
            }
            for c, v in verdicts
        ],
        "table": experiment.rows(found),
    }


def write(path: Path, known: dict[str, Any]) -> None:
    """Judge all experiments anew, and write them."""
    path.parent.mkdir(parents=True, exist_ok=True)
    parts = {name: {**known[name], **judged(of, known[name]["runs"])} for name, of in EXPERIMENTS.items()}
    write_rows(path, parts)


def asked(experiment: Experiment, options: argparse.Namespace) -> list[tuple[Run, int]]:
    """The runs that the options ask for, with their seeds: all runs of a seed come before the next seed's."""
    runs = [
        run
        for run in experiment.runs
        if (not options.tasks or run.task in options.tasks)
        and (not options.algos or run.algo in options.algos)
        and (not options.variants or any(text in run.variant for text in options.variants))
    ]
    runs = runs[: experiment.short] if options.short else runs
    seeds = range(1 if options.short else options.seeds or experiment.seeds)
    return [(run, seed) for seed in seeds for run in runs if seed < most(run, len(seeds))]


def most(run: Run, seeds: int) -> int:
    """How many of the seeds a run has: a training each of them, if it has no limit of its own."""
    return 1 if run.kind != "train" else seeds if run.seeds is None else min(seeds, run.seeds)


def parsed() -> argparse.Namespace:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = parser.add_argument
    add("experiments", nargs="*", metavar="EXPERIMENT", help=f"of {', '.join(EXPERIMENTS)}")
    add("--seeds", type=int, help="of each run; left out: as many as the experiment has")
    add("--tasks", nargs="*", default=[], help="these alone")
    add("--algos", nargs="*", default=[], help="these alone: bptt, ppo, zoo")
    add("--variants", nargs="*", default=[], help="those alone whose names hold one of these texts")
    add("--most", type=float, default=math.inf, help="stop a training after so many environment steps")
    add(
        "--stop", type=float, choices=LEVELS, help=f"stop a training once its success stays so high: {HELD} evaluations"
    )
    add("--device", choices=["cpu", "gpu"], default="cpu", help="where to train; left out: cpu")
    add(
        "--runs",
        type=Path,
        help="folder of the trainings, which a later command takes or goes on with; left out: a temporary one",
    )
    add("--again", action="store_true", help="repeat what is there already")
    add("--short", action="store_true", help="a tiny run or two of each experiment")
    add("--add", type=Path, nargs="*", default=[], help="files of other runs, which join those of --json")
    add("--json", type=Path, default=FILE, help=f"the figures; left out: {FILE.name} beside the others")
    options = parser.parse_args()
    for name in options.experiments:
        if name not in EXPERIMENTS:
            parser.error(f"EXPERIMENT is {name!r}; accepted: {', '.join(EXPERIMENTS)}")
    return options


def main() -> None:
    """Make what is asked for, judge, print the tables, write JSON."""
    options = parsed()
    with tempfile.TemporaryDirectory() as folder:
        how = How(
            options.runs or Path(folder),
            short=options.short,
            most=options.most,
            stop=options.stop,
            device=options.device,
        )
        with held(how.folder):
            for name in options.experiments:
                measure(EXPERIMENTS[name], options, how)
    known = read(options.json)
    for file in options.add:
        known = joined(known, read(file))
    write(options.json, known)
    for name in options.experiments or EXPERIMENTS:
        result = judged(EXPERIMENTS[name], known[name]["runs"])
        words = [
            {part: claim[part] for part in ("the paper", "theirs", "verdict", "why")} for claim in result["claims"]
        ]
        print(f"\n{EXPERIMENTS[name].title}\n\n{table(words)}")
        if result["table"]:
            print(f"\n{table(result['table'])}")


def measure(experiment: Experiment, options: argparse.Namespace, how: How) -> None:
    """Make the runs of an experiment that are not there yet; write each at once."""
    seeds = 1 if options.short else options.seeds or experiment.seeds
    for run, seed in asked(experiment, options):
        known = read(options.json)
        own = known[experiment.name]
        if not options.again and not wanted(run, seed, seeds, own["runs"], how):
            continue
        told = {**make(run, seed, seeds, how), "date": today(), "cpu": machine()["cpu"]}
        known = read(options.json)  # another process may have written meanwhile
        own = known[experiment.name]
        runs = [one for one in own["runs"] if key(one) != key(told)]
        known[experiment.name] = {"machine": machine(), "date": today(), "runs": [*runs, told]}
        write(options.json, known)
        print(f"{experiment.name}: {run.task} by {run.algo}, {run.variant}, seed {seed}: "
              f"{told['seconds']:.0f} s, finished: {told['finished']}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
