"""Passes poses of ROS 1, ROS 2 or a motion capture system, or commands of ROS, to the bridge as lines of text.

It runs as a script in a separate process, because `rospy`, `rclpy` and `motioncapture` block, start threads, handle
signals and can crash, and none of that may happen in the control loop. It needs only Python (3.8 or newer) and the
package of its source. So any interpreter that has this package can run it, for example the system's Python for ROS.

It writes the lines of `speech.py`. For each pose or command it writes `message RECEIVED JSON`: the time of arrival on
the monotonic clock, s, and the message in the format of `docs/pose-sources.md` or `docs/commands.md`. For a message
that is no valid pose or command it writes `problem TEXT`.
"""

from __future__ import annotations

import importlib
import json
import math
import os
import sys
import time
from typing import Any, Callable  # noqa: UP035  # Python 3.8

TYPES = ("nav_msgs/Odometry", "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped")
"""Message types of ROS that carry a pose."""
COMMAND_TYPES = (
    "geometry_msgs/PoseStamped",
    "geometry_msgs/TwistStamped",
    "geometry_msgs/AccelStamped",
    "std_msgs/String",
)
"""Message types of ROS that carry a command."""
LENGTH_ERROR = 0.01
"""How much the length of a quaternion may differ from 1."""


def pose_of(message: Any) -> dict[str, Any]:
    """Convert one message of ROS 1 or 2, of any of `TYPES`, to a message of the JSON format.

    ROS uses ENU and FLU, as e2efly does (REP 103), but its quaternions are xyzw. The twist of an Odometry is in the
    axes of the child frame, the body, so its velocity is rotated to the world. A covariance that starts below zero
    means that there is no twist. A stamp of zero means that there is no stamp.
    """
    pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
    p, q = pose.position, pose.orientation
    content: dict[str, Any] = {"position": [p.x, p.y, p.z], "quaternion": [q.w, q.x, q.y, q.z]}
    if hasattr(message, "twist") and message.twist.covariance[0] >= 0:
        v, w = message.twist.twist.linear, message.twist.twist.angular
        content["velocity"] = turn([q.w, q.x, q.y, q.z], [v.x, v.y, v.z])
        content["body_rate"] = [w.x, w.y, w.z]
    return {**content, **header_of(message)}


def header_of(message: Any) -> dict[str, Any]:
    """The stamp, if there is one, and the frame of a message of ROS 1 or 2."""
    stamp = message.header.stamp
    seconds, nanoseconds = (stamp.sec, stamp.nanosec) if hasattr(stamp, "sec") else (stamp.secs, stamp.nsecs)
    said = {"stamp": seconds + nanoseconds * 1e-9} if seconds or nanoseconds else {}
    return {**said, "frame": message.header.frame_id}


def command_of(message: Any) -> str:
    """Convert one message of ROS 1 or 2, of any of `COMMAND_TYPES`, to a message of the JSON format of
    `docs/commands.md`.

    A PoseStamped gives a position and its yaw, a TwistStamped a velocity and a yaw rate, and an AccelStamped an
    acceleration, all in the axes of the world. A String is passed on unchanged.

    Raises:
        ValueError: a value that the mode cannot use is not zero, or the orientation is no unit quaternion.
    """
    if hasattr(message, "data"):
        return message.data
    if hasattr(message, "pose"):
        p, q = message.pose.position, message.pose.orientation
        length = math.hypot(q.w, q.x, q.y, q.z)
        if not abs(length - 1) <= LENGTH_ERROR:  # zeros if the sender did not set it
            raise ValueError(f"the length of the orientation is {length:.3g}; accepted: 1")
        yaw = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        content = {"mode": "position", "position": [p.x, p.y, p.z], "yaw": yaw}
    elif hasattr(message, "twist"):
        v, w = message.twist.linear, message.twist.angular
        content = {"mode": "velocity", "velocity": [v.x, v.y, v.z], "yaw_rate": w.z}
        if w.x or w.y:
            raise ValueError(f"twist.angular is {w.x:g}, {w.y:g} about x and y; accepted: 0, as only yaw can be turned")
    else:
        a, w = message.accel.linear, message.accel.angular
        content = {"mode": "acceleration", "acceleration": [a.x, a.y, a.z]}
        if w.x or w.y or w.z:
            raise ValueError(f"accel.angular is {w.x:g}, {w.y:g}, {w.z:g}; accepted: 0, as the heading is held")
    return json.dumps({**content, **header_of(message)})


def turn(q: list[float], v: list[float]) -> list[float]:
    """The vector v, (3,), rotated by q, (4,) wxyz of any length but 0: v + 2 u x (w v + u x v) / |q|^2, u = xyz."""
    w, u = q[0], q[1:]
    length = sum(x * x for x in q) or 1.0
    inner = [w * a + b for a, b in zip(v, cross(u, v))]  # noqa: B905  # Python 3.8
    return [a + 2 * b / length for a, b in zip(v, cross(u, inner))]  # noqa: B905


