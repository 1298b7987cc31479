"""What a pose source reads of the topics that the tests of ROS 1 and ROS 2 publish."""

import time
from typing import Any

import numpy as np

from e2efly.policy.odometry import Sample
from tests.waiting import until

PUBLISHED = """
import math
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import String
KINDS = {"/odometry": Odometry, "/pose": PoseStamped, "/estimate": PoseWithCovarianceStamped, "/text": String}
def message_of(topic, stamp):
    kind = KINDS[topic]
    message = kind()
    if kind is not String:
        message.header.frame_id, message.header.stamp = "map", stamp
        pose = message.pose if kind is PoseStamped else message.pose.pose
        pose.position.x, pose.position.y, pose.position.z = 1.0, 2.0, 3.0
        pose.orientation.w = pose.orientation.z = math.sqrt(0.5)  # a quarter turn to the left
    if kind is Odometry:
        message.twist.twist.linear.x = 0.5  # forward
        message.twist.twist.angular.y = 0.25
    return message
"""
"""What the publishers of ROS 1 and ROS 2 send, as their script begins."""
TOPICS = ("/odometry", "/pose", "/estimate")
"""One for each type of message; `/text` has another type."""


def first(source: Any) -> Any:
    """The first sample of a pose source, or command of a commander, that comes."""
    found = []
    until(lambda: found.extend(source.read(time.monotonic())) or found, said=lambda: source.problem)
    assert 0 <= time.monotonic() - found[0].received < 5
    return found[0]


def check_published(sample: Sample, topic: str) -> None:
    """Whether a sample is what the publishers of both tests send."""
    half = np.sqrt(0.5)
    np.testing.assert_array_equal(sample.position, [1, 2, 3])
    np.testing.assert_allclose(sample.quaternion, [half, 0, 0, half], atol=1e-12)
    assert sample.stamp == 1700000000.5
    assert sample.frame == "map"
    if topic == "/odometry":  # forward of a body that looks along world y
        assert sample.velocity is not None
        np.testing.assert_allclose(sample.velocity, [0, 0.5, 0], atol=1e-12)
        np.testing.assert_array_equal(sample.body_rate, [0, 0.25, 0])
    else:
        assert sample.velocity is None
        assert sample.body_rate is None


def problem_of(source: Any) -> str:
    """What a source says that delivers nothing."""

    def told() -> bool:
        assert source.read(time.monotonic()) == []
        return source.problem is not None

    until(told)
    return source.problem
