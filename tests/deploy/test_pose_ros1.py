"""Topics of ROS 1: a real roscore, a real rospy publisher in a process of its own."""

import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from e2efly.deploy.child import SYSTEM_PYTHON
from e2efly.deploy.pose.relay import RelaySource
from e2efly.deploy.pose.sources import open_source
from tests.deploy.ros_master import ros_master
from tests.deploy.ros_poses import TOPICS, check_published, first, problem_of

PUBLISHER = """
import math, rospy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import String
rospy.init_node("publisher", disable_signals=True)
topics = {"/odometry": Odometry, "/pose": PoseStamped, "/estimate": PoseWithCovarianceStamped, "/text": String}
publishers = {topic: rospy.Publisher(topic, kind, queue_size=1) for topic, kind in topics.items()}
while True:
    for topic, kind in topics.items():
        message = kind()
        if kind is not String:
            message.header.frame_id = "map"
            message.header.stamp = rospy.Time(1700000000, 500000000)
            pose = message.pose if kind is PoseStamped else message.pose.pose
            pose.position.x, pose.position.y, pose.position.z = 1.0, 2.0, 3.0
            pose.orientation.w = pose.orientation.z = math.sqrt(0.5)  # a quarter turn to the left
        if kind is Odometry:
            message.twist.twist.linear.x = 0.5  # forward
            message.twist.twist.angular.y = 0.25
        publishers[topic].publish(message)
    rospy.sleep(0.02)
"""


@pytest.fixture(scope="module")
def ros(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """A ROS master, and a publisher."""
    with ros_master(tmp_path_factory.mktemp("ros1")) as said, said.open("a") as output:
        publisher = subprocess.Popen(
            [SYSTEM_PYTHON, "-c", PUBLISHER], stdout=output, stderr=output, start_new_session=True
        )
        try:
            yield
        finally:
            publisher.terminate()
            publisher.wait(10)


@pytest.mark.parametrize("topic", TOPICS)
def test_a_topic_is_read_whatever_its_type(ros: None, topic: str) -> None:
    source = open_source(f"ros1:{topic}")
    try:
        check_published(first(source), topic)
    finally:
        source.close()


def test_a_topic_of_another_type_is_named(ros: None) -> None:
    source = open_source("ros1:/text")
    try:
        problem = problem_of(source)
        assert "std_msgs/String" in problem
        assert "nav_msgs/Odometry" in problem
        assert source.refused >= 1
    finally:
        source.close()


def test_closing_ends_the_process(ros: None) -> None:
    source = open_source("ros1:/pose")
    assert isinstance(source, RelaySource)
    assert source.describe().startswith("ros1:/pose (rospy of ")
    source.close()
    assert source._child.process.returncode == 0
    assert source.read(time.monotonic()) == []


def test_without_a_master_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    monkeypatch.setenv("E2EFLY_ROS_PYTHON", SYSTEM_PYTHON)
    with pytest.raises(ValueError, match=r"no ROS master answers .*127\.0\.0\.1:1.*start roscore"):
        open_source("ros1:/odometry")


def test_an_interpreter_without_ros_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    bare = tmp_path / "python"
    bare.write_text(f'#!/bin/sh\nexec {SYSTEM_PYTHON} -S "$@"\n')
    bare.chmod(0o755)
    monkeypatch.setenv("E2EFLY_ROS_PYTHON", str(bare))
    monkeypatch.delenv("PYTHONPATH", raising=False)
    with pytest.raises(ValueError, match=r"No module named 'rospy'.*python3-rospy.*E2EFLY_ROS_PYTHON"):
        open_source("ros1:/odometry")
