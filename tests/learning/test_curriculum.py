"""Curricula: promotion by success or by steps, without compiling anything again."""

import dataclasses
import json
from pathlib import Path

import pytest

from e2efly.config import DisturbanceConfig, EnvConfig, EstimateConfig, LinkConfig, Robust, StageConfig, TrainConfig
from e2efly.learning.runner import train
from e2efly.learning.setup import Setup
from e2efly.runs import presets
from e2efly.runs.inputs import fingerprint, from_json, to_json
from e2efly.runs.rundir import RunDirectory
from tests.learning.test_runner import Silent, small

NEAR = StageConfig({"position": 0.1, "velocity": 0.0}, success=0.0001, steps=512)
HALF = StageConfig({"position": 1.0}, success=1.0, steps=512)


def with_stages(*curriculum: StageConfig) -> TrainConfig:
    return dataclasses.replace(small(), curriculum=curriculum, steps=3072)


def test_stages_differ_in_numbers_and_end_with_the_task() -> None:
    first, second, last = Setup.of(with_stages(NEAR, HALF)).stages
    assert (first.env.task.config.position, second.env.task.config.position) == (0.1, 1.0)
    assert second.env.task.config.velocity == last.env.task.config.velocity == 1.0
    assert last.env.task.config == small().task and last.config is None


def test_a_stage_has_a_share_of_what_an_episode_draws() -> None:
    env = EnvConfig(
        randomize={"mass": 0.2},
        wind=2.0,
        latency_spread=(0.01, 0.02),
        disturbance=DisturbanceConfig(gust=1.0),
        estimate=EstimateConfig(yaw=0.1, hold=4.0),
        link=LinkConfig(dropped=0.1),
    )
    config = dataclasses.replace(with_stages(StageConfig({}, steps=512, strength=0.5)), env=env)
    first, last = (stage.env for stage in Setup.of(config).stages)
    assert (first.randomize, first.wind) == ({"mass": 0.1}, 1.0)
    assert first.disturbance == DisturbanceConfig(gust=0.5)
    assert (first.estimate, first.link) == (EstimateConfig(yaw=0.05, hold=2.0), LinkConfig(dropped=0.05))
    latency = float(first.physics.nominal.latency)
    assert first.latency_range == pytest.approx([latency - 0.005, latency + 0.01])
    assert (last.estimate, last.randomize) == (env.estimate, env.randomize)


def test_a_recipe_begins_with_a_share_of_the_draws() -> None:
    recipe = Robust(steps=3072, eased=(0.4, 1024))
    assert recipe.into(small()).curriculum == (StageConfig({}, steps=1024, strength=0.4),)
    assert recipe.into(with_stages(NEAR)).curriculum == (StageConfig(NEAR.changes, steps=1024, strength=0.4), NEAR)


def test_files_from_before_a_field_was_added_are_read_and_define_the_same_training() -> None:
    config = with_stages(NEAR)
    content = json.loads(json.dumps(to_json(config)))
    known = fingerprint(config)
    del content["env"]["estimate"], content["env"]["link"], content["curriculum"][0]["strength"]
    assert from_json(content, "old") == config
    assert fingerprint(from_json(content, "old")) == known
    late = dataclasses.replace(config, env=dataclasses.replace(config.env, link=LinkConfig(dropped=0.1)))
    assert fingerprint(late) != known


@pytest.mark.parametrize(
    ("stage", "success", "steps", "over"),
    [
        (StageConfig({}, success=0.8), 0.8, 1, True),
        (StageConfig({}, success=0.8), 0.79, 10**9, False),
        (StageConfig({}, steps=1000), 0.0, 1000, True),
        (StageConfig({}, steps=1000), 1.0, 999, False),
        (StageConfig({}, success=0.8, steps=1000), 0.9, 1, True),
    ],
)
def test_promotion(stage: StageConfig, success: float, steps: int, over: bool) -> None:
    first, last = Setup.of(with_stages(stage)).stages
    assert first.is_over(success, steps) == over
    assert not last.is_over(1.0, 10**9)


@pytest.mark.whole
def test_a_run_goes_through_its_stages_and_compiles_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import jax

    compiled: list[str] = []

    def count(name: str, *args: object, **kwargs: object) -> None:
        del args, kwargs
        if name == "/jax/core/compile/backend_compile_duration":
            compiled.append(name)

    shown: list[str] = []

    class Told(Silent):
        def progress(self, *args: object) -> None:
            shown.append(str(args[-1]))
            counts.append(len(compiled))

    counts: list[int] = []
    jax.monitoring.register_event_duration_secs_listener(count)
    config = with_stages(HALF, HALF)
    train(Setup.of(config), RunDirectory(tmp_path / "run"), Told())
    first, *rest = (text.removeprefix("vehicle of the file, ") for text in shown)
    assert first == "stage 2 of 3" and set(rest) == {"stage 3 of 3"} and len(shown) >= 4
    assert counts[0] == counts[-1] > 0, "nothing is compiled after the first chunk"
    rows = RunDirectory(tmp_path / "run").rows()
    assert sorted({row["stage"] for row in rows}) == [1.0, 2.0, 3.0]


def test_a_curriculum_survives_its_file() -> None:
    config = with_stages(NEAR, StageConfig({"target": (0.0, 0.0, 2.0)}, steps=10))
    assert from_json(json.loads(json.dumps(to_json(config))), "here") == config


@pytest.mark.parametrize(
    ("stage", "message"),
    [
        (StageConfig({"position": 1.0}), r"curriculum\[0\] has neither success nor steps"),
        (StageConfig({"positon": 1.0}, steps=1), r"curriculum\[0\].changes: no field 'positon'; accepted: .*position"),
        (StageConfig({"target": 1.0}, steps=1), r"curriculum\[0\].changes: target is 1.0; accepted: a value like"),
        (StageConfig({"position": 1.0}, steps=0), r"curriculum\[0\].steps is 0"),
    ],
)
def test_a_bad_stage_is_refused_by_name(stage: StageConfig, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Setup.of(with_stages(stage))


def test_the_papers_curricula_are_presets() -> None:
    for task in ("avoid", "race_clutter"):
        for algo in ("ppo", "bptt"):
            assert len(Setup.of(presets.preset(task, algo, "paper")).stages) == 3
