"""`eval` under what training could meet: the changes fly, are told, and leave what the contract fixes."""

import dataclasses
import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.commands.eval import parse
from e2efly.config import CameraConfig, EnvConfig, RewardConfig
from e2efly.config.changes import changed, differing
from e2efly.courses.references import Lissajous, knot_count
from e2efly.environment import Env
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import SEED
from e2efly.validation.starts import draw_starts


@pytest.mark.whole
def test_what_is_asked_for_flies_and_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A wind of 40 m/s carries the hover away; the report says so, and the terminal."""
    report = tmp_path / "report.json"
    asked = ["eval", "hover", "--episodes", "20", "--env.wind", "40", "--env.randomize", "mass", "0.2"]
    assert run([*asked, "--json", str(report), "--plots", str(tmp_path)]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert "Flown under env.randomize {'mass': 0.2} (not {}), env.wind 40.0 (not 0.0)." in told
    said = json.loads(report.read_text())
    assert said["changed"] == {"env.randomize": {"mass": 0.2}, "env.wind": 40.0}
    assert (said["env"]["wind"], said["env"]["randomize"]) == (40.0, {"mass": 0.2})
    again = e2efly.evaluate("hover", 20, env={"wind": 40.0, "randomize": {"mass": 0.2}}).flown["hover"]
    still = e2efly.evaluate("hover", 20)
    assert still.as_json()["changed"] == {}
    windy = said["criteria"]["hover"]["final_error_m"]
    assert windy == pytest.approx(float(np.mean(again.final_error)), abs=1e-5)
    assert windy > float(np.mean(still.flown["hover"].final_error)) + 0.005


def test_a_later_command_leaves_the_observation_as_it_is() -> None:
    """The queue holds more actions than the policy sees."""
    found = candidate("hover", env={"action_latency": (0.2, 0.2)})
    env = found.environment(found.task)
    seen = next(f.size for f in found.policy.contract.observation if f.name == "past_actions")
    assert env.seen_actions == seen // 4
    assert env.queue == 7  # 0.2 s at 30 Hz
    # the spread lies about the vehicle's own latency, which takes the place of the contract's range
    spread = candidate("hover", env={"latency_spread": (0.01, 0.02)})
    np.testing.assert_allclose(spread.environment(spread.task).latency_range, (0.05, 0.08), atol=1e-6)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--env.past-actions", "5"], "env.past_actions is 5; accepted: 4, which the policy's contract fixes"),
        (["--env.vehicle", "vis_h"], "env.vehicle is 'vis_h'; accepted: 'vis_r', which the policy's contract fixes; "),
        (["--env.control-rate", "50"], "env.control_rate is 50.0; accepted: 30.0"),
        (["--env.command-mode", "attitude"], "env.command_mode is 'attitude'; accepted: 'ctbr'"),
        (["--env.imu.observed"], "env.imu.observed is True; accepted: False"),
        (["--env.randomize", "mas", "0.2"], "unknown vehicle parameter 'mas'; did you mean 'mass'"),
        (["--env.wind", "1", "--stress"], "--env.wind is given with --stress; accepted: one of them"),
    ],
)
def test_what_the_contract_fixes_is_refused_by_name(
    options: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["eval", "hover", "--episodes", "2", *options]) == 2
    assert message in " ".join(capsys.readouterr().err.split())


def test_of_a_camera_its_image_is_fixed_and_its_place_is_not(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["eval", "avoid", "--env.cameras.0.width", "16"]) == 2
    assert "env.cameras.0.width is 16; accepted: 32" in " ".join(capsys.readouterr().err.split())
    asked = parse(["avoid", "--env.cameras.0.pitch", "0.1", "--env.cameras.0.noise.speckle", "0.2"])
    assert asked.env == {"cameras.0.pitch": 0.1, "cameras.0.noise.speckle": 0.2}
    found = candidate("avoid", env=asked.env)
    assert found.environment(found.task).cameras[0].pitch == 0.1
    with pytest.raises(ValueError, match=r"env.cameras is \(\); accepted: \(Camera.*, which the policy's contract fix"):
        candidate("avoid", env={"cameras": ()})


def test_the_policy_comes_first(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["eval", "--env.wind", "1", "hover"]) == 2
    assert "eval begins with --env.wind; accepted: the policy first" in " ".join(capsys.readouterr().err.split())


def test_changes_by_dotted_name_name_what_is_wrong() -> None:
    env = EnvConfig(cameras=(CameraConfig(), CameraConfig()))
    new = changed(env, {"disturbance.gust": 2, "cameras.1.pitch": 0.5, "action_latency": (0.0, 0.1)}, "env")
    assert new.disturbance.gust == 2
    assert [camera.pitch for camera in new.cameras] == [env.cameras[0].pitch, 0.5]
    assert {name: value for name, (_, value) in differing(env, new).items()} == {
        "action_latency": (0.0, 0.1), "disturbance.gust": 2, "cameras.1.pitch": 0.5,
    }  # fmt: skip
    assert differing(env, dataclasses.replace(env)) == {}
    for changes, said in (
        ({"wnd": 1.0}, "unknown option of env 'wnd'; did you mean 'wind'"),
        ({"disturbance.gus": 1.0}, "unknown option of env.disturbance 'gus'; did you mean 'gust'"),
        ({"wind": "much"}, "env.wind is 'much'; accepted: a number"),
        ({"cameras.2.pitch": 0.1}, r"unknown number of env.cameras '2' \(there are: 0, 1\)"),
        ({"wind.x": 1.0}, "unknown option of env.wind 'x'"),
    ):
        with pytest.raises(ValueError, match=said):
            changed(env, changes, "env")


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("flown", [e2efly.evaluate, partial(e2efly.validate, plant="simulator")], ids=["eval", "plant"])
def test_the_reference_of_a_row_can_be_made_again(flown: Callable[..., Any]) -> None:
    """From the report's numbers alone: where the reference is at any time."""
    said = flown("track", episodes=3).as_json()["criteria"]
    found = candidate("track")
    time = np.linspace(0, 9, 40)[None].repeat(3, 0)
    for criterion, suite in found.task.criteria().items():
        starts = draw_starts(found.environment(suite), 3, SEED)
        rebuilt = []
        for row in said[criterion]["starts"]:
            course = row["course"]
            assert (course["reference"], course["duration_s"]) == (criterion, 10.0)
            if criterion == "circle":
                curve = Lissajous.circle(course["radius_m"], course["rate_rad_s"])
            else:
                curve = Lissajous.lemniscate(course["half_length_m"], course["top_speed_m_s"])
            phase = np.array([course["phase_rad"]])
            rebuilt.append(curve.spline(np.array(course["centre_m"]), phase, knot_count(11)).position(time[:1])[0])
        wanted = np.asarray(starts.memory.reference.position(time))
        np.testing.assert_allclose(rebuilt, wanted, atol=1e-4)
        assert len({row["course"]["phase_rad"] for row in said[criterion]["starts"]}) == 3


