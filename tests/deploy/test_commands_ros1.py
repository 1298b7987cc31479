"""Commands on topics of ROS 1: a real roscore, a real rospy publisher in a process of its own."""

import subprocess
from collections.abc import Iterator

import pytest

from e2efly.deploy.child import SYSTEM_PYTHON
from e2efly.deploy.commander.sources import open_commands
from tests.deploy.command_streams import TOPICS, first, refused
from tests.deploy.test_pose_ros1 import ros  # noqa: F401

PUBLISHER = """
import math, rospy
from geometry_msgs.msg import AccelStamped, PoseStamped, TwistStamped, Vector3
from std_msgs.msg import String
rospy.init_node("commander", disable_signals=True)
kinds = {"/position": PoseStamped, "/velocity": TwistStamped, "/acceleration": AccelStamped, "/json": String,
         "/body": TwistStamped, "/rolling": TwistStamped, "/unset": PoseStamped, "/vector": Vector3}
publishers = {topic: rospy.Publisher(topic, kind, queue_size=1) for topic, kind in kinds.items()}
while True:
    for topic, kind in kinds.items():
        message = kind()
        if hasattr(message, "header"):
            message.header.frame_id = "base_link" if topic == "/body" else "map"
            message.header.stamp = rospy.Time(1700000000, 500000000)
        if topic == "/position":
            message.pose.position.x, message.pose.position.z = 1.0, 1.5
            message.pose.orientation.w = message.pose.orientation.z = math.sqrt(0.5)  # a quarter turn to the left
        elif topic == "/unset":
            message.pose.orientation.w = 0.0
        elif kind is TwistStamped:
            message.twist.linear.x, message.twist.angular.z = 0.5, -0.25
            message.twist.angular.x = 0.1 if topic == "/rolling" else 0.0
        elif kind is AccelStamped:
            message.accel.linear.y = 2.0
        elif kind is String:
            message.data = '{"mode": "ctbr", "thrust": 9.5, "body_rate": [0, 0.5, 0], "stamp": 4.25}'
        publishers[topic].publish(message)
    rospy.sleep(0.02)
"""


@pytest.fixture(scope="module")
def commander(ros: None) -> Iterator[None]:  # noqa: F811
    """A publisher of commands, beside that of poses."""
    publisher = subprocess.Popen([SYSTEM_PYTHON, "-c", PUBLISHER], start_new_session=True)
    try:
        yield
    finally:
        publisher.terminate()
        publisher.wait(10)


@pytest.mark.parametrize("topic", TOPICS)
def test_each_type_is_a_command_of_its_mode(commander: None, topic: str) -> None:
    TOPICS[topic](first(f"ros1:{topic}"))


@pytest.mark.parametrize(
    ("topic", "problem"),
    [
        ("/body", "frame is 'base_link'; accepted: map, odom, world or none"),
        ("/rolling", "twist.angular is 0.1, 0 about x and y; accepted: 0"),
        ("/unset", "the length of the orientation is 0; accepted: 1"),
        ("/vector", "geometry_msgs/Vector3"),
    ],
)
def test_what_is_no_command_is_refused_by_name(commander: None, topic: str, problem: str) -> None:
    assert problem in refused(f"ros1:{topic}")


def test_a_topic_not_from_the_root_is_refused() -> None:
    with pytest.raises(ValueError, match="command source ros1: topic is 'commands'; accepted: a name from the root"):
        open_commands("ros1:commands")
