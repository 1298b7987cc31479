"""One flight of a vehicle, as every program would have logged it: what is read from its log is what was flown."""

import dataclasses
import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.estimates import Estimate
from e2efly.alignment.vehicle_file import write_vehicle
from e2efly.commands.cli import run
from e2efly.logs.blackbox_merge import with_blackboxes
from e2efly.logs.readers import LogReading, read_flights
from e2efly.logs.recording import Record, Stream
from e2efly.validation.plant_excitation import Sensors, fly_excitation, sensed
from e2efly.validation.plants import find_plant
from e2efly.vehicles.loading import load_vehicle, read_sigmas
from tests.alignment.flights import FILE, as_mcap
from tests.logs.flight_formats import (
    ELSE,
    MOTIONS,
    PLACES,
    as_bag,
    as_blackbox,
    as_crazyflie,
    as_ulog,
    mavros,
    px4_msgs,
    with_outputs,
)  # fmt: skip

BODY = dataclasses.replace(
    FILE,
    mass=0.9,
    thrust_map=FILE.thrust_map * 0.92,
    motor_time_constant=0.045,
    rate_gain=FILE.rate_gain * [1.15, 0.9, 1.1],
    latency=0.043,
)
OLD = {"MAV_TYPE": 2, "SYS_AUTOSTART": 4001}
NEW = {"CA_ROTOR_COUNT": 4} | {
    f"CA_ROTOR{i}_P{axis}": float(x) for i, at in enumerate(ELSE) for axis, x in zip("XY", PLACES[at], strict=True)
}
BEFORE, AFTER = (*MOTIONS, "actuator_outputs", "esc_status"), (*MOTIONS, "actuator_motors", "esc_status")


@pytest.fixture(scope="module")
def record() -> Record:
    plant = find_plant("mujoco")(FILE)  # type: ignore[call-arg]
    plant.meet(BODY)
    exact = fly_excitation(plant, FILE, BODY.latency, seconds=8.0)
    return with_outputs(sensed(exact, Sensors(pose_delay=0.0, gaps=0), 0), exact, BODY)


LOGS: dict[str, Callable[[Path, Record], Path]] = {
    "PX4 before 1.14": lambda folder, record: as_ulog(folder / "a.ulg", record, BEFORE, OLD),
    "PX4 from 1.14": lambda folder, record: as_ulog(folder / "a.ulg", record, AFTER, NEW, ELSE),
    "mavros, ROS 1": lambda folder, record: as_bag(folder / "a.bag", mavros(record)),
    "mavros, ROS 2": lambda folder, record: as_bag(folder / "a", mavros(record)),
    "px4_msgs": lambda folder, record: as_bag(folder / "a", px4_msgs(record, AFTER), record),
    "px4_msgs before 1.14": lambda folder, record: as_bag(folder / "a", px4_msgs(record, BEFORE), record),
    "blackbox 3.1": lambda folder, record: as_blackbox(folder / "a.bbl", record, "3.1"),
    "blackbox 4.2": lambda folder, record: as_blackbox(folder / "a.bbl", record, "4.2"),
    "blackbox 4.5": lambda folder, record: as_blackbox(folder / "a.TXT", record, "4.5", fine=True),
    "Crazyflie": lambda folder, record: as_crazyflie(folder / "log00", record),
}
POSES = {"position", "velocity", "quaternion"}
INNER = {"body_rate", "specific_force", "motor", "voltage"}
HAVE = {
    "PX4 before 1.14": {*POSES, *INNER, "rotor_speed", "setpoint"},
    "PX4 from 1.14": {*POSES, *INNER, "rotor_speed", "setpoint"},
    "mavros, ROS 1": {*POSES, *INNER, "rotor_speed", "setpoint", "command"},
    "mavros, ROS 2": {*POSES, *INNER, "rotor_speed", "setpoint", "command"},
    "px4_msgs": {*POSES, *INNER, "rotor_speed", "setpoint", "command"},
    "px4_msgs before 1.14": {*POSES, *INNER, "rotor_speed", "setpoint", "command"},
    "blackbox 3.1": INNER,
    "blackbox 4.2": {*INNER, "setpoint"},
    "blackbox 4.5": {*INNER, "rotor_speed", "setpoint"},
    "Crazyflie": {*POSES, *INNER},
}
"""What each gives, besides commands that are made of setpoints."""
ROUNDED = {
    "body_rate": 0.01,
    "setpoint": 0.01,
    "specific_force": 0.01,
    "rotor_speed": 1.0,
    "motor": 1e-3,
    "voltage": 0.06,
}
"""Steps of the numbers in the coarsest of the formats."""


