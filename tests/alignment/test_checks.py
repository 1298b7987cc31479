"""A flight that cannot be learned from is refused by name, and what can be cut away is cut away."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from e2efly.alignment.checks import checked
from e2efly.control import Quat, Vec3
from e2efly.logs.recording import Record, Stream
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle


@pytest.fixture(scope="module")
def vehicle() -> Vehicle:
    return load_vehicle("vis_r")


def flight(late: float = 0.0, drift: float = 0.0, seed: int = 0, seconds: float = 12.0) -> Record:
    """A vehicle that turns to and fro by its rotors' torques, rigid-body kinematics and nothing else."""
    vehicle, rng = load_vehicle("vis_r"), np.random.default_rng(seed)
    dt = 0.005
    t = np.arange(0, seconds, dt)
    turn = np.stack([a * np.sin(w * t + p) for a, w, p in ((3, 5, 0), (2, 7, 1), (1, 3, 2))], -1)
    turn *= 1 + 0.3 * rng.standard_normal()
    change = np.gradient(turn, dt, axis=0)
    # thrusts that give these torques
    x, y = vehicle.rotor_position.T
    lever = np.stack([np.ones(4), y, -x])
    torque = np.concatenate([np.full((len(t), 1), 9.81 * vehicle.mass), change[:, :2] * vehicle.inertia[:2]], 1)
    thrust = torque @ np.linalg.pinv(lever).T
    q = np.empty((len(t), 4))
    q[0] = 1, 0, 0, 0
    for i in range(1, len(t)):
        w, a = (turn[i - 1] + turn[i]) / 2, q[i - 1]
        rate = 0.5 * np.array([-a[1:] @ w, *(a[0] * w + np.cross(a[1:], w))])
        q[i] = (a + rate * dt) / np.linalg.norm(a + rate * dt)
    pose = t * (1 + drift) + late
    up = Quat(*q.T).unrotate(Vec3(0.0, 0.0, 9.81))
    noise = rng.normal(0, 0.05, (len(t), 3))
    return Record(
        Path(f"flight{seed}.csv"),
        {
            "body_rate": Stream(t, turn),
            "specific_force": Stream(t, noise + np.stack([up.x, up.y, up.z], -1)),
            "rotor_speed": Stream(t, np.sqrt(np.maximum(thrust, 0) / vehicle.thrust_map[0])),
            "quaternion": Stream(pose[::2], q[::2]),
            "position": Stream(pose[::2], rng.normal(0, 0.001, (len(t[::2]), 3)) + np.array([0, 0, 1.5])),
        },
    )


def changed(record: Record, name: str, of: Callable[[np.ndarray], np.ndarray]) -> Record:
    stream = record.streams[name]
    return replace(record, streams={**record.streams, name: Stream(stream.time, of(stream.values))})


def test_a_good_flight_stays_as_it_is(vehicle: Vehicle) -> None:
    (found,) = checked([flight()], vehicle)
    assert found.notes == ()
    assert set(found.streams) == set(flight().streams)


@pytest.mark.parametrize("late", [-0.06, 0.08])
def test_poses_are_moved_onto_the_gyroscope_s_clock(vehicle: Vehicle, late: float) -> None:
    (found,) = checked([flight(late)], vehicle)
    assert abs(found.streams["quaternion"].time[0]) < 2e-3
    assert found.notes == (f"poses are moved by {-1000 * late:.0f} ms onto the gyroscope's clock",)


def test_a_clock_of_another_rate_is_corrected(vehicle: Vehicle) -> None:
    (found,) = checked([flight(0.0, 0.01)], vehicle)
    assert found.notes == ("the poses' clock is 1 % fast against the gyroscope's; their times are corrected",)
    true = flight().streams["quaternion"]
    assert np.max(np.abs(found.streams["quaternion"].time - true.time)) < 3e-3


def test_clocks_that_run_apart_unevenly_are_refused(vehicle: Vehicle) -> None:
    record = flight()
    pose = record.streams["quaternion"]
    late = Stream(pose.time + np.where(np.abs(pose.time - 6) < 2, 0.15, 0.0), pose.values)
    with pytest.raises(ValueError, match="their clocks do not run apart evenly"):
        checked([replace(record, streams={**record.streams, "quaternion": late})], vehicle)


def test_the_ground_is_cut_away(vehicle: Vehicle) -> None:
    record = flight()
    on = (record.streams["rotor_speed"].time > 3) & (record.streams["rotor_speed"].time < 10)
    (found,) = checked([changed(record, "rotor_speed", lambda x: np.where(on[:, None], x, 100.0 + 0.01 * x))], vehicle)
    start, end = found.span
    assert 3 < start < 4 and 9 < end < 10
    assert "when it is in the air" in found.notes[0]


def test_single_wrong_samples_are_left_out(vehicle: Vehicle) -> None:
    def hit(x: np.ndarray) -> np.ndarray:
        x = x.copy()
        x[77] = 1e5
        return x

    (found,) = checked([changed(flight(), "body_rate", hit)], vehicle)
    assert len(found.streams["body_rate"].time) == len(flight().streams["body_rate"].time) - 1
    assert "1 samples of body_rate that no quadrotor reaches are left out" in found.notes[0]


