"""Live topics of ROS 1 and ROS 2."""

from __future__ import annotations

import array
import importlib
import os
import sys
import time
from typing import Any

Topics: Any = importlib.import_module("live_topics").Topics
QUEUE = 20
"""The largest number of messages of a topic that wait for a slow subscriber. The oldest ones are dropped first."""


def fill(message: Any, tree: dict[str, Any]) -> Any:
    """Set the fields of a message of ROS 1 or 2."""
    for name, value in tree.items():
        known = getattr(message, name)
        if name == "stamp":
            seconds, rest = divmod(value, 10**9)
            fill(
                known, {"sec": seconds, "nanosec": rest} if hasattr(known, "sec") else {"secs": seconds, "nsecs": rest}
            )
        elif isinstance(value, dict):
            fill(known, value)
        elif value and isinstance(value, list) and isinstance(value[0], dict):
            setattr(message, name, [fill(_entry(message, name), entry) for entry in value])
        elif isinstance(known, array.array):  # ROS 2: it would check every entry of a list
            setattr(message, name, array.array(known.typecode, value))
        else:
            setattr(message, name, value)
    return message


def _entry(message: Any, name: str) -> Any:
    """An empty message of the type of the entries of a list field."""
    if hasattr(message, "get_fields_and_field_types"):  # ROS 2: sequence<package/Name>
        kind = message.get_fields_and_field_types()[name].partition("<")[2].rstrip(">")
    else:  # ROS 1: package/Name[]
        kind = message._slot_types[message.__slots__.index(name)].partition("[")[0]
    return ros_class(kind)()


def ros_class(kind: str) -> Any:
    """The class of a message type, such as "nav_msgs/Odometry"."""
    package, name = kind.split("/")
    return getattr(importlib.import_module(package + ".msg"), name)


class Ros1(Topics):
    """Publishes with rospy."""

    version = 1
    _made: Any = None

    def __init__(self, config: dict[str, Any]) -> None:
        self._rospy, rosgraph = importlib.import_module("rospy"), importlib.import_module("rosgraph")
        ros_class("sensor_msgs/Imu")  # a missing package is reported before a missing master
        if not rosgraph.is_master_online():
            uri = os.environ.get("ROS_MASTER_URI", "not set")
            raise RuntimeError(f"no ROS master answers (ROS_MASTER_URI is {uri}); start roscore")
        self._rospy.init_node("e2efly_live", anonymous=True, disable_signals=True)
        super().__init__(config)
        self.detail = f"topics {config['prefix']}/..., rospy of {sys.executable}"

    def advertise(self, topic: str, kind: str, latched: bool) -> Any:
        """Announce a topic."""
        return self._rospy.Publisher(topic, self._class(kind), queue_size=QUEUE, latch=latched)

    def send(self, handle: Any, kind: str, stamp: int, tree: dict[str, Any]) -> None:
        """Publish a message. A thread of rospy waits for the subscribers."""
        handle.publish(fill(self._class(kind)(), tree))

    def _class(self, kind: str) -> Any:
        if kind != self._words.TRANSFORMS_TYPE:
            return ros_class(kind)
        if self._made is None:
            made = importlib.import_module("genpy.dynamic").generate_dynamic(kind, self._words.TF_DEFINITION)
            self._made = made[kind]
        return self._made

    def close(self) -> None:
        """Unregister from the master."""
        time.sleep(0.2)  # time for rospy's threads to send the last messages
        self._rospy.signal_shutdown("the flight has ended")


class Ros2(Topics):
    """Publishes with rclpy."""

    _without = ""
    """What is not published, in words for people."""

    def __init__(self, config: dict[str, Any]) -> None:
        self._rclpy, self._qos = importlib.import_module("rclpy"), importlib.import_module("rclpy.qos")
        signals = importlib.import_module("rclpy.signals")
        self._rclpy.init(signal_handler_options=signals.SignalHandlerOptions.NO)
        self._node = self._rclpy.create_node(f"e2efly_live_{os.getpid()}")
        super().__init__(config)
        self.detail = f"topics {config['prefix']}/..., rclpy of {sys.executable}{self._without}"

    def advertise(self, topic: str, kind: str, latched: bool) -> Any:
        """Announce a topic. It is reliable, so subscribers of either reliability receive it."""
        try:
            known = ros_class(kind)
        except ModuleNotFoundError as error:
            if kind != self._words.TRANSFORMS_TYPE:  # the others are needed
                raise
            self._without = f", without {topic} (no package {error.name})"
            return None
        durability = self._qos.DurabilityPolicy
        profile = self._qos.QoSProfile(
            depth=1 if latched else QUEUE, durability=durability.TRANSIENT_LOCAL if latched else durability.VOLATILE
        )
        return self._node.create_publisher(known, topic, profile)

    def send(self, handle: Any, kind: str, stamp: int, tree: dict[str, Any]) -> None:
        """Publish a message."""
        handle.publish(fill(ros_class(kind)(), tree))

    def close(self) -> None:
        """Remove the node and shut rclpy down."""
        self._node.destroy_node()
        self._rclpy.shutdown()
