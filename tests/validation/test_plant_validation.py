"""`e2efly validate` end to end."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from e2efly.commands.policies import Asked
from e2efly.commands.validate import Validate, run
from e2efly.config import ImuConfig
from e2efly.validation.plant_validation import validate
from e2efly.vehicles import vehicle
from e2efly.vehicles.loading import load_vehicle


@pytest.mark.whole
def test_hover_in_mujoco_is_as_in_training(
    policy_of: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    report = tmp_path / "report.json"
    asked = Validate(policy_of("hover"), "mujoco", 5, out=tmp_path / "plots", json=report)
    assert run(Asked(asked, {})) == 0
    out = capsys.readouterr().out
    assert "training" in out
    assert "mujoco" in out
    content = json.loads(report.read_text())
    criterion = content["criteria"]["hover"]
    assert criterion["training"]["success"] == criterion["mujoco"]["success"] == 1
    assert criterion["drop"] == 0
    assert abs(criterion["training"]["mean_error_m"] - criterion["mujoco"]["mean_error_m"]) < 0.02
    assert len(criterion["starts"]) == 5
    assert len({tuple(row["start"]["position"]) for row in criterion["starts"]}) == 5
    assert (tmp_path / "plots" / "mujoco_hover.png").read_bytes().startswith(b"\x89PNG\r\n\x1a\n")


def test_success_that_drops_too_far_is_told_by_the_exit_status(
    policy_of: Callable[..., Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The same policy on a vehicle with motors that are ten times as slow."""
    text = (Path(vehicle.__file__).parent / "vis_r.toml").read_text()
    slow = tmp_path / "slow.toml"
    slow.write_text(text.replace("value = 0.035", "value = 0.35"))
    assert load_vehicle(slow).motor_time_constant == 0.35
    options: dict[str, Any] = {"episodes": 3, "out": tmp_path / "plots", "vehicle": str(slow)}
    assert run(Asked(Validate(policy_of("hover"), "mujoco", **options), {})) == 1
    assert "hover: success drops by 100.0 points, 2 are allowed" in " ".join(capsys.readouterr().out.split())
    assert validate(policy_of("hover"), "mujoco", 3, vehicle=str(slow), max_drop=100.0).passed


@pytest.mark.whole
def test_a_policy_that_sees_an_imu_is_validated(policy_of: Callable[..., Path]) -> None:
    seeing = policy_of("hover", imu=ImuConfig(observed=True, gyro_noise=0.0, accel_noise=0.0))
    assert validate(seeing, "simulator", 3).passed


def test_bad_input_is_told(policy_of: Callable[..., Path], tmp_path: Path) -> None:
    hover = policy_of("hover")
    for options, said in (
        ({"plant": "mujocco"}, "unknown plant 'mujocco'; did you mean 'mujoco'"),
        ({"episodes": 0}, "--episodes is 0; accepted: more than 0"),
        ({"max_drop": -1.0}, "--max-drop is -1.0; accepted: 0 or more"),
        ({"max_drop": float("nan")}, "--max-drop is nan"),
        ({"policy": tmp_path / "none.onnx"}, "none.onnx"),
        ({"policy": tmp_path}, "unknown policy '.*policy.onnx'"),
        ({"vehicle": "vis_x"}, "unknown vehicle 'vis_x'"),
    ):
        with pytest.raises((ValueError, OSError), match=said):
            validate(**({"policy": hover, "plant": "mujoco"} | options))


def test_rotor_commands_fly_on_a_plant_that_takes_them() -> None:
    found = validate("any/hover_rotors", "mujoco", episodes=4, vehicle="crazyflie").criteria["hover"]
    assert found.flown.success.all()
    with pytest.raises(ValueError, match="plant 'betaflight' takes no 'rotor_share' commands"):
        validate("any/hover_rotors", "betaflight", episodes=1, vehicle="crazyflie")
