"""Flight reports: estimates against known truth, figures and summary of whole, partial and cut-off flights."""

import dataclasses
import json
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.image import imread

from e2efly.commands.fly_report import FlyReport, run
from e2efly.logs.blackbox import align, read_blackbox
from e2efly.logs.flight_log import FlightLog, Series, read_log
from e2efly.logs.telemetry import Telemetry
from e2efly.viewing.flight_data import align_command, blackbox_responses, intervals, responses, summary
from e2efly.viewing.flight_figures import draw
from e2efly.viewing.rate_response import step_response

DATA = Path(__file__).parents[1] / "data" / "blackbox"
DEAD_TIME, LAG = (0.012, 0.018, 0.025), (0.025, 0.030, 0.060)
MODES = (
    (0.0, "INIT", []),
    (2.0, "TAKEOFF", ["pilot's switch", "all conditions met"]),
    (5.0, "HOVER", ["height reached"]),
    (8.0, "POLICY", ["pilot's switch", "state inside the policy's envelope"]),
    (21.0, "HOVER", ["odometry stale: 0.12 s, limit 0.10 s"]),
    (24.0, "LAND", ["pilot's switch"]),
    (27.5, "DISARMED", ["landed: still for 1 s on the ground"]),
)
RATE, DURATION = 100, 28.0


def lagged(time: np.ndarray, x: np.ndarray, dead: float, lag: float) -> np.ndarray:
    """x, held between its samples, after a dead time and a first-order lag: exact at the samples' times."""
    fine = 20
    t = np.arange(len(time) * fine) / (RATE * fine)
    held = x[np.clip(np.floor((t - dead) * RATE + 1e-9).astype(int), 0, None)]
    y, part = np.zeros(len(t)), 1 - np.exp(-1 / (RATE * fine * lag))
    for i in range(1, len(t)):
        y[i] = y[i - 1] + part * (held[i - 1] - y[i - 1])
    return y[::fine]


