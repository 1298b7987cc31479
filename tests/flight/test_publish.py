"""A flight, live: what each outlet says, and that none of them can hold up the control loop or spoil its log."""

import json
import os
import signal
import socket
import statistics
import struct
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mcap.reader import make_reader
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_typestore

import e2efly
from e2efly.flight.log_record import Logs
from e2efly.flight.publish import Live, targets_of
from e2efly.flight.sight.image_source import Frame
from e2efly.flight.sight.quality import SeenImages
from e2efly.flight.sight.shared import place
from e2efly.logs.channels import CHANNELS
from e2efly.logs.flight_log import read_log
from e2efly.logs.scripts.ros_topics import TOPICS
from e2efly.logs.telemetry import Telemetry
from e2efly.policy.contract import Contract
from tests.conftest import NetworkTrace
from tests.flight.foxglove_client import FoxgloveClient
from tests.flight.live_ros import check_info, check_transforms
from tests.waiting import running, until

CONTRACT: Contract = e2efly.load_policy("avoid").contract
CAMERA = CONTRACT.images[0]
HALF = float(np.sqrt(0.5))
ODOMETRY: dict[str, Any] = {
    "age": 0.004, "position": [1.0, 2.0, 3.0], "velocity": [4.0, 0.0, 0.5], "quaternion": [HALF, 0.0, 0.0, HALF],
    "body_rate": [0.1, 0.2, 0.3],
}  # fmt: skip
IMAGE, INFO = (f"/camera/{CAMERA.name}/{what}" for what in ("image", "camera_info"))
MODE = {"mode": "POLICY", "previous": "HOVER", "reasons": ["switch"]}


Opened = Callable[..., Live]


@pytest.fixture
def opened() -> Iterator[Opened]:
    """Opens outlets, which are closed at the end of a test, however it ends."""
    started: list[Live] = []

    def begin(*targets: str) -> Live:
        started.append(Live(targets_of(targets), [CAMERA]))
        return started[-1]

    yield begin
    for live in started:
        for outlet in live.outlets:
            if outlet._process.poll() is None:
                outlet._process.send_signal(signal.SIGCONT)
        live.close()


def picture(value: float = 1.5) -> np.ndarray:
    """Metres, with a nearer corner."""
    image = np.full(CAMERA.shape, value)
    image[0, 0] = 0.5
    return image


def fly(live: Live, rounds: int = 20) -> float:
    """Some rounds of a flight; when the first was."""
    start = time.monotonic()
    for i in range(rounds):
        now = start + 0.01 * i
        live.record("odometry", now, ODOMETRY)
        live.record("imu", now, {"gyro": [1.0, 2.0, 3.0], "specific_force": [0.0, float("nan"), 9.81]})
        live.record("policy", now, {"observation": np.arange(3.0), "action": [0.1, -0.2, 0.3, -0.4], "step": i})
    live.record("mode", start, MODE)
    live.show([SeenImages(CAMERA, Frame(start, picture()))])
    return start


def stamp_of(moment: float) -> int:
    return time.time_ns() - round((time.monotonic() - moment) * 1e9)


