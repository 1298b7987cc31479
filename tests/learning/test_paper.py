"""The paper's experiments, in their short versions: what they write, what they do not repeat, what they make of it."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import QUICK

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

import paper  # noqa: E402
from claims import EXPERIMENTS  # noqa: E402
from claims.ablations import missed, without  # noqa: E402
from claims.alignment import NOMINAL  # noqa: E402
from claims.experiment import (  # noqa: E402
    CONFIRMED,
    NOTHING,
    REFUTED,
    UNMEASURED,
    UNTESTABLE,
    Found,
    Run,
    Verdict,
)
from claims.learning import LEARNING, OWN, TASKS  # noqa: E402
from claims.running import SHORT, SMALL, How, converged, figures, process, trained, wanted  # noqa: E402

WITH_RUNS = [name for name, experiment in EXPERIMENTS.items() if experiment.runs]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the trainings, which the experiments share."""
    return tmp_path_factory.mktemp("paper")


def command(*words: str, file: Path, runs: Path) -> list[str]:
    return [sys.executable, str(BENCHMARKS / "paper.py"), *words, "--short", "--json", str(file), "--runs", str(runs)]


def environment() -> dict[str, str]:
    return {**os.environ, "XLA_FLAGS": f"{os.environ.get('XLA_FLAGS', '')} {QUICK}"}


