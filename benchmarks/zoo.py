"""Train the policy zoo: the best preset of each task for each vehicle, kept as package data with its success and the
configuration and the curve of its training.

    python benchmarks/zoo.py [--vehicles vis_r ...] [--tasks hover ...] [--seeds 3]
    python benchmarks/zoo.py --digests
    python benchmarks/zoo.py --again [--missing]
    python benchmarks/zoo.py --runs DIR ...
    python benchmarks/zoo.py --images
    python benchmarks/zoo.py --domains

The preset is `robust` where the task has it. The best of at most `seeds` runs by each algorithm is kept, if it succeeds
more often than not; none more is made once one meets 99.5 %, or a robust one 97 % in its worst row of the stress. What
is best the runs' own reports say, and of robust ones those rows, from starts of their own; of a family's, unseen
vehicles in still air. The rows from laws that no training draws from choose nothing. The success that is stated is that
of the lone ONNX file, of the 1000 starts of `e2efly eval` and `eval --stress`, which nothing was chosen by; in the
rows, of the first 250 of them; of a policy that sees, in those rows alone that trainings draw from.

`--again` trains nothing: it flies the robust policies that are there in all rows of the stress, or with `--missing` in
those that zoo.json does not have, and all at once.
`--runs` trains nothing: it keeps the policies of finished runs, by the presets that are meant here.
`--images` trains nothing: it keeps images of the starts of the policies that see, which have none beside them.
`--domains` trains nothing: it writes into the contract of each file that says nothing of its courses, vehicles or
sensing the ranges of the configuration beside it, by which it was trained; the graph with its weights stays, byte by
byte.
`--digests` trains nothing: it gives the files that are there their digests, where they have none, and writes the digest
of each file into zoo.json.
"""

import dataclasses
import hashlib
import itertools
import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

import jax
import numpy as np
import onnx
from common import arguments, table

from e2efly.config import TrainConfig
from e2efly.config.algorithms import EXPERT
from e2efly.config.storage import write_json
from e2efly.environment.limits import posterior_of, sensing_of, vehicles_of
from e2efly.environment.stress_rows import ALL, rows_for
from e2efly.flight.sight.samples import COUNT, packed, samples_file
from e2efly.learning.judge import worst_success
from e2efly.learning.onnx_export import write_policy
from e2efly.policy.loader import load_policy
from e2efly.policy.onnx_file import is_sealed
from e2efly.policy.zoo import FOLDER, USUAL, config_file, contents, curve_file, shipped_name
from e2efly.runs import presets
from e2efly.runs.inputs import from_json, to_json
from e2efly.runs.rundir import RunDirectory
from e2efly.tasks import TASKS
from e2efly.validation.candidate import candidate
from e2efly.validation.stress import every_row
from e2efly.vehicles.family import family_names
from e2efly.vehicles.loading import load_vehicle, vehicle_names

VARIANTS = {
    "race_any": ("race", "any_track", "bptt"), "hover_rotors": ("hover", "rotors", "bptt"),
    "race_told": ("race_eyes", "told", "bptt"),
}  # fmt: skip
"""Policies of a task by a preset of its own: task, preset and algorithm."""
ALONE = {
    "race_any": USUAL, "race_clutter_room": USUAL, "dodge": USUAL, "hall": USUAL, "hover_payload": USUAL,
    "race_duel": USUAL, "swap": USUAL, "race_told": USUAL, "race_eyes": USUAL, "hover_rotors": presets.FAMILY,
}  # fmt: skip
"""For this vehicle alone."""
FRAMES = "multirotor"
"""The family that has a policy of hover alone."""
SEEING = (USUAL, "vis_h", presets.FAMILY)
"""Vehicles that have policies by sight: the paper's, one with a camera and one in virtual worlds, and any."""
PER_ROW = 250
"""Starts per row of the stress."""
ENOUGH, ENOUGH_STRESSED, WORTH = 0.995, 0.97, 0.5
POINTS = 200
"""Evaluations that are kept of a training, for its curve."""
CHOSEN_BY = 2_000_000
"""Seed of the starts that a robust policy is chosen by."""


