"""Passes the poses of ROS 1, ROS 2 or a motion capture system on to the bridge, as lines of text.

It runs as a script in a process of its own: `rospy`, `rclpy` and `motioncapture` block, start threads, handle signals
and can crash, and none of that may happen in the control loop. It needs nothing but Python (3.8 or newer) and the
package that it speaks for, so that any interpreter which has that package can run it, such as the system's for ROS.

It writes the lines of `speech.py`, `problem TEXT` for what is no pose, and for each pose `pose RECEIVED JSON`, with the
time of arrival on the monotonic clock, s, and the message of `docs/pose-sources.md`.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import time
from typing import Any

TYPES = ("nav_msgs/Odometry", "geometry_msgs/PoseStamped", "geometry_msgs/PoseWithCovarianceStamped")
"""Message types of ROS that carry a pose."""


def pose_of(message: Any) -> dict[str, Any]:
    """One message of ROS 1 or 2, of any of `TYPES`, as a message of the JSON format.

    ROS is ENU and FLU as we are (REP 103); quaternions are xyzw there. The twist of an Odometry is in the axes of the
    child frame, the body, so its velocity is turned into the world; a covariance that starts below zero says that there
    is no twist. A stamp of zero says that there is no stamp.
    """
    pose = message.pose.pose if hasattr(message.pose, "pose") else message.pose
    p, q = pose.position, pose.orientation
    content: dict[str, Any] = {"position": [p.x, p.y, p.z], "quaternion": [q.w, q.x, q.y, q.z]}
    if hasattr(message, "twist") and message.twist.covariance[0] >= 0:
        v, w = message.twist.twist.linear, message.twist.twist.angular
        content["velocity"] = turn([q.w, q.x, q.y, q.z], [v.x, v.y, v.z])
        content["body_rate"] = [w.x, w.y, w.z]
    stamp = message.header.stamp
    seconds, nanoseconds = (stamp.sec, stamp.nanosec) if hasattr(stamp, "sec") else (stamp.secs, stamp.nsecs)
    if seconds or nanoseconds:
        content["stamp"] = seconds + nanoseconds * 1e-9
    return {**content, "frame": message.header.frame_id}


def turn(q: list[float], v: list[float]) -> list[float]:
    """The vector v, (3,), turned by q, (4,) wxyz of any length but 0: v + 2 u x (w v + u x v) / |q|^2, u = xyz."""
    w, u = q[0], q[1:]
    length = sum(x * x for x in q) or 1.0
    inner = [w * a + b for a, b in zip(v, cross(u, v))]  # noqa: B905  # Python 3.8
    return [a + 2 * b / length for a, b in zip(v, cross(u, inner))]  # noqa: B905


def cross(a: list[float], b: list[float]) -> list[float]:
    """The cross product of two vectors, (3,)."""
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def relay_ros1(speech: Any, topic: str) -> None:
    """Subscribe to a topic of ROS 1, whatever its type turns out to be."""
    rospy, rosgraph = importlib.import_module("rospy"), importlib.import_module("rosgraph")
    classes = {name: ros_class(name, ".msg") for name in TYPES}
    if not rosgraph.is_master_online():
        uri = os.environ.get("ROS_MASTER_URI", "not set")
        raise RuntimeError(f"no ROS master answers (ROS_MASTER_URI is {uri}); start roscore")

    def receive(raw: Any) -> None:
        received, kind = time.monotonic(), raw._connection_header["type"]
        if kind not in classes:
            speech.say("problem", f"{topic} is {kind!r}; accepted: {', '.join(TYPES)}")
            return
        speech.say("pose", repr(received), json.dumps(pose_of(classes[kind]().deserialize(raw._buff))))

    rospy.init_node("e2efly_pose", anonymous=True, disable_signals=True)
    rospy.Subscriber(topic, rospy.AnyMsg, receive, queue_size=10, tcp_nodelay=True)
    speech.say("ready", f"rospy of {sys.executable}")
    speech.closing.wait()
    rospy.signal_shutdown("closed")


def relay_ros2(speech: Any, topic: str) -> None:
    """Subscribe to a topic of ROS 2, as soon as somebody publishes it."""
    rclpy, qos = importlib.import_module("rclpy"), importlib.import_module("rclpy.qos")
    executors, signals = importlib.import_module("rclpy.executors"), importlib.import_module("rclpy.signals")
    classes = {name.replace("/", "/msg/"): ros_class(name, ".msg") for name in TYPES}
    rclpy.init(signal_handler_options=signals.SignalHandlerOptions.NO)
    node = rclpy.create_node(f"e2efly_pose_{os.getpid()}")
    executor = executors.SingleThreadedExecutor()
    executor.add_node(node)

    def receive(message: Any) -> None:
        received = time.monotonic()
        speech.say("pose", repr(received), json.dumps(pose_of(message)))

    speech.say("ready", f"rclpy of {sys.executable}")
    said, subscribed = "", False
    while not speech.closing.is_set():
        if not subscribed:
            kinds = dict(node.get_topic_names_and_types()).get(topic, [])
            known = [kind for kind in kinds if kind in classes]
            if known:
                # Best effort agrees with publishers of either reliability.
                node.create_subscription(classes[known[0]], topic, receive, qos.qos_profile_sensor_data)
                subscribed = True
            elif kinds and kinds != said:
                said = kinds
                speech.say("problem", f"{topic} is {', '.join(map(repr, kinds))}; accepted: {', '.join(classes)}")
        executor.spin_once(timeout_sec=0.05)
    executor.shutdown()
    node.destroy_node()
    rclpy.shutdown()


def ros_class(name: str, module: str) -> Any:
    """The class of a message type, such as "nav_msgs/Odometry"."""
    package, kind = name.split("/")
    return getattr(importlib.import_module(package + module), kind)


def relay_mocap(speech: Any, system: str, host: str, body: str) -> None:
    """Wait for frames of a motion capture system and pass one rigid body on."""
    connection = importlib.import_module("motioncapture").connect(system, {"hostname": host})
    speech.say("ready", f"motioncapture of {sys.executable}")
    warned = float("-inf")
    while not speech.closing.is_set():
        connection.waitForNextFrame()
        received, bodies = time.monotonic(), connection.rigidBodies
        if body in bodies:
            p, q = [float(x) for x in bodies[body].position], bodies[body].rotation
            speech.say("pose", repr(received), json.dumps({"position": p, "quaternion": [q.w, q.x, q.y, q.z]}))
        elif received - warned > 1:  # once per second is enough
            warned = received
            speech.say(
                "problem",
                f"rigid body {body!r} is not tracked; there are: {', '.join(map(repr, sorted(bodies))) or 'none'}",
            )


if __name__ == "__main__":
    relays = {"ros1": relay_ros1, "ros2": relay_ros2, "mocap": relay_mocap}
    importlib.import_module("speech").main(relays, sys.argv[1:])
