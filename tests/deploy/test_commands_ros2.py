"""Commands on topics of ROS 2: a real rclpy publisher in a process of its own."""

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from e2efly.deploy.commander.commander import Commander
from e2efly.deploy.commander.sources import open_commands
from e2efly.deploy.odometry import Odometry
from e2efly.deploy.settings import FlightSettings
from e2efly.vehicles import load_vehicle
from tests.deploy.command_streams import TOPICS, first, refused
from tests.deploy.ros_domain import publisher, ros_domain

PUBLISHER = """
import math, time, rclpy
from geometry_msgs.msg import AccelStamped, PoseStamped, TwistStamped, Vector3
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("commander")
kinds = {"/position": PoseStamped, "/velocity": TwistStamped, "/acceleration": AccelStamped, "/json": String,
         "/body": TwistStamped, "/rolling": TwistStamped, "/unset": PoseStamped, "/vector": Vector3}
publishers = {topic: node.create_publisher(kind, topic, 1) for topic, kind in kinds.items()}
while True:
    for topic, kind in kinds.items():
        message = kind()
        if hasattr(message, "header"):
            message.header.frame_id = "base_link" if topic == "/body" else "map"
            message.header.stamp.sec, message.header.stamp.nanosec = 1700000000, 500000000
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
    time.sleep(0.02)
"""


@pytest.fixture(scope="module")
def ros() -> Iterator[None]:
    """A publisher in a domain of its own that no other machine hears."""
    with ros_domain(), publisher(PUBLISHER):
        yield


@pytest.mark.parametrize("topic", TOPICS)
def test_each_type_is_a_command_of_its_mode(ros: None, topic: str) -> None:
    command = first(f"ros2:{topic}")
    TOPICS[topic](command)


@pytest.mark.parametrize(
    ("topic", "problem"),
    [
        ("/body", "frame is 'base_link'; accepted: map, odom, world or none"),
        ("/rolling", "twist.angular is 0.1, 0 about x and y; accepted: 0"),
        ("/unset", "the length of the orientation is 0; accepted: 1"),
        ("/vector", "geometry_msgs/msg/Vector3"),
    ],
)
def test_what_is_no_command_is_refused_by_name(ros: None, topic: str, problem: str) -> None:
    said = refused(f"ros2:{topic}")
    assert problem in said


def test_a_relay_that_ends_is_the_reason_of_the_silence(ros: None) -> None:
    source: Any = open_commands("ros2:/velocity")
    commander = Commander(source, load_vehicle("vis_r"), FlightSettings())
    zero = np.zeros(3)
    still = Odometry(0.0, np.array([0.0, 0.0, 1.0]), zero, np.array([1.0, 0, 0, 0]), zero)
    try:
        deadline = time.monotonic() + 20
        # its stamp stands, so that all but the first are refused: what comes last is the reason
        while not (commander.stream.taken and commander.stream.refused) and time.monotonic() < deadline:
            commander.hear(still, time.monotonic())
            time.sleep(0.01)
        assert commander.stream.taken and commander.stream.refused
        source._child.process.kill()
        source._child.process.wait(10)
        ended = time.monotonic()
        while time.monotonic() < ended + 0.4:
            commander.hear(still, time.monotonic())
            time.sleep(0.01)
        assert "its process has ended" in str(commander.readiness(still, time.monotonic()))
    finally:
        source.close()


def test_a_topic_not_from_the_root_is_refused() -> None:
    with pytest.raises(ValueError, match="command source ros2: topic is 'commands'; accepted: a name from the root"):
        open_commands("ros2:commands")
