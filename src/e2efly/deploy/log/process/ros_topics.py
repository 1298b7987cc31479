"""What a flight says in the words of ROS: the topics, their types, and a message for each record of the flight log.

A message is a tree: dictionaries by the names of ROS's fields, without those that keep their defaults. `stamp` is ns
since 1970, which ROS 1 and ROS 2 write differently; bytes are arrays of uint8. World is the frame `map` (ENU), body is
`base_link` (FLU), as REP 103 and REP 105 have them; the twist of an odometry is in the body's frame, as nav_msgs has
it. What is not known is NaN, and a covariance of zeros.

Whatever Python has ROS must be able to run this: it needs Python 3.8 or newer and nothing else.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Dict, List, NamedTuple, Optional  # noqa: UP035  # Python 3.8

WORLD_FRAME, BODY_FRAME = "map", "base_link"
"""Names of the frames, by REP 105."""
IMAGE_TYPE, INFO_TYPE, TRANSFORMS_TYPE = "sensor_msgs/Image", "sensor_msgs/CameraInfo", "tf2_msgs/TFMessage"
"""Types of the images, of what is known of their cameras, and of where the frames are."""
IMAGE_TOPIC, INFO_TOPIC = "/camera/{}/image", "/camera/{}/camera_info"
"""Names of their topics, by the camera's; rviz looks for the second beside the first."""
TRANSFORMS_TOPIC = "/tf"
"""Of the frames, below no prefix."""

TF_DEFINITION = """geometry_msgs/TransformStamped[] transforms
================================================================================
MSG: geometry_msgs/TransformStamped
Header header
string child_frame_id
Transform transform
================================================================================
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
================================================================================
MSG: geometry_msgs/Transform
Vector3 translation
Quaternion rotation
================================================================================
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
================================================================================
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
"""Of tf2_msgs/TFMessage, by which ROS 1 makes the type where the package is not there."""

Tree = Dict[str, Any]  # noqa: UP006
Build = Callable[[Dict[str, Any], int], Optional[Tree]]  # noqa: UP006, UP045


class Topic(NamedTuple):
    """One topic."""

    name: str
    """Its name, below a prefix."""
    kind: str
    """Its message type, as ROS 1 writes it."""
    channel: str
    """The channel of the flight log that it is made of."""
    build: Build
    """(values of the record, its time in ns) -> a message, or None where nothing can be told."""
    latched: bool = False
    """Whether who comes later hears the last message at once."""


def number(values: dict[str, Any], field: str) -> float:
    """A field as a number, NaN where there is none."""
    value = values.get(field)
    return math.nan if value is None else float(value)


def numbers(values: dict[str, Any], field: str, size: int | None = None) -> list[float]:
    """A field as numbers, all NaN where there are none or `size` is another."""
    found = values.get(field)
    if found is None or (size is not None and len(found) != size):
        return [math.nan] * (size or 0)
    return [math.nan if value is None else float(value) for value in found]


def vector(xyz: list[float]) -> Tree:
    """A Vector3 or a Point."""
    return dict(zip("xyz", xyz))  # noqa: B905  # Python 3.8


def header(stamp: int, frame: str) -> Tree:
    """A header."""
    return {"stamp": stamp, "frame_id": frame}


def into_body(q: list[float], v: list[float]) -> list[float]:
    """A vector of the world in the axes of the body: by the transpose of the rotation matrix of q, wxyz."""
    w, x, y, z = q
    a, b, c = v
    return [
        (1 - 2 * (y * y + z * z)) * a + 2 * (x * y + w * z) * b + 2 * (x * z - w * y) * c,
        2 * (x * y - w * z) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z + w * x) * c,
        2 * (x * z + w * y) * a + 2 * (y * z - w * x) * b + (1 - 2 * (x * x + y * y)) * c,
    ]


def odometry(values: dict[str, Any], stamp: int) -> Tree:
    """Twist in the body's frame, the odometry's child frame; stamped with the time at which it was true."""
    age, q = number(values, "age"), numbers(values, "quaternion", 4)
    true = stamp if math.isnan(age) else max(stamp - round(age * 1e9), 0)
    w, x, y, z = q
    pose = {"position": vector(numbers(values, "position", 3)), "orientation": {"x": x, "y": y, "z": z, "w": w}}
    twist = {
        "linear": vector(into_body(q, numbers(values, "velocity", 3))),
        "angular": vector(numbers(values, "body_rate", 3)),
    }
    known = {"child_frame_id": BODY_FRAME, "pose": {"pose": pose}, "twist": {"twist": twist}}
    return {"header": header(true, WORLD_FRAME), **known}


def imu(values: dict[str, Any], stamp: int) -> Tree | None:
    """No orientation (its covariance begins with -1): the controller's yaw has an origin of its own."""
    gyro, force = numbers(values, "gyro", 3), numbers(values, "specific_force", 3)
    if not any(map(math.isfinite, gyro + force)):  # a record of the attitude only
        return None
    return {
        "header": header(stamp, BODY_FRAME),
        "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0},
        "orientation_covariance": [-1.0] + [0.0] * 8,
        "angular_velocity": vector(gyro),
        "linear_acceleration": vector(force),
    }


def command(values: dict[str, Any], stamp: int) -> Tree:
    """Linear z is thrust over mass, m/s^2; angular is the body rate, rad/s."""
    linear = vector([0.0, 0.0, number(values, "collective_thrust")])
    twist = {"linear": linear, "angular": vector(numbers(values, "body_rate", 3))}
    return {"header": header(stamp, BODY_FRAME), "twist": twist}