@pytest.mark.whole
def test_a_row_of_visual_landing_says_what_pad_it_had() -> None:
    found = e2efly.evaluate("land_visual", episodes=30, task={"pad_size": (0.3, 0.8)})
    (criterion,) = found.as_json()["criteria"].values()
    pads = [row["course"] for row in criterion["starts"]]
    assert {pad["pad_outline"] for pad in pads} == {0, 1, 2}
    widths = [pad["pad_width_m"] for pad in pads]
    assert 0.3 <= min(widths) < 0.4 < 0.7 < max(widths) <= 0.8
    start = draw_starts(found.candidate.environment(found.candidate.task), 30, SEED)
    np.testing.assert_allclose(widths, 2 * np.asarray(start.memory.size[:, 0, 0]), atol=1e-6)


def test_a_reference_without_a_phase_says_its_knots_and_one_from_a_file_its_name() -> None:
    suite = dataclasses.replace(candidate("track").task, reference="polynomial")
    env = Env.of(suite, RewardConfig({"prog2": 1.0}))
    starts = draw_starts(env, 2, SEED)
    assert suite.course() == {"reference": "polynomial", "duration_s": 10.0}
    np.testing.assert_array_equal(starts.drawn["knots"], starts.memory.reference.knots)
    still = Lissajous.circle(1.0, 0.0)
    phase = np.array([0.5, -2.0, 3.0])
    np.testing.assert_allclose(still.phase(np.ones(3), still.spline(np.ones(3), phase, 3).knots[:, 0]), phase)
