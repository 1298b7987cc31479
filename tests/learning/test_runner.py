"""Runs: real trainings that reach a stated success, resume bit for bit, stop when they must."""

import dataclasses
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import load_file

from e2efly.commands.cli import run as command
from e2efly.config import ALGORITHMS, NetworkConfig, RewardConfig, TrainConfig
from e2efly.config.numbers import Rule
from e2efly.environment.episodes import Episodes
from e2efly.learning import runner
from e2efly.learning.checkpoint import read_about
from e2efly.learning.metrics import NonFiniteError
from e2efly.learning.point import Point
from e2efly.learning.runner import train
from e2efly.learning.setup import Setup
from e2efly.runs import presets
from e2efly.runs.inputs import from_json, to_json
from e2efly.runs.rundir import RunDirectory
from e2efly.tasks import TASKS
from tests.conftest import QUICK
from tests.learning.one_program import compile_once

SMALL = ["--steps", "6144", "--chunk", "2", "--eval-episodes", "20", "--algo.envs", "16", "--algo.horizon", "16",
         "--network.hidden", "8", "--task.episode-s", "1", "--no-plots"]  # fmt: skip

MORE = {
    "ppo": ["--algo.minibatch", "128"],
    "abpt": ["--algo.minibatch", "128", "--algo.buffer", "1024", "--algo.places", "64"],
    "bptt": ["--algo.average", "0.8"],
}


class Silent:
    """A reporter that keeps what it was told."""

    def __init__(self) -> None:
        self.seen: list[tuple[int, float]] = []

    def ended(self, *end: object) -> None:
        pass

    def compiling(self) -> None:
        pass

    def judging(self, starts: int) -> None:
        pass

    def progress(self, steps: int, total: int, rate: float, success: float, best: float, flown: str) -> None:
        del total, rate, best
        self.seen.append((steps, success))


def small(task: str = "hover", algo: str = "ppo", **changes: Any) -> TrainConfig:
    config = presets.preset(task, algo)
    sizes: dict[str, Any] = {"envs": 16, "horizon": 16}
    if algo == "ppo":
        sizes["minibatch"] = 128
    return dataclasses.replace(
        config,
        algo=dataclasses.replace(config.algo, **sizes),
        steps=1024,
        chunk=2,
        eval_episodes=20,
        devices=1,
        **changes,
    )


@pytest.mark.whole
@pytest.mark.parametrize(
    ("task", "algo", "steps", "success"),
    [("hover", "ppo", 700_000, 0.98), ("land", "bptt", 700_000, 0.95), ("race", "ppo", 1_200_000, 0.9)],
)
def test_a_short_training_learns(task: str, algo: str, steps: int, success: float, tmp_path: Path) -> None:
    config = dataclasses.replace(presets.preset(task, algo), steps=steps, stop_at=max(success, 0.97))
    summary = train(Setup.of(config), RunDirectory(tmp_path / "run"), Silent())
    assert summary["reached_criterion"]
    reached = [value["success"] for name, value in summary["shipped"].items() if name != "update"]
    assert min(reached) >= success, summary


@pytest.mark.whole
def test_a_thrown_vehicle_is_caught(tmp_path: Path) -> None:
    """Learned in episodes of 3 s by the hybrid of exploration and exact gradients, judged in those of 10 s."""
    config = dataclasses.replace(presets.preset("hover", "foppo", "thrown"), steps=500_000, stop_at=0.99)
    setup = Setup.of(config)
    assert setup.env.task.episode_s == 3.0
    assert [judge.task.episode_s for judge in setup.judges.values()] == [10.0]
    assert setup.episode_steps == 300
    summary = train(Setup.of(config), RunDirectory(tmp_path / "run"), Silent())
    assert summary["reached_criterion"]
    assert summary["shipped"]["hover"]["success"] >= 0.985  # of other starts than those that it was stopped by


