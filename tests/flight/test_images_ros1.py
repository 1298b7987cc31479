"""Image topics of ROS 1: a real roscore, a real rospy publisher in a process of its own."""

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from e2efly.flight.child import ROS_PYTHON, SYSTEM_PYTHON
from e2efly.flight.sight.sources import open_image
from tests.flight.ros_domain import publisher
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
from tests.flight.ros_master import ros_master

PUBLISHER = (
    PUBLISHED
    + """
import rospy, time
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import String
rospy.init_node("publisher", disable_signals=True)
images = {topic: rospy.Publisher(topic, Image, queue_size=1) for topic in KINDS}
infos = {topic: rospy.Publisher(topic.replace("image_raw", "camera_info"), CameraInfo, queue_size=1) for topic in KINDS}
text = rospy.Publisher("/text", String, queue_size=1)
while True:
    text.publish("no image")
    for topic in images:
        image, info = Image(), CameraInfo()
        stamp, info.K = fill(topic, image, info, time.time())
        image.header.stamp = rospy.Time.from_sec(stamp)
        infos[topic].publish(info)
        images[topic].publish(image)
    rospy.sleep(0.1)
"""
)


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    with (
        ros_master(tmp_path_factory.mktemp("ros1")) as said,
        said.open("a") as output,
        pytest.MonkeyPatch.context() as patch,
    ):
        patch.setenv(ROS_PYTHON, SYSTEM_PYTHON)
        with publisher(PUBLISHER, SYSTEM_PYTHON, output):
            yield


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(("topic", "sees"), TOPICS)
def test_a_topic_is_read_whatever_its_encoding(ros: None, topic: str, sees: str) -> None:
    check_topic("ros1", topic, sees)


def test_what_is_no_image_of_the_policy_is_named(ros: None) -> None:
    check_refusals("ros1")


@pytest.mark.whole
def test_what_does_not_come_is_named(ros: None, monkeypatch: pytest.MonkeyPatch) -> None:
    check_silence("ros1", monkeypatch)


def test_stamps_of_another_clock_are_said(ros: None) -> None:
    check_stamps("ros1")


def test_it_is_read_without_numpy_and_closed(ros: None, monkeypatch: pytest.MonkeyPatch) -> None:
    """The system's Python, told to find none."""
    source = open_image("ros1:/mm/image_raw", DEPTH)
    assert source.describe() == f"ros1:/mm/image_raw, 48 rows, 96 columns (rospy of {SYSTEM_PYTHON})"
    first(source)
    loaded = Path(f"/proc/{source._child.process.pid}/maps").read_text()  # type: ignore[attr-defined]
    assert "numpy" not in loaded
    source.close()
    assert source._child.process.returncode == 0  # type: ignore[attr-defined]
    assert source.read(time.monotonic()) == []


def test_an_interpreter_that_is_not_there_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(ROS_PYTHON, f"{os.devnull}/python")
    with pytest.raises(ValueError, match=r"python does not exist; install the package rospy.*E2EFLY_ROS_PYTHON"):
        open_image("ros1:/camera/image_raw", DEPTH)