def test_foxglove_hears_the_channels_of_the_log_the_pose_and_the_image(opened: Opened, network: NetworkTrace) -> None:
    live = opened("foxglove:0")
    (address,) = [outlet.detail for outlet in live.outlets]
    host, port = address.removeprefix("ws://").split(":")
    assert host == "127.0.0.1"
    live.record("mode", time.monotonic(), MODE)  # before anybody listens
    client = FoxgloveClient(host, int(port))
    offered = client.advertised(*CHANNELS, "/tf", IMAGE, INFO)
    assert set(offered) == {*CHANNELS, "/tf", IMAGE, INFO}
    assert offered[INFO]["schemaName"] == "foxglove.CameraCalibration"
    assert "[m/s]" in json.loads(offered["odometry"]["schema"])["properties"]["velocity"]["description"]
    assert (offered["/tf"]["schemaName"], offered[IMAGE]["schemaName"]) == (
        "foxglove.FrameTransform",
        "foxglove.RawImage",
    )
    client.subscribe("mode")
    assert json.loads(client.message("mode")[1]) == MODE
    client.subscribe("imu", IMAGE)
    client.subscribe("odometry")
    start = time.monotonic()
    for i in range(100):  # until the subscription has come through
        live.record("odometry", time.monotonic(), {**ODOMETRY, "position": [float(i), 0.0, 0.0]})
        live.show([SeenImages(CAMERA, Frame(time.monotonic(), picture()))])
        live.record("imu", start, {"gyro": [1.0, float("nan"), 3.0]})
        time.sleep(0.01)
    stamp, data = client.message("imu")
    assert json.loads(data) == {"gyro": [1.0, None, 3.0]}
    assert abs(stamp - stamp_of(start)) < 50e6
    assert picture().astype("<f4").tobytes() in client.message(IMAGE)[1]
    client.subscribe(INFO, "/tf")
    for _ in range(50):
        live.record("odometry", time.monotonic(), ODOMETRY)
        live.show([SeenImages(CAMERA, Frame(time.monotonic(), picture()))])
        time.sleep(0.01)
    calibration = client.message(INFO)[1]
    focal = CAMERA.width / 2 / np.tan(CAMERA.fov_rad[0] / 2)
    assert struct.pack("<d", focal) in calibration and f"{CAMERA.name}_optical".encode() in calibration
    placed = client.message("/tf")[1], client.message("/tf")[1]
    assert any(b"map" in each and b"base_link" in each for each in placed)
    assert any(b"base_link" in each and f"{CAMERA.name}_optical".encode() in each for each in placed)
    live.close()
    client.close()
    assert live.problems == []
    assert network.left() == []