def cross(a: list[float], b: list[float]) -> list[float]:
    """The cross product of two vectors, (3,)."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def relay_ros1(speech: Any, topic: str, what: str = "pose") -> None:
    """Subscribe to a topic of ROS 1. Its type need not be known in advance."""
    rospy, rosgraph = importlib.import_module("rospy"), importlib.import_module("rosgraph")
    types, text_of = CONTENTS[what]
    classes = {name: ros_class(name, ".msg") for name in types}
    if not rosgraph.is_master_online():
        uri = os.environ.get("ROS_MASTER_URI", "not set")
        raise RuntimeError(f"no ROS master answers (ROS_MASTER_URI is {uri}); start roscore")

    def receive(raw: Any) -> None:
        received, kind = time.monotonic(), raw._connection_header["type"]
        if kind not in classes:
            speech.say("problem", f"{topic} is {kind!r}; accepted: {', '.join(types)}")
            return
        pass_on(speech.say, topic, received, text_of, classes[kind]().deserialize(raw._buff))

    rospy.init_node(f"e2efly_{what}", anonymous=True, disable_signals=True)
    rospy.Subscriber(topic, rospy.AnyMsg, receive, queue_size=10, tcp_nodelay=True)
    speech.say("ready", f"rospy of {sys.executable}")
    speech.closing.wait()
    rospy.signal_shutdown("closed")


def relay_ros2(speech: Any, topic: str, what: str = "pose") -> None:
    """Subscribe to a topic of ROS 2, as soon as it has a publisher."""
    rclpy, qos = importlib.import_module("rclpy"), importlib.import_module("rclpy.qos")
    executors, signals = importlib.import_module("rclpy.executors"), importlib.import_module("rclpy.signals")
    types, text_of = CONTENTS[what]
    classes = {name.replace("/", "/msg/"): ros_class(name, ".msg") for name in types}
    rclpy.init(signal_handler_options=signals.SignalHandlerOptions.NO)
    node = rclpy.create_node(f"e2efly_{what}_{os.getpid()}")
    executor = executors.SingleThreadedExecutor()
    executor.add_node(node)

    def receive(message: Any) -> None:
        received = time.monotonic()
        pass_on(speech.say, topic, received, text_of, message)

    speech.say("ready", f"rclpy of {sys.executable}")
    said, subscribed = "", False
    while not speech.closing.is_set():
        if not subscribed:
            kinds = dict(node.get_topic_names_and_types()).get(topic, [])
            known = [kind for kind in kinds if kind in classes]
            if known:
                # Best effort fits publishers of either reliability.
                node.create_subscription(classes[known[0]], topic, receive, qos.qos_profile_sensor_data)
                subscribed = True
            elif kinds and kinds != said:
                said = kinds
                speech.say("problem", f"{topic} is {', '.join(map(repr, kinds))}; accepted: {', '.join(classes)}")
        executor.spin_once(timeout_sec=0.05)
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown()


def pass_on(say: Callable[..., None], topic: str, received: float, text_of: Callable[[Any], str], message: Any) -> None:
    """Write one message, or the reason why it is not valid."""
    try:
        text = text_of(message)
    except ValueError as error:
        say("problem", f"{topic}: {error}")
    else:
        say("message", repr(received), text)


def ros_class(name: str, module: str) -> Any:
    """The class of a message type, such as "nav_msgs/Odometry"."""
    package, kind = name.split("/")
    return getattr(importlib.import_module(package + module), kind)


def relay_mocap(speech: Any, system: str, host: str, body: str) -> None:
    """Wait for frames of a motion capture system and pass on the pose of one rigid body."""
    connection = importlib.import_module("motioncapture").connect(system, {"hostname": host})
    speech.say("ready", f"motioncapture of {sys.executable}")
    warned = float("-inf")
    while not speech.closing.is_set():
        connection.waitForNextFrame()
        received, bodies = time.monotonic(), connection.rigidBodies
        if body in bodies:
            p, q = [float(x) for x in bodies[body].position], bodies[body].rotation
            speech.say("message", repr(received), json.dumps({"position": p, "quaternion": [q.w, q.x, q.y, q.z]}))
        elif received - warned > 1:  # once per second is enough
            warned = received
            speech.say(
                "problem",
                f"rigid body {body!r} is not tracked; there are: {', '.join(map(repr, sorted(bodies))) or 'none'}",
            )


CONTENTS: dict[str, tuple[tuple[str, ...], Callable[[Any], str]]] = {
    "pose": (TYPES, lambda message: json.dumps(pose_of(message))),
    "command": (COMMAND_TYPES, command_of),
}
"""What a topic may carry: the message types, and the function that converts them to JSON."""


if __name__ == "__main__":
    relays = {"ros1": relay_ros1, "ros2": relay_ros2, "mocap": relay_mocap}
    importlib.import_module("speech").main(relays, sys.argv[1:])
