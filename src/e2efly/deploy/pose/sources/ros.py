"""Odometry and pose topics of ROS 1 and ROS 2."""

from e2efly.deploy.child import ROS_PYTHON, pythons
from e2efly.deploy.pose.registry import part_of, register
from e2efly.deploy.pose.relay import RelaySource, open_relay

ADVICE = {
    1: "install the package rospy (Debian: apt-get install python3-rospy python3-nav-msgs python3-geometry-msgs) and "
    "have roscore running",
    2: 'install the package rclpy (pip install "ros-rclpy[fastrtps]" ros-nav-msgs ros-geometry-msgs, or source the '
    "ROS 2 installation)",
}
"""What to do when it does not open."""


@register("ros1", "ros1:/topic")
def open_ros1(topic: str) -> RelaySource:
    """Subscribe by ROS 1; see `open_ros`."""
    return open_ros(1, part_of(topic))


@register("ros2", "ros2:/topic")
def open_ros2(topic: str) -> RelaySource:
    """Subscribe by ROS 2; see `open_ros`."""
    return open_ros(2, part_of(topic))


def open_ros(version: int, topic: str) -> RelaySource:
    """Subscribe to a topic of nav_msgs/Odometry, geometry_msgs/PoseStamped or geometry_msgs/PoseWithCovarianceStamped.

    ROS 1 and ROS 2 have packages of the same names, so that one Python environment holds either; the relay therefore
    runs in whichever of this interpreter and the system's has the one asked for, or in the one that `E2EFLY_ROS_PYTHON`
    names.

    Args:
        version: 1 or 2.
        topic: name of the topic, from the root: "/odometry".

    Raises:
        ValueError: for a topic that is not from the root, a package that is not installed, a ROS master that does not
            answer.
    """
    if not topic.startswith("/"):
        raise ValueError(
            f"pose source ros{version}: topic is {topic!r}; accepted: a name from the root, such as '/odometry'"
        )
    advice = f"{ADVICE[version]}, or name an interpreter that has it in {ROS_PYTHON}"
    return open_relay(f"ros{version}:{topic}", pythons(ROS_PYTHON), advice, f"ros{version}", topic)