def run(*command: str) -> None:
    """A command of ours."""
    subprocess.run([sys.executable, "-m", "e2efly", *command], stdout=subprocess.DEVNULL, check=True)


def algorithms(task: str) -> tuple[str, ...]:
    """What is tried, in this order."""
    return (VARIANTS[task][2] if task in VARIANTS else TASKS[task].best,)


def stressed(policy: Path, folder: Path, *options: str) -> dict[str, dict[str, float]]:
    """Success of the worst criterion in each row of the stress: `stress`, the rows that trainings draw from, and
    `untrained`, the rows from laws that none draws from.
    """
    report = folder / "stress.json"
    run("eval", str(policy), "--stress", "--json", str(report), "--plots", str(folder / "plots"), *options)
    said = json.loads(report.read_text())
    return {
        kind: {row: min(found["success"] for found in criteria.values()) for row, criteria in said[kind].items()}
        for kind in ("stress", "untrained")
    }


def measured(task: str, known: Collection[str] = ()) -> tuple[str, ...]:
    """The options of the stress that zoo.json tells: all rows but the known ones. Of a policy that sees, which takes
    minutes, those rows alone that trainings draw from.
    """
    cameras = TASKS[task].cameras if task in TASKS else ()
    rows = rows_for(cameras) if cameras else every_row(cameras)
    new = [row for row in rows if row not in known or row == ALL]  # all at once has the new ones, too
    return ("--episodes", str(PER_ROW), "--rows", *new)


def recipe(vehicle: str, task: str) -> tuple[str, str]:
    """The task that a policy is of, and the preset by which it is learned; empty: the one that `train` takes."""
    kind, own, _ = VARIANTS.get(task, (task, "", ""))
    alone = presets.ROBUST if TASKS[kind].best in TASKS[kind].robust else presets.NOMINAL
    return kind, own or ("" if vehicle in family_names() else alone)


def trained(vehicle: str, task: str, algo: str, seed: int, out: Path) -> None:
    """Train a run into a folder."""
    kind, name = recipe(vehicle, task)
    preset = ("--preset", name) if name else ()
    options = ("--vehicle", vehicle, "--seed", str(seed), "--out", str(out), "--no-plots")
    run("train", kind, "--algo", algo, *preset, *options)


def judged(vehicle: str, task: str, out: Path, folder: Path, chosen: bool = True) -> tuple[float, dict[str, Any]]:
    """What there is to say of a run, and what it is chosen by among others, where it is: its worst success by its own
    report or, of a robust one, in the rows.
    """
    report, together, (_, name) = folder / "report.json", vehicle in family_names(), recipe(vehicle, task)
    lone = shutil.copy(out / "policy.onnx", folder / "lone.onnx")  # without its run: on the vehicle of its contract
    run("eval", str(lone), "--json", str(report), "--plots", str(folder / "plots"))
    suites = json.loads(report.read_text())["criteria"]
    summary = json.loads((out / "summary.json").read_text())
    reported = worst_success(summary.get("nominal", summary["shipped"]) if together else summary["shipped"])
    more: dict[str, Any] = {"preset": name or "robust"} if name or together else {}
    if name == "robust":
        if chosen:
            options = ("--episodes", str(PER_ROW), "--seed", str(CHOSEN_BY), "--rows", *rows_for(TASKS[task].cameras))
            rows = stressed(out / "policy.onnx", folder, *options)["stress"]
            at_once = rows.pop(ALL)
            reported = min(rows.values()) + 1e-3 * at_once  # among equals the one that stands all at once more often
        if TASKS[task].cameras:
            more |= {"mean_speed_m_s": {name: suite["mean_speed_m_s"] for name, suite in suites.items()}}
        more |= stressed(out / "policy.onnx", folder, *measured(task))
    return reported, {
        "algorithm": summary["algorithm"],
        "seed": summary["seed"],
        "env_steps": summary["env_steps"],
        "version": summary["versions"]["e2efly"],
        "success": {name: suite["success"] for name, suite in suites.items()},
        **more,
    }


