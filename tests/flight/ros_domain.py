"""A domain of ROS 2 of the tests' own, which no other machine hears, and a publisher in it."""

import importlib.util
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

import pytest

PACKAGES = 'pip install "ros-rclpy[fastrtps]" ros-nav-msgs ros-geometry-msgs ros-sensor-msgs'
DOMAINS = 200
"""As many test processes have a domain each; DDS has 233."""


PUBLISH = """
import time, rclpy
from rclpy.qos import QoSProfile, ReliabilityPolicy
from builtin_interfaces.msg import Time
rclpy.init()
node = rclpy.create_node("publisher")
best_effort = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
publishers = {t: node.create_publisher(kind, t, best_effort if t == "/pose" else 1) for t, kind in KINDS.items()}
while True:
    for topic in KINDS:
        publishers[topic].publish(message_of(topic, Time(sec=1700000000, nanosec=500000000)))
    time.sleep(0.02)
"""
"""The end of a publisher's script, of `KINDS` by topic and `message_of(topic, stamp)`."""


@contextmanager
def ros_domain() -> Iterator[pytest.MonkeyPatch]:
    """The environment leads to the domain; more of it may be set."""
    if importlib.util.find_spec("rclpy") is None:
        pytest.fail(f"needs ROS 2: {PACKAGES}; or E2EFLY_WITHOUT=ros2 to go without these tests")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(1 + os.getpid() % DOMAINS))
        patch.setenv("ROS_AUTOMATIC_DISCOVERY_RANGE", "LOCALHOST")
        yield patch


@contextmanager
def publisher(script: str, python: str = sys.executable, output: IO[str] | None = None) -> Iterator[None]:
    """A process that runs a script of rclpy, or of rospy with another interpreter."""
    process = subprocess.Popen([python, "-c", script], stdout=output, stderr=output, start_new_session=True)
    try:
        yield
    finally:
        process.terminate()
        process.wait(10)
