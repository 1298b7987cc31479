"""`e2efly build`: from a list of parts to policies. What flies and trains is replaced: others test both."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from e2efly.commands import build, train
from e2efly.commands.cli import run
from e2efly.policy.zoo import policy_file
from e2efly.vehicles.loading import load_vehicle

FLOWN = {"success": 1.0, "mean_error_m": 0.1, "top_speed_m_s": 2.0}


@pytest.fixture
def flown(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The tasks that were evaluated."""
    seen: list[str] = []

    def fly(policy: Path, file: Path, episodes: int) -> dict[str, Any]:
        seen.append(policy.parent.name)
        return {policy.parent.name: FLOWN}

    monkeypatch.setattr(build, "_flown", fly)
    return seen


@pytest.fixture
def trained(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """The arguments of the trainings. Each writes its policy, and not more than that."""
    asked: list[list[str]] = []

    def learn(arguments: list[str]) -> int:
        asked.append(arguments)
        out = Path(arguments[arguments.index("--out") + 1] if "--out" in arguments else arguments[1])
        assert "--overwrite" in arguments or "--resume" in arguments or not (out / "policy.onnx").exists()
        out.mkdir(parents=True, exist_ok=True)
        for name in ("policy.onnx", "config.json", "summary.json"):
            (out / name).write_text('{"finished": true}')
        return 0

    monkeypatch.setattr(train, "parse", lambda arguments: arguments)
    monkeypatch.setattr(train, "run", learn)
    return asked


def listed(folder: Path, mass: float = 0.2, left: float = 0.0) -> Path:
    """VIS-R as one plate, and a battery beside its middle."""
    path = folder / "mine.toml"
    part = '[[part]]\nname = "{}"\nshape = "box"\nsize = [{}, {}, {}]\nmass = {}\nplace = [0.0, {}, 0.0]\n'
    path.write_text(
        part.format("all", 0.11, 0.11, 0.105, 0.6, 0.0)
        + part.format("battery", 0.08, 0.03, 0.03, mass, left)
        + "tolerance = { mass = 0.002, place = 0.002 }\n"
    )
    return path


def test_what_a_shipped_policy_was_trained_for_is_taken(
    tmp_path: Path, flown: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "out"
    asked = ["build", str(listed(tmp_path, left=0.01)), "--out", str(out), "--tasks", "hover", "land_visual"]
    assert run(asked) == 0
    vehicle = load_vehicle(out / "vehicle.toml")
    assert np.isclose(vehicle.mass, 0.8)
    assert np.allclose(vehicle.centre_of_mass, [0.0, 0.0025, 0.0])  # 0.2 of 0.8 kg, 1 cm to the left
    assert vehicle.rotor_thrust_max == load_vehicle("vis_r").rotor_thrust_max
    for task in ("hover", "land_visual"):
        assert (out / task / "policy.onnx").read_bytes() == policy_file(f"vis_r/{task}").read_bytes()
    assert (out / "land_visual" / "policy.images.npz").exists()
    said = " ".join(capsys.readouterr().out.split())
    assert "mass 0.8 kg: 7 % more than the 0.75 kg of vis_r; trained for 0.5625 to 0.9375 kg" in said
    assert f"e2efly fly {out}/hover --vehicle {out}/vehicle.toml" in said.replace("\n", "")
    assert run(asked) == 0
    assert flown == ["hover", "land_visual"]  # once each: the second build had nothing to do
    report = json.loads((out / "build.json").read_text())["tasks"]
    assert report["hover"]["policy"] == "vis_r/hover" and report["hover"]["criteria"] == {"hover": FLOWN}
    listed(tmp_path, mass=0.21)
    assert run(asked) == 2
    assert "which has the policies of another vehicle" in " ".join(capsys.readouterr().err.split())


def test_a_vehicle_outside_of_every_range_is_trained_for_and_a_stopped_build_goes_on(
    tmp_path: Path, flown: list[str], trained: list[list[str]], capsys: pytest.CaptureFixture[str]
) -> None:
    out, parts = tmp_path / "out", listed(tmp_path, mass=0.4)  # 1 kg: more than VIS-R's policies were trained for
    assert run(["build", str(parts), "--out", str(out), "--preview"]) == 0
    assert not out.exists()
    said = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["hover", "taken:", "any/hover"] in said
    assert ["race_clutter", "trained:", "preset", "robust,", "15.0", "M", "steps"] in said
    assert run(["build", str(parts), "--out", str(out), "--tasks", "hover"]) == 0
    assert (out / "hover" / "policy.onnx").read_bytes() == policy_file("any/hover").read_bytes()
    asked = ["build", str(parts), "--out", str(out), "--tasks", "hover", "race_clutter", "--train", "hover"]
    assert run(asked) == 0
    file = str(out / "vehicle.toml")
    first = ["hover", "--preset", "identified", "--vehicle", file, "--out", str(out / "hover"), "--no-plots"]
    second = ["race_clutter", "--preset", "robust", "--vehicle", file, "--out", str(out / "race_clutter"), "--no-plots"]
    assert trained == [first, second]
    assert run(asked[:-2]) == 0  # without --train: what is trained already is kept
    assert len(trained) == 2
    (out / "hover" / "summary.json").write_text('{"finished": false}')
    (out / "hover" / "checkpoint.safetensors").write_bytes(b"")
    (out / "race_clutter" / "summary.json").unlink()  # stopped before its first checkpoint
    assert run(asked) == 0
    assert trained[2:] == [["--resume", str(out / "hover"), "--no-plots"], [*second, "--overwrite"]]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--tasks", "hovr"], "unknown task 'hovr'; did you mean 'hover'"),
        (["--train", "nothing"], "unknown task 'nothing'"),
        (["--episodes", "0"], "--episodes is 0; accepted: more than 0"),
        (["--vehicle", "vis_x"], "unknown vehicle 'vis_x'; did you mean 'vis_r'"),
    ],
)
def test_bad_input_is_named(more: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["build", str(listed(tmp_path)), "--out", str(tmp_path / "out"), *more]) == 2
    assert message in " ".join(capsys.readouterr().err.split())


def test_a_vehicle_file_is_taken_as_it_is(tmp_path: Path, flown: list[str]) -> None:
    text = (Path(build.__file__).parents[1] / "vehicles" / "vis_h.toml").read_text()
    (tmp_path / "mine.toml").write_text(text)
    out = tmp_path / "out"
    assert run(["build", str(tmp_path / "mine.toml"), "--out", str(out), "--tasks", "hover"]) == 0
    assert (out / "vehicle.toml").read_text() == text
    assert (out / "hover" / "policy.onnx").read_bytes() == policy_file("vis_h/hover").read_bytes()
