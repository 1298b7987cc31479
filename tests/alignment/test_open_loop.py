"""Flights are foretold by vehicles, and by predictions that need none."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.model import LOST, NUISANCES, Model
from e2efly.alignment.open_loop import AHEAD, HOLD, HOVER, OWN_S, OWN_VEHICLE, VEHICLE, Forecast, forecast, typical
from e2efly.commands.cli import run
from e2efly.logs.csv_file import write_csv
from e2efly.logs.recording import Record, Stream
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle
from tests.alignment.flights import FILE, PERFECT, flown

HEAVY = dataclasses.replace(FILE, mass=1.15 * FILE.mass)
SAG = 0.1


@pytest.fixture(scope="module")
def record() -> Record:
    return flown(FILE, 15.0, PERFECT, sag=SAG)


def foretold(vehicle: Vehicle, record: Record, driver: str) -> Forecast:
    model = Model.of(vehicle, driver)
    return forecast(model, np.zeros(len(model.unknowns)), np.zeros(len(NUISANCES)), record)


def outputs(record: Record, every: int) -> Record:
    """With the motor outputs that led to the rotor speeds by the file's lag, in place of what else drives a vehicle."""
    rotors = record.streams["rotor_speed"]
    asked = rotors.values + FILE.motor_time_constant * np.gradient(rotors.values, rotors.time, axis=0)
    share = np.clip(FILE.thrust_map[0] * np.maximum(asked, 0.0) ** 2 / FILE.thrust_range[1], 0.0, 1.0)
    streams = {k: s for k, s in record.streams.items() if k not in ("rotor_speed", "command")}
    motor = Stream(rotors.time[::every], (np.sqrt(0.25 + 2 * share) - 0.5)[::every])
    return dataclasses.replace(record, streams=streams | {"motor": motor})


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("driver", ["command", "rotor_speed"])
def test_the_vehicle_that_flew_predicts_far_better_than_hold_and_a_wrong_mass_worse(driver: str) -> None:
    flight = flown(FILE, 8.0, PERFECT)
    right, wrong = (foretold(vehicle, flight, driver).mean() for vehicle in (FILE, HEAVY))
    for stream in ("position", "velocity", "quaternion"):
        assert np.all(right[stream][VEHICLE][:3] < 0.2 * right[stream][HOLD][:3]), stream
    assert np.all(right["position"][VEHICLE] < 0.5 * wrong["position"][VEHICLE])
    assert np.allclose(right["position"][HOLD], wrong["position"][HOLD])


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("every, driver", [(1, "motor"), (5, "motor_and_rate")])
def test_motor_outputs_drive_a_prediction(every: int, driver: str) -> None:
    """Those that the measured rates turn do not foretell the attitude, which is an input."""
    prompt = dataclasses.replace(FILE, latency=0.0)  # these outputs are those of the motors' own time
    found = foretold(prompt, outputs(flown(FILE, 6.0, PERFECT), every), driver)
    told = found.mean()
    assert found.driver == driver and ("quaternion" in told) == (driver == "motor")
    assert np.all(told["position"][VEHICLE][:2] < 0.35 * told["position"][HOLD][:2])


def test_the_flights_own_thrust_helps_where_its_battery_sags(record: Record) -> None:
    found = foretold(FILE, record, "rotor_speed")
    told = found.mean()["position"]
    assert np.all(told[OWN_VEHICLE] < 0.75 * told[VEHICLE])
    assert np.log(1 - 2 / 3 * SAG) < found.own["flight_thrust"] < -0.01  # what is lost within the first 10 s
    rest = found.begin >= OWN_S
    assert told[OWN_VEHICLE][0] == pytest.approx(found.size["position"][OWN_VEHICLE][rest, 0].mean())


def test_what_is_lost_with_time_goes_with_the_length_of_a_flight() -> None:
    q = np.zeros((2, len(NUISANCES)))
    q[:, LOST] = 0.02, 0.08
    assert typical(q, [10.0, 40.0], 30.0)[LOST] == pytest.approx(0.06)


def made(thrust: float, tilt: float) -> Record:
    """A flight of constant thrust over mass along a constant attitude, tilted about y."""
    t = np.arange(0, 6, 0.01)
    turned = thrust * np.array([np.sin(tilt), 0.0, np.cos(tilt)]) - np.array([0.0, 0.0, GRAVITY])
    still, one = np.zeros((len(t), 3)), np.ones((len(t), 4))
    values = {
        "body_rate": still, "rotor_speed": 900 * one, "quaternion": [np.cos(tilt / 2), 0, np.sin(tilt / 2), 0] * one,
        "velocity": np.array([1.0, 2.0, 0.0]) + turned * t[:, None],
        "position": np.array([1.0, 2.0, 0.0]) * t[:, None] + 0.5 * turned * t[:, None] ** 2,
    }  # fmt: skip
    return Record(Path("made.csv"), {name: Stream(t, np.array(x)) for name, x in values.items()})


def test_hold_is_exact_at_constant_velocity_and_hover_thrust_at_constant_thrust() -> None:
    steady = foretold(FILE, made(GRAVITY, 0.0), "rotor_speed").mean()
    assert np.all(steady["position"][HOLD] < 1e-9) and np.all(steady["velocity"][HOLD] < 1e-9)
    pushed = foretold(FILE, made(11.0, 0.2), "rotor_speed").mean()
    assert np.all(pushed["position"][HOVER] < 1e-6) and np.all(pushed["velocity"][HOVER] < 1e-6)
    times = np.array(AHEAD)
    moved = np.hypot(11.0 * np.sin(0.2), 11.0 * np.cos(0.2) - GRAVITY)
    assert np.allclose(pushed["position"][HOLD], 0.5 * moved * times**2, rtol=1e-6)


def test_positions_alone_tell_the_velocity_at_the_start() -> None:
    flight = made(GRAVITY, 0.0)
    bare = {name: s for name, s in flight.streams.items() if name != "velocity"}
    told = foretold(FILE, dataclasses.replace(flight, streams=bare), "rotor_speed").mean()
    assert "velocity" not in told and np.all(told["position"][HOLD] < 1e-6)


def test_a_flight_that_is_too_short_is_refused_by_name() -> None:
    with pytest.raises(ValueError, match=r"made.csv: lasts 0\.50 s; accepted: 0\.552 s or more"):
        foretold(FILE, made(GRAVITY, 0.0).during(0.0, 0.5), "rotor_speed")
    assert foretold(FILE, made(GRAVITY, 0.0).during(0.0, 1.0), "rotor_speed").ahead == (0.3, 0.5)


def test_the_command_prints_and_writes_the_errors_of_each_flight(
    tmp_path: Path, record: Record, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    write_csv(record, tmp_path / "log.csv")
    words = ["predict", str(tmp_path / "log.csv"), "--out", str(tmp_path), "--json", str(tmp_path / "errors.json")]
    assert run([*words, "--without", "command"]) == 0
    (flight,) = json.loads((tmp_path / "errors.json").read_text())["flights"]
    assert flight["driven_by"] == "rotor_speed" and flight["seconds"] == list(AHEAD)
    position = flight["mean_error"]["position"]
    assert position["unit"] == "m" and position[VEHICLE][0] < position[HOLD][0]
    assert (tmp_path / "prediction.png").stat().st_size > 0
    said = capsys.readouterr().out
    assert "hover thrust" in said and "position (m)" in said
    assert run(["predict", str(tmp_path / "gone.csv")]) == 2 and run(["predict"]) == 2
    assert run([*words, "--volts", "0"]) == 2
    assert "--volts is 0.0; accepted: above 0 V" in capsys.readouterr().err
