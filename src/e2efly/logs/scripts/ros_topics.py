"""A flight as ROS topics: the topics, their types, and a message for each record of the flight log.

A message is a tree: nested dictionaries whose keys are the names of the ROS fields. Fields that keep their defaults are
left out. `stamp` is in ns since 1970, which ROS 1 and ROS 2 write differently. Bytes are arrays of uint8. The world is
the frame `map` (ENU) and the body is `base_link` (FLU), according to REP 103 and REP 105. The twist of an odometry is
in the body frame, as nav_msgs defines it. An unknown value is NaN, and an unknown covariance is all zeros.

Any Python that has ROS must be able to run this file, so it needs only Python 3.8 or newer.
"""

from __future__ import annotations

import math
from typing import Any, Callable, Dict, List, NamedTuple, Optional  # noqa: UP035  # Python 3.8

WORLD_FRAME, BODY_FRAME = "map", "base_link"
"""Names of the frames, according to REP 105."""
IMAGE_TYPE, INFO_TYPE, TRANSFORMS_TYPE = "sensor_msgs/Image", "sensor_msgs/CameraInfo", "tf2_msgs/TFMessage"
"""Message types of the images, of the parameters of their cameras, and of the poses of the frames."""
IMAGE_TOPIC, INFO_TOPIC = "/camera/{}/image", "/camera/{}/camera_info"
"""Names of the topics of images and camera parameters, with a place for the name of the camera. rviz expects the second
next to the first."""
TRANSFORMS_TOPIC = "/tf"
"""Name of the topic of the frames. It gets no prefix."""

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
"""Definition of tf2_msgs/TFMessage. In ROS 1 the type is made from it if the package is not installed."""

Tree = Dict[str, Any]  # noqa: UP006
Build = Callable[[Dict[str, Any], int], Optional[Tree]]  # noqa: UP006, UP045


class Topic(NamedTuple):
    """One topic."""

    name: str
    """The name of the topic, to which a prefix is added."""
    kind: str
    """The message type, in the form of ROS 1."""
    channel: str
    """The channel of the flight log from which it is made."""
    build: Build
    """(values of the record, its time in ns) -> a message, or None if the record gives none."""
    latched: bool = False
    """Whether a later subscriber gets the last message at once."""


def number(values: dict[str, Any], field: str) -> float:
    """A field as a number. NaN if there is none."""
    value = values.get(field)
    return math.nan if value is None else float(value)


def numbers(values: dict[str, Any], field: str, size: int | None = None) -> list[float]:
    """A field as numbers. If there are none, or not `size` of them, `size` NaNs."""
    found = values.get(field)
    if found is None or (size is not None and len(found) != size):
        return [math.nan] * (size or 0)
    return [math.nan if value is None else float(value) for value in found]


def vector(xyz: list[float]) -> Tree:
    """A Vector3 or a Point."""
    return dict(zip("xyz", xyz))  # noqa: B905  # Python 3.8


def header(stamp: int, frame: str) -> Tree:
    """A std_msgs/Header."""
    return {"stamp": stamp, "frame_id": frame}


def into_body(q: list[float], v: list[float]) -> list[float]:
    """A vector of the world in the axes of the body: the transposed rotation matrix of q, wxyz, times the vector."""
    w, x, y, z = q
    a, b, c = v
    return [
        (1 - 2 * (y * y + z * z)) * a + 2 * (x * y + w * z) * b + 2 * (x * z - w * y) * c,
        2 * (x * y - w * z) * a + (1 - 2 * (x * x + z * z)) * b + 2 * (y * z + w * x) * c,
        2 * (x * z + w * y) * a + 2 * (y * z - w * x) * b + (1 - 2 * (x * x + y * y)) * c,
    ]


def odometry(values: dict[str, Any], stamp: int) -> Tree:
    """An odometry, with the twist in the body frame, its child frame. The stamp is the time at which it was true."""
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
    """The inertial sensors, without orientation (its covariance begins with -1).

    The orientation is left out because the controller's yaw has another origin than the odometry's. None: the record
    has neither body rates nor a specific force.
    """
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
    """The command as a twist: linear z is thrust over mass, m/s^2, and angular is the body rate, rad/s."""
    linear = vector([0.0, 0.0, number(values, "collective_thrust")])
    twist = {"linear": linear, "angular": vector(numbers(values, "body_rate", 3))}
    return {"header": header(stamp, BODY_FRAME), "twist": twist}