def run(*words: str, file: Path, runs: Path) -> str:
    done = subprocess.run(
        command(*words, file=file, runs=runs), env=environment(), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.whole
@pytest.mark.parametrize("name", WITH_RUNS)
def test_the_short_version_of_an_experiment_gives_rows_and_verdicts(name: str, folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "paper.json"
    told = run(name, file=file, runs=folder)
    assert EXPERIMENTS[name].title in told
    found = json.loads(file.read_text())
    assert list(found) == list(EXPERIMENTS)
    part = found[name]
    assert len(part["runs"]) == EXPERIMENTS[name].short
    assert part["machine"]["cores"] and part["date"]
    assert all(one["finished"] for one in part["runs"])
    assert all(claim["verdict"] in (CONFIRMED, REFUTED, UNTESTABLE, UNMEASURED) for claim in part["claims"])
    assert len(part["table"]) > 1
    assert any(UNMEASURED in str(row) or "-" in row.values() for row in part["table"])  # the runs left out
    for one in part["runs"]:
        (asked,) = [r for r in EXPERIMENTS[name].runs if (r.task, r.algo, r.variant) == paper.key(one)[:3]]
        assert list(one["flights"]) == list(asked.flights)[:1]
        if asked.kind == "train":
            assert one["steps"] >= 256
            assert len(one["curve"]["reward"].split()) == len(one["curve"]["steps"].split()) > 1


@pytest.mark.whole
def test_what_was_killed_goes_on_where_it_was(folder: Path, tmp_path: Path) -> None:
    file = tmp_path / "paper.json"
    with subprocess.Popen(
        command("learning", file=file, runs=folder), env=environment(), start_new_session=True
    ) as running:
        while not (file.exists() and json.loads(file.read_text())["learning"]["runs"]):
            assert running.poll() is None
            time.sleep(0.01)
        os.killpg(running.pid, signal.SIGKILL)  # with the training that it waits for
    before = json.loads(file.read_text())["learning"]["runs"]
    (first,) = before[:1]
    run("learning", file=file, runs=folder)
    after = json.loads(file.read_text())["learning"]["runs"]
    assert after[: len(before)] == before
    assert [one["algo"] for one in after] == ["bptt", "ppo"]
    assert first == after[0]
    whole = file.read_bytes()
    run("learning", file=file, runs=folder)  # nothing is repeated
    assert file.read_bytes() == whole


@pytest.mark.whole
def test_a_training_that_was_stopped_goes_on_from_its_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XLA_FLAGS", environment()["XLA_FLAGS"])
    steps = 8_000
    longer = (*SHORT, *SMALL["ppo"], "--steps", str(steps))
    one, out = Run("hover", "ppo", "long", (*NOMINAL, *longer)), tmp_path / "run"
    first = trained(one, 0, out, How(tmp_path, most=1))
    assert not first["finished"]
    assert 0 < first["steps"] < steps
    known = [{"task": "hover", "algo": "ppo", "variant": "long", "seed": 0, **first}]
    assert not wanted(one, 0, 1, known, How(tmp_path, most=1))
    assert wanted(one, 0, 1, known, How(tmp_path, most=steps))
    assert wanted(one, 1, 2, known, How(tmp_path, most=1))
    second = trained(one, 0, out, How(tmp_path))
    assert second["finished"]
    assert second["steps"] >= steps
    assert second["cpu_seconds"] > first["cpu_seconds"] > 0
    assert not wanted(one, 0, 1, [{**known[0], **second}], How(tmp_path))
    assert figures(out) == second


def test_the_file_and_the_page_are_what_the_rules_say_of_the_runs() -> None:
    written = json.loads(paper.FILE.read_text())
    for name, experiment in EXPERIMENTS.items():
        judged = json.loads(json.dumps(paper.judged(experiment, written[name]["runs"])))
        assert {part: written[name][part] for part in judged} == judged


def test_a_reward_has_converged_where_it_stays() -> None:
    reward = [-10.0, -4.0, -1.0, -3.0, -1.0, -1.1, -1.0, -0.9, -1.0, -1.0]
    points = [{"steps": 10.0 * i, "seconds": 1.0 * i, "reward": x} for i, x in enumerate(reward)]
    assert converged(points) == {"steps": 40.0, "seconds": 4.0, "reward": -1.0}
    assert converged(points[:1])["steps"] == 0.0


def learned(algo: str, reached: float | None, **other: Any) -> dict[str, Any]:
    at = None if reached is None else {"steps": reached, "seconds": reached / 1e4}
    told: dict[str, Any] = {
        "task": "hover", "algo": algo, "variant": "identical rewards", "seed": 0, "finished": True, "steps": 1e7,
        "seconds": 1e3, "cpu_seconds": 1e3, "cores": 1, "reached": {"0.9": at},
        "shipped": {"hover": {"success": 1.0}}, "converged": {"reward": -1.0},
    }  # fmt: skip
    return told | other


def verdicts(bptt: dict[str, Any], *ppo: dict[str, Any]) -> list[str]:
    """The verdicts where all tasks have the same runs, PPO with either reward."""
    runs = [one | {"task": task} for task in TASKS for one in (bptt, *ppo)]
    runs += [one | {"task": task, "variant": OWN} for task in TASKS for one in ppo]
    return words(runs)


def words(runs: list[dict[str, Any]]) -> list[str]:
    return [claim.judge(Found(runs, lambda name: None)).word for claim in LEARNING.claims]


def test_verdicts_of_learning_follow_the_figures() -> None:
    assert words([]) == [NOTHING.word] * 6
    bptt, ppo = learned("bptt", 1e6), learned("ppo", 5e6, converged={"reward": -2.0})
    assert verdicts(bptt, ppo) == [CONFIRMED] * 6
    assert words([bptt, ppo]) == [UNMEASURED] * 6  # hover alone
    slower = learned("ppo", 2e6, converged={"reward": -0.5})
    assert verdicts(bptt, slower)[:3] == [CONFIRMED, REFUTED, REFUTED]
    assert words([bptt, slower])[:3] == [UNMEASURED, REFUTED, REFUTED]  # one case is enough to refute
    # PPO that never got there took at least what its run took
    assert verdicts(bptt, learned("ppo", None))[:2] == [CONFIRMED, CONFIRMED]
    stopped = learned("ppo", None, finished=False, steps=5e5, seconds=50.0, cpu_seconds=50.0)
    assert verdicts(bptt, stopped)[:3] == [UNMEASURED, UNMEASURED, UNMEASURED]
    assert verdicts(learned("bptt", None), stopped)[:2] == [REFUTED, REFUTED]
    failed = {"hover": {"success": 0.2}}
    assert verdicts(bptt, learned("ppo", None, shipped=failed))[4] == REFUTED
    assert verdicts(bptt, learned("ppo", None, shipped=failed, finished=False))[4] == UNMEASURED


def test_an_ablation_counts_where_the_full_reward_learns() -> None:
    def row(task: str, algo: str, full: float, sparse: float) -> dict[str, Any]:
        rates = {"success": [[full], [sparse]], "error": [[0.0], [0.0]]}
        return {"task": task, "algo": algo, "variant": "paper", "variants": ["full", "sparse"], "seed": 0, **rates}

    def judge(*runs: dict[str, Any]) -> Verdict:
        return without("sparse", ("land", "race"), ("ppo",), 2)(Found(runs, lambda name: None))

    learned, lost = row("race", "ppo", 1.0, 0.2), row("land", "ppo", 0.0, 0.0)
    assert judge().word == UNMEASURED
    assert judge(learned).word == UNMEASURED  # the other one is still to come
    found = judge(learned, lost)
    assert found.word == CONFIRMED
    assert found.why == "not learned in these steps with the full reward either: land by PPO"
    assert judge(row("race", "ppo", 1.0, 1.0), lost).word == REFUTED
    assert judge(row("race", "ppo", 0.4, 0.0), lost).word == UNTESTABLE
    assert missed(row("track", "ppo", 1.0, 0.0), "sparse")  # all crash before an error counts


@pytest.mark.whole
def test_the_seconds_of_a_process_that_was_killed_are_not_known(tmp_path: Path) -> None:
    times = tmp_path / "run.time"
    process(["list"], times)
    assert sum(map(float, times.read_text().split())) > 0
    times.with_suffix(".log").touch()  # as a process leaves it that was killed
    process(["list"], times)
    assert math.isnan(sum(map(float, times.read_text().split())))
