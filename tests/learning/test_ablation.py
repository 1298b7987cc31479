"""Rewards without each of their terms, learned side by side."""

import dataclasses
import shutil
from pathlib import Path

import numpy as np
import pytest

from e2efly.commands.cli import run
from e2efly.config import TrainConfig
from e2efly.learning.ablation import FULL, KeptRun, ablate
from e2efly.learning.runner import train
from e2efly.learning.setup import Setup
from e2efly.runs import presets
from e2efly.runs.rundir import RunDirectory
from tests.learning.one_program import compile_once
from tests.learning.test_runner import Silent


def small(algo: str, steps: int = 4096) -> TrainConfig:
    config = presets.preset("hover", algo)
    sizes = {"envs": 16, "horizon": 16} | ({"minibatch": 128} if algo == "ppo" else {})
    return dataclasses.replace(
        config,
        task=dataclasses.replace(config.task, episode_s=1.0),
        algo=dataclasses.replace(config.algo, **sizes),
        steps=steps, chunk=4, eval_episodes=20, devices=1, fast_compile=False,
    )  # fmt: skip


@pytest.mark.whole
@pytest.mark.parametrize("algo", ["ppo", "bptt"])
def test_a_member_learns_as_a_run_alone_does(algo: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    config = small(algo)
    compile_once(monkeypatch)
    curves = ablate(config, 2)
    assert curves.variants == (FULL, *config.reward.weights)
    assert curves.success["hover"].shape == (len(curves.variants), 2, 4)
    variants = [(0, 1, config.reward.weights), (2, 0, {**config.reward.weights, curves.variants[2]: 0.0})]
    for variant, seed, weights in variants:
        reward = dataclasses.replace(config.reward, weights=weights)
        out = tmp_path / f"{variant}"
        train(Setup.of(dataclasses.replace(config, reward=reward, seed=seed)), RunDirectory(out), Silent())
        rows = [row for row in RunDirectory(out).rows() if "eval/hover/final_error" in row]
        alone = [row["eval/hover/final_error"] for row in rows]
        np.testing.assert_allclose(curves.error["hover"][variant, seed], alone, rtol=0.02)
        np.testing.assert_array_equal(curves.steps, [row["steps"] for row in rows])


@pytest.mark.whole
def test_members_differ_and_an_ablation_that_was_stopped_ends_bit_for_bit_like_one_that_was_not(tmp_path: Path) -> None:
    config, path, shares = small("bptt"), tmp_path / "kept.safetensors", []
    kept = KeptRun(path, {"seeds": 2, "steps": config.steps}, period=0.0)

    def told(share: float, success: float) -> None:
        shares.append(share)
        if len(shares) == 3:  # as if it were stopped here
            shutil.copy(path, tmp_path / "copy")

    whole = ablate(config, 2, told, kept)
    last = whole.error["hover"][..., -1]
    assert len(np.unique(np.round(last, 5))) == last.size  # by their terms and seeds
    shutil.copy(tmp_path / "copy", path)
    said = r"kept\.safetensors is of another ablation: seeds: 2 and 1; accepted: another --out"
    with pytest.raises(ValueError, match=said):
        dataclasses.replace(kept, about={**kept.about, "seeds": 1}).done()
    resumed = ablate(config, 2, told, kept)
    assert shares == [pytest.approx(x) for x in (0.25, 0.5, 0.75, 1.0, 1.0)]
    for name in whole.error:
        np.testing.assert_array_equal(resumed.error[name], whole.error[name])
        np.testing.assert_array_equal(resumed.success[name], whole.success[name])


@pytest.mark.whole
def test_the_papers_groups_are_left_out_whole() -> None:
    config = small("ppo")
    reward = dataclasses.replace(config.reward, weights={"prog2": 1.0, "near": 1.0, "v1": 0.1, "anglev_sq": 0.1})
    config = dataclasses.replace(config, reward=reward)
    curves = ablate(config, 1, by="group")
    assert curves.variants == (FULL, "prog", "v", "anglev")
    without = dataclasses.replace(config, reward=dataclasses.replace(reward, weights={"v1": 0.1, "anglev_sq": 0.1}))
    with_one = dataclasses.replace(config, reward=dataclasses.replace(reward, weights={"prog2": 1.0, "anglev_sq": 0.1}))
    alone = ablate(without, 1).error["hover"][0, 0]  # what the group leaves
    np.testing.assert_allclose(curves.error["hover"][1, 0], alone, rtol=0.02)
    assert not np.allclose(curves.error["hover"][1, 0], ablate(with_one, 1).error["hover"][0, 0], rtol=0.02)


def test_what_cannot_be_compared_is_refused() -> None:
    one = dataclasses.replace(small("bptt"), reward=dataclasses.replace(small("bptt").reward, weights={"prog2": 1.0}))
    with pytest.raises(ValueError, match="1 reward terms"):
        ablate(one, 2)
    with pytest.raises(ValueError, match="over 0 seeds"):
        ablate(small("bptt"), 0)


@pytest.mark.whole
def test_the_command_draws_and_takes_what_is_there_already(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    command = ["ablate", "hover", "--algos", "ppo", "--seeds", "1", "--steps", "40960", "--out", "found"]
    assert run(command) == 0
    first = (tmp_path / "found" / "hover_ppo.json").read_bytes()
    text = (tmp_path / "found" / "ablation.md").read_text()
    assert "| without near |" in text and "| full |" in text
    assert (tmp_path / "found" / "ablation_ppo.png").stat().st_size > 20_000
    capsys.readouterr()
    assert run(command) == 0
    assert "as found" in capsys.readouterr().out
    assert (tmp_path / "found" / "hover_ppo.json").read_bytes() == first
    # before anything is trained
    assert run(["ablate", "land", "hover", "--algos", "ppo", "--seeds", "1", "--steps", "81920", "--out", "found"]) == 2
    assert "of another ablation: config.steps: 40960 and 81920; accepted: another --out" in " ".join(
        capsys.readouterr().err.split()
    )
    assert (tmp_path / "found" / "hover_ppo.json").read_bytes() == first
    assert not (tmp_path / "found" / "land_ppo.json").exists()


def test_an_unknown_task_is_named(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    assert run(["ablate", "hoover", "--out", str(tmp_path)]) == 2
    assert "did you mean 'hover'" in " ".join(capsys.readouterr().err.split())
