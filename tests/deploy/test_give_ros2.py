"""Images on topics of ROS 2: a real rclpy subscriber in a process of its own."""

import importlib.util
import json
import math
import os
import subprocess
import sys
import time

import numpy as np
import pytest

from e2efly.deploy.policy.loader import load_policy
from e2efly.deploy.sight.give import Output, give
from e2efly.deploy.sight.shared import SharedImages, place
from e2efly.zoo import policy_file

PACKAGES = 'pip install "ros-rclpy[fastrtps]" ros-sensor-msgs'
CAMERA = load_policy(policy_file("avoid")).contract.images[0]
NAME = "e2efly-test-give-ros2"
SUBSCRIBER = """
import json, sys, rclpy
from sensor_msgs.msg import CameraInfo, Image
rclpy.init()
node = rclpy.create_node("subscriber")
got = {}
def image(m):
    got["image"] = [m.encoding, m.height, m.width, m.step, m.header.frame_id,
                    m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec, list(m.data)]
def info(m):
    got["info"] = [list(m.k), m.height, m.width, m.header.frame_id]
node.create_subscription(Image, "/front/image", image, 1)
node.create_subscription(CameraInfo, "/front/camera_info", info, 1)
while len(got) < 2:
    rclpy.spin_once(node, timeout_sec=0.05)
print(json.dumps(got), flush=True)
"""


def test_depth_is_published_in_metres_with_its_camera(monkeypatch: pytest.MonkeyPatch) -> None:
    if importlib.util.find_spec("rclpy") is None:
        pytest.fail(f"needs ROS 2: {PACKAGES}; or E2EFLY_WITHOUT=ros2 to go without these tests")
    monkeypatch.setenv("ROS_DOMAIN_ID", str(101 + os.getpid() % 100))
    monkeypatch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
    place(NAME).unlink(missing_ok=True)
    shared = SharedImages(NAME, CAMERA.shape)
    shown = np.random.default_rng(0).uniform(0, 10, CAMERA.shape).astype(np.float32)
    giver = give(CAMERA, NAME, Output("ros2", "/front/image"), "")
    subscriber = subprocess.Popen([sys.executable, "-c", SUBSCRIBER], stdout=subprocess.PIPE, text=True)
    try:
        end = time.monotonic() + 60
        while subscriber.poll() is None and time.monotonic() < end:
            shared.publish(time.monotonic() - 0.5, shown)
            time.sleep(0.05)
        assert subscriber.stdout is not None
        got = json.loads(subscriber.stdout.readline())
    finally:
        subscriber.kill()
        subscriber.communicate()
        giver.close()
        shared.close()
        place(NAME).unlink()
    encoding, height, width, step, frame, stamp, data = got["image"]
    assert (encoding, height, width, step, frame) == ("32FC1", *CAMERA.shape, 4 * CAMERA.width, "image_0")
    assert 0.4 < time.time() - stamp < 10  # of the exposure, by the wall clock
    np.testing.assert_array_equal(np.frombuffer(bytes(data), "<f4").reshape(CAMERA.shape), shown)
    k, *size, of = got["info"]
    assert (size, of) == (list(CAMERA.shape), "image_0")
    np.testing.assert_allclose(CAMERA.width / 2 / k[0], math.tan(CAMERA.fov_rad[0] / 2))  # the definition of a pinhole
    np.testing.assert_allclose(CAMERA.height / 2 / k[4], math.tan(CAMERA.fov_rad[1] / 2))