def fly(path: Path, rates: float = 1.0, only: tuple[str, ...] = ()) -> Telemetry:
    """A flight by formulas: up, a lemniscate, down. Its rates follow the commands by `DEAD_TIME` and `LAG`.

    Args:
        path: of the log.
        rates: size of the body-rate commands, rad/s.
        only: the channels recorded; empty: all.
    """
    rng = np.random.default_rng(0)
    t = np.arange(round(DURATION * RATE)) / RATE
    air = ((t > 2.5) & (t < 27)).astype(float)
    height = 1.5 * np.interp(t, [2.5, 5, 24, 27], [0, 1, 1, 0])
    turn = 2 * np.pi / 5 * np.clip(t - 8, 0, 13)
    goal = np.stack([2 * np.sin(turn), np.sin(2 * turn), height], axis=1)
    position = goal + 0.03 * np.sin(np.outer(t, [1.3, 2.1, 0.7])) * np.clip(np.minimum(t - 2.5, 27 - t), 0, 1)[:, None]
    velocity = np.gradient(position, t, axis=0)
    asked = np.zeros((len(t), 3))
    for i in range(1, len(t)):
        asked[i] = 0.93 * asked[i - 1] + 0.4 * rates * rng.normal(size=3) * air[i]
    rate = np.stack([lagged(t, asked[:, i], DEAD_TIME[i], LAG[i]) for i in range(3)], axis=1)
    rate += 0.03 * rng.normal(size=rate.shape)
    throttle = air * (0.36 + 0.05 * np.sin(3 * t) + 0.001 * t + 0.01 * rng.normal(size=len(t)))
    force = np.maximum(18 * np.roll(throttle, 4) + 26 * np.roll(throttle, 4) ** 2 * (1 - 0.004 * t), 9.81 * (air == 0))
    late = np.abs(rng.normal(size=len(t))) * 2e-4 + 4e-3 * (rng.uniform(size=len(t)) > 0.998)
    angle = 0.15 * np.sin(turn) * air
    start = time.monotonic()
    log = Telemetry(path, queue_size=100_000)  # a flight in a moment

    def record(channel: str, i: int, values: dict[str, Any]) -> None:
        if not only or channel in only:
            log.record(channel, start + t[i], values)

    record("meta", 0, {"contract": "{}", "vehicle": "vis_r 0123456789abcdef", "versions": '{"e2efly": "0.1.0"}'})
    changes = {round(when * RATE): (mode, reasons) for when, mode, reasons in MODES}
    mode = ""
    for i in range(len(t)):
        if i in changes:
            previous, (mode, reasons) = mode, changes[i]
            if i:
                record("mode", i, {"mode": mode, "previous": previous, "reasons": reasons})
        quaternion = [np.cos(angle[i] / 2), np.sin(angle[i] / 2), 0.0, 0.0]
        motion = {"position": position[i], "velocity": velocity[i], "quaternion": quaternion, "body_rate": rate[i]}
        record("odometry", i, {"time": start + t[i] - 0.004, "age": 0.004 + late[i], **motion})
        record("imu", i, {"attitude": [angle[i], 0.0, 0.0]})  # in a message of its own, as the controller answers
        record("imu", i, {"gyro": rate[i], "specific_force": [0.0, 0.0, force[i] + 0.2 * rng.normal()]})
        setpoint = goal[i] if mode not in ("INIT", "DISARMED") else None
        thrust = {"source": mode, "collective_thrust": force[i], "yaw": 0.0}
        record("command", i, {**thrust, "body_rate": asked[i], "setpoint": setpoint})
        record("sticks", i, {"channels": [1500] * 8, "throttle": throttle[i], "saturated": False})
        work = 0.0012 + 2e-4 * abs(rng.normal())
        load = {"deadline_missed": bool(late[i] > 3e-3), "cpu_load": 0.18 + 0.01 * rng.normal()}
        record("timing", i, {"period_s": 0.01 + late[i] - late[i - 1], "work_s": work, "lateness_s": late[i], **load})
        if mode == "POLICY":
            network = {"inference_s": 4e-5 + 1e-5 * abs(rng.normal()), "step": i - 800}
            record("policy", i, {"observation": [0.0] * 20, "action": [0.0] * 4, **network})
        if i % 20 == 0:
            record("battery", i, {"voltage": 16.4 - 0.04 * t[i] - 0.4 * air[i], "current": 0.4 + 11 * air[i]})
            record("status", i, {"armed": bool(air[i]), "cpu_load": 0.31 + 0.02 * rng.normal(), "cycle_time": 125e-6})
            counted = {"requests": 3 * i, "replies": 3 * i - i // 500, "timeouts": i // 500, "errors": i // 900}
            record("link", i, {**counted, "reconnects": 0, "round_trip": 0.002 + 4e-4 * abs(rng.normal())})
            scale = 36 - 9 * np.exp(-max(t[i] - 2.5, 0))
            record("throttle_map", i, {"scale": scale, "voltage_gain": 1.0, "residual": 0.3 * rng.normal()})
    record("event", 2100, {"level": "warning", "text": "policy handed over to hover"})
    log.close(timeout=300)
    assert log.problems == {}
    return log


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> FlightLog:
    return read_log(fly(tmp_path_factory.mktemp("flight") / "flight.mcap").path)


def test_modes_follow_one_another_with_their_reasons(log: FlightLog) -> None:
    found = intervals(log)
    assert [(i.mode, list(i.reasons)) for i in found] == [(mode, reasons) for _, mode, reasons in MODES]
    assert [i.start for i in found] == pytest.approx([start for start, _, _ in MODES], abs=1e-6)
    assert all(a.end == b.start for a, b in pairwise(found))


def test_the_step_response_finds_the_true_delay_and_lag(log: FlightLog) -> None:
    for i, (axis, r) in enumerate(responses(log).items()):
        dead, lag = DEAD_TIME[i], LAG[i]
        assert r.reason == "", axis
        assert r.rise == pytest.approx(dead + lag, abs=0.003)
        assert r.delay == pytest.approx(dead + 0.105 * lag, abs=0.004)  # 1 - exp(-0.105) = 10 %
        assert r.gain == pytest.approx(1.0, abs=0.03)
        assert r.overshoot < 0.05
        truth = np.where(r.time > dead, 1 - np.exp(-(r.time - dead) / lag), 0.0)
        assert np.abs(r.response - truth).max() < 0.08


def test_overshoot_is_found() -> None:
    """A second-order loop with damping 0.5 overshoots by exp(-pi 0.5 / sqrt(0.75)) = 16.3 %."""
    step, frequency, damping = 0.001, 40.0, 0.5
    time = step * np.arange(30_000)
    command = np.repeat(np.random.default_rng(1).normal(size=600), 50)
    y, v = np.zeros(len(time)), 0.0
    for i in range(1, len(time)):
        v += step * (frequency**2 * (command[i - 1] - y[i - 1]) - 2 * damping * frequency * v)
        y[i] = y[i - 1] + step * v
    r = step_response(time, command, time, y)
    assert r.reason == ""
    assert r.overshoot == pytest.approx(0.163, abs=0.03)


def test_a_flight_that_does_not_move_has_no_step_response(tmp_path: Path) -> None:
    still = read_log(fly(tmp_path / "still.mcap", rates=0.01, only=("command", "imu", "mode")).path)
    for r in responses(still).values():
        assert r.reason.startswith("not enough excitation")
    numbers = summary(still)["rate_response"]["roll"]
    assert numbers["delay_s"] is None and "not enough excitation" in numbers["reason"]
    assert summary(still)["align"] is None


def test_a_flight_that_cannot_be_aligned_is_not_said_to_be(log: FlightLog) -> None:
    """Too short, or with the body rates of its poses alone."""
    found = responses(log)
    assert align_command(log, found) is not None
    short = {name: _until(s, 6.0) for name, s in log.series.items()}  # of which 2 s on the ground
    assert align_command(dataclasses.replace(log, series={k: s for k, s in short.items() if len(s)}), found) is None
    blind = {name: s for name, s in log.series.items() if name != "imu"}
    assert align_command(dataclasses.replace(log, series=blind), found) is None


def _until(s: Series, end: float) -> Series:
    kept = int(np.sum(s.time <= end))
    return Series(s.channel, s.stamp[:kept], s.time[:kept], s.values[:kept])


def test_a_response_that_is_not_the_command_s_is_not_believed(log: FlightLog) -> None:
    commands = log["command"]
    noise = np.random.default_rng(2).normal(size=len(commands))
    r = step_response(commands.time, commands.numbers("body_rate", 3)[:, 0], commands.time, noise)
    assert "explains" in r.reason


def test_a_loop_that_does_not_end_at_its_command_is_not_believed(log: FlightLog) -> None:
    commands = log["command"]
    roll = commands.numbers("body_rate", 3)[:, 0]
    r = step_response(commands.time, roll, commands.time, 0.4 * roll)
    assert r.gain == pytest.approx(0.4, abs=0.02)
    assert r.reason.startswith("settles at 0.")


def test_the_summary_says_what_was_flown(log: FlightLog) -> None:
    table = summary(log)
    assert table["duration_s"] == pytest.approx(27.99, abs=1e-3) and table["cut_off"] is None
    assert table["vehicle"] == "vis_r 0123456789abcdef"
    missed = log["timing"].numbers("deadline_missed").sum()
    assert table["loop"]["deadlines_missed"] == missed > 0
    assert table["loop"]["work_s"]["p99"] == pytest.approx(np.quantile(log["timing"].numbers("work_s"), 0.99))
    assert 0.02 < table["error_m"]["POLICY"]["rms"] < 0.06
    assert "INIT" not in table["error_m"]  # no setpoint there
    assert table["link"]["timeouts"] == 5 and table["battery"]["voltage_v"]["first"] == pytest.approx(16.4)
    assert table["cpu_load"]["companion"]["mean"] == pytest.approx(0.18, abs=0.01)
    assert table["throttle_map"]["scale"]["first"] == pytest.approx(27.0)
    assert table["events"] == [
        {"time_s": pytest.approx(21.0), "level": "warning", "text": "policy handed over to hover"}
    ]


@pytest.mark.whole
def test_the_command_draws_prints_and_exports(
    tmp_path: Path, log: FlightLog, capsys: pytest.CaptureFixture[str]
) -> None:
    bag1, bag2 = tmp_path / "flight.bag", tmp_path / "bag"
    assert run(FlyReport(log.path, tmp_path / "out", bag1=bag1, bag2=bag2)) == 0
    told = capsys.readouterr().out
    align = f"e2efly align {log.path} --vehicle vis_r.toml"  # the log's vehicle has the name, and another hash
    assert align in "".join(told.split("\n")) and summary(log)["align"] == align
    for word in ("POLICY", "odometry stale", "deadlines missed", "policy handed over", "ROS 1 bag", "ROS 2 bag"):
        assert word in told
    written = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert "has 100 samples of the gyro a second" in written.pop("pid")["reason"]
    assert written == json.loads(json.dumps(summary(log)))
    figures = {path.stem for path in (tmp_path / "out").glob("*.png")}
    assert figures == {"track", "motion", "rates", "response", "loop", "health", "throttle"}
    for name in figures:
        image = imread(tmp_path / "out" / f"{name}.png")
        assert image.shape[1] == 1200 and 0.002 < (image[..., :3] < 0.9).any(axis=2).mean() < 0.9
    assert bag1.is_file() and bag2.is_dir()


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("only", "figures"),
    [
        (("event",), set()),
        (("mode",), {"motion"}),
        (("odometry",), {"track", "motion", "health"}),
        (("command", "sticks"), {"rates", "response", "throttle"}),
        (("status", "policy"), {"loop"}),
    ],
)
def test_a_flight_of_few_channels_is_reported_as_far_as_it_goes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, only: tuple[str, ...], figures: set[str]
) -> None:
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    part = read_log(fly(tmp_path / "part.mcap", only=only).path)
    assert {path.stem for path in draw(part, tmp_path)} == figures == {path.stem for path in tmp_path.glob("*.png")}
    json.dumps(summary(part), allow_nan=False)
    assert summary(part)["align"] is None


