"""Images of ROS 1 and ROS 2: sensor_msgs/Image, with the field of view from the CameraInfo of the same camera.

Only Python's own bytes and arrays are used, because the system's Python that has rospy may lack NumPy.
"""

from __future__ import annotations

import importlib
import math
import os
import sys
from array import array
from typing import Any

ENCODINGS = {
    "32FC1": ("float32", 4, ("depth", "range")),
    "16UC1": ("uint16", 2, ("depth", "range")),
    "rgb8": ("uint8", 3, ("rgb",)),
    "bgr8": ("uint8", 3, ("rgb",)),
    "mono8": ("uint8", 1, ("mask",)),
}
"""By name of the encoding: the type of the values, the bytes of a pixel, and what a policy may see in it.

32FC1 is in m and 16UC1 in mm. In mono8, 255 stands for 1.
"""
IMAGE, INFO = "sensor_msgs/Image", "sensor_msgs/CameraInfo"
QUEUE = 1 << 24
"""Bytes that rospy reads at once. With its default of 64 KiB, an image would wait for the next one."""


def values_of(message: Any, sees: str) -> tuple[bytes, tuple[int, ...], str]:
    """The values of an image in the format of the shared memory: little-endian, without padding, red before blue.

    Args:
        message: sensor_msgs/Image of ROS 1 or 2.
        sees: what the policy sees.

    Returns:
        Its bytes, its shape and the type of its values.

    Raises:
        ValueError: the encoding is unknown, or shows what the policy does not see.
        BrokenImage: the image has fewer bytes than its size says.
    """
    accepted = [name for name, (_, _, shows) in ENCODINGS.items() if sees in shows]
    if message.encoding not in accepted:
        raise ValueError(
            f"encoding is {message.encoding!r}; accepted: {', '.join(accepted) or 'none'} for a policy that sees {sees}"
        )
    kind, pixel, _ = ENCODINGS[message.encoding]
    height, width, row = message.height, message.width, message.width * pixel
    step, data = message.step, bytes(message.data)
    if step < row or len(data) < step * (height - 1) + row:
        raise BrokenImage(f"an image of {height} rows of {step} bytes, {width} pixels in each, has {len(data)} bytes")
    if step != row:
        data = b"".join(data[i * step : i * step + row] for i in range(height))
    data = data[: height * row]
    if message.is_bigendian and kind != "uint8":
        numbers = array({"float32": "I", "uint16": "H"}[kind], data)
        numbers.byteswap()
        data = numbers.tobytes()
    if message.encoding == "bgr8":
        turned = bytearray(data)
        turned[0::3], turned[2::3] = data[2::3], data[0::3]
        data = bytes(turned)
    return data, (height, width) if sees != "rgb" else (height, width, 3), kind


class BrokenImage(Exception):  # noqa: N818  # it does not end the capture: this one image is skipped
    """One image that cannot be read."""


def field_of_view(info: Any, rectified: bool) -> tuple[float, float]:
    """Horizontal and vertical field of view of a pinhole camera, rad: 2 atan(size / (2 f)). If it is `rectified`, its
    projection matrix P is used, which is that of rectified images, instead of K.

    Raises:
        ValueError: the camera is not calibrated.
    """
    k, p = (info.k, info.p) if hasattr(info, "k") else (info.K, info.P)
    across, down = (p[0], p[5]) if rectified and p[0] > 0 and p[5] > 0 else (k[0], k[4])
    if not (across > 0 and down > 0 and info.width > 0 and info.height > 0):
        raise ValueError(
            f"CameraInfo has the focal lengths {across:g} and {down:g} and the size {info.width} x {info.height}; "
            "accepted: positive ones, or ?fov=ACROSSxDOWN behind the topic"
        )
    return 2 * math.atan(info.width / (2 * across)), 2 * math.atan(info.height / (2 * down))


def beside(topic: str) -> str:
    """The topic of the CameraInfo that belongs to an image's topic: /camera/camera_info for /camera/image_raw."""
    return topic.rpartition("/")[0] + "/camera_info"


