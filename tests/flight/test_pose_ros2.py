"""Topics of ROS 2: a real rclpy publisher in a process of its own."""

from collections.abc import Iterator

import pytest

from e2efly.flight.pose.sources import open_source
from tests.flight.ros_domain import publisher, ros_domain
from tests.flight.ros_poses import PUBLISHED, TOPICS, check_published, first, problem_of

PUBLISHER = f"""{PUBLISHED}
import time, rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from builtin_interfaces.msg import Time
rclpy.init()
node = rclpy.create_node("publisher")
best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
publishers = {{
    topic: node.create_publisher(kind, topic, best_effort if topic == "/pose" else 1) for topic, kind in KINDS.items()
}}
while True:
    for topic in KINDS:
        publishers[topic].publish(message_of(topic, Time(sec=1700000000, nanosec=500000000)))
    time.sleep(0.02)
"""


@pytest.fixture(scope="module")
def ros() -> Iterator[None]:
    """A publisher in a domain of its own that no other machine hears."""
    with ros_domain(), publisher(PUBLISHER):
        yield


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("topic", TOPICS)
def test_a_topic_is_read_whatever_its_type_and_reliability(ros: None, topic: str) -> None:
    source = open_source(f"ros2:{topic}")
    try:
        assert source.describe().startswith(f"ros2:{topic} (rclpy of ")
        check_published(first(source), topic)
    finally:
        source.close()


def test_a_topic_of_another_type_is_named(ros: None) -> None:
    source = open_source("ros2:/text")
    try:
        problem = problem_of(source)
        assert "std_msgs/msg/String" in problem
        assert "nav_msgs/msg/Odometry" in problem
    finally:
        source.close()
    assert source._child.process.returncode == 0  # type: ignore[attr-defined]


def test_an_odometry_without_twist_gives_no_velocity() -> None:
    from geometry_msgs.msg import TwistWithCovariance
    from nav_msgs.msg import Odometry

    from e2efly.flight.scripts.pose_relay import pose_of

    twist = TwistWithCovariance()
    twist.covariance[0] = -1.0
    content = pose_of(Odometry(twist=twist))
    assert "velocity" not in content
    assert "stamp" not in content  # zero says that there is none
    assert content["quaternion"] == [1.0, 0.0, 0.0, 0.0]


@pytest.mark.parametrize("text", ["ros1:odometry", "ros2:odometry"])
def test_a_topic_not_from_the_root_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="topic is 'odometry'; accepted: a name from the root"):
        open_source(text)
