"""Logs as they come off the device: whatever the name, the topics, the units and the byte order of the header."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import zstandard
from scipy.spatial.transform import Rotation

from e2efly.alignment.checks import checked
from e2efly.alignment.identification import driver_of
from e2efly.logs.bag_storage import BagTopic
from e2efly.logs.csv_file import column_map, read_csv
from e2efly.logs.readers import FORMATS, LogReading, read_flights
from e2efly.logs.recording import Record, Stream, percent
from e2efly.logs.ros_bag import _store_of
from e2efly.vehicles.loading import load_vehicle
from tests.logs.log_samples import IMU, SAMPLES, bag, crazyflie, odometry, only, two_events, ulog

POSE = odometry()["pose"]["pose"]
RATE = 2 * math.pi / 60


@pytest.mark.parametrize("name", SAMPLES)
def test_a_log_is_recognised_by_its_content_whatever_its_name(tmp_path: Path, name: str) -> None:
    path = SAMPLES[name](tmp_path)
    (expected,) = read_flights(path)
    renamed = path.rename(tmp_path / "LOG00001.TXT")
    (found,) = read_flights(renamed)
    assert found.kind == expected.kind and found.kind in {form.name for form in FORMATS}
    assert {k: len(s.time) for k, s in found.streams.items()} == {k: len(s.time) for k, s in expected.streams.items()}
    assert found.has("body_rate")


def read(path: Path, **options: Any) -> Record:
    (found,) = read_flights(path, LogReading(**options))
    return found


@pytest.mark.parametrize(
    ("local", "earth"), [("/mavros/local_position/odom", "/mavros/global_position/local"), ("/z", "/a")]
)
def test_a_bag_says_which_topic_it_takes_and_prefers_the_local_one(tmp_path: Path, local: str, earth: str) -> None:
    far = odometry(x=464_998.9)
    path = bag(tmp_path / "b", ((earth, "nav_msgs/Odometry", far), (local, "nav_msgs/Odometry", odometry())))
    found = read(path)
    assert np.allclose(found.streams["position"].values, [1, 2, 3])
    assert np.allclose(found.streams["velocity"].values, [4, 0, 0.5])
    assert f"position, quaternion, velocity from {local}" in found.notes
    (other,) = (note for note in found.notes if note.startswith("nothing from"))
    assert f"--topics {earth}" in other
    asked = read(path, topics=(earth,))
    assert np.allclose(asked.streams["position"].values, 0)
    assert f"positions of {earth} are places on the Earth: from the first one" in asked.notes
    with pytest.raises(ValueError, match=rf"b: --topics: unknown topic '/other' \(there are: .*{local}"):
        read(path, topics=("/other",))


def test_poses_of_two_topics_are_not_mixed(tmp_path: Path) -> None:
    """Their worlds may differ. Asked for, they are."""
    vicon = {"transform": {"translation": {"x": 7.0, "y": 8.0, "z": 9.0}, "rotation": POSE["orientation"]}}
    messages = (("/vicon/quad", "geometry_msgs/TransformStamped", vicon), ("/odom", "nav_msgs/Odometry", odometry()))
    path = bag(tmp_path / "b", messages)
    assert "position, quaternion, velocity from /odom" in read(path).notes
    found = read(path, topics=("/vicon/quad",))
    assert np.allclose(found.streams["position"].values, [7, 8, 9]) and "velocity" not in found.streams
    both = read(path, topics=("/vicon/quad", "/odom"))
    assert np.allclose(both.streams["position"].values, [7, 8, 9]) and "velocity" in both.streams


@pytest.mark.parametrize(
    ("kind", "content"),
    [
        ("geometry_msgs/PoseStamped", {"pose": POSE}),
        ("geometry_msgs/PoseWithCovarianceStamped", {"pose": {"pose": POSE}}),
        (
            "geometry_msgs/TransformStamped",
            {"transform": {"translation": POSE["position"], "rotation": POSE["orientation"]}},
        ),
    ],
)
@pytest.mark.parametrize("name", ["a.bag", "a"])
def test_poses_of_every_type_are_read(tmp_path: Path, name: str, kind: str, content: dict[str, Any]) -> None:
    found = read(bag(tmp_path / name, (("/pose", kind, content), ("/scan", "std_msgs/Header", {}))))
    assert np.allclose(found.streams["position"].values, [1, 2, 3])
    assert np.allclose(found.streams["quaternion"].values, [math.sqrt(0.5), 0, 0, math.sqrt(0.5)])
    assert np.allclose(np.diff(found.streams["position"].time), 0.01, atol=1e-6)
    assert "topics that are not used: /scan (std_msgs/msg/Header)" in found.notes


RATES = {"body_rate": {"x": 0.1, "y": 0.2, "z": 0.3}, "thrust": 0.4}
ESC = [{"rpm": rpm} for rpm in (6000, 7000, 8000, 9000)]
TWIST = {"twist": {"linear": {"x": 0.0, "y": 0.0, "z": 12.0}, "angular": {"x": 0.1, "y": 0.2, "z": 0.3}}}


@pytest.mark.parametrize(
    ("topic", "kind", "content", "stream", "values"),
    [
        ("/mavros/rc/out", "mavros_msgs/RCOut", {"channels": [1100, 1200, 1300, 1400]}, "motor", [0.4, 0.1, 0.2, 0.3]),
        ("/mavros/esc_status", "mavros_msgs/ESCStatus", {"esc_status": ESC}, "rotor_speed",
         [9000 * RATE, 6000 * RATE, 7000 * RATE, 8000 * RATE]),
        ("/mavros/setpoint_raw/attitude", "mavros_msgs/AttitudeTarget", RATES, "setpoint", [0.1, 0.2, 0.3]),
        ("/command", "geometry_msgs/TwistStamped", TWIST, "command", [12.0, 0.1, 0.2, 0.3]),
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["a.bag", "a"])
def test_a_bag_carries_what_drives_the_simulation(
    tmp_path: Path, name: str, topic: str, kind: str, content: dict[str, Any], stream: str, values: list[float]
) -> None:
    """Rotors of PX4 (front right, rear left, front left, rear right) in the order of our files."""
    found = read(bag(tmp_path / name, ((topic, kind, content), ("/imu", "sensor_msgs/Imu", IMU))))
    assert np.allclose(found.streams[stream].values, values)
    assert f"{stream} from {topic}" in found.notes


def test_commands_without_a_thrust_drive_the_fit_of_the_rates_alone(tmp_path: Path) -> None:
    messages = (
        ("/target", "mavros_msgs/AttitudeTarget", RATES), ("/masked", "mavros_msgs/AttitudeTarget", {"type_mask": 7}),
        ("/imu", "sensor_msgs/Imu", IMU), ("/velocity", "geometry_msgs/TwistStamped", TWIST),
    )  # fmt: skip
    found = read(bag(tmp_path / "b", messages))
    assert driver_of([found], step=True) == "command"
    with pytest.raises(ValueError, match="commands whose thrust changes"):
        driver_of([found])
    told = " ".join(found.notes)
    assert "thrust of /target is a share of the largest" in told and "nothing from /masked" in told
    assert "/velocity (geometry_msgs/msg/TwistStamped, which is a command only if its name ends in /command)" in told


@pytest.mark.parametrize("storage", ["SQLITE3", "MCAP"])
def test_messages_of_px4_are_what_its_logs_are(tmp_path: Path, storage: str, monkeypatch: pytest.MonkeyPatch) -> None:
    kind = "px4_msgs/msg/ActuatorMotors"
    text = "uint64 timestamp\nuint64 timestamp_sample\nuint16 reversible_flags\nfloat32[12] control\n"
    store = _store_of(BagTopic("", kind, 2, text))
    monkeypatch.setattr("tests.logs.log_samples._store", lambda version: store)
    control = {"timestamp": 5_000_000, "control": [0.1, 0.2, 0.3, 0.4, *[math.nan] * 8]}
    path = bag(tmp_path / "b", (("/fmu/out/actuator_motors", "px4_msgs/ActuatorMotors", control),), 1, storage)
    found = read(path)
    assert np.allclose(found.streams["motor"].values, [[0.4, 0.1, 0.2, 0.3]]) and found.streams["motor"].time[0] == 5


def test_a_file_of_a_bag_may_be_compressed(tmp_path: Path) -> None:
    """As ros2 bag record --compression-mode file does it."""
    folder = bag(tmp_path / "b")
    file = only(folder, ".db3")
    (folder / "b.db3.zstd").write_bytes(zstandard.compress(file.read_bytes()))
    file.unlink()
    assert len(read(folder).streams["body_rate"].time) == 20


def test_attitude_and_voltage_of_a_crazyflie(tmp_path: Path) -> None:
    names = (*(f"stateEstimate.{q}(f)" for q in ("qw", "qx", "qy", "qz")), "pm.vbatMV(H)", "ctrl.cmd(f)")
    found = read(crazyflie(tmp_path / "log00", 5, names, (0.8, 0.6, 0.0, 0.0, 3900, 1.0)))
    assert np.allclose(found.streams["quaternion"].values, [0.8, 0.6, 0, 0])
    assert np.allclose(found.streams["voltage"].values, 3.9)
    assert found.notes == ("variables that are not used: ctrl.cmd",)


def test_events_of_a_crazyflie_have_their_own_times(tmp_path: Path) -> None:
    found = read(two_events(tmp_path / "log01"))
    assert (
        np.allclose(found.streams["body_rate"].values[:, 1], math.pi / 2) and len(found.streams["body_rate"].time) == 20
    )
    assert np.allclose(found.streams["voltage"].time, [0.0005, 0.0055, 0.0105, 0.0155])


def test_angles_and_compressed_state_of_a_crazyflie(tmp_path: Path) -> None:
    """Its pitch is positive with the nose up, against the right hand about the left axis."""
    axes = ("x", "y", "z", "vx", "vy", "vz")
    names = (*(f"stateEstimate.{a}(f)" for a in ("roll", "pitch", "yaw")), *(f"stateEstimateZ.{a}(h)" for a in axes))
    found = read(crazyflie(tmp_path / "log00", 5, names, (10.0, 20.0, 30.0, 1000, -500, 250, 100, 0, -2000)))
    w, x, y, z = found.streams["quaternion"].values[0]
    turned = Rotation.from_quat([x, y, z, w])
    assert np.allclose(turned.as_euler("ZYX", degrees=True), [30, -20, 10])
    assert turned.apply([1.0, 0, 0])[2] > 0
    assert np.allclose(found.streams["position"].values, [1, -0.5, 0.25])
    assert np.allclose(found.streams["velocity"].values, [0.1, 0, -2])


def circle(gravity: float, of: tuple[str, ...], g: float) -> Record:
    """Banked turns at `g` times gravity, 12 m/s: what a race shows, without any rest."""
    t = np.arange(0, 6, 0.004)
    side = 9.81 * math.sqrt(g**2 - 1)
    turn, bank = side / 12.0 * t, math.acos(1 / g)
    pose = Rotation.from_euler("ZX", np.stack([turn, np.full_like(t, -bank)], -1))
    velocity = 12.0 * np.stack([np.cos(turn), np.sin(turn), 0 * t], -1)
    across = side * np.stack([-np.sin(turn), np.cos(turn), 0 * t], -1)
    force = pose.inv().apply(across + np.array([0, 0, 9.81 * gravity]))
    rate = pose.inv().apply(np.stack([0 * t, 0 * t, 0 * t + side / 12.0], -1))
    shake = np.random.default_rng(0).normal(0, 0.01, (len(t), 3))
    streams = {
        "specific_force": force + shake, "body_rate": rate + shake, "velocity": velocity + shake,
        "quaternion": pose.as_quat()[:, [3, 0, 1, 2]],
    }  # fmt: skip
    return Record(Path("race.csv"), {k: Stream(t, v) for k, v in streams.items() if k in (*of, "specific_force")})


def scaled(record: Record, factor: float) -> Record:
    force = record.streams["specific_force"]
    return replace(record, streams={**record.streams, "specific_force": Stream(force.time, force.values * factor)})


@pytest.mark.parametrize("of", [("velocity", "quaternion", "body_rate"), ("velocity",), ()])
@pytest.mark.parametrize("g", [1.02, 2.5, 4.0])
def test_units_are_judged_by_what_gravity_shows(of: tuple[str, ...], g: float) -> None:
    vehicle = load_vehicle("vis_r")
    checked([circle(1.0, of, g)], vehicle)
    with pytest.raises(ValueError, match=rf"has a median size of .*it looks like {'g;' if of else ''}"):
        checked([scaled(circle(1.0, of, g), 1 / 9.81)], vehicle)
    with pytest.raises(ValueError, match=r"specific_force is up to .*in 100 % of its samples; accepted: up to 300 m/s"):
        checked([scaled(circle(1.0, of, g), 1000.0)], vehicle)
    if len(of) > 1:
        with pytest.raises(ValueError, match="it looks like values without gravity"):
            checked([circle(0.0, of, g)], vehicle)


def test_a_remedy_that_is_named_can_be_done_in_every_format(tmp_path: Path) -> None:
    path = bag(tmp_path / "b", (("/imu", "sensor_msgs/Imu", IMU),))
    columns = column_map(["az=az*9.81", "wx=wy", "wy=wx*-1"])
    found = read(path, columns=columns, without=("position",))
    assert np.allclose(found.streams["specific_force"].values, [0, 0.1, 9.81**2])
    assert np.allclose(found.streams["body_rate"].values, [2, -1, 3])
    assert "az of specific_force are changed, as --columns asks" in found.notes
    assert "specific_force" not in read(path, without=("specific_force",)).streams
    with pytest.raises(ValueError, match="--without: unknown stream 'force'"):
        LogReading(without=("force",))


@pytest.mark.parametrize("code", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_units_in_the_header_are_converted(tmp_path: Path, code: str, mark: str) -> None:
    header = ["time [ms]", "wx (°/s)", "wy(deg/s)", "wz (rad/s)", "ax (g)", "ay [m/s²]", "az (mm/s^2)", "temp (°C)"]
    rows = [["1000", "180", "90", "3", "1", "2", "9810", "20"], ["1010", "0", "0", "0", "0", "0", "0", "20"]]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(mark.join(row) for row in (header, *rows)) + "\n", encoding=code)
    found = read(path, columns=column_map(["t=time"]))
    assert np.allclose(found.streams["body_rate"].time, [1.0, 1.01])
    assert np.allclose(found.streams["body_rate"].values[0], [math.pi, math.pi / 2, 3])
    assert np.allclose(found.streams["specific_force"].values[0], [9.81, 2, 9.81])
    assert "wx (°/s) is multiplied by 0.0174533, for wx in rad/s" in found.notes
    assert "columns that are not used: temp (°C)" in found.notes


def test_a_unit_that_is_not_known_is_refused_with_the_known_ones(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t,wx (counts),wy,wz\n0,1,2,3\n1,1,2,3\n")
    with pytest.raises(ValueError, match=r"wx is in the unit of the column wx \(counts\).*accepted: rad/s, .*deg/s"):
        read_csv(path)
    found = read_csv(path, column_map(["wx=wx*0.5"]))
    assert np.allclose(found.streams["body_rate"].values, [0.5, 2, 3])


def test_what_a_log_of_px4_lacks_is_noted(tmp_path: Path) -> None:
    fields = {"vehicle_angular_velocity": "uint64_t stamp;float[3] xyz;"}
    fields["vehicle_attitude"] = "uint64_t timestamp;float[4] q;"
    found = read(ulog(tmp_path / "a.ulg", fields))
    assert set(found.streams) == {"quaternion"}
    assert found.notes == (
        "vehicle_angular_velocity is left out: it has no time stamps",
        "topics that are not used: vehicle_angular_velocity",
    )


@pytest.mark.parametrize(
    ("share", "text"),
    [(1.0, "100 %"), (12.5, "1250 %"), (0.0999, "10 %"), (0.0123, "1.2 %"), (0.996, "100 %"), (0.0, "0 %")],
)
def test_shares_print_as_numbers(share: float, text: str) -> None:
    assert percent(np.float64(share)) == text