class Receiver:
    """Processes the messages of a topic, for ROS 1 and ROS 2."""

    def __init__(self, output: Any, topic: str, detail: str) -> None:
        """Wait for the first message. `detail` describes the source."""
        self._output, self._topic, self._detail = output, topic, detail
        self._stamps = importlib.import_module("capture").Stamps(output.speech, topic)
        self._fov: Any = None
        self._rectified = "rect" in topic.rpartition("/")[2]
        self._asked = False

    def camera(self, info: Any) -> None:
        """Process a CameraInfo."""
        try:
            self._fov = field_of_view(info, self._rectified)
        except ValueError as error:
            if self._output.fov is None:
                self._output.speech.fail(f"{beside(self._topic)}: {error}")

    def image(self, message: Any) -> None:
        """Publish an image."""
        output, topic, stamp = self._output, self._topic, message.header.stamp
        moment = self._stamps.moment(
            stamp.sec + 1e-9 * stamp.nanosec if hasattr(stamp, "sec") else stamp.secs + 1e-9 * stamp.nsecs
        )
        try:
            values, shape, kind = values_of(message, output.sees)
            if self._fov is None and output.fov is None:
                if not self._asked:
                    self._asked = True
                    said = f"no CameraInfo came on {beside(topic)}; publish it, or give ?fov=ACROSSxDOWN"
                    output.speech.say("waiting", said)
                return
            output.put(moment, values, shape, kind, self._fov, self._detail)
        except BrokenImage as error:
            output.speech.say("problem", f"{topic}: {error}")
        except ValueError as error:
            output.speech.fail(f"{topic}: {error}")


def capture_ros1(output: Any, topic: str) -> None:
    """Subscribe with rospy.

    Raises:
        RuntimeError: no master answers.
    """
    output.speech.say("waiting", f"no image came on {topic}")
    rospy, rosgraph = importlib.import_module("rospy"), importlib.import_module("rosgraph")
    messages = importlib.import_module("sensor_msgs.msg")
    if not rosgraph.is_master_online():
        uri = os.environ.get("ROS_MASTER_URI", "not set")
        raise RuntimeError(f"no ROS master answers (ROS_MASTER_URI is {uri}); start roscore")
    receiver = Receiver(output, topic, f"rospy of {sys.executable}")

    def receive(raw: Any) -> None:
        kind = raw._connection_header["type"]
        if kind != IMAGE:
            output.speech.fail(f"{topic} is {kind!r}; accepted: {IMAGE}")
        receiver.image(messages.Image().deserialize(raw._buff))

    rospy.init_node("e2efly_image", anonymous=True, disable_signals=True)
    rospy.Subscriber(beside(topic), messages.CameraInfo, receiver.camera, queue_size=1)
    rospy.Subscriber(topic, rospy.AnyMsg, receive, queue_size=1, buff_size=QUEUE, tcp_nodelay=True)
    output.speech.closing.wait()
    rospy.signal_shutdown("closed")


def capture_ros2(output: Any, topic: str) -> None:
    """Subscribe with rclpy, as soon as there is a publisher.

    Raises:
        ValueError: the topic has another type.
    """
    output.speech.say("waiting", f"no image came on {topic}")
    rclpy, qos = importlib.import_module("rclpy"), importlib.import_module("rclpy.qos")
    executors, signals = importlib.import_module("rclpy.executors"), importlib.import_module("rclpy.signals")
    messages = importlib.import_module("sensor_msgs.msg")
    rclpy.init(signal_handler_options=signals.SignalHandlerOptions.NO)
    node = rclpy.create_node(f"e2efly_image_{os.getpid()}")
    executor = executors.SingleThreadedExecutor()
    executor.add_node(node)
    receiver = Receiver(output, topic, f"rclpy of {sys.executable}")
    newest = qos.QoSProfile(depth=1, reliability=qos.ReliabilityPolicy.BEST_EFFORT)  # fits either reliability
    node.create_subscription(messages.CameraInfo, beside(topic), receiver.camera, newest)
    wanted, subscribed = IMAGE.replace("/", "/msg/"), False
    while not output.speech.closing.is_set():
        if not subscribed and (kinds := dict(node.get_topic_names_and_types()).get(topic)):
            if wanted not in kinds:
                raise ValueError(f"{topic} is {', '.join(map(repr, kinds))}; accepted: {wanted}")
            node.create_subscription(messages.Image, topic, receiver.image, newest)
            subscribed = True
        executor.spin_once(timeout_sec=0.05)
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown()
