"""A run that begins with another policy's weights."""

import hashlib
import json
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.learning import runner
from e2efly.learning.checkpoint import read_arrays
from e2efly.learning.judge import rates
from e2efly.learning.setup import Setup
from e2efly.learning.warm_start import started_from
from e2efly.policy.random_inputs import random_images, random_observations
from e2efly.policy.zoo import policy_file
from e2efly.runs.presets import begun
from tests.learning.one_program import compile_once

pytestmark = pytest.mark.usefixtures("quick")


SMALL = {"steps": 4096, "chunk": 1, "eval_episodes": 100, "preset_name": "nominal"}


@pytest.mark.parametrize("task", ["hover", "land_visual", "avoid"])
def test_what_is_read_acts_as_the_file(task: str) -> None:
    config = e2efly.preset(task, "bptt", "robust")
    setup = Setup.of(config)
    parameters = started_from(setup.algorithm.init(setup.env, config.algo, 0), policy_file(task), setup)
    policy, rng = e2efly.load_policy(task), np.random.default_rng(0)
    observation = random_observations(rng, setup.env.fields, 50)
    images = [random_images(rng, image, 50) for image in policy.contract.images]
    memory = rng.uniform(-1, 1, (50, config.network.recurrent)).astype(np.float32)
    features = setup.actor.features(observation, images)
    wanted = policy.act(observation, images, memory)
    found = setup.actor(parameters.policy, features, memory)
    np.testing.assert_allclose(found[0], wanted[0], atol=1e-5)
    np.testing.assert_allclose(found[1], wanted[1], atol=1e-5)