@pytest.mark.parametrize("name", LOGS)
def test_a_log_gives_what_was_flown(tmp_path: Path, record: Record, name: str) -> None:
    """Units, axes, and the order of the rotors are ours."""
    (found,) = read_flights(LOGS[name](tmp_path, record))
    assert set(found.streams) - HAVE[name] <= {"command"}
    for stream in HAVE[name]:
        read, flown = found.streams[stream], record.streams[stream]
        at = read.time - round(read.time[0] - flown.time[0])  # clocks begin anywhere
        values = np.stack([np.interp(at, flown.time, column) for column in flown.values.T], -1)
        if stream == "quaternion":
            values *= np.sign(np.sum(values * read.values, 1, keepdims=True))
        off = np.quantile(np.abs(read.values - values), 0.95, axis=0)  # setpoints step
        assert np.all(off < ROUNDED.get(stream, 1e-3)), (stream, off)


def read(path: Path, **options: object) -> Record:
    (found,) = read_flights(path, LogReading(**options))  # type: ignore[arg-type]
    return found


# PX4


def test_the_order_of_the_rotors_is_told(tmp_path: Path, record: Record) -> None:
    told = read(as_ulog(tmp_path / "a.ulg", record, AFTER, NEW, ELSE)).notes
    assert (
        "CA_ROTOR*_PX and _PY tell the order of the rotors: rear right is 2, front right is 3, rear left is 1, "
        "front left is 4" in told
    )
    for path in (as_ulog(tmp_path / "b.ulg", record, BEFORE, OLD), as_bag(tmp_path / "b.bag", mavros(record))):
        assert any("as PX4 and ArduPilot number those of a quadrotor X" in note for note in read(path).notes)


@pytest.mark.parametrize(
    ("parameters", "why"),
    [
        (NEW | {"CA_ROTOR_COUNT": 6}, r"place the rotors at .* m; accepted: a quadrotor X, one in each quadrant"),
        (NEW | {"CA_ROTOR1_PX": 0.0}, r"place the rotors at .*\(0, "),
        ({"MAV_TYPE": 13}, "MAV_TYPE is 13; accepted: 2, a quadrotor"),
        (OLD | {"SYS_AUTOSTART": 5001}, r"SYS_AUTOSTART is 5001, a quadrotor \+; accepted: a quadrotor X"),
    ],
)
def test_rotors_of_another_frame_are_left_out_by_name(
    tmp_path: Path, record: Record, parameters: dict[str, float], why: str
) -> None:
    found = read(as_ulog(tmp_path / "a.ulg", record, AFTER, parameters))
    assert not {"motor", "rotor_speed"} & {*found.streams} and "body_rate" in found.streams
    assert any(re.search(f"motor, rotor_speed are left out: .*{why}", note) for note in found.notes)


def test_rotors_before_the_control_allocation_are_those_of_the_mixer(tmp_path: Path, record: Record) -> None:
    """PX4 1.13 has its parameters, and does not use them."""
    found = read(as_ulog(tmp_path / "a.ulg", record, BEFORE, OLD | NEW | {"SYS_CTRL_ALLOC": 0}))
    assert np.allclose(found.streams["motor"].values, record.streams["motor"].values, atol=1e-3)


