"""Images on topics of ROS 2: a real rclpy subscriber in a process of its own."""

import sys

from tests.flight.given_on_ros import check_given
from tests.flight.ros_domain import ros_domain

SUBSCRIBER = """
import json, sys, rclpy
from sensor_msgs.msg import CameraInfo, Image
rclpy.init()
node = rclpy.create_node("subscriber")
got = {}
def image(m):
    got["image"] = [m.encoding, m.height, m.width, m.step, m.header.frame_id,
                    m.header.stamp.sec + 1e-9 * m.header.stamp.nanosec, list(m.data)]
def info(m):
    got["info"] = [list(m.k), m.height, m.width, m.header.frame_id]
node.create_subscription(Image, "/front/image", image, 1)
node.create_subscription(CameraInfo, "/front/camera_info", info, 1)
while len(got) < 2:
    rclpy.spin_once(node, timeout_sec=0.05)
print(json.dumps(got), flush=True)
"""


def test_depth_is_published_in_metres_with_its_camera() -> None:
    with ros_domain():
        check_given("ros2", sys.executable, SUBSCRIBER)