def keep(vehicle: str, task: str, policy: Path, about: dict[str, Any]) -> dict[str, Any]:
    """Copy a policy into the zoo, and say so; a line for the table."""
    kept = FOLDER / vehicle / f"{task}.onnx"
    kept.parent.mkdir(exist_ok=True)
    shutil.copy(policy, kept)
    if (seen := samples_file(policy)).is_file():
        shutil.copy(seen, samples_file(kept))
    config = RunDirectory(policy.parent).config()
    if config.start_from is not None:
        config = dataclasses.replace(config, start_from=of_the_zoo(config.start_from))
    if (teacher := getattr(config.algo, "teacher", EXPERT)) != EXPERT:
        config = dataclasses.replace(config, algo=dataclasses.replace(config.algo, teacher=of_the_zoo(teacher)))
    write_json(config_file(kept), to_json(config), indent=None)
    curve_file(kept).write_text(curve(RunDirectory(policy.parent)), encoding="utf-8")
    zoo = contents() if (FOLDER / "zoo.json").exists() else {}
    zoo.setdefault(vehicle, {})[task] = about
    write(zoo)
    success = " ".join(f"{100 * share:.1f}" for share in about["success"].values())
    line = {"vehicle": vehicle, "task": task, "success, %": success, "kB": kept.stat().st_size // 1000}
    print(line, flush=True)
    return line


def named(config: TrainConfig) -> str:
    """The name of a run's policy: its task, or the variant whose preset has the same task, commands and cameras."""

    def flies(config: TrainConfig) -> tuple[Any, ...]:
        return config.task, config.env.command_mode, config.env.cameras

    variants = ((name, presets.preset(task, algo, preset)) for name, (task, preset, algo) in VARIANTS.items())
    return next((name for name, its in variants if flies(its) == flies(config)), config.task.name)


def of_the_zoo(file: str) -> str:
    """The name of a policy of the zoo, wherever the zoo is."""
    if name := shipped_name(Path(file).read_bytes()):
        return name
    raise SystemExit(f"a run was made from {file}; accepted: a policy of the zoo, as it is now")


def curve(run: RunDirectory) -> str:
    """The evaluations of a training as CSV, at most `POINTS` of them, the last among them: environment steps, seconds
    from the process's start, success of each criterion.
    """
    rows = [row for row in run.rows() if "seconds" in row]
    rows = rows[:: -max(1, -(-len(rows) // POINTS))][::-1]
    suites = [name for name in rows[0] if name.startswith("eval/") and name.endswith("/success")]
    lines = [",".join(["steps", "seconds", *(name.split("/")[1] for name in suites)])]
    lines += [
        ",".join([f"{row['steps']:.0f}", f"{row['seconds']:.1f}", *(f"{row[s]:g}" for s in suites)]) for row in rows
    ]
    return "\n".join([*lines, ""])


def starts_of(policy: Path) -> dict[str, np.ndarray]:
    """What a policy sees at starts of its first criterion, by the names of its images; empty: nothing."""
    found = candidate(policy)
    if not (images := found.policy.contract.images):
        return {}
    env = found.environment(next(iter(found.task.criteria().values())))
    state, _ = env.reset(jax.random.key(0), COUNT)
    return {image.name: np.asarray(x) for image, x in zip(images, state.images, strict=True)}


def declare(file: Path) -> None:
    """Let the contract of a file say for which courses, vehicles and sensing it was trained, if it does not."""
    config = from_json(json.loads(config_file(file).read_text()), str(config_file(file)))
    contract, graph = load_policy(file).contract, onnx.load(file).graph
    sensing = contract.sensing or sensing_of(config.env, contract.latency_range_s, contract.control_rate_hz)
    about = {"courses": contract.courses or config.task.domain(), "vehicles": contract.vehicles, "sensing": sensing}
    if not contract.of_family and contract.vehicles is None:
        vehicle = load_vehicle(config.env.vehicle)
        assert vehicle.hash == contract.vehicle_hash, file
        about["vehicles"] = vehicles_of(config.env, vehicle, posterior_of(config.env))
    if (declared := dataclasses.replace(contract, **about)) != contract:
        write_policy(file, graph, declared)
        assert onnx.load(file).graph.SerializeToString() == graph.SerializeToString(), file
        print(file.relative_to(FOLDER), len(declared.domain), "ranges", flush=True)


def write(zoo: dict[str, dict[str, dict[str, Any]]]) -> None:
    """zoo.json, with the digest of each file."""
    for vehicle, tasks in zoo.items():
        for task, about in tasks.items():
            about["sha256"] = hashlib.sha256((FOLDER / vehicle / f"{task}.onnx").read_bytes()).hexdigest()
    write_json(FOLDER / "zoo.json", json.loads(json.dumps(zoo, sort_keys=True)))


def main() -> None:
    """Train, keep the policies and zoo.json, print a table."""
    every, policies = [*vehicle_names(), *family_names()], [*TASKS, *VARIANTS]
    options = arguments(
        __doc__ or "",
        vehicles=every,
        tasks=policies,
        seeds=3,
        digests=False,
        domains=False,
        again=False,
        missing=False,
        images=False,
        runs=[],
    )
    if options.digests:
        for file in FOLDER.glob("*/*.onnx"):
            if not is_sealed(file.read_bytes()):
                run("export", str(file))
        write(contents())
        return
    if options.domains:
        for file in sorted(FOLDER.glob("*/*.onnx")):
            declare(file)
        write(contents())
        return
    if options.images:
        for file in FOLDER.glob("*/*.onnx"):
            if not samples_file(file).exists() and (images := starts_of(file)):
                samples_file(file).write_bytes(packed(images))
        return
    if options.again:
        zoo = contents()
        for vehicle, task in itertools.product(options.vehicles, options.tasks):
            about = zoo[vehicle].get(task, {})
            if about.get("preset") == "robust" and vehicle not in family_names():
                with tempfile.TemporaryDirectory() as folder:
                    known = {*about["stress"], *about.get("untrained", ())} if options.missing else ()
                    found = stressed(FOLDER / vehicle / f"{task}.onnx", Path(folder), *measured(task, known))
                if options.missing:
                    found = {kind: about.get(kind, {}) | rows for kind, rows in found.items()}
                about |= {kind: rows for kind, rows in found.items() if rows}
                write(contents() | {vehicle: contents()[vehicle] | {task: about}})
                print(vehicle, task, f"{about['stress'][ALL]:.3f} {ALL}", flush=True)
        return
    rows = []
    for out in map(Path, options.runs):
        with tempfile.TemporaryDirectory() as folder:
            config = RunDirectory(out).config()
            vehicle, task = config.env.vehicle, named(config)
            _, about = judged(vehicle, task, out, Path(folder), chosen=False)
            rows.append(keep(vehicle, task, out / "policy.onnx", about))
    for vehicle in () if options.runs else options.vehicles:
        for task in options.tasks:
            if vehicle != ALONE.get(task, vehicle):
                continue
            if task in TASKS and TASKS[task].cameras and vehicle not in SEEING:
                continue
            if vehicle == FRAMES and task != "hover":
                continue
            if vehicle in family_names() and algorithms(task)[0] not in TASKS[recipe(vehicle, task)[0]].family:
                continue
            with tempfile.TemporaryDirectory() as folder:
                highest, best, policy = -1.0, {}, Path()
                for seed, algo in itertools.product(range(options.seeds), algorithms(task)):
                    out = Path(folder) / f"{algo}{seed}"
                    trained(vehicle, task, algo, seed, out)
                    reported, found = judged(vehicle, task, out, Path(folder))
                    if reported > highest:
                        highest, best, policy = reported, found, out / "policy.onnx"
                    if highest >= (ENOUGH if "stress" not in best else ENOUGH_STRESSED):
                        break
                if min(best["success"].values()) < WORTH:
                    print(f"{vehicle} {task}: {best['success']}, not kept", flush=True)
                    continue
                rows.append(keep(vehicle, task, policy, best))
    print(table(rows))


if __name__ == "__main__":
    main()
