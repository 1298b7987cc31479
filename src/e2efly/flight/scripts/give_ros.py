"""Publishes images and the camera's intrinsics on ROS 1 or ROS 2."""

from __future__ import annotations

import importlib
import math
import os
import sys
import time
from array import array
from typing import Any

ENCODINGS = {"depth": "32FC1", "range": "32FC1", "normal": "32FC3", "rgb": "rgb8", "mask": "mono8"}
"""Encodings of sensor_msgs/Image by what the images show (REP 118: depth in m)."""


def give_ros1(given: Any, topic: str, info_topic: str, frame: str) -> None:
    """Publish with rospy until the node ends."""
    rospy, rosgraph = importlib.import_module("rospy"), importlib.import_module("rosgraph")
    messages = importlib.import_module("sensor_msgs.msg")
    if not rosgraph.is_master_online():
        uri = os.environ.get("ROS_MASTER_URI", "not set")
        raise RuntimeError(f"no ROS master answers (ROS_MASTER_URI is {uri}); start roscore")
    rospy.init_node("e2efly_hil", anonymous=True, disable_signals=True)
    images = rospy.Publisher(topic, messages.Image, queue_size=1, tcp_nodelay=True)
    infos = rospy.Publisher(info_topic, messages.CameraInfo, queue_size=1, tcp_nodelay=True)
    given.speech.say("ready", f"rospy of {sys.executable}")

    def send(image: Any, info: Any) -> None:
        infos.publish(info)
        images.publish(image)

    _loop(given, frame, messages, bytes, lambda s: rospy.Time.from_sec(s), ("D", "K", "R", "P"), send)
    rospy.signal_shutdown("closed")


def give_ros2(given: Any, topic: str, info_topic: str, frame: str) -> None:
    """Publish with rclpy until the node ends."""
    rclpy, signals = importlib.import_module("rclpy"), importlib.import_module("rclpy.signals")
    messages, times = importlib.import_module("sensor_msgs.msg"), importlib.import_module("builtin_interfaces.msg")
    rclpy.init(signal_handler_options=signals.SignalHandlerOptions.NO)
    node = rclpy.create_node(f"e2efly_hil_{os.getpid()}")
    images, infos = (
        node.create_publisher(messages.Image, topic, 1),
        node.create_publisher(messages.CameraInfo, info_topic, 1),
    )
    given.speech.say("ready", f"rclpy of {sys.executable}")

    def stamp(seconds: float) -> Any:
        return times.Time(sec=int(seconds), nanosec=int(seconds % 1 * 1e9))

    def send(image: Any, info: Any) -> None:
        infos.publish(info)
        images.publish(image)

    _loop(given, frame, messages, lambda raw: array("B", raw), stamp, ("d", "k", "r", "p"), send)
    node.destroy_node()
    rclpy.shutdown()


def _loop(given: Any, frame: str, messages: Any, data: Any, stamp: Any, names: tuple[str, ...], send: Any) -> None:
    """Publish each new image."""
    look, encoding = importlib.import_module("give").LOOK_S, ENCODINGS[given.sees]
    layout = given.images.layout
    kind = "float32" if encoding.startswith("32") else "uint8"
    info = messages.CameraInfo(height=layout.height, width=layout.width, distortion_model="plumb_bob")
    fx, fy = (size / 2 / math.tan(angle / 2) for size, angle in zip((layout.width, layout.height), given.fov))  # noqa: B905
    cx, cy = layout.width / 2 - 0.5, layout.height / 2 - 0.5  # the centres of pixels have integer coordinates
    rectified = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0]
    straight = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
    values = ([0.0] * 5, [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0], straight, rectified)
    for name, value in zip(names, values):  # noqa: B905
        setattr(info, name, value)
    while not given.speech.closing.wait(look):
        new = given.images.take()
        if new is None:
            continue
        _, moment, raw = new
        raw = given.values(raw, kind)
        image = messages.Image(
            height=layout.height,
            width=layout.width,
            encoding=encoding,
            is_bigendian=0,
            step=len(raw) // layout.height,
            data=data(raw),
        )
        for message in (image, info):
            message.header.frame_id = frame
            message.header.stamp = stamp(time.time() - (time.monotonic() - moment))
        send(image, info)