def test_escs_are_taken_by_the_motors_that_they_turn(tmp_path: Path, record: Record) -> None:
    found = read(as_ulog(tmp_path / "a.ulg", record, AFTER, OLD, turned=(2, 3, 1, 0)))
    assert np.allclose(found.streams["rotor_speed"].values, record.streams["rotor_speed"].values, atol=0.1)


def test_of_several_outputs_those_that_move_are_taken(tmp_path: Path, record: Record) -> None:
    found = read(as_ulog(tmp_path / "a.ulg", record, BEFORE, OLD, idle="actuator_outputs"))
    assert np.allclose(found.streams["motor"].values, record.streams["motor"].values, atol=1e-3)
    assert "topics that are not used: actuator_outputs" in found.notes


def test_outputs_that_are_no_pulses_are_left_out_by_name(tmp_path: Path, record: Record) -> None:
    """DShot's go from 0 to 1999."""
    motor = record.streams["motor"]
    shot = dataclasses.replace(record, streams={**record.streams, "motor": Stream(motor.time, 2 * motor.values - 1)})
    found = read(as_ulog(tmp_path / "a.ulg", shot, BEFORE, OLD))
    assert "motor" not in found.streams
    assert any(
        re.search("actuator_outputs gives no motor: its outputs are .* accepted: pulses", n) for n in found.notes
    )


def test_of_two_topics_with_the_same_stream_the_one_with_more_samples_is_taken(tmp_path: Path, record: Record) -> None:
    rate = record.streams["body_rate"]
    slow = dataclasses.replace(
        record, streams={**record.streams, "body_rate": Stream(rate.time[::5], rate.values[::5])}
    )
    path = as_ulog(tmp_path / "a.ulg", slow, ("vehicle_angular_velocity", "sensor_combined"), {})
    found = read(path)
    assert len(found.streams["body_rate"].time) == len(record.streams["specific_force"].time)
    assert "topics that are not used: vehicle_angular_velocity" in found.notes


# Betaflight


def sessions(path: Path, record: Record) -> Path:
    """Of three lengths: 1, 2 and 3 s."""
    parts = [as_blackbox(path, record.during(0.0, end), "4.2").read_bytes() for end in (1.0, 2.0, 3.0)]
    path.write_bytes(b"".join(parts))
    return path


def test_sessions_of_a_blackbox_are_chosen_by_number(tmp_path: Path, record: Record) -> None:
    path = sessions(tmp_path / "a.bbl", record)
    assert [round(found.duration) for found in read_flights(path)] == [1, 2, 3]
    chosen = read_flights(path, LogReading(sessions=(3, 1)))
    assert [round(found.duration) for found in chosen] == [1, 3]
    assert "left out: 1 of 3 sessions, as asked" in chosen[0].notes
    with pytest.raises(ValueError, match=r"a\.bbl: has no session 4; accepted: a session from 1 to 3"):
        read_flights(path, LogReading(sessions=(4,)))
    other = read(as_crazyflie(tmp_path / "log00", record), sessions=(1,))
    assert "--sessions does not concern it: a log of a Crazyflie's micro-SD deck has one flight" in other.notes


def test_what_a_blackbox_lacks_and_what_is_not_used_of_it_is_told(tmp_path: Path, record: Record) -> None:
    notes = read(as_blackbox(tmp_path / "a.bbl", record, "3.1")).notes
    assert "the log has no setpoint, rotor_speed" in notes
    assert "fields that are not used: loopIteration, rcCommand" in notes
    found = read(as_blackbox(tmp_path / "a.bbl", record, "4.5", poles=None))
    assert "rotor_speed" not in found.streams
    assert "eRPM is left out: the header does not say motor_poles" in found.notes
    with pytest.raises(ValueError, match="session 1 has outputs of 6 motors; accepted: a quadrotor's 4"):
        read(as_blackbox(tmp_path / "a.bbl", record, "4.5", motors=6))