def battery(values: dict[str, Any], stamp: int) -> Tree:
    """The battery. A drawn current is negative, as in ROS. The number of cells is known, but not their voltages."""
    cells = number(values, "cells")
    unknown = dict.fromkeys(("temperature", "charge", "capacity", "design_capacity", "percentage"), math.nan)
    known = {"voltage": number(values, "voltage"), "current": -number(values, "current")}
    state = {"power_supply_status": 2, "power_supply_health": 0, "power_supply_technology": 3, "present": True}
    each = [math.nan] * (int(cells) if cells >= 1 else 0)
    return {"header": header(stamp, BODY_FRAME), **unknown, **known, **state, "cell_voltage": each}


def joy(values: dict[str, Any], stamp: int) -> Tree:
    """The channels as axes: 1000 to 2000 us become -1 to 1."""
    axes = [(channel - 1500.0) / 500.0 for channel in numbers(values, "channels")]
    return {"header": header(stamp, BODY_FRAME), "axes": axes}


def mode(values: dict[str, Any], stamp: int) -> Tree:
    """A change of the mode as text: `PREVIOUS -> MODE: reason; reason`."""
    reasons = "; ".join(values.get("reasons") or [])
    change = f"{values.get('previous') or ''} -> {values.get('mode') or ''}".strip()
    return {"data": f"{change}: {reasons}" if reasons else change}


def event(values: dict[str, Any], stamp: int) -> Tree:
    """An event as text: `level: text`."""
    return {"data": f"{values.get('level') or 'info'}: {values.get('text') or ''}"}


def observation(values: dict[str, Any], stamp: int) -> Tree:
    """The observation of the policy, in the order of its contract."""
    return {"data": numbers(values, "observation")}


def action(values: dict[str, Any], stamp: int) -> Tree:
    """The action of the policy, in [-1, 1]."""
    return {"data": numbers(values, "action")}


def image(layout: dict[str, Any], stamp: int, data: bytes) -> Tree:
    """An image. `layout` has its frame, height, width and encoding, and the bytes of a row."""
    size = {key: layout[key] for key in ("height", "width", "encoding", "step")}
    return {"header": header(stamp, layout["frame"]), **size, "is_bigendian": 0, "data": data}


def intrinsics(layout: dict[str, Any]) -> Tree:
    """The intrinsics of a pinhole camera without distortion whose optical axis is in the centre of the image.

    They have the names of ROS 1: D, K, R and P.
    """
    across, down = layout["fov"]
    height, width = layout["height"], layout["width"]
    fx, fy = width / 2 / math.tan(across / 2), height / 2 / math.tan(down / 2)
    cx, cy = width / 2 - 0.5, height / 2 - 0.5  # the centres of pixels have integer coordinates
    return {
        "D": [0.0] * 5,
        "K": [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0],
        "R": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "P": [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
    }


def camera_info(layout: dict[str, Any], stamp: int, version: int) -> Tree:
    """The parameters of a camera. ROS 2 writes the names of `intrinsics` in lower case."""
    known = {name if version == 1 else name.lower(): value for name, value in intrinsics(layout).items()}
    size = {"height": layout["height"], "width": layout["width"], "distortion_model": "plumb_bob"}
    return {"header": header(stamp, layout["frame"]), **size, **known}


class Transform(NamedTuple):
    """The pose of a frame in its parent frame."""

    stamp: int
    parent: str
    child: str
    position: List[float]  # noqa: UP006
    """m."""
    quaternion: List[float]  # noqa: UP006
    """The rotation from child to parent, wxyz."""


def transforms(values: dict[str, Any], stamp: int, images: dict[str, dict[str, Any]]) -> list[Transform]:
    """The poses of the body in the world, from a record of the odometry, and of the cameras on the body.

    The list is empty if the record has no pose. The cameras are included each time, so that a later subscriber also
    gets them.
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
    """The transforms as a message."""
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
"""The topics. They are the same in a bag and during a flight."""