@pytest.mark.whole
@pytest.mark.usefixtures("quick")
def test_what_met_the_criterion_is_shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Though another policy had a better score before, and failed."""
    successes, scores = iter([0.0, 0.0, 1.0, 1.0]), iter([3.0, 2.0, 1.0])
    monkeypatch.setattr(runner, "success", lambda flown: next(successes))
    monkeypatch.setattr(runner, "score", lambda task, flown: next(scores))
    config = dataclasses.replace(small(), steps=10_240, stop_at=0.5)
    summary = train(Setup.of(config), RunDirectory(tmp_path / "run"), Silent())
    assert summary["finished"]
    assert summary["last"]["update"] == summary["shipped"]["update"] == 6


def cli(*arguments: str, cwd: Path) -> subprocess.Popen[bytes]:
    command, environment = [sys.executable, "-m", "e2efly", *arguments], os.environ | {"XLA_FLAGS": QUICK}
    with (cwd / "output.txt").open("ab") as output:
        return subprocess.Popen(command, cwd=cwd, stdout=output, stderr=output, env=environment)


def output_of(cwd: Path) -> str:
    return (cwd / "output.txt").read_text()


def wait_for_update(run: Path, process: subprocess.Popen[bytes], updates: int) -> None:
    """Wait until the metrics hold `updates` rows."""
    metrics = run / "metrics.csv"
    while process.poll() is None:
        if metrics.exists() and metrics.read_text().count("\n") > updates:
            return
        time.sleep(0.005)
    raise AssertionError(output_of(run.parent))


def timeless(rows: list[dict[str, float]]) -> list[dict[str, float]]:
    return [{name: value for name, value in row.items() if name not in ("seconds", "rate")} for row in rows]


def alike(folder: Path) -> None:
    """The runs `whole` and `cut` ended bit for bit the same."""
    a, b = (load_file(folder / run / "checkpoint.safetensors") for run in ("whole", "cut"))
    assert a.keys() == b.keys()
    for name in a:
        np.testing.assert_array_equal(a[name], b[name], err_msg=name)
    assert (folder / "whole/policy.onnx").read_bytes() == (folder / "cut/policy.onnx").read_bytes()
    rows_a, rows_b = (RunDirectory(folder / run).rows() for run in ("whole", "cut"))
    assert timeless(rows_a) == timeless(rows_b)


@pytest.mark.whole
def test_a_killed_run_ends_bit_for_bit_like_one_that_was_not(tmp_path: Path) -> None:
    flags = ["train", "hover", "--algo", "ppo", "--preset", "nominal", *SMALL, "--devices", "2", *MORE["ppo"]]
    whole = cli(*flags, "--out", "whole", cwd=tmp_path)
    assert whole.wait() == 0, output_of(tmp_path)
    process = cli(*flags, "--out", "cut", cwd=tmp_path)
    wait_for_update(tmp_path / "cut", process, 6)
    process.send_signal(signal.SIGKILL)
    process.wait()
    resumed = cli(*flags, "--out", "cut", "--resume", cwd=tmp_path)
    assert resumed.wait() == 0, output_of(tmp_path)
    alike(tmp_path)


class Killed(BaseException):
    """Ends a run where it is, as a signal does."""


@pytest.mark.whole
@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("algo", ["bptt", "abpt"])
def test_what_other_algorithms_keep_is_enough_to_go_on_bit_for_bit(
    algo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here a run ends where its rows are ahead of its checkpoint; its programs are compiled once."""
    monkeypatch.chdir(tmp_path)
    compile_once(monkeypatch)
    preset = "robust" if algo == "bptt" else "nominal"  # with a memory, and without
    flags = ["train", "hover", "--algo", algo, "--preset", preset, *SMALL, "--devices", "2", *MORE[algo]]
    assert command([*flags, "--out", "whole"]) == 0
    save, saved = Point.save, []

    def killed_at_the_fourth(*args: Any) -> None:
        saved.append(args)
        if len(saved) == 4:
            raise Killed
        save(*args)

    with monkeypatch.context() as cut:
        cut.setattr(Point, "save", killed_at_the_fourth)
        with pytest.raises(Killed):
            command([*flags, "--out", "cut"])
    assert len(RunDirectory(tmp_path / "cut").rows()) == 8
    assert read_about(tmp_path / "cut/checkpoint.safetensors")["update"] == 6
    alone = ["train", "--resume", "cut", "--no-plots"]  # the run says all the rest
    assert command(alone if algo == "bptt" else [*flags, "--out", "cut", "--resume"]) == 0
    alike(tmp_path)


@pytest.mark.whole
def test_a_run_is_one_process_s_and_ctrl_c_saves_and_stops_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run = tmp_path / "my run"
    flags = ["train", "hover", "--algo", "ppo", "--preset", "nominal", *SMALL, *MORE["ppo"], "--steps", "100000000"]
    process = cli(*flags, "--out", "my run", cwd=tmp_path)
    wait_for_update(run, process, 4)
    for again in ([*flags, "--out", str(run)], ["train", "--resume", str(run)]):
        assert command(again) == 2
        assert f"--out {run} is in use by process {process.pid} on " in " ".join(capsys.readouterr().err.split())
    os.kill(process.pid, signal.SIGINT)
    assert process.wait() == 130
    assert "Stopped; go on with: e2efly train --resume 'my run' --no-plots\n" in output_of(tmp_path)
    summary = json.loads((run / "summary.json").read_text())
    assert summary["stopped_by_user"]
    assert not summary["finished"]
    assert (run / "policy.onnx").exists()
    updates = [row["update"] for row in RunDirectory(run).rows()]
    assert updates == list(range(1, len(updates) + 1))


