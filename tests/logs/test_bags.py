"""Bags of ROS 1 and 2, opened by their own readers."""

import math
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

from e2efly.logs.bags import export_bag
from e2efly.logs.channels import CHANNELS
from e2efly.logs.flight_log import FlightLog, Series, read_log
from e2efly.logs.scripts.ros_topics import BODY_FRAME, TOPICS, WORLD_FRAME, into_body
from e2efly.logs.telemetry import Telemetry
from tests.logs.log_samples import HALF, fly


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> FlightLog:
    """Flying along world x is flying to the right: body -y."""
    start = time.monotonic()
    path = tmp_path_factory.mktemp("log") / "flight.mcap"
    with Telemetry(path) as telemetry:
        fly(telemetry, start)
        for i in range(20):
            now = start + 0.01 * i
            telemetry.record("imu", now, {"attitude": [0.0, 0.0, 0.1]})
            policy = {
                "observation": [0.5, None, -2.0],
                "action": [0.1, -0.2, 0.3, -0.4],
                "inference_s": 1e-4,
                "step": i,
            }
            telemetry.record("policy", now, policy)
            telemetry.record("rc", now, {"channels": [1500, 1000, 2000, 1750]})
        change = {"mode": "POLICY", "previous": "HOVER", "reasons": ["switch", "inside its envelope"]}
        telemetry.record("mode", start + 0.1, change)
        telemetry.record("odometry", start + 0.3, {"position": [0.0, float("nan"), 0.0], "age": None})
    assert telemetry.problems == {}
    return read_log(path)


def read(path: Path, version: int) -> dict[str, list[tuple[int, Any]]]:
    store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
    found: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([path], default_typestore=store) as reader:
        for connection, stamp, data in reader.messages():
            found.setdefault(connection.topic, []).append((stamp, reader.deserialize(data, connection.msgtype)))
    return found


@pytest.mark.parametrize("version", [1, 2])
def test_a_bag_says_what_the_log_says_in_ros_s_words(tmp_path: Path, log: FlightLog, version: int) -> None:
    path = tmp_path / ("flight.bag" if version == 1 else "flight")
    counts = export_bag(log, path, version)
    bag = read(path, version)
    assert counts == {topic: len(messages) for topic, messages in bag.items()}
    assert counts == {"/odometry": 21, "/imu": 20, "/command": 20, "/rc": 20, "/battery": 1, "/mode": 1,
                      "/policy/observation": 20, "/policy/action": 20}  # fmt: skip

    stamp, odometry = bag["/odometry"][3]
    assert stamp == log["odometry"].stamp[3]
    header = odometry.header.stamp
    assert header.sec * 10**9 + header.nanosec == stamp - 4_000_000  # when it was true, not when it was used
    assert (odometry.header.frame_id, odometry.child_frame_id) == (WORLD_FRAME, BODY_FRAME)
    pose, twist = odometry.pose.pose, odometry.twist.twist
    np.testing.assert_allclose([pose.position.x, pose.position.y, pose.position.z], [0.3, 2.0, 3.0])
    np.testing.assert_allclose([pose.orientation.w, pose.orientation.x, pose.orientation.z], [HALF, 0.0, HALF])
    np.testing.assert_allclose([twist.linear.x, twist.linear.y, twist.linear.z], [0.0, -4.0, 0.5], atol=1e-12)
    np.testing.assert_allclose([twist.angular.x, twist.angular.y, twist.angular.z], [0.1, 0.2, 0.3])
    assert math.isnan(bag["/odometry"][20][1].pose.pose.position.y)

    imu = bag["/imu"][0][1]
    assert (imu.angular_velocity.z, imu.linear_acceleration.z) == (3.0, 9.81)
    assert imu.orientation_covariance[0] == -1 and imu.header.frame_id == BODY_FRAME
    command = bag["/command"][0][1].twist
    assert (command.linear.z, command.angular.y, command.angular.z) == (12.0, -1.0, 0.5)
    battery = bag["/battery"][0][1]
    assert (battery.voltage, battery.current, len(battery.cell_voltage)) == (15.5, -8.0, 4)
    np.testing.assert_allclose(bag["/rc"][0][1].axes, [0.0, -1.0, 1.0, 0.5])
    np.testing.assert_allclose(bag["/policy/observation"][0][1].data, [0.5, math.nan, -2.0])
    np.testing.assert_allclose(bag["/policy/action"][0][1].data, [0.1, -0.2, 0.3, -0.4], rtol=1e-6)
    assert bag["/mode"][0][1].data == "HOVER -> POLICY: switch; inside its envelope"


def test_what_cannot_be_written_is_refused_by_name(tmp_path: Path, log: FlightLog) -> None:
    with pytest.raises(ValueError, match="version is 3; accepted: 1"):
        export_bag(log, tmp_path / "a.bag", 3)
    with pytest.raises(ValueError, match=r"accepted for ROS 1: a file ending in \.bag"):
        export_bag(log, tmp_path / "a", 1)
    with pytest.raises(ValueError, match="accepted for ROS 2: a folder"):
        export_bag(log, tmp_path / "a.bag", 2)
    with pytest.raises(ValueError, match="exists already"):
        export_bag(log, tmp_path, 2)
    with pytest.raises(ValueError, match="has no message of odometry, imu"):
        export_bag(FlightLog(log.path, {}, {}, ""), tmp_path / "b", 2)
    assert list(tmp_path.iterdir()) == []


def test_a_vector_is_turned_into_the_body_s_axes() -> None:
    random = np.random.default_rng(0)
    for _ in range(20):
        q, v = random.normal(size=4), random.normal(size=3)
        q /= np.linalg.norm(q)
        turned = Rotation.from_quat(q, scalar_first=True).inv().apply(v)
        np.testing.assert_allclose(into_body(q.tolist(), v.tolist()), turned, atol=1e-12)


def test_every_topic_has_a_name_of_its_own_and_a_channel_of_the_log() -> None:
    assert len({topic.name for topic in TOPICS}) == len(TOPICS)
    assert {topic.channel for topic in TOPICS} <= set(CHANNELS)


def test_a_message_that_is_not_of_its_schema_is_named(tmp_path: Path, log: FlightLog) -> None:
    bad = Series("rc", log["rc"].stamp[:1], log["rc"].time[:1], ({"channels": ["left"]},))
    with pytest.raises(ValueError, match=r"flight log: rc has \{'channels': \['left'\]\}"):
        export_bag(FlightLog(log.path, {"rc": bad}, {}, ""), tmp_path / "c", 2)
    assert list(tmp_path.iterdir()) == []
