"""Hover controllers in place of a policy, under its contract: in `eval`, `--stress` and `validate`."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.control import Quat
from e2efly.policy.loader import level_and_still, load_policy
from e2efly.tasks.race.goal import CRUISE, RaceGoal
from e2efly.tasks.track.goal import TrackGoal
from e2efly.validation.baseline import Baseline
from e2efly.validation.candidate import candidate
from e2efly.validation.stress import stress
from e2efly.vehicles.loading import load_vehicle

NAMES = "pid", "geometric", "indi", "mpc"
STILL = {"randomize": {}, "action_latency": (0.06, 0.06)}


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("task", ["hover", "hover_aware", "land"])
def test_it_does_the_task_of_the_policy(name: str, task: str) -> None:
    """`pid` learns what lasts, such as another mass, so slowly that episodes are over before it is there."""
    found = e2efly.evaluate(task, 20, baseline=name)
    (flown,) = found.flown.values()
    if name == "pid":
        assert not flown.crashed.any() or task == "land"
        assert np.median(flown.final_error) < 0.1
    else:
        assert found.success >= (0.9 if task != "land" else 0.8)
    assert found.as_json()["baseline"] == name
    assert any(f"hover controller {name}" in note for note in found.candidate.notes)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", NAMES)
def test_it_follows_a_circle_on_vehicles_that_are_late(name: str) -> None:
    """By up to 50 ms, of which it is not told."""
    flown = e2efly.evaluate("track", 20, baseline=name).flown["circle"]
    assert not flown.crashed.any()
    assert flown.mean_error.mean() < (0.2 if name == "pid" else 0.1)


@pytest.mark.parametrize("name", ["indi", "mpc"])
def test_it_flies_through_gates(name: str) -> None:
    assert e2efly.evaluate("race", 20, baseline=name).success >= 0.9


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", NAMES)
def test_a_plant_flies_it_as_eval_does(name: str) -> None:
    found = e2efly.validate("hover", "simulator", 3, baseline=name)
    criterion = found.criteria["hover"]
    still = e2efly.evaluate("hover", 3, baseline=name, env=STILL).flown["hover"]
    np.testing.assert_array_equal(criterion.flown.success, still.success)
    np.testing.assert_allclose(criterion.flown.final_error, still.final_error, atol=5e-3)
    assert found.as_json()["baseline"] == name


def test_it_is_one_controller_for_many_vehicles_at_once_or_one() -> None:
    contract, vehicle = load_policy("track").contract, load_vehicle("vis_r")
    flies, rng = Baseline.of(contract, "geometric", vehicle), np.random.default_rng(0)
    rows = level_and_still(contract) + 0.05 * rng.normal(size=(3, 4, contract.observation_size))
    attitude = contract.slices[contract.attitude]
    rows[..., attitude] /= np.linalg.norm(rows[..., attitude], axis=-1, keepdims=True)
    together, memory, alone = [], None, [None] * 4
    for observation in rows:
        actions, memory = flies.act(observation, memory=memory)
        together.append(actions)
        for i in range(4):
            action, alone[i] = flies.act(observation[i], memory=alone[i])
            assert action.shape == (4,) and action.dtype == np.float32
            np.testing.assert_allclose(action, actions[i], atol=1e-6)
    assert np.abs(np.array(together)).max() <= 1


def test_the_motion_of_a_reference_is_that_of_its_points() -> None:
    t = 0.1 * np.arange(10)
    points = np.stack([1 + 2 * t + 3 * t**2, t**3, 4 - t], axis=1)
    place = TrackGoal.aim({"reference": points.ravel()[None]})
    for part, wanted in (
        (place.position, [1, 0, 4]), (place.velocity, [2, 0, -1]), (place.acceleration, [6, 0, 0]),
        (place.jerk, [0, 6, 0]),
    ):  # fmt: skip
        np.testing.assert_allclose(part.stack(), [wanted], atol=1e-6)


def test_a_race_leads_straight_to_the_gate() -> None:
    place = RaceGoal.aim({"gates": np.array([[3.0, 4.0, 0.0, 9.0, 9.0, 9.0]])})
    np.testing.assert_allclose(place.position.stack(), [[0.0, 0.0, 0.0]])
    np.testing.assert_allclose(place.velocity.stack(), [[0.6 * CRUISE, 0.8 * CRUISE, 0.0]], atol=1e-4)


def test_a_heading_is_kept_only_where_the_task_names_one() -> None:
    contract, vehicle = load_policy("hover").contract, load_vehicle("vis_r")
    seen = level_and_still(contract)
    seen[contract.slices[contract.attitude]] = Quat.of_euler(0.0, 0.0, 1.0).stack()
    action, _ = Baseline.of(contract, "pid", vehicle).act(seen)
    assert action[3] == pytest.approx(0.0, abs=1e-6)
    contract = load_policy("hover_aware").contract
    seen = level_and_still(contract)
    seen[contract.slices["look_at"]] = (0.0, 3.0, 0.0)
    action, _ = Baseline.of(contract, "pid", vehicle).act(seen)
    assert action[3] > 0.1


@pytest.mark.parametrize("task", ["gap", "avoid", "land_visual"])
def test_a_task_without_a_place_to_fly_to_is_named(task: str) -> None:
    with pytest.raises(
        ValueError, match=rf"'geometric', and task '{task}'.*hover, hover_aware, hover_payload, land, race, swap, track"
    ):
        candidate(task, baseline="geometric")


def test_what_it_cannot_fly_is_named() -> None:
    with pytest.raises(ValueError, match=r"--baseline is 'pid', and every episode flies another vehicle"):
        candidate("any/hover", baseline="pid")
    assert candidate("any/hover", "vis_h", baseline="pid").baseline == "pid"
    with pytest.raises(ValueError, match="hover controller"):
        candidate("hover", baseline="pidd")
    contract, vehicle = load_policy("hover").contract, load_vehicle("vis_r")
    by_velocity = dataclasses.replace(contract, action=dataclasses.replace(contract.action, mode="velocity"))
    with pytest.raises(ValueError, match=r"the policy commands 'velocity'; accepted: one by 'ctbr'"):
        Baseline.of(by_velocity, "pid", vehicle)
    blind = dataclasses.replace(contract, observation=tuple(f for f in contract.observation if f.name != "body_rate"))
    with pytest.raises(ValueError, match=r"the policy is shown no body_rate; accepted"):
        Baseline.of(blind, "pid", vehicle)


def test_the_rows_of_the_stress_are_flown() -> None:
    found = stress("hover", 10, rows=("nominal", "mass x1.25", "wind 3 m/s"), baseline="geometric")
    assert found.success == {"nominal": 1.0, "mass x1.25": 1.0, "wind 3 m/s": 1.0}
    assert found.as_json()["baseline"] == "geometric"


def test_the_command_line_takes_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "report.json"
    arguments = ["--baseline", "pid", "--episodes", "4", "--json", str(file), "--plots", str(tmp_path)]
    assert run(["eval", "hover", *arguments]) == 0
    assert json.loads(file.read_text())["baseline"] == "pid"
    assert "hover controller pid" in capsys.readouterr().out
    assert run(["eval", "gap", *arguments]) != 0
    assert "accepted: a policy of hover" in capsys.readouterr().err
