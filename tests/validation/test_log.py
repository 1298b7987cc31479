"""Logs of flights on a plant, as `validate --log` writes them and `e2efly identify` reads them."""

from pathlib import Path

import numpy as np
import pytest

import e2efly
from e2efly.commands.cli import run
from e2efly.control import Quat, Vec3
from e2efly.logs.csv_file import read_csv


@pytest.mark.whole
def test_each_flight_has_a_log_that_is_the_flight(tmp_path: Path) -> None:
    found = e2efly.validate("hover", "mujoco", 2, log=tmp_path / "logs")
    paths = sorted((tmp_path / "logs").iterdir())
    assert [path.name for path in paths] == ["hover_0000.csv", "hover_0001.csv"]
    for path, flight in zip(paths, found.criteria["hover"].flights, strict=True):
        streams = read_csv(path).streams
        assert set(streams) == {
            "position", "velocity", "quaternion", "body_rate", "specific_force", "rotor_speed", "command",
        }  # fmt: skip
        assert 250 <= streams["body_rate"].rate < 400
        assert np.diff(streams["position"].time).max() < 0.0041
        # at the control steps the log is the flight
        at = np.searchsorted(streams["position"].time, flight.time - 1e-6)
        assert np.allclose(streams["position"].time[at], flight.time, atol=1e-6)
        assert np.allclose(streams["position"].values[at], flight.position, atol=1e-5)
        assert np.allclose(streams["command"].values, flight.command, atol=1e-5)
        assert np.allclose(streams["command"].time, flight.time[:-1], atol=1e-6)
        # the accelerometer is what changes the velocity
        attitude, force = Quat(*streams["quaternion"].values.T), Vec3(*streams["specific_force"].values.T)
        pull = attitude.rotate(force).stack() - np.array([0, 0, 9.81])
        time, velocity = streams["velocity"].time, streams["velocity"].values
        gained = np.sum((pull[1:] + pull[:-1]) / 2 * np.diff(time)[:, None], 0)
        assert np.allclose(gained, velocity[-1] - velocity[0], atol=0.05)


def test_without_the_option_a_flight_is_the_same_to_the_last_bit(tmp_path: Path) -> None:
    """Sampling cuts the plant's steps only where it steps anyway."""
    with_log, without = (
        e2efly.validate("hover", "simulator", 1, log=log).criteria["hover"].flights[0]
        for log in (tmp_path / "logs", None)
    )
    assert np.allclose(with_log.position, without.position, atol=1e-6)
    assert without.samples == ()


def test_a_log_of_the_stress_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["validate", "hover", "--stress", "--log", str(tmp_path / "logs")]) == 2
    assert "--log is" in capsys.readouterr().err
    assert not (tmp_path / "logs").exists()