@pytest.mark.whole
def test_a_run_begins_where_the_policy_was_and_says_how_it_flies_the_file_s_vehicle(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compile_once(monkeypatch)
    monkeypatch.setattr(runner, "REPORT_EPISODES", 250)
    task, algo, options = "hover", "bptt", {**SMALL, "eval_episodes": 250, "preset_name": "robust"}
    begun = e2efly.train(task, algo, out=tmp_path / "run", start_from=task, **options)
    assert begun["shipped"][task]["success"] > 0.9
    more = e2efly.train(task, algo, out=tmp_path / "more", start_from=tmp_path / "run", **options)
    assert more["shipped"][task]["success"] > 0.9
    assert e2efly.train(task, algo, out=tmp_path / "fresh", **options)["shipped"][task]["success"] < 0.5
    # on the vehicle of the file the same starts end nearer than on the others
    assert begun["nominal"][task]["success"] > 0.98
    assert begun["nominal"][task]["final_error_m"] < 0.8 * begun["shipped"][task]["final_error_m"]
    assert begun["stress"][task]["success"] > 0.8  # 0.86 by zoo.json
    assert begun["stress"][task]["final_error_m"] > 2 * begun["nominal"][task]["final_error_m"]
    told = {"vehicle of the file": begun["nominal"], "random vehicles": begun["shipped"]}
    assert rates(begun) == {name: flown[task]["success"] for name, flown in told.items()}
    # the file says for which vehicle it is, and which delays it has seen
    contract, vehicle = e2efly.load_policy(tmp_path / "run").contract, e2efly.load_vehicle("vis_r")
    assert contract.memory_size == 64
    assert contract.latency_s == vehicle.latency
    assert contract.latency_range_s == pytest.approx((vehicle.latency - 0.04, vehicle.latency + 0.05))


def test_actions_of_a_policy_of_many_vehicles_go_on_to_mean_the_same_commands() -> None:
    many = e2efly.load_policy("any/hover").contract
    fresh = e2efly.preset("hover", "bptt", "robust")
    config = begun(replace(fresh, start_from="any/hover"))
    env = Setup.of(config).env
    np.testing.assert_allclose(env.center - env.half, many.action.low, atol=1e-5)
    np.testing.assert_allclose(env.center + env.half, many.action.high, rtol=1e-6)
    assert env.fields[-1] == many.observation[-1]  # it sees as many past actions
    # those of one vehicle are shares of what the vehicle can do
    other = begun(replace(fresh, start_from="hover", env=replace(fresh.env, vehicle="crazyflie")))
    assert other.env.command_range is None
    # what the configuration says stands
    own = replace(config.env, command_range=((0.0, -9.0, -9.0, -3.0), (40.0, 9.0, 9.0, 3.0)), past_actions=5)
    assert begun(replace(config, env=own)).env == own


@pytest.mark.parametrize("largest", [-12.0, float("nan"), float("inf")])
def test_a_range_that_is_none_is_named(largest: float) -> None:
    given = ((0.0, -12.0, -12.0, -5.0), (50.0, largest, 12.0, 5.0))
    config = e2efly.preset("hover")
    with pytest.raises(ValueError, match=r"env.command_range is .*; accepted: four finite numbers, and four"):
        Setup.of(replace(config, env=replace(config.env, command_range=given)))


def test_what_does_not_fit_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small = ["--steps", "4096", "--no-plots"]
    assert run(["train", "hover", "--from", "race", "--out", str(tmp_path / "a"), *small]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "race.onnx: its observation is ['gates', " in said
    assert "accepted: ['position_error', " in said
    assert run(["train", "hover", "--from", "hower", "--out", str(tmp_path / "b"), *small]) == 2
    assert "unknown policy 'hower'; did you mean 'hover'" in capsys.readouterr().err
    assert run(["train", "hover", "--from", "hover", "--out", str(tmp_path / "c"), *small, "--preset", "nominal"]) == 2
    assert "memory_size is 64; accepted: 0" in " ".join(capsys.readouterr().err.split())
    config = e2efly.preset("hover_aware")
    own = config.network.activation
    for changes, message in (
        ({"network": replace(config.network, hidden=(32, 64))}, r"weight_0 has shape \(95, 64\); accepted: \(95, 32\)"),
        ({"network": replace(config.network, hidden=(64, 64, 64))}, "weight_2 has shape"),
        (
            {"network": replace(config.network, activation="relu" if own != "relu" else "tanh")},
            "accepted: .* network.activation",
        ),
        ({"env": replace(config.env, command_mode="rotor_thrust")}, "command mode is ctbr; accepted: rotor_thrust"),
    ):
        setup = Setup.of(replace(config, **changes))
        parameters = setup.algorithm.init(setup.env, config.algo, 0)
        with pytest.raises(ValueError, match=message):
            started_from(parameters, policy_file("hover_aware"), setup)


def test_a_camera_may_sit_elsewhere_but_must_be_encoded_alike() -> None:
    config = e2efly.preset("avoid")

    def begun(**changes: Any) -> Any:
        cameras = (replace(config.env.cameras[0], **changes),)
        setup = Setup.of(replace(config, env=replace(config.env, cameras=cameras)))
        fresh = setup.algorithm.init(setup.env, config.algo, 0)
        return started_from(fresh, policy_file("avoid"), setup), fresh

    weights, fresh = begun(pitch=0.2)
    assert not np.array_equal(weights.policy.head[0][0], fresh.policy.head[0][0])
    with pytest.raises(ValueError, match="its image_0 encoding is inverse; accepted: linear"):
        begun(encoding="linear")


@pytest.mark.whole
def test_a_run_hands_on_what_its_algorithm_has_beside_the_policy(tmp_path: Path) -> None:
    e2efly.train("hover", "ppo", out=tmp_path / "run", **SMALL)
    arrays = read_arrays(tmp_path / "run" / "checkpoint.safetensors")
    for algo, handed in (("ppo", True), ("foppo", False)):
        setup = Setup.of(e2efly.preset("hover", algo, "nominal"))
        fresh = setup.algorithm.init(setup.env, setup.config.algo, 0)
        begun = started_from(fresh, tmp_path / "run" / "policy.onnx", setup)
        assert np.array_equal(begun.log_std, arrays["['state'].parameters.log_std"][0]) == handed
        assert np.array_equal(begun.critic[0][0], arrays["['state'].parameters.critic[0][0]"][0]) == handed
        assert np.array_equal(begun.critic[0][0], fresh.critic[0][0]) != handed


@pytest.mark.whole
def test_the_file_is_recorded_and_may_go_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compile_once(monkeypatch)
    first, more = tmp_path / "run", tmp_path / "more"
    e2efly.train("hover", "ppo", out=first, **SMALL)
    digest = hashlib.sha256((first / "policy.onnx").read_bytes()).hexdigest()
    e2efly.train("hover", "ppo", out=more, start_from=first, **SMALL)
    assert json.loads((more / "config.json").read_text())["start_from"] == str(first / "policy.onnx")
    assert json.loads((more / "inputs.json").read_text())["start_from"]["sha256"] == digest
    shutil.rmtree(first)
    assert run(["train", "--resume", str(more), "--no-plots"]) == 0
    e2efly.train("hover", "ppo", out=more, start_from=more, overwrite=True, **SMALL)  # takes more steps in its place
    assert json.loads((more / "inputs.json").read_text())["start_from"]["sha256"] != digest
