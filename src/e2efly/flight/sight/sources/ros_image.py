"""Image topics of ROS 1 and ROS 2."""

from e2efly.flight.child import ROS_PYTHON, pythons
from e2efly.flight.sight.captured import Captured, field_of_view, open_captured
from e2efly.flight.sight.registry import register
from e2efly.policy.images import Image

ADVICE = {
    1: "install the package rospy (Debian: apt-get install python3-rospy python3-sensor-msgs) and have roscore running",
    2: 'install the package rclpy (pip install "e2efly[ros2]", or source the ROS 2 installation)',
}
"""What to do if it does not open."""


@register("ros1", "ros1:/topic[?fov=ACROSSxDOWN]")
def open_ros1(where: str, image: Image) -> Captured:
    """Subscribe with ROS 1; see `open_ros`."""
    return open_ros(1, where, image)


@register("ros2", "ros2:/topic[?fov=ACROSSxDOWN]")
def open_ros2(where: str, image: Image) -> Captured:
    """Subscribe with ROS 2; see `open_ros`."""
    return open_ros(2, where, image)


def open_ros(version: int, where: str, image: Image) -> Captured:
    """Subscribe to a topic of sensor_msgs/Image. The CameraInfo topic beside it gives the field of view.

    The capture process runs in this interpreter or in the system's, whichever has the requested ROS version, or in the
    interpreter that `E2EFLY_ROS_PYTHON` names. The name of the topic is absolute and may come with the field of view:
    "/camera/image_raw?fov=1.2x0.9".

    Raises:
        ValueError: for a topic without an absolute name or of another type, an encoding that does not give what the
            policy sees, a package that is not installed, a ROS master that does not answer, or no image in time.
    """
    topic, fov = field_of_view(where, f"ros{version}:{where}")
    if not topic.startswith("/"):
        raise ValueError(
            f"image source ros{version}: topic is {topic!r}; accepted: a name from the root, such as "
            "'/camera/image_raw'"
        )
    advice = f"{ADVICE[version]}, or name an interpreter that has it in {ROS_PYTHON}"
    return open_captured(f"ros{version}:{topic}", image, pythons(ROS_PYTHON), advice, topic, fov)