def test_rotor_speeds_of_a_blackbox_are_laid_over_a_flight(tmp_path: Path, record: Record) -> None:
    as_mcap(record, tmp_path / "a.mcap")
    flight = read(tmp_path / "a.mcap")
    found = with_blackboxes([flight, read(as_blackbox(tmp_path / "b.bbl", record, "4.5"))])
    assert len(found) == 1 and found[0].has("rotor_speed", "voltage", "command", "position")
    assert np.array_equal(found[0].streams["specific_force"].values, flight.streams["specific_force"].values)
    read_at, flown = found[0].streams["rotor_speed"], record.streams["rotor_speed"]
    began = np.median(found[0].streams["command"].time - record.streams["command"].time)
    speeds = np.interp(read_at.time - began, flown.time, flown.values[:, 0])
    assert np.median(np.abs(read_at.values[:, 0] - speeds)) < 15
    assert any("its specific_force is not used, as the flight log has its own" in note for note in found[0].notes)
    assert "b.bbl: fields that are not used: loopIteration, rcCommand, setpoint[3]" in found[0].notes


# from a log to a vehicle


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", ["blackbox 4.5", "mavros, ROS 1", "PX4 before 1.14"])
def test_a_vehicle_is_identified_from_its_log(
    tmp_path: Path, record: Record, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Thrust within 3 %, the delay within 3 ms. Setpoints alone do not tell when commands were sent."""
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    log, out = LOGS[name](tmp_path, record), tmp_path / "out"
    assert run(["identify", "flight", str(log), "--mass", "0.9", "0.001", "--out", str(out)]) == 0
    found = load_vehicle(out / "vehicle.toml")
    assert found.thrust_map[0] == pytest.approx(BODY.thrust_map[0], rel=0.03)
    assert np.allclose(found.inertia[:2], BODY.inertia[:2], rtol=0.05)
    assert float(found.latency) == pytest.approx(BODY.latency if "command" in HAVE[name] else FILE.latency, abs=3e-3)


@pytest.mark.whole
@pytest.mark.parametrize("name", ["mavros, ROS 2", "blackbox 4.2"])
def test_a_vehicle_is_aligned_with_its_log(
    tmp_path: Path, record: Record, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The rate loop answers with its gain times the thrust that there is. A blackbox shows no delay."""
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    log, out = LOGS[name](tmp_path, record), tmp_path / "out"
    assert run(["align", str(log), "--out", str(out)]) == 0
    found, sigma = load_vehicle(out / "vehicle.toml"), read_sigmas(out / "vehicle.toml")
    late = BODY.latency if "command" in HAVE[name] else 0.0
    assert float(found.latency) == pytest.approx(late, abs=2e-3 + 2 * sigma["latency"])
    assert np.allclose(found.rate_gain, 0.92 * BODY.rate_gain, rtol=0.05 if "command" in HAVE[name] else 0.1)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("name", ["px4_msgs", "Crazyflie", "PX4 from 1.14", "PX4 before 1.14"])
def test_the_vehicle_that_flew_predicts_its_log(
    tmp_path: Path, record: Record, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("e2efly.viewing.style.DPI", 30)
    changed = ("mass", "thrust_map", "motor_time_constant", "rate_gain", "latency")
    said = {x: Estimate(x, np.asarray(v := getattr(BODY, x)), 1e-3 * np.abs(v), "the body") for x in changed}
    write_vehicle(tmp_path / "body.toml", "vis_r", FILE, said)
    log, report = LOGS[name](tmp_path, record), tmp_path / "errors.json"
    more = ["--vehicle", str(tmp_path / "body.toml"), "--json", str(report), "--out", str(tmp_path / "out")]
    assert run(["predict", str(log), *more]) == 0
    (flight,) = json.loads(report.read_text())["flights"]
    half = flight["seconds"].index(0.5)
    for stream in ("position", "velocity"):
        own, hover = (flight["mean_error"][stream][by][half] for by in ("vehicle", "hover thrust"))
        assert own < 0.6 * hover, stream
