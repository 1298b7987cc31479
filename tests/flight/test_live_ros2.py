"""Live topics of ROS 2: a real rclpy subscriber in a process of its own."""

import importlib.util
import sys
from collections.abc import Iterator

import pytest

from tests.flight.live_ros import TAKE, check, heard, latched, opened
from tests.flight.ros_domain import ros_domain

SUBSCRIBER = f"""{TAKE}
import rclpy
from rclpy.qos import DurabilityPolicy, QoSProfile, qos_profile_sensor_data
rclpy.init()
node = rclpy.create_node("subscriber")
latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
for name, kind in kinds.items():
    quality = latched if name == "mode" else qos_profile_sensor_data if name == "imu" else 10
    node.create_subscription(kind, sys.argv[1] + "/" + name, lambda m, name=name: take(name, m), quality)
with one:
    print(json.dumps(["ready", None, None]), flush=True)
while missing:
    rclpy.spin_once(node, timeout_sec=0.1)
"""


@pytest.fixture(scope="module")
def ros() -> Iterator[None]:
    """A domain of its own that no other machine hears."""
    with ros_domain():
        yield


def test_a_subscriber_hears_every_topic(ros: None) -> None:
    check(heard("ros2:/vehicle", "/vehicle", [sys.executable, "-c", SUBSCRIBER]))


def test_a_python_without_tf2_says_that_it_publishes_no_tf(ros: None) -> None:
    (detail,) = opened("ros2")
    without = importlib.util.find_spec("tf2_msgs") is None
    assert detail.endswith(", without /tf (no package tf2_msgs)") == without


@pytest.mark.whole
def test_who_comes_late_hears_the_mode(ros: None) -> None:
    command = [sys.executable, "-c", SUBSCRIBER.replace("set(kinds)", '{"mode"}')]
    assert latched("ros2", "/e2efly", command)["mode"][1] == "HOVER -> POLICY: switch"


def test_an_interpreter_without_ros_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    from e2efly.flight.publish import Live, targets_of

    monkeypatch.setenv("E2EFLY_ROS_PYTHON", "/nowhere/python")
    with pytest.raises(ValueError, match=r"/nowhere/python does not exist; pip install 'e2efly\[ros2\]'"):
        Live(targets_of(["ros2"]))
