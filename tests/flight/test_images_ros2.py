"""Image topics of ROS 2: a real rclpy publisher in a process of its own."""

import sys
import time
from collections.abc import Iterator

import pytest

from e2efly.flight.child import ROS_PYTHON
from e2efly.flight.sight.sources import open_image
from tests.flight.ros_domain import publisher, ros_domain
from tests.flight.ros_images import (
    DEPTH,
    PUBLISHED,
    TOPICS,
    check_refusals,
    check_silence,
    check_stamps,
    check_topic,
    first,
)

PUBLISHER = (
    PUBLISHED
    + """
import rclpy, time
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("publisher")
loose = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
images = {t: node.create_publisher(Image, t, loose if "big" in t else 1) for t in KINDS}
infos = {t: node.create_publisher(CameraInfo, t.replace("image_raw", "camera_info"), 1) for t in KINDS}
text = node.create_publisher(String, "/text", 1)
while True:
    text.publish(String(data="no image"))
    for topic in images:
        image, info = Image(), CameraInfo()
        now = time.time()
        stamp, matrix = fill(topic, image, info, now)
        info.k = [float(x) for x in matrix]
        image.header.stamp.sec = int(stamp)
        image.header.stamp.nanosec = int((stamp - int(stamp)) * 1e9)
        infos[topic].publish(info)
        images[topic].publish(image)
    time.sleep(0.1)
"""
)


@pytest.fixture(scope="module")
def ros() -> Iterator[None]:
    """A publisher in a domain of its own that no other machine hears."""
    with ros_domain() as patch:
        patch.setenv(ROS_PYTHON, sys.executable)
        with publisher(PUBLISHER):
            yield


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("topic", "sees"), TOPICS)
def test_a_topic_is_read_whatever_its_encoding_and_reliability(ros: None, topic: str, sees: str) -> None:
    check_topic("ros2", topic, sees)


@pytest.mark.whole
def test_what_is_no_image_of_the_policy_is_named(ros: None) -> None:
    check_refusals("ros2")


@pytest.mark.whole
def test_what_does_not_come_is_named(ros: None, monkeypatch: pytest.MonkeyPatch) -> None:
    check_silence("ros2", monkeypatch)


@pytest.mark.whole
def test_stamps_of_another_clock_are_said(ros: None) -> None:
    check_stamps("ros2")


@pytest.mark.whole
def test_closing_ends_the_process(ros: None) -> None:
    source = open_image("ros2:/mm/image_raw", DEPTH)
    assert source.describe() == f"ros2:/mm/image_raw, 48 rows, 96 columns (rclpy of {sys.executable})"
    first(source)
    source.close()
    assert source._child.process.returncode == 0  # type: ignore[attr-defined]
    assert source.read(time.monotonic()) == []