@pytest.mark.whole
@pytest.mark.usefixtures("quick")
def test_a_loss_that_is_not_finite_stops_the_run_and_keeps_the_checkpoint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Rule, "accepts", lambda *_: True)
    config = small("hover", "ppo")
    config = dataclasses.replace(
        config, algo=dataclasses.replace(config.algo, learning_rate=1e30, learning_rate_end=1e30)
    )
    with pytest.raises(NonFiniteError, match=r"(reward|loss).* became (nan|-?inf) in update \d+"):
        train(Setup.of(dataclasses.replace(config, steps=100_000)), RunDirectory(tmp_path / "run"), Silent())


def test_resume_refuses_another_configuration_and_names_it(tmp_path: Path) -> None:
    config = small()
    RunDirectory(tmp_path / "run").create(config)
    other = dataclasses.replace(config, seed=5, algo=dataclasses.replace(config.algo, gamma=0.9))
    with pytest.raises(ValueError, match=r"algo.gamma: 0.96 and 0.9; seed: 0 and 5"):
        train(Setup.of(other), RunDirectory(tmp_path / "run"), Silent(), resume=True)


def test_resume_with_another_task_says_that_alone(tmp_path: Path) -> None:
    RunDirectory(tmp_path / "run").create(small())
    with pytest.raises(ValueError, match=r"another configuration: task: hover and land; algo: ppo and bptt$"):
        train(Setup.of(small("land", "bptt")), RunDirectory(tmp_path / "run"), Silent(), resume=True)


def test_resume_refuses_another_version(tmp_path: Path) -> None:
    config = small()
    run = RunDirectory(tmp_path / "run")
    run.create(config)
    run.write_json("versions.json", {**run.read_json("versions.json"), "jaxlib": "0.0.1"})
    with pytest.raises(ValueError, match=r"another version: jaxlib: 0\.0\.1 and "):
        train(Setup.of(config), run, Silent(), resume=True)


def test_the_next_process_of_a_run_clears_what_a_killed_one_had_not_finished(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path / "run")
    run.create(small())
    (run.path / "checkpoint.safetensors.123.part").write_bytes(b"half")
    run.forget_after(0)
    assert sorted(path.name for path in run.path.iterdir()) == ["config.json", "inputs", "inputs.json", "versions.json"]


def test_a_run_of_a_version_that_did_not_know_an_option_is_read_without_it() -> None:
    config = presets.preset("race_clutter", "bptt")
    content = json.loads(json.dumps(to_json(config)))
    assert content["algo"].pop("average") == 0.99
    old = from_json(content, "config.json")
    assert old == dataclasses.replace(config, algo=dataclasses.replace(config.algo, average=None))
    with pytest.raises(ValueError, match=r"config.json: algo: unknown or missing key: \['avrage'\]; accepted: average"):
        from_json({**content, "algo": {**content["algo"], "avrage": 0.9}}, "config.json")
    del content["task"]
    with pytest.raises(ValueError, match=r"config.json: unknown or missing key: \['task'\]"):
        from_json(content, "config.json")


NOT_IN_THE_PAPER = (
    "hover_aware", "gap", "race_speed", "race_clutter_room", "dodge", "hall", "swap", "avoid_together", "race_duel",
    "hover_payload", "race_eyes",
)  # fmt: skip
BY_THE_PAPER = ("ppo", "bptt", "abpt")


@pytest.mark.parametrize(
    ("name", "task", "algo"),
    [("nominal", t, a) for t in TASKS for a in ALGORITHMS]
    + [(p, t, a) for p in ("paper", "authors") for t in TASKS if t not in NOT_IN_THE_PAPER for a in BY_THE_PAPER]
    + [("thrown", "hover", a) for a in ALGORITHMS]
    + [("lost_rotor", task, "bptt") for task in ("hover", "land")],
)
def test_every_preset_is_complete_and_survives_json(task: str, algo: str, name: str) -> None:
    config = presets.preset(task, algo, name)
    presets.check(config)
    assert from_json(json.loads(json.dumps(to_json(config))), "config.json") == config


@pytest.mark.parametrize("task", NOT_IN_THE_PAPER)
def test_a_preset_that_the_paper_does_not_give_is_refused(task: str) -> None:
    with pytest.raises(ValueError, match=f"the paper has no reward for task '{task}'; accepted: avoid, hover, land"):
        presets.preset(task, "ppo", "paper")


