"""What a real subscriber of ROS 1 or 2 hears of a flight: both tests' common part."""

import json
import subprocess
import threading
import time
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import e2efly
from e2efly.flight.publish import Live, targets_of
from e2efly.flight.sight.image_source import Frame
from e2efly.flight.sight.quality import SeenImages

CAMERA = e2efly.load_policy("avoid").contract.images[0]
HALF = float(np.sqrt(0.5))
IMAGE = np.linspace(0.5, 2.5, CAMERA.height * CAMERA.width, dtype=np.float32).reshape(CAMERA.shape)
MODE = {"mode": "POLICY", "previous": "HOVER", "reasons": ["switch"]}
LONGEST = 30.0
"""How long a subscriber may take to hear everything, s."""

TAKE = """
import json, sys, threading
from geometry_msgs.msg import TwistStamped
from nav_msgs.msg import Odometry
from sensor_msgs.msg import BatteryState, CameraInfo, Image, Imu, Joy
from std_msgs.msg import Float32MultiArray, String
def seconds(stamp):
    return stamp.sec + 1e-9 * stamp.nanosec if hasattr(stamp, "sec") else stamp.to_sec()
camera = "camera/" + sys.argv[2]
kinds = {"odometry": Odometry, "imu": Imu, "command": TwistStamped, "battery": BatteryState, "rc": Joy, "mode": String,
         "policy/observation": Float32MultiArray, "policy/action": Float32MultiArray, camera + "/image": Image,
         camera + "/camera_info": CameraInfo}
missing, one = set(kinds), threading.Lock()  # topics come by threads of their own
def take(name, m):
    with one:
        if name in missing:
            tell(name, m)
            missing.discard(name)
def tell(name, m):
    stamp = seconds(m.header.stamp) if hasattr(m, "header") else None
    if name == "odometry":
        v, p = m.twist.twist.linear, m.pose.pose.position
        said = [p.x, p.y, p.z, v.x, v.y, v.z, m.header.frame_id, m.child_frame_id]
    elif name == "imu":
        said = [m.linear_acceleration.z, m.angular_velocity.x, m.orientation_covariance[0]]
    elif name == "command":
        said = [m.twist.linear.z, m.twist.angular.y]
    elif name == "battery":
        said = [m.voltage, m.current, len(m.cell_voltage)]
    elif name == "rc":
        said = list(m.axes)
    elif name == "/tf":
        said = [[t.header.frame_id, t.child_frame_id, seconds(t.header.stamp)]
                + [getattr(t.transform.translation, c) for c in "xyz"]
                + [getattr(t.transform.rotation, c) for c in "wxyz"]
                for t in m.transforms]
    elif name.endswith("camera_info"):
        k, p, d = (getattr(m, c, getattr(m, c.lower(), None)) for c in "KPD")
        said = [m.height, m.width, m.distortion_model, list(k), list(p), list(d), m.header.frame_id]
    elif name.endswith("image"):
        said = [m.height, m.width, m.encoding, m.step, bytes(m.data).hex()]
    else:
        said = m.data if name == "mode" else list(m.data)
    print(json.dumps([name, stamp, said]), flush=True)
"""
"""A subscriber's program but for the subscribing: `kinds` by topic, and `take`, which prints the first of each."""

Heard = dict[str, tuple[float | None, Any]]


class Subscriber:
    """A process that prints each topic's first message as JSON."""

    def __init__(self, command: list[str]) -> None:
        self.heard: Heard = {}
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, start_new_session=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def wait_for(self, count: int, deadline: float) -> bool:
        """Whether it has heard so many topics."""
        while len(self.heard) < count and time.monotonic() < deadline and self.process.poll() is None:
            time.sleep(0.01)
        return len(self.heard) >= count

    def close(self) -> None:
        self.process.kill()
        self.process.wait()
        self._reader.join(5)
        self.process.stdout.close()

    def _read(self) -> None:
        for line in self.process.stdout:
            name, stamp, said = json.loads(line)
            self.heard[name] = stamp, said