def test_a_cut_off_flight_is_reported_and_told(
    tmp_path: Path, log: FlightLog, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    data = log.path.read_bytes()
    (tmp_path / "cut.mcap").write_bytes(data[: len(data) // 2])
    assert run(FlyReport(tmp_path / "cut.mcap")) == 0
    assert "Cut off" in capsys.readouterr().out
    table = json.loads((tmp_path / "cut_report" / "summary.json").read_text())
    assert table["cut_off"] and 5 < table["duration_s"] < 20


def test_a_blackbox_of_real_firmware_is_read_in_our_units_and_frames() -> None:
    """Recorded by Betaflight 4.6 SITL, which was fed the body rates of the flight log beside it."""
    (session,) = read_blackbox(DATA / "sitl.bfl")
    assert "Betaflight 4.6.0" in session.firmware
    assert session.gyro.shape == session.setpoint.shape == (len(session.time), 3)
    assert session.motor.min() >= 0 and session.motor.max() <= 1
    commands = read_log(DATA / "sitl.mcap")["command"].numbers("body_rate", 3)
    np.testing.assert_allclose(session.setpoint.max(axis=0), commands.max(axis=0), atol=0.02)  # signs and scale
    np.testing.assert_allclose(session.setpoint.min(axis=0), commands.min(axis=0), atol=0.02)


def test_a_blackbox_is_laid_over_by_the_gyro(tmp_path: Path) -> None:
    log, (session,) = read_log(DATA / "sitl.mcap"), read_blackbox(DATA / "sitl.bfl")
    laid = align(log["imu"].time, log["imu"].numbers("gyro", 3), session)
    assert laid.correlation > 0.95 and laid.overlap > 7.5
    assert np.all(np.diff(laid.time) > -0.01)
    for axis, r in blackbox_responses(session).items():
        if axis != "yaw":  # which was commanded too little beside what the other axes do to it
            assert r.rise == pytest.approx(responses(log)[axis].rise, abs=0.005)
    assert run(FlyReport(DATA / "sitl.mcap", tmp_path, DATA / "sitl.bfl")) == 0
    table = json.loads((tmp_path / "summary.json").read_text())["blackbox"]
    assert table["start_s"] == pytest.approx(laid.time[0]) and (tmp_path / "blackbox.png").is_file()


def test_the_blackbox_of_another_flight_is_refused(tmp_path: Path, log: FlightLog) -> None:
    with pytest.raises(ValueError, match=r"no session is of the flight .*best correlation 0\.\d+, needed 0\.8"):
        run(FlyReport(log.path, tmp_path / "out", DATA / "sitl.bfl"))
    assert not (tmp_path / "out").exists()


def test_files_that_are_no_blackbox_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="does not exist"):
        read_blackbox(tmp_path / "none.bbl")
    for data in (b"", b"no log", (DATA / "sitl.bfl").read_bytes()[:300]):
        (tmp_path / "bad.bbl").write_bytes(data)
        with pytest.raises(ValueError, match=r"bad\.bbl: no blackbox log that can be read"):
            read_blackbox(tmp_path / "bad.bbl")


def test_a_blackbox_cut_off_by_a_power_loss_is_read_up_to_there(tmp_path: Path) -> None:
    data = (DATA / "sitl.bfl").read_bytes()
    (tmp_path / "cut.bbl").write_bytes(data[: len(data) // 2])
    (part,), (whole,) = read_blackbox(tmp_path / "cut.bbl"), read_blackbox(DATA / "sitl.bfl")
    assert 1000 < len(part.time) < len(whole.time)
    np.testing.assert_array_equal(part.gyro[:-2], whole.gyro[: len(part.time) - 2])
