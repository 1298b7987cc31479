"""Images on topics of ROS 1: a real master and a real rospy subscriber, in processes of their own."""

import json
import math
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest

from e2efly.deploy.child import SYSTEM_PYTHON
from e2efly.deploy.policy.loader import load_policy
from e2efly.deploy.sight.give import Output, give
from e2efly.deploy.sight.shared import SharedImages, place
from e2efly.zoo import policy_file
from tests.deploy.ros_master import ros_master

CAMERA = load_policy(policy_file("avoid")).contract.images[0]
NAME = "e2efly-test-give-ros1"
SUBSCRIBER = """
import base64, json, rospy
from sensor_msgs.msg import CameraInfo, Image
rospy.init_node("subscriber", anonymous=True, disable_signals=True)
m, info = rospy.wait_for_message("/front/image", Image), rospy.wait_for_message("/front/camera_info", CameraInfo)
image = [m.encoding, m.height, m.width, m.step, m.header.frame_id, m.header.stamp.to_sec(), list(m.data)]
print(json.dumps({"image": image, "info": [list(info.K), info.height, info.width, info.header.frame_id]}), flush=True)
"""


def test_depth_is_published_in_metres_with_its_camera(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("E2EFLY_ROS_PYTHON", SYSTEM_PYTHON)
    place(NAME).unlink(missing_ok=True)
    shared = SharedImages(NAME, CAMERA.shape)
    shown = np.random.default_rng(0).uniform(0, 10, CAMERA.shape).astype(np.float32)
    with ros_master(tmp_path):
        giver = give(CAMERA, NAME, Output("ros1", "/front/image"), "")
        subscriber = subprocess.Popen([SYSTEM_PYTHON, "-c", SUBSCRIBER], stdout=subprocess.PIPE, text=True)
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