def test_an_mcap_file_says_in_ros_2_s_words_what_was_recorded(tmp_path: Path, opened: Opened) -> None:
    live = opened(f"mcap:{tmp_path / 'new' / 'live.mcap'}")
    start = fly(live)
    live.close()
    assert live.problems == []
    store, found = get_typestore(Stores.ROS2_HUMBLE), {}
    with (tmp_path / "new" / "live.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        assert reader.get_header().profile == "ros2"
        for schema, channel, message in reader.iter_messages():
            assert schema is not None and (schema.encoding, channel.message_encoding) == ("ros2msg", "cdr")
            read = store.deserialize_cdr(message.data, schema.name)
            found.setdefault(channel.topic, []).append((message.log_time, read))
        summary = reader.get_summary()
    assert {channel.topic for channel in summary.channels.values()} == {topic.name for topic in TOPICS} | {
        IMAGE,
        INFO,
        "/tf",
    }
    check_messages(found, start)


def test_a_bag_says_in_ros_1_s_words_what_was_recorded(tmp_path: Path, opened: Opened) -> None:
    live = opened(f"bag:{tmp_path / 'live.bag'}")
    start = fly(live)
    live.close()
    assert live.problems == []
    found: dict[str, list[tuple[int, Any]]] = {}
    with AnyReader([tmp_path / "live.bag"]) as reader:
        for connection, stamp, data in reader.messages():
            found.setdefault(connection.topic, []).append((stamp, reader.deserialize(data, connection.msgtype)))
    check_messages(found, start)


def check_messages(found: dict[str, list[tuple[int, Any]]], start: float) -> None:
    """What `fly` recorded, by topic."""
    assert {topic: len(messages) for topic, messages in found.items()} == {
        "/odometry": 20, "/imu": 20, "/mode": 1, "/policy/observation": 20, "/policy/action": 20, IMAGE: 1,
        INFO: 1, "/tf": 20,
    }  # fmt: skip
    stamp, odometry = found["/odometry"][3]
    assert abs(stamp - stamp_of(start + 0.03)) < 50e6
    header = odometry.header.stamp
    assert abs(header.sec * 10**9 + header.nanosec - (stamp - 4_000_000)) < 1000
    twist = odometry.twist.twist.linear  # the body looks along world y: east is to its right
    np.testing.assert_allclose([twist.x, twist.y, twist.z], [0.0, -4.0, 0.5], atol=1e-12)
    imu = found["/imu"][0][1]
    assert np.isnan(imu.linear_acceleration.y) and imu.linear_acceleration.z == 9.81
    np.testing.assert_array_equal(found["/policy/observation"][0][1].data, [0, 1, 2])
    assert found["/mode"][0][1].data == "HOVER -> POLICY: switch"
    image, info = found[IMAGE][0][1], found[INFO][0][1]
    assert info.header.stamp == image.header.stamp
    k, p, d = (getattr(info, name, getattr(info, name.lower(), None)) for name in "KPD")
    check_info(info.height, info.width, info.distortion_model, k, p, d, info.header.frame_id)
    placed = found["/tf"][3][1].transforms
    assert placed[0].header.stamp == header  # when the odometry was true
    check_transforms([
        [each.header.frame_id, each.child_frame_id, None, *(getattr(each.transform.translation, c) for c in "xyz"),
         *(getattr(each.transform.rotation, c) for c in "wxyz")]
        for each in placed
    ])  # fmt: skip
    assert (image.height, image.width, image.encoding) == (*CAMERA.shape, "32FC1")
    assert image.step * image.height == len(image.data)
    np.testing.assert_array_equal(image.data.view("<f4").reshape(CAMERA.shape), picture().astype("<f4"))


def test_a_process_that_stands_still_costs_the_loop_nothing_and_the_log_no_message(
    tmp_path: Path, opened: Opened
) -> None:
    """Four seconds of a flight, as fast as they can be told, to a process that reads none of it."""
    live = opened(f"mcap:{tmp_path / 'live.mcap'}")
    outlet = live.outlets[0]
    outlet._process.send_signal(signal.SIGSTOP)
    costs = []
    with Telemetry(tmp_path / "flight.mcap") as telemetry:
        log = Logs((telemetry, live))
        for i in range(400):
            for channel in ("odometry", "command", "sticks", "timing", "imu", "rc", "policy", "link"):
                began = time.perf_counter()
                log.record(channel, time.monotonic(), ODOMETRY if channel == "odometry" else {"step": i})
                costs.append(time.perf_counter() - began)
            assert sum(costs) < 20.0
            live.show([SeenImages(CAMERA, Frame(time.monotonic(), picture()))])
    kept = read_log(tmp_path / "flight.mcap")
    assert sum(map(len, kept.series.values())) == 3200
    assert outlet.sent + outlet.dropped == 3600
    assert outlet.dropped > 100
    assert statistics.median(costs) < 1e-3  # a wait would be at least as long as the process stands still
    assert live.problems == [f"{outlet.name}: {outlet.dropped} of 3600 records were dropped: it did not take them"]
    outlet._process.send_signal(signal.SIGCONT)

    def taken() -> bool:
        before = outlet.dropped
        live.record("mode", time.monotonic(), MODE)
        return outlet.dropped == before

    until(taken)  # it goes on by itself
    live.close()
    with (tmp_path / "live.mcap").open("rb") as file:
        topics = [channel.topic for _, channel, _ in make_reader(file).iter_messages()]
    assert "/mode" in topics and "/odometry" in topics


def test_a_browser_that_stalls_holds_up_neither_the_process_nor_another_browser(opened: Opened) -> None:
    live = opened("foxglove:0")
    port = int(live.outlets[0].detail.rpartition(":")[2])
    stalled, other = FoxgloveClient("127.0.0.1", port), FoxgloveClient("127.0.0.1", port)
    stalled.subscribe(IMAGE)  # and never reads again
    other.subscribe("odometry")
    told = 0
    for i in range(1500):  # more than the sockets between them keep
        live.show([SeenImages(CAMERA, Frame(time.monotonic(), picture(1 + i / 1500)))])
        live.record("odometry", time.monotonic(), {**ODOMETRY, "age": float(i)})
        time.sleep(0.001)
    while told < 1499:
        told = json.loads(other.message("odometry")[1])["age"]
    assert live.outlets[0].dropped == 0
    stalled.close()
    other.close()


def test_a_process_that_is_killed_is_told_once_and_another_goes_on(tmp_path: Path, opened: Opened) -> None:
    said: list[str] = []
    live = opened("foxglove:0", f"bag:{tmp_path / 'live.bag'}")
    live.say = said.append
    live.outlets[0]._process.kill()
    live.outlets[0]._process.wait()
    fly(live)
    live.close()
    assert said == ["live foxglove:0: its process has ended; the flight goes on without it"]
    assert any("foxglove:0: its process has ended" in problem for problem in live.problems)
    with AnyReader([tmp_path / "live.bag"]) as reader:
        assert sum(1 for _ in reader.messages()) == 103


def test_a_bridge_that_is_killed_leaves_a_whole_file_and_no_process(tmp_path: Path) -> None:
    script = (
        "import sys, time\n"
        "from e2efly.flight.publish import Live, targets_of\n"
        "live = Live(targets_of([f'mcap:{sys.argv[1]}']))\n"
        "live.record('mode', time.monotonic(), {'mode': 'HOVER'})\n"
        "print(live.outlets[0]._process.pid, flush=True)\n"
        "time.sleep(60)\n"
    )
    path = tmp_path / "live.mcap"
    with subprocess.Popen([sys.executable, "-c", script, str(path)], stdout=subprocess.PIPE) as bridge:
        child = int(bridge.stdout.readline())
        bridge.kill()
    until(lambda: not running(child))
    with path.open("rb") as file:
        reader = make_reader(file)
        assert reader.get_summary() is not None
        assert [channel.topic for _, channel, _ in reader.iter_messages()] == ["/mode"]


def test_what_does_not_open_is_named_and_leaves_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(ValueError, match=rf"live foxglove:{port}: .*in use"):
            Live(targets_of([f"foxglove:{port}"]), [CAMERA])
    bare = tmp_path / "python"
    bare.write_text(f'#!/bin/sh\nexec {sys.executable} -S "$@"\n')
    bare.chmod(0o755)
    monkeypatch.setenv("E2EFLY_LIVE_PYTHON", str(bare))
    monkeypatch.delenv("PYTHONPATH", raising=False)
    for text, package in ((f"mcap:{tmp_path / 'a.mcap'}", "rosbags"), ("foxglove:0", "foxglove")):
        with pytest.raises(ValueError, match=rf"No module named '{package}'.*; pip install 'e2efly\["):
            Live(targets_of([text]), [CAMERA])
    assert not (tmp_path / "a.mcap").exists()
    assert not place(f"live_{os.getpid()}_0").exists()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("rviz", r"--live is 'rviz'; accepted: foxglove"),
        ("foxglove:", "accepted: foxglove"),
        ("foxglove:host", "accepted: foxglove"),
        ("foxglove:127.0.0.1:70000", "accepted: foxglove"),
        ("ros2:e2efly", "a prefix from the root, such as ros2:/e2efly"),
        ("ros1:/a//b", "a prefix from the root"),
        ("mcap:flight.bag", r"a file that ends in \.mcap"),
        ("bag", r"a file that ends in \.bag"),
    ],
)
def test_a_malformed_target_is_named(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        targets_of([text])


def test_a_file_that_exists_and_a_target_given_twice_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "old.mcap"
    path.touch()
    with pytest.raises(ValueError, match="exists already; accepted: a new one"):
        targets_of([f"mcap:{path}"])
    with pytest.raises(ValueError, match="given twice"):
        targets_of(["foxglove", "ros2", "foxglove:8765"])