def heard(target: str, prefix: str, command: list[str]) -> Heard:
    """Fly until a subscriber has heard a message of each topic."""
    live = Live(targets_of([target]), [CAMERA])
    subscriber = Subscriber([*command, prefix, CAMERA.name])
    try:
        end = time.monotonic() + LONGEST
        while subscriber.process.poll() is None and time.monotonic() < end:
            now = time.monotonic()
            live.record("odometry", now, {
                "age": 0.0, "position": [1.0, 2.0, 3.0], "velocity": [4.0, 0.0, 0.5],
                "quaternion": [HALF, 0.0, 0.0, HALF], "body_rate": [0.1, 0.2, 0.3],
            })  # fmt: skip
            live.record("imu", now, {"gyro": [1.0, 2.0, 3.0], "specific_force": [0.0, 0.0, 9.81]})
            live.record("command", now, {"collective_thrust": 12.0, "body_rate": [0.0, -1.0, 0.5]})
            live.record("battery", now, {"voltage": 15.5, "current": 8.0, "cells": 4})
            live.record("rc", now, {"channels": [1500, 1000, 2000, 1750]})
            live.record("policy", now, {"observation": [0.5, None], "action": [0.25, 0.0, 0.0, -1.0], "step": 1})
            live.record("mode", now, MODE)
            live.show([SeenImages(CAMERA, Frame(now, IMAGE))])
            time.sleep(0.02)
        subscriber.wait_for(11, time.monotonic() + 2)
        live.close()
        assert live.problems == []
        return subscriber.heard
    finally:
        subscriber.close()
        live.close()


def check(said: Heard) -> None:
    """What `heard` flew, in ROS's words."""
    values = {name: value for name, (_, value) in said.items()}
    image, info = f"camera/{CAMERA.name}/image", f"camera/{CAMERA.name}/camera_info"
    assert set(values) - {"/tf"} == {
        "ready", "odometry", "imu", "command", "battery", "rc", "mode", "policy/observation", "policy/action", image,
        info,
    }  # fmt: skip
    check_info(*values[info])
    for name, (stamp, _) in said.items():
        assert stamp is None or abs(stamp - time.time()) < 120, name
    np.testing.assert_allclose(values["odometry"][:6], [1, 2, 3, 0, -4, 0.5], atol=1e-9)
    assert values["odometry"][6:] == ["map", "base_link"]
    assert values["imu"] == [9.81, 1.0, -1.0]
    assert values["command"] == [12.0, -1.0]
    assert values["battery"] == [15.5, -8.0, 4]
    assert values["rc"] == [0.0, -1.0, 1.0, 0.5]
    assert values["mode"] == "HOVER -> POLICY: switch"
    np.testing.assert_array_equal(values["policy/observation"], [0.5, np.nan])
    np.testing.assert_array_equal(values["policy/action"], [0.25, 0.0, 0.0, -1.0])
    height, width, encoding, step, data = values[image]
    assert (height, width, encoding, step) == (*CAMERA.shape, "32FC1", 4 * CAMERA.width)
    np.testing.assert_array_equal(np.frombuffer(bytes.fromhex(data), "<f4").reshape(CAMERA.shape), IMAGE)


def check_info(height: int, width: int, model: str, k: Any, p: Any, d: Any, frame: str) -> None:
    """Of the camera: a ray through the edge of the image is half of the field of view aside."""
    assert (height, width, model, frame) == (*CAMERA.shape, "plumb_bob", f"{CAMERA.name}_optical")
    np.testing.assert_allclose(np.reshape(p, (3, 4))[:, :3], np.reshape(k, (3, 3)))
    assert not np.any(d)
    for size, focal, middle, angle in ((width, k[0], k[2], CAMERA.fov_rad[0]), (height, k[4], k[5], CAMERA.fov_rad[1])):
        np.testing.assert_allclose(
            [(-0.5 - middle) / focal, (size - 0.5 - middle) / focal], np.tan([-angle / 2, angle / 2])
        )


def check_transforms(found: list[list[Any]]) -> None:
    """The body in the room and the camera on the body, as rviz asks for them: the camera looks along the nose."""
    assert [each[:2] for each in found] == [["map", "base_link"], ["base_link", f"{CAMERA.name}_optical"]]
    body, camera = (np.array(each[3:], float) for each in found)
    np.testing.assert_allclose(body, [1, 2, 3, HALF, 0, 0, HALF], atol=1e-9)
    np.testing.assert_allclose(camera[:3], CAMERA.position_m)
    turn = Rotation.from_quat(camera[3:], scalar_first=True)
    down = np.array([np.cos(CAMERA.pitch_rad), 0, -np.sin(CAMERA.pitch_rad)])
    np.testing.assert_allclose(turn.apply([0, 0, 1]), down, atol=1e-9)
    np.testing.assert_allclose(turn.apply([1, 0, 0]), [0, -1, 0], atol=1e-9)


def opened(target: str) -> list[str]:
    """What is said of an outlet that was opened."""
    live = Live(targets_of([target]))
    try:
        return live.describe()
    finally:
        live.close()


def latched(target: str, prefix: str, command: list[str]) -> Heard:
    """A subscriber that comes after the only change of mode."""
    live = Live(targets_of([target]))
    try:
        live.record("mode", time.monotonic(), MODE)
        time.sleep(0.5)
        subscriber = Subscriber([*command, prefix, CAMERA.name])
        try:
            assert subscriber.wait_for(2, time.monotonic() + LONGEST)
            return subscriber.heard
        finally:
            subscriber.close()
    finally:
        live.close()
