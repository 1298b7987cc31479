"""The paper's experiments, in their short versions: what they write, what they do not repeat, what they make of it."""

import dataclasses
import json
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

from e2efly.commands.train import parse

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"
sys.path.insert(0, str(BENCHMARKS))

import paper  # noqa: E402
from claims import EXPERIMENTS  # noqa: E402
from claims.ablations import ABLATION, THEIRS, missed  # noqa: E402
from claims.ablations import AUTHORS as THEIR_AUTHORS  # noqa: E402
from claims.alignment import NOMINAL  # noqa: E402
from claims.experiment import Run  # noqa: E402
from claims.found import Found  # noqa: E402
from claims.learning import AUTHORS, IDENTICAL, LEARNING, OWN, PAPER, TASKS, VARIED  # noqa: E402
from claims.rule import (  # noqa: E402
    CONFIRMED,
    DIFFERS,
    REFUTED,
    UNMEASURED,
    UNTESTABLE,
    WORDS,
    Case,
    Claim,
    Invented,
    Side,
    Verdict,
    judge,
)
from claims.running import (  # noqa: E402
    SHORT,
    SMALL,
    How,
    converged,
    enough,
    figures,
    first_held,
    process,
    trained,
    wanted,
)

SPARSE = ABLATION.claims[2]
WITH_RUNS = [name for name, experiment in EXPERIMENTS.items() if experiment.runs]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of the trainings, which the experiments share."""
    return tmp_path_factory.mktemp("paper")


def command(*words: str, file: Path, runs: Path) -> list[str]:
    return [sys.executable, str(BENCHMARKS / "paper.py"), *words, "--short", "--json", str(file), "--runs", str(runs)]


def run(*words: str, file: Path, runs: Path) -> str:
    done = subprocess.run(command(*words, file=file, runs=runs), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.whole
@pytest.mark.parametrize("name", ["ablation", "landing", "learning", "racing"])  # of the others, the options below
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
    assert all(claim["verdict"] in WORDS for claim in part["claims"])
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
    with subprocess.Popen(command("learning", file=file, runs=folder), start_new_session=True) as running:
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
def test_a_training_that_was_stopped_goes_on_from_its_checkpoint(tmp_path: Path) -> None:
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


def learned(algo: str, reached: float | None, seed: int = 0, **other: Any) -> dict[str, Any]:
    at = None if reached is None else {"steps": reached, "seconds": reached / 1e4}
    told: dict[str, Any] = {
        "task": "hover", "algo": algo, "variant": f"{PAPER}, {IDENTICAL}", "seed": seed, "finished": True,
        "steps": 1e8, "seconds": 1e3, "cpu_seconds": 1e3, "cores": 1, "reached": {"0.9": at},
        "held": {"0.99": at}, "shipped": {"hover": {"success": 1.0}}, "curve": {"return": "-1"},
    }  # fmt: skip
    return told | other


def seeds(one: dict[str, Any], count: int = 3) -> list[dict[str, Any]]:
    return [one | {"seed": seed} for seed in range(count)]


def every(*runs: dict[str, Any], variants: tuple[str, ...] = (IDENTICAL, OWN)) -> list[dict[str, Any]]:
    """The same runs in all tasks, with both presets and these rewards."""
    return [
        one | {"task": task, "variant": f"{preset}, {variant}"}
        for task in TASKS for preset in (PAPER, AUTHORS) for variant in variants for one in runs
    ]  # fmt: skip


def words(runs: list[dict[str, Any]]) -> list[str]:
    return [judge(claim, Found(runs)).word for claim in LEARNING.claims]


def test_verdicts_of_learning_follow_the_figures() -> None:
    assert words([]) == [UNMEASURED] * 6
    bptt, ppo = learned("bptt", 1e6), learned("ppo", 5e6, curve={"return": "-2"})
    assert words(every(bptt, ppo)) == [CONFIRMED] * 6
    assert words([one for one in every(bptt, ppo) if one["task"] == "hover"]) == [UNMEASURED] * 6
    slower = learned("ppo", 2e6, curve={"return": "-0.5"})
    assert words(every(bptt, slower))[:3] == [CONFIRMED, DIFFERS, DIFFERS]  # one seed, nothing varied
    # one set of rewards with which a claim holds is enough for it
    assert words([*every(bptt, slower, variants=(OWN,)), *every(bptt, ppo, variants=(IDENTICAL,))])[1] == CONFIRMED
    # PPO that never gets there says nothing about BPTT's share of its steps
    never = learned("ppo", None, shipped={"hover": {"success": 0.2}})
    assert words(every(bptt, never)) == [UNMEASURED] * 3 + [CONFIRMED, UNMEASURED, UNMEASURED]
    # a run that was stopped has no reward to compare
    assert words(every(bptt, learned("ppo", 5e6, finished=False, steps=6e6)))[2] == UNMEASURED


def varied(variants: Sequence[str], one: dict[str, Any]) -> list[dict[str, Any]]:
    """One seed of every variant in every task."""
    return [one | {"task": task, "variant": variant} for task in TASKS for variant in variants]


def test_a_claim_about_learning_is_refuted_only_if_the_rule_is_met() -> None:
    claim = LEARNING.claims[5]
    assert claim.invented
    numbers = [variant for number in claim.invented for variant in number.variants]
    failed = {"hover": {"success": 0.2}}
    fails = [one for seed in seeds(learned("ppo", None, shipped=failed)) for one in every(seed)]
    others = varied([variant for variant in numbers if AUTHORS not in variant], learned("ppo", None, shipped=failed))
    able = varied(["elsewhere"], learned("ppo", 1e6))  # PPO can learn the tasks at all

    def verdict(runs: list[dict[str, Any]]) -> Verdict:
        return judge(claim, Found(runs))

    assert verdict([*fails, *others, *able]).word == REFUTED
    assert verdict([*fails, *others]).word == UNMEASURED
    assert "does not learn" in verdict([*fails, *others]).why
    two = [one for one in fails if one["seed"] < 2]
    assert verdict([*two, *able]).word == DIFFERS
    short = [one | {"steps": 1e6} for one in fails]
    found = verdict([*short, *others, *able])
    assert found.word == DIFFERS
    assert "1 % of the paper's steps" in found.why
    for number in claim.invented:
        if set(number.variants) & {f"{AUTHORS}, {OWN}"}:
            continue
        unvaried = [one for one in others if one["variant"] not in number.variants]
        assert f"not varied: {number.what}" in verdict([*fails, *unvaried, *able]).why
    # with one choice of an invented number every task is learned: then the claim holds
    name = f"{PAPER}, {VARIED[0][0]}"
    remaining = [one for one in others if one["variant"] != name]
    assert verdict([*fails, *remaining, *able, *varied([name], learned("ppo", 1e6))]).word == CONFIRMED


def case(agrees: bool, runs: list[dict[str, Any]], claimed: float | None = 1e6, learns: bool = True) -> Claim:
    sides = (Side(runs, claimed),)
    number = Invented("a number", "1", ("other",))
    return Claim("it is so", "-", lambda found: [Case("hover", agrees, learns, "-", sides)], invented=(number,))


def test_the_rule_decides_the_word() -> None:
    full = [{"task": "hover", "variant": "usual", "seed": seed, "steps": 1e6} for seed in range(3)]
    found = Found([*full, full[0] | {"variant": "other"}])
    assert judge(case(True, full), found).word == CONFIRMED
    assert judge(case(False, full), found).word == REFUTED
    assert judge(case(False, full, learns=False), found).word == UNMEASURED
    assert judge(case(True, full, learns=False), found).word == UNMEASURED
    for lacking, reason in (
        (case(False, full[:2]), "only 2 seeds of 3"),
        (case(False, full, claimed=1e8), "only 1 % of the paper's steps"),
        (case(False, []), "only 0 seeds of 3"),
        (dataclasses.replace(case(False, full), invented=None), "are not listed"),
        (dataclasses.replace(case(False, full), theirs_alone="of their machine"), "of their machine"),
    ):
        told = judge(lacking, found)
        assert told.word == DIFFERS
        assert reason in told.why
    assert "not varied: a number" in judge(case(False, full), Found(full)).why
    early = [one | {"steps": 1e4, "held": {"0.99": {"steps": 1e3}}} for one in full]  # stopped because it had learned
    assert judge(case(False, early), found).word == REFUTED
    assert judge(dataclasses.replace(case(False, full), untestable="needs a vehicle"), found).word == UNTESTABLE


def test_no_claim_is_refuted_by_default() -> None:
    """A claim that lists nothing, or has no runs, cannot be refuted by any figure."""
    against = [Case("x", False, True, "-")]
    for experiment in EXPERIMENTS.values():
        for claim in experiment.claims:
            told = judge(dataclasses.replace(claim, cases=lambda found: against), Found([]))
            assert told.word in (DIFFERS, UNTESTABLE), claim.says


def test_the_variants_of_invented_numbers_are_runs() -> None:
    for experiment in EXPERIMENTS.values():
        variants = {run.variant for run in experiment.runs}
        assert len({(run.task, run.algo, run.variant) for run in experiment.runs}) == len(experiment.runs)
        for claim in experiment.claims:
            for number in claim.invented or ():
                assert set(number.variants) <= variants, (claim.says, number.what)


@pytest.mark.whole
@pytest.mark.parametrize("name", ["racing", *(name for name in WITH_RUNS if name not in ("racing", "ablation"))])
def test_the_options_of_all_trainings_are_accepted(name: str) -> None:
    """A run begins only after hours of others."""
    for run in (run for run in EXPERIMENTS[name].runs if run.kind == "train"):
        asked = parse([run.task, "--algo", run.algo, "--out", "never", *run.options])
        assert asked.config.task.name == run.task


def test_an_ablation_counts_where_the_full_reward_learns() -> None:
    def row(task: str, full: float, sparse: float, steps: float = 1e8) -> dict[str, Any]:
        rates = {"success": [[full], [sparse]], "error": [[0.0], [0.0]], "steps": steps, "seeds": 3}
        curve = {"steps": "1 2", "success": [f"{full} {full}", f"{sparse} {sparse}"]}
        about = {"task": task, "algo": "ppo", "variant": THEIRS, "variants": ["full", "sparse"], "seed": 0}
        return about | rates | {"curve": curve}

    def told(*runs: dict[str, Any]) -> Verdict:
        return judge(SPARSE, Found(runs))

    learned, lost = row("race", 1.0, 0.2), row("land", 0.0, 0.0)
    needed = [row(task, 1.0, 0.2) for task in TASKS]
    assert told().word == told(learned).word == UNMEASURED
    assert told(*needed).word == CONFIRMED
    assert told(learned, lost).word == UNMEASURED
    assert "does not learn: land" in told(learned, lost).why
    spared = row("race", 1.0, 1.0)
    assert told(spared).word == DIFFERS  # nothing was varied
    as_authors = spared | {"variant": THEIR_AUTHORS}
    assert told(spared, as_authors).word == REFUTED
    assert told(spared, as_authors | {"success": [[1.0], [0.2]]}).word == UNMEASURED  # it is needed with other numbers
    brief = row("race", 1.0, 0.989, steps=1e6)  # not worse by 2 points, but by half a point
    assert told(brief).word == UNMEASURED
    assert missed(row("track", 1.0, 0.0), "sparse")  # all crash before an error counts


def test_a_level_is_held_from_the_first_of_five_evaluations_of_the_task_itself() -> None:
    def points(*success: float, final: bool = True) -> list[dict[str, Any]]:
        return [{"steps": 10.0 * i, "success": x, "final": final} for i, x in enumerate(success, 1)]

    good = points(0.0, 1.0, 0.9, 1.0, 1.0, 1.0, 0.99, 1.0)
    first = first_held(good, 0.99)
    assert first is not None
    assert first["steps"] == 40.0
    assert first_held(good[:-1], 0.99) is None
    assert first_held(points(*[1.0] * 9, final=False), 0.99) is None  # of an earlier stage of a curriculum
    how = How(Path(), stop=0.99)
    assert enough(good, how)
    assert not enough(good[:-1], how)
    assert not enough(good, How(Path()))
    assert enough(good, How(Path(), most=80.0))


@pytest.mark.whole
def test_the_seconds_of_a_process_that_was_killed_are_not_known(tmp_path: Path) -> None:
    times = tmp_path / "run.time"
    process(["list"], times)
    assert sum(map(float, times.read_text().split())) > 0
    times.with_suffix(".log").touch()  # as a process leaves it that was killed
    process(["list"], times)
    assert math.isnan(sum(map(float, times.read_text().split())))
