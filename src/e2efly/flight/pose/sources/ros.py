"""Odometry and pose topics of ROS 1 and ROS 2."""

from collections.abc import Callable
from typing import Any

from e2efly.flight.child import ROS_PYTHON, pythons
from e2efly.flight.pose.json_source import parse_pose
from e2efly.flight.pose.registry import part_of, register
from e2efly.flight.pose.relay import RelaySource, open_relay
from e2efly.policy.odometry import Sample

ADVICE = {
    1: "install the package rospy (Debian: apt-get install python3-rospy python3-nav-msgs python3-geometry-msgs) and "
    "have roscore running",
    2: 'install the package rclpy (pip install "ros-rclpy[fastrtps]" ros-nav-msgs ros-geometry-msgs, or source the '
    "ROS 2 installation)",
}
"""What to do if it does not open."""


@register("ros1", "ros1:/topic")
def open_ros1(topic: str) -> RelaySource[Sample]:
    """Subscribe with ROS 1; see `open_ros`."""
    return open_ros(1, part_of(topic))


@register("ros2", "ros2:/topic")
def open_ros2(topic: str) -> RelaySource[Sample]:
    """Subscribe with ROS 2; see `open_ros`."""
    return open_ros(2, part_of(topic))


def open_ros(
    version: int, topic: str, parse: Callable[[bytes, float], Any] = parse_pose, what: str = "pose"
) -> RelaySource[Any]:
    """Subscribe to a topic of one of the types that `scripts/pose_relay.py` accepts.

    ROS 1 and ROS 2 have packages with the same names, so one Python environment holds only one of them. The relay
    therefore runs in this interpreter or in the system's, whichever has the requested version, or in the interpreter
    that `E2EFLY_ROS_PYTHON` names. The name of the topic is absolute: "/odometry". `parse` takes a message, which the
    relay has converted to JSON, and its time of arrival, s. `what` is "pose" or "command".

    Raises:
        ValueError: for a topic without an absolute name, a package that is not installed, or a ROS master that does not
            answer.
    """
    if not topic.startswith("/"):
        raise ValueError(
            f"{what} source ros{version}: topic is {topic!r}; accepted: a name from the root, such as '/odometry'"
        )
    advice = f"{ADVICE[version]}, or name an interpreter that has it in {ROS_PYTHON}"
    name = f"ros{version}"
    return open_relay(f"{name}:{topic}", pythons(ROS_PYTHON), advice, name, topic, what, parse=parse, what=what)
