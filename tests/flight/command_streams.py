"""Commanders in tests: commands as bytes, through the real parser, or over a real socket in a rig's time."""

import dataclasses
import json
import math
import socket
from collections.abc import Callable
from contextlib import closing
from operator import attrgetter
from typing import Any

import numpy as np

from e2efly.flight.commander.command import Command
from e2efly.flight.commander.sources import open_commands
from tests.flight.ros_poses import first as first_of
from tests.flight.ros_poses import problem_of
from tests.waiting import free_port

PUBLISHED = """
import math
from geometry_msgs.msg import AccelStamped, PoseStamped, TwistStamped, Vector3
from std_msgs.msg import String
KINDS = {"/position": PoseStamped, "/velocity": TwistStamped, "/acceleration": AccelStamped, "/json": String,
         "/body": TwistStamped, "/rolling": TwistStamped, "/unset": PoseStamped, "/vector": Vector3}
def message_of(topic, stamp):
    kind = KINDS[topic]
    message = kind()
    if hasattr(message, "header"):
        message.header.frame_id = "base_link" if topic == "/body" else "map"
        message.header.stamp = stamp
    if topic == "/position":
        message.pose.position.x, message.pose.position.z = 1.0, 1.5
        message.pose.orientation.w = message.pose.orientation.z = math.sqrt(0.5)  # a quarter turn to the left
    elif topic == "/unset":
        message.pose.orientation.w = 0.0
    elif kind is TwistStamped:
        message.twist.linear.x, message.twist.angular.z = 0.5, -0.25
        message.twist.angular.x = 0.1 if topic == "/rolling" else 0.0
    elif kind is AccelStamped:
        message.accel.linear.y = 2.0
    elif kind is String:
        message.data = '{"mode": "ctbr", "thrust": 9.5, "body_rate": [0, 0.5, 0], "stamp": 4.25}'
    return message
"""
"""What the publishers of ROS 1 and ROS 2 send, as their script begins."""
REFUSED = {
    "/body": "frame is 'base_link'; accepted: map, odom, world or none",
    "/rolling": "twist.angular is 0.1, 0 about x and y; accepted: 0",
    "/unset": "the length of the orientation is 0; accepted: 1",
}
"""The topics of those publishers that are no commands, and what is said of each."""


def encode(**content: Any) -> bytes:
    return json.dumps(content).encode()


class Loopback:
    """A real UDP source and its sender; what has arrived counts as arrived at the time of the next `read`."""

    def __init__(self) -> None:
        self.port = free_port(udp=True)
        self.source = open_commands(f"udp:{self.port}")
        self.sender = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def __enter__(self) -> "Loopback":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def send(self, message: bytes) -> None:
        self.sender.sendto(message, ("127.0.0.1", self.port))

    refused, problem, describe = (property(attrgetter(f"source.{name}")) for name in ("refused", "problem", "describe"))

    def read(self, now: float) -> list[Command]:
        return [dataclasses.replace(command, received=now) for command in self.source.read(now)]

    def close(self) -> None:
        self.sender.close()
        self.source.close()


def _is_position(command: Command) -> None:
    np.testing.assert_array_equal(command.main, [1, 0, 1.5])
    assert command.yaw is not None
    assert abs(command.yaw - math.pi / 2) < 1e-9
    assert (command.mode, command.stamp) == ("position", 1700000000.5)


def _is_velocity(command: Command) -> None:
    np.testing.assert_array_equal(command.main, [0.5, 0, 0])
    assert (command.mode, command.yaw_rate, command.altitude) == ("velocity", -0.25, None)


def _is_acceleration(command: Command) -> None:
    np.testing.assert_array_equal(command.main, [0, 2, 0])
    assert (command.mode, command.yaw, command.yaw_rate) == ("acceleration", None, None)


def _is_ctbr(command: Command) -> None:
    np.testing.assert_array_equal(command.main, [0, 0.5, 0])
    assert (command.mode, command.thrust, command.stamp) == ("ctbr", 9.5, 4.25)


TOPICS: dict[str, Callable[[Command], None]] = {
    "/position": _is_position,
    "/velocity": _is_velocity,
    "/acceleration": _is_acceleration,
    "/json": _is_ctbr,
}
"""The topics of the publishers of ROS 1 and ROS 2 that are commands, and what each is to say."""


def first(text: str) -> Command:
    """The first command that a source delivers."""
    with closing(open_commands(text)) as source:
        return first_of(source)


def refused(text: str) -> str:
    """What a source says of a stream of which nothing is accepted."""
    with closing(open_commands(text)) as source:
        said = problem_of(source)
        assert source.refused >= 1
        return said