def battery(values: dict[str, Any], stamp: int) -> Tree:
    """A current drawn is negative, as ROS has it; of the cells their number is known, and not their voltages."""
    cells = number(values, "cells")
    unknown = dict.fromkeys(("temperature", "charge", "capacity", "design_capacity", "percentage"), math.nan)
    known = {"voltage": number(values, "voltage"), "current": -number(values, "current")}
    state = {"power_supply_status": 2, "power_supply_health": 0, "power_supply_technology": 3, "present": True}
    each = [math.nan] * (int(cells) if cells >= 1 else 0)
    return {"header": header(stamp, BODY_FRAME), **unknown, **known, **state, "cell_voltage": each}


def joy(values: dict[str, Any], stamp: int) -> Tree:
    """Axes are the channels with 1000 to 2000 us as -1 to 1."""
    axes = [(channel - 1500.0) / 500.0 for channel in numbers(values, "channels")]
    return {"header": header(stamp, BODY_FRAME), "axes": axes}


def mode(values: dict[str, Any], stamp: int) -> Tree:
    """`PREVIOUS -> MODE: reason; reason`."""
    reasons = "; ".join(values.get("reasons") or [])
    change = f"{values.get('previous') or ''} -> {values.get('mode') or ''}".strip()
    return {"data": f"{change}: {reasons}" if reasons else change}


def event(values: dict[str, Any], stamp: int) -> Tree:
    """`level: text`."""
    return {"data": f"{values.get('level') or 'info'}: {values.get('text') or ''}"}


def observation(values: dict[str, Any], stamp: int) -> Tree:
    """What the policy saw, as its contract lays it out."""
    return {"data": numbers(values, "observation")}


def action(values: dict[str, Any], stamp: int) -> Tree:
    """What it wants, in [-1, 1]."""
    return {"data": numbers(values, "action")}


def image(layout: dict[str, Any], stamp: int, data: bytes) -> Tree:
    """An image; `layout` has its height, width, encoding and the bytes of a row."""
    size = {key: layout[key] for key in ("height", "width", "encoding", "step")}
    return {"header": header(stamp, layout["frame"]), **size, "is_bigendian": 0, "data": data}


def intrinsics(layout: dict[str, Any]) -> Tree:
    """Of a pinhole camera without distortion, whose optical axis is in the middle: D, K, R and P by ROS 1's names."""
    across, down = layout["fov"]
    height, width = layout["height"], layout["width"]
    fx, fy = width / 2 / math.tan(across / 2), height / 2 / math.tan(down / 2)
    cx, cy = width / 2 - 0.5, height / 2 - 0.5  # centres of pixels have whole numbers
    return {
        "D": [0.0] * 5,
        "K": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }


def camera_info(layout: dict[str, Any], stamp: int, version: int) -> Tree:
    """What is known of a camera; ROS 2 writes the names of `intrinsics` small."""
    known = {name if version == 1 else name.lower(): value for name, value in intrinsics(layout).items()}
    size = {"height": layout["height"], "width": layout["width"], "distortion_model": "plumb_bob"}
    return {"header": header(stamp, layout["frame"]), **size, **known}


class Transform(NamedTuple):
    """Where a frame is in another."""

    stamp: int
    parent: str
    child: str
    position: List[float]  # noqa: UP006
    """m."""
    quaternion: List[float]  # noqa: UP006
    """wxyz, child to parent."""


def transforms(values: dict[str, Any], stamp: int, images: dict[str, dict[str, Any]]) -> list[Transform]:
    """Where the body is in the world by a record of the odometry, and the cameras are on the body; empty where the
    record does not say it. The cameras are told each time, so that who comes later hears of them, too.
    """
    age, position, q = number(values, "age"), numbers(values, "position", 3), numbers(values, "quaternion", 4)
    if not all(map(math.isfinite, position + q)):
        return []
    true = stamp if math.isnan(age) else max(stamp - round(age * 1e9), 0)
    mounted = [
        Transform(true, BODY_FRAME, layout["frame"], layout["position"], layout["quaternion"])
        for layout in images.values()
    ]
    return [Transform(true, WORLD_FRAME, BODY_FRAME, position, q), *mounted]


def tf_message(found: list[Transform]) -> Tree:
    """The same as a message."""
    return {
        "transforms": [
            {
                "header": header(each.stamp, each.parent),
                "child_frame_id": each.child,
                "transform": {
                    "translation": vector(each.position),
                    "rotation": dict(zip("wxyz", each.quaternion)),  # noqa: B905  # Python 3.8
                },
            }
            for each in found
        ]
    }


TOPICS = (
    Topic("/odometry", "nav_msgs/Odometry", "odometry", odometry),
    Topic("/imu", "sensor_msgs/Imu", "imu", imu),
    Topic("/command", "geometry_msgs/TwistStamped", "command", command),
    Topic("/battery", "sensor_msgs/BatteryState", "battery", battery),
    Topic("/rc", "sensor_msgs/Joy", "rc", joy),
    Topic("/sticks", "sensor_msgs/Joy", "sticks", joy),
    Topic("/mode", "std_msgs/String", "mode", mode, latched=True),
    Topic("/event", "std_msgs/String", "event", event, latched=True),
    Topic("/policy/observation", "std_msgs/Float32MultiArray", "policy", observation),
    Topic("/policy/action", "std_msgs/Float32MultiArray", "policy", action),
)
"""The topics, of a bag as of a flight under way."""
