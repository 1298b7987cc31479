"""Delay and rate loop of vehicles that MuJoCo flies are found from the commands that were sent and the response."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.alignment import LEAD_S, Alignment, align, clearest
from e2efly.alignment.checks import checked
from e2efly.alignment.model import Model
from e2efly.alignment.replay import replay, rms, stretches, wrong
from e2efly.commands.align import pose_delay_of
from e2efly.commands.cli import run
from e2efly.logs.csv_file import write_csv
from e2efly.logs.readers import read_flights
from e2efly.logs.recording import Record, Stream
from e2efly.validation.plant_excitation import Sensors
from e2efly.vehicles.loading import load_vehicle, read_sigmas
from tests.alignment.flights import FILE, PERFECT, as_mcap, flown

BODY = dataclasses.replace(FILE, rate_gain=FILE.rate_gain * [1.3, 0.75, 1.2], latency=0.035)
POSES = 0.02
"""Delay of the poses that is part of the vehicle's latency, s."""


@pytest.fixture(scope="module")
def record() -> Record:
    return flown(BODY, 8.0, Sensors(pose_delay=0.0))


@pytest.fixture(scope="module")
def found(record: Record) -> Alignment:
    return align(FILE, [record], POSES)


@pytest.mark.whole
def test_delay_and_rate_loop_are_found(found: Alignment) -> None:
    """Gains within 5 %, the delay within 2 ms; the vehicle's latency holds the poses' besides."""
    values = {e.name: e.value for e in found.estimates}
    assert set(values) == {"rate_gain", "latency", "motor_time_constant"}
    np.testing.assert_allclose(values["rate_gain"], BODY.rate_gain, rtol=0.05)
    assert abs(float(values["latency"]) - (BODY.latency + POSES)) < 2e-3
    before, after, sigma = found.delay
    assert before == pytest.approx(FILE.latency - POSES) and abs(after - BODY.latency) < 2e-3 and sigma < 2e-3


def test_the_error_falls_where_the_fit_did_not_look(found: Alignment) -> None:
    assert set(found.before) == {"roll_rate", "pitch_rate", "yaw_rate", "thrust", "attitude", "velocity"}
    for signal in ("roll_rate", "pitch_rate", "yaw_rate", "attitude"):
        assert found.after[signal] < 0.5 * found.before[signal], signal
    assert found.thrust == pytest.approx(1.0, abs=0.02)


def test_the_replay_of_the_right_vehicle_is_the_flight() -> None:
    """MuJoCo's flight, by the physics: rotors begin as the commands before the start left them."""
    record = flown(FILE, 4.0, PERFECT)
    starts = 0.5 + 0.4 * np.arange(8)
    flight = stretches(record, starts, 0.4)
    model = Model.of(FILE, "command", FILE, ("latency",))
    error = {signal: rms(e) for signal, e in wrong(flight, replay(model, np.zeros(1), flight)).items()}
    assert error["roll_rate"] < 0.05 and error["pitch_rate"] < 0.05 and error["yaw_rate"] < 0.05
    assert error["attitude"] < 0.01 and error["velocity"] < 0.05 and error["thrust"] < 0.4
    late = {signal: rms(e) for signal, e in wrong(flight, replay(model, np.array([0.03]), flight)).items()}
    assert late["roll_rate"] > 3 * error["roll_rate"]


def test_a_log_of_ours_says_how_late_its_poses_were(tmp_path: Path, record: Record) -> None:
    """40 ms that their source did not tell, and 5 ms of age."""
    as_mcap(record, tmp_path / "flight.mcap", late=0.045, age=0.005)
    read = read_flights(tmp_path / "flight.mcap")
    late, how, known = pose_delay_of(None, checked(read, FILE))
    assert known and late == pytest.approx(0.045, abs=2e-3) and "by the log" in how
    assert pose_delay_of(0.03, read)[0] == 0.03
    late, how, known = pose_delay_of(None, [record])
    assert late == 0 and not known and "--pose-delay" in how