@pytest.mark.parametrize("algo", ["shac", "foppo"])
def test_the_paper_does_not_train_by(algo: str) -> None:
    with pytest.raises(ValueError, match=f"the paper does not train by '{algo}'; accepted: ppo, bptt, abpt"):
        presets.preset("hover", algo, "paper")


@pytest.mark.parametrize("task", ["hover", "land"])
def test_a_lost_rotor_is_learned_by_bptt(task: str) -> None:
    with pytest.raises(ValueError, match=f"preset 'lost_rotor': accepted for {task} by bptt; not by ppo"):
        presets.preset(task, "ppo", "lost_rotor")


def test_only_hover_starts_thrown() -> None:
    with pytest.raises(ValueError, match="preset 'thrown': accepted for task hover, not 'race'"):
        presets.preset("race", "ppo", "thrown")


@pytest.mark.parametrize(("task", "algo"), [("hover", "bptt"), ("hover_aware", "bptt"), ("avoid", "bptt")])
def test_the_algorithm_left_out_is_the_task_s_best(task: str, algo: str) -> None:
    assert TASKS[task].best == algo


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"steps": 0}, "^steps is 0; accepted: a whole number, 1 to 1000000000000000$"),
        ({"network": NetworkConfig(())}, r"network.hidden is \(\); accepted: one or more sizes"),
        ({"reward": RewardConfig({"v1": 1e300})}, r"reward v1 is 1e\+300; accepted: a number, -10000 to 10000"),
    ],
)
def test_bad_numbers_are_named(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        presets.check(dataclasses.replace(presets.preset("hover", "ppo"), **change))


@pytest.mark.parametrize(
    ("algo", "option", "value", "accepted"),
    [
        ("bptt", "horizon_start", 65, "0 to 64"),
        ("ppo", "minibatch", 511, r"a divisor of algo.envs \* algo.horizon \(4096\)"),
        ("abpt", "places", 100, "a positive multiple of 64, what an update adds"),
    ],
)
def test_bad_options_of_algorithms_are_named(algo: str, option: str, value: float, accepted: str) -> None:
    config = presets.preset("hover", algo)
    changed = dataclasses.replace(config, algo=dataclasses.replace(config.algo, **{option: value}))
    with pytest.raises(ValueError, match=f"^algo.{option} is {value}; accepted: {accepted}$"):
        presets.check(changed)


def flown(success: list[bool], error: float, seconds: float) -> dict[str, Episodes]:
    n = np.ones(len(success))
    values = dict.fromkeys((field.name for field in dataclasses.fields(Episodes)), n)
    return {
        "task": Episodes(**{**values, "success": np.array(success), "final_error": error * n, "duration": seconds * n})
    }


@pytest.mark.parametrize("name", ["hover", "race"])
def test_the_best_policy_succeeds_most_often_and_among_equals_is_most_precise(name: str) -> None:
    task = TASKS[name]()
    often, more = [True] * 97 + [False] * 3, [True] * 98 + [False] * 2
    assert runner.score(task, flown(more, 9.0, 90.0)) > runner.score(task, flown(often, 0.0, 1.0))
    assert runner.score(task, flown(more, 0.1, 5.0)) > runner.score(task, flown(more, 0.2, 6.0))
    assert np.isfinite(runner.score(task, flown([False], 1.0, 1.0)))


def test_where_pace_counts_a_much_faster_policy_may_fail_a_little_more_often() -> None:
    task = TASKS["avoid"]()
    often, less = [True] * 98 + [False] * 2, [True] * 94 + [False] * 6
    assert runner.score(task, flown(less, 1.0, 6.0)) > runner.score(task, flown(often, 1.0, 9.0))
    assert runner.score(task, flown(often, 1.0, 6.0)) > runner.score(task, flown(less, 1.0, 6.0))
    assert runner.score(task, flown([False], 1.0, 1.0)) == 0


def test_a_full_disk_at_the_first_row_does_not_end_a_run_for_good(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path)
    run.metrics.touch()
    run.forget_after(0)
    run.append([{"update": 1, "reward": 2.0}])
    assert run.rows() == [{"update": 1, "reward": 2.0}]


def test_a_folder_holds_a_run_once_all_that_resuming_reads_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written: list[str] = []
    monkeypatch.setattr(RunDirectory, "write_json", lambda self, name, content: written.append(name))
    RunDirectory(tmp_path).create(small())
    assert written == ["inputs.json", "versions.json", "config.json"]
