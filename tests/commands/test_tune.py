"""`e2efly tune`: from a log of a flight to a policy."""

import json
from pathlib import Path

import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.config.storage import held
from e2efly.logs.csv_file import write_csv
from e2efly.validation.plant_excitation import Sensors, fly_excitation, sensed
from e2efly.validation.plants import find_plant
from e2efly.validation.stress import stress
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.posterior import load_posterior


@pytest.mark.whole
def test_a_log_becomes_a_policy_for_the_vehicle_that_it_shows(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    # every row of the stress, from one batch of starts instead of four
    monkeypatch.setattr("e2efly.validation.stress.stress", lambda policy, _, **flies: stress(policy, 50, **flies))
    vehicle = load_vehicle("vis_r")
    plant = find_plant("mujoco")(vehicle)
    log, out = tmp_path / "flight.csv", tmp_path / "tuned"
    write_csv(sensed(fly_excitation(plant, vehicle, 0.04, seconds=8.0), Sensors(), 0), log)
    asked = ["tune", str(log), "--task", "hover", "--mass", "0.75", "0.002", "--steps", "2000", "--out", str(out)]
    assert run(asked) == 0
    file = out / "identified" / "vehicle.toml"
    found = load_vehicle(file)
    assert np.isclose(found.latency, 0.04, atol=2e-3)
    policy = e2efly.load_policy(str(out / "policy.onnx"))
    assert policy.contract.vehicle_hash == found.hash
    low, high = policy.contract.latency_range_s  # what the flights leave open of the delay
    assert (high - low) / 2 == pytest.approx(2.5 * load_posterior(file).sigma["latency"], rel=1e-3)
    config = json.loads((out / "run" / "config.json").read_text())
    assert config["env"]["randomize"] == {"identified": 1.0}
    # it began with the zoo's policy of any quadrotor, and means the same by its actions
    assert policy.contract.action.command_range == e2efly.load_policy("any/hover").contract.action.command_range
    alone = e2efly.evaluate(out / "policy.onnx", episodes=50, vehicle=str(file))  # it left its run's folder
    assert np.mean(alone.flown["hover"].success) > 0.9
    assert set(json.loads((out / "stress.json").read_text())["stress"]) >= {"nominal", "mass x1.25"}
    assert run(asked) == 2  # nothing is lost: the run is there


@pytest.mark.parametrize("asked", [["tune", "--task", "hover"], ["identify", "flight"]])
def test_two_writers_of_a_folder_are_not_let_in(
    asked: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    command, *more = asked
    with held(tmp_path / "out"):
        assert run([command, *more, str(tmp_path / "flight.csv"), "--out", str(tmp_path / "out")]) == 2
    assert "out is in use by process" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize(
    ("given", "message"),
    [
        (["--task", "hoover"], "unknown task 'hoover'; did you mean 'hover'?"),
        (["--task", "hover", "--mass", "0", "1"], "--mass is 0.0 1.0; accepted: kg"),
        ([], "none.csv' does not exist"),
    ],
)
def test_what_cannot_be_tuned_is_named(
    given: list[str], message: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["tune", str(tmp_path / "none.csv"), "--out", str(tmp_path / "out"), *given]) == 2
    assert message in " ".join(capsys.readouterr().err.split())
    assert not (tmp_path / "out").exists()