@pytest.mark.parametrize(
    ("records", "told"),
    [
        (lambda f: [f, replace(f, path=Path("copy.csv"))], "copy.csv: holds the same numbers as flight0.csv"),
        (lambda f: [changed(f, "specific_force", lambda x: x / 9.81)], "it looks like g; accepted: m/s"),
        (lambda f: [changed(f, "body_rate", lambda x: np.degrees(x))], "body_rate"),
        (lambda f: [changed(f, "body_rate", lambda x: x * 0.01)], "it looks like another unit"),
        (lambda f: [changed(f, "rotor_speed", lambda x: x * 0 + 2000.0)], "n1 of rotor_speed never changes"),
        (lambda f: [changed(f, "rotor_speed", lambda x: x[:, [1, 0, 3, 2]])], "fit it in the order n2, n1, n4, n3"),
        (lambda f: [changed(f, "rotor_speed", lambda x: 0.1 * x)], "never leaves the ground"),
    ],
)  # fmt: skip
def test_a_bad_flight_is_refused_by_name(
    vehicle: Vehicle, records: Callable[[Record], list[Record]], told: str
) -> None:
    with pytest.raises(ValueError, match=told):
        checked(records(flight()), vehicle)


def test_poses_are_turned_onto_the_accelerometer_s_level_before_take_off(vehicle: Vehicle) -> None:
    """Markers that were put on with a pitch of 3 degrees: the poses' x axis points down."""
    record, rest = flight(), 2.0
    half = np.radians(3.0) / 2
    still = np.arange(0, rest, 0.005)
    before = {
        "body_rate": np.zeros(3), "specific_force": np.array([0, 0, 9.81]), "motor": np.zeros(4),
        "quaternion": np.array([1.0, 0, 0, 0]),
    }  # fmt: skip
    thrust = record.streams["rotor_speed"].values ** 2 * vehicle.thrust_map[0] / vehicle.rotor_thrust_max
    streams = {**record.streams, "motor": Stream(record.streams["rotor_speed"].time, thrust)}
    tilted = {}
    for name, at_rest in before.items():
        stream = streams[name]
        values = np.concatenate([np.tile(at_rest, (len(still), 1)), stream.values])
        if name == "quaternion":  # times a turn about y
            w, x, y, z = values.T
            c, s = np.cos(half), np.sin(half)
            values = np.stack([w * c - y * s, x * c - z * s, y * c + w * s, z * c + x * s], -1)
        tilted[name] = Stream(np.concatenate([still, rest + stream.time]), values)
    (found,) = checked([replace(record, streams=tilted)], vehicle)
    assert "poses are turned by 3.0 degrees onto the accelerometer's level before take-off" in found.notes
    pose = found.streams["quaternion"]
    told = np.stack(
        [
            np.interp(pose.time - rest, record.streams["quaternion"].time, q)
            for q in record.streams["quaternion"].values.T
        ],
        -1,
    )
    assert np.all(np.abs(np.sum(told * pose.values, -1)) > 1 - 1e-5)


def test_swapped_motor_outputs_are_told_through_the_motors_lag(vehicle: Vehicle) -> None:
    """Outputs that lead what the body does by lag and delay."""
    record = flight()
    speed = record.streams["rotor_speed"]
    thrust = speed.values**2 * vehicle.thrust_map[0] / vehicle.rotor_thrust_max
    asked = thrust + vehicle.motor_time_constant * np.gradient(thrust, speed.time, axis=0)
    streams = {k: s for k, s in record.streams.items() if k != "rotor_speed"}
    good = replace(record, streams={**streams, "motor": Stream(speed.time - 0.01, np.clip(asked, 0, 1))})
    checked([good], vehicle)
    swapped = changed(good, "motor", lambda x: x[:, [1, 0, 2, 3]])
    with pytest.raises(ValueError, match="the columns fit it in the order m2, m1, m3, m4"):
        checked([swapped], vehicle)


def test_splines_that_overshoot_are_refused(vehicle: Vehicle) -> None:
    rng = np.random.default_rng(0)
    with pytest.raises(ValueError, match=r"rotor_speed is up to 1e\+06 rad/s, and beyond what a quadrotor can do in"):
        checked([changed(flight(), "rotor_speed", lambda x: np.where(rng.random((len(x), 1)) < 0.01, 1e6, x))], vehicle)


def test_a_voltage_that_was_not_measured_scales_no_motor_outputs(vehicle: Vehicle) -> None:
    t = np.arange(0, 12.0, 0.5)
    none, some = (Stream(t, np.where(np.arange(len(t))[:, None] < k, 0.0, 16.1)) for k in (len(t), 3))
    record = flight()
    (dead,) = checked([replace(record, streams={**record.streams, "voltage": none})], vehicle)
    (late,) = checked([replace(record, streams={**record.streams, "voltage": some})], vehicle)
    assert "voltage" not in dead.streams
    assert dead.notes == ("the battery's voltage was not measured: 0 V",)
    assert late.streams["voltage"].values.min() == 16.1
    assert late.notes == ("3 voltages of 0 V are left out",)


def test_axes_that_hardly_move_are_told(vehicle: Vehicle) -> None:
    record = flight()
    time, rng = record.streams["position"].time, np.random.default_rng(1)
    up, still = np.array([0.0, 0.0, 1.0]), rng.normal(0, 1e-4, (len(time), 3))
    climbs = {
        "position": Stream(time, still + (1.5 + 0.5 * np.sin(time))[:, None] * up),
        "velocity": Stream(time, still + (0.5 * np.cos(time))[:, None] * up),
    }
    streams = {name: stream for name, stream in record.streams.items() if name != "specific_force"}
    (found,) = checked([replace(record, streams=streams | climbs)], vehicle)
    assert any("velocity can be checked against the change of position on 1 of 3 axes" in note for note in found.notes)