def test_the_clearest_step_is_the_one_from_rest() -> None:
    t = np.arange(0, 6, 0.01)
    command = np.zeros((len(t), 4))
    command[:, 0] = 9.81
    command[(t > 2) & (t < 2.3), 1] = 2.0
    command[(t > 2.3) & (t < 2.6), 1] = -2.0
    record = Record(Path("x"), {"command": Stream(t, command), "body_rate": Stream(t, np.zeros((len(t), 3)))})
    shown = clearest(record, 1)
    assert shown.begin[0] + LEAD_S == pytest.approx(2.01, abs=0.011)
    assert not shown.command[0, shown.time < LEAD_S - 0.01, 1].any()


def test_responses_before_their_commands_are_refused(record: Record) -> None:
    sent = record.streams["command"]
    late = dataclasses.replace(record, streams={**record.streams, "command": Stream(sent.time + 0.1, sent.values)})
    with pytest.raises(ValueError, match=r"answer \d+ ms before the commands were sent; accepted: times of both"):
        align(FILE, [late])


@pytest.mark.whole
def test_the_command_writes_a_vehicle_and_shows_before_and_after(
    tmp_path: Path, record: Record, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    write_csv(record, tmp_path / "log.csv")
    out = tmp_path / "mine"
    assert run(["align", str(tmp_path / "log.csv"), "--pose-delay", str(POSES), "--out", str(out)]) == 0
    vehicle = load_vehicle(out / "vehicle.toml")
    np.testing.assert_allclose(vehicle.rate_gain, BODY.rate_gain, rtol=0.05)
    assert abs(vehicle.latency - BODY.latency - POSES) < 2e-3 and vehicle.mass == FILE.mass
    assert 0 < read_sigmas(out / "vehicle.toml")["latency"] < 2e-3
    assert {p.name for p in out.iterdir()} == {"vehicle.toml", "align.json", "steps.png", "replay.png", "errors.png"}
    report = json.loads((out / "align.json").read_text())
    assert report["held_out"]["rms"]["roll_rate"]["after"] < report["held_out"]["rms"]["roll_rate"]["before"]
    said = capsys.readouterr().out
    assert "rate_gain[0]" in said and "delay from command to response" in said and "roll rate" in said


def test_logs_that_cannot_be_aligned_are_refused_and_nothing_is_written(
    tmp_path: Path, record: Record, capsys: pytest.CaptureFixture[str]
) -> None:
    """Without commands, and without steps: all parameters are named, and what to fly."""

    def refusal(streams: dict[str, Stream], *more: str) -> str:
        write_csv(dataclasses.replace(record, streams=streams), tmp_path / "log.csv")
        assert run(["align", str(tmp_path / "log.csv"), "--out", str(tmp_path / "out"), *more]) == 2
        assert not (tmp_path / "out").exists()
        return " ".join(capsys.readouterr().err.split())

    mute = {name: stream for name, stream in record.streams.items() if name != "command"}
    assert "accepted: command in every flight, besides body_rate" in refusal(mute)
    assert run(["align", f"{tmp_path / 'log.csv'}:5-2", "--out", str(tmp_path / "out")]) == 2
    assert "is from 5 to 2 s" in " ".join(capsys.readouterr().err.split())
    assert "--pose-delay is -1.0; accepted: 0 to 1 s" in refusal(dict(record.streams), "--pose-delay", "-1")
    calm = refusal(dict(flown(FILE, 6.0, Sensors(pose_delay=0.0), speed=0.0, pulses=False).streams))
    for name in ("rate_gain of roll", "rate_gain of pitch", "rate_gain of yaw", "the delay"):
        assert f"{name} cannot be had" in calm
    assert "fly steps or doublets of roll rate, 2 rad/s and more" in calm


def test_a_log_without_thrust_in_its_commands_is_aligned_by_its_rates(record: Record) -> None:
    sent = record.streams["command"].values.copy()
    sent[:, 0] = 9.81
    bare = dataclasses.replace(
        record, streams={**record.streams, "command": Stream(record.streams["command"].time, sent)}
    )
    flight = stretches(bare, 0.5 + 0.4 * np.arange(8), 0.4)
    model = Model.of(FILE, "command", FILE, ("latency",))
    assert set(wrong(flight, replay(model, np.zeros(1), flight))) == {"roll_rate", "pitch_rate", "yaw_rate", "attitude"}
