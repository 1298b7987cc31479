"""Flight logs as bags of ROS 1 and ROS 2, written without ROS by the package `rosbags`.

World is the frame `map` (ENU), body is `base_link` (FLU), as REP 103 and REP 105 have them. Quaternions turn from our
wxyz into ROS's xyzw fields, and the twist of an odometry is in the body's frame, as nav_msgs has it.
"""

from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.deploy.log.flight_log import FlightLog, Series

WORLD_FRAME, BODY_FRAME = "map", "base_link"
"""Names of the frames, by REP 105."""

Build = Callable[[Any, Series], Iterator[Any]]


@dataclass(frozen=True)
class Topic:
    """One topic of a bag."""

    name: str
    """Its name."""
    kind: str
    """Its message type, as ROS 2 writes it."""
    channel: str
    """The channel of the flight log that it is made of."""
    build: Build
    """(message types, series) -> a message, or None where nothing can be told, for every message of the channel."""


def export_bag(log: FlightLog, path: str | Path, version: int) -> dict[str, int]:
    """Write a flight log as a bag.

    Args:
        log: what `read_log` gave.
        path: a new file ending in `.bag` (version 1), or a new folder (version 2: sqlite3 storage).
        version: 1 or 2, of ROS.

    Returns:
        Messages written, by topic.

    Raises:
        ValueError: for another version, a path that exists, an ending that the version does not have, a log without any
            of the channels that a bag has, or where the package `rosbags` is not there.
    """
    if version not in (1, 2):
        raise ValueError(f"bag: version is {version!r}; accepted: 1 (ROS 1) or 2 (ROS 2)")
    path = Path(path)
    if path.exists():
        raise ValueError(f"bag: {str(path)!r} exists already; accepted: a path that is not there")
    if (path.suffix == ".bag") != (version == 1):
        wanted = "a file ending in .bag" if version == 1 else "a folder, whose name does not end in .bag"
        raise ValueError(f"bag: path is {str(path)!r}; accepted for ROS {version}: {wanted}")
    kept = [topic for topic in TOPICS if topic.channel in log.series]
    if not kept:
        raise ValueError(f"bag: {log.path} has no message of {', '.join(topic.channel for topic in TOPICS)}")
    try:
        from rosbags.rosbag1 import Writer as Writer1
        from rosbags.rosbag2 import Writer as Writer2
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise ValueError(
            f"bag: the package rosbags is missing ({error}); accepted: pip install 'e2efly[ros]'"
        ) from None
    store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)
    encode = store.serialize_ros1 if version == 1 else store.serialize_cdr
    path.parent.mkdir(parents=True, exist_ok=True)
    with ExitStack() as stack:
        writer: Any = stack.enter_context(Writer1(path) if version == 1 else Writer2(path, version=8))
        connections = {topic.name: writer.add_connection(topic.name, topic.kind, typestore=store) for topic in kept}
        rows = sorted(_rows(kept, log, _Types(store.types, version)), key=lambda row: row[0])
        for stamp, topic, message in rows:
            writer.write(connections[topic.name], stamp, encode(message, topic.kind))
    return {topic.name: sum(row[1] is topic for row in rows) for topic in kept}


def _rows(topics: list[Topic], log: FlightLog, types: "_Types") -> Iterator[tuple[int, Topic, Any]]:
    for topic in topics:
        series = log[topic.channel]
        for stamp, message in zip(series.stamp, topic.build(types, series), strict=True):
            if message is not None:
                yield int(stamp), topic, message


@dataclass(frozen=True)
class _Types:
    """Message types of one ROS version: what they share, under one roof."""

    types: Any
    version: int

    def __call__(self, kind: str, *values: Any) -> Any:
        return self.types[kind](*values)

    def header(self, stamp: int, frame: str) -> Any:
        time = self("builtin_interfaces/msg/Time", stamp // 10**9, stamp % 10**9)
        first = (0,) if self.version == 1 else ()  # ROS 1 counts its headers
        return self("std_msgs/msg/Header", *first, time, frame)

    def vector(self, xyz: np.ndarray) -> Any:
        return self("geometry_msgs/msg/Vector3", *map(float, xyz))

    def quaternion(self, wxyz: np.ndarray) -> Any:
        w, x, y, z = map(float, wxyz)
        return self("geometry_msgs/msg/Quaternion", x, y, z, w)


_UNKNOWN_COVARIANCE = np.zeros(36)  # what nav_msgs has for "not known"


def _odometry(types: _Types, series: Series) -> Iterator[Any]:
    """Twist in the body's frame, the odometry's child frame; stamped with the time at which it was true."""
    position, velocity = series.numbers("position", 3), series.numbers("velocity", 3)
    quaternion, rate = series.numbers("quaternion", 4), series.numbers("body_rate", 3)
    age = np.nan_to_num(series.numbers("age"))
    body = _into_body(quaternion, velocity)
    for i, stamp in enumerate(series.stamp):
        header = types.header(max(int(stamp) - round(age[i] * 1e9), 0), WORLD_FRAME)
        point = types("geometry_msgs/msg/Point", *map(float, position[i]))
        pose = types("geometry_msgs/msg/Pose", point, types.quaternion(quaternion[i]))
        twist = types("geometry_msgs/msg/Twist", types.vector(body[i]), types.vector(rate[i]))
        yield types(
            "nav_msgs/msg/Odometry",
            header,
            BODY_FRAME,
            types("geometry_msgs/msg/PoseWithCovariance", pose, _UNKNOWN_COVARIANCE),
            types("geometry_msgs/msg/TwistWithCovariance", twist, _UNKNOWN_COVARIANCE),
        )


def _imu(types: _Types, series: Series) -> Iterator[Any]:
    """No orientation (its covariance begins with -1): the controller's yaw has an origin of its own."""
    gyro, force = series.numbers("gyro", 3), series.numbers("specific_force", 3)
    measured: np.ndarray = np.any(np.isfinite(np.concatenate([gyro, force], axis=1)), axis=1)
    absent, unknown = np.concatenate([[-1.0], np.zeros(8)]), np.zeros(9)
    for i, stamp in enumerate(series.stamp):
        if not measured[i]:  # a message with the attitude only
            yield None
            continue
        header = types.header(int(stamp), BODY_FRAME)
        orientation = types.quaternion(np.array([1.0, 0.0, 0.0, 0.0]))
        gyro_and_force = types.vector(gyro[i]), unknown, types.vector(force[i]), unknown
        yield types("sensor_msgs/msg/Imu", header, orientation, absent, *gyro_and_force)


def _command(types: _Types, series: Series) -> Iterator[Any]:
    """Linear z is thrust over mass, m/s^2; angular is the body rate, rad/s."""
    thrust, rate = series.numbers("collective_thrust"), series.numbers("body_rate", 3)
    for i, stamp in enumerate(series.stamp):
        linear = types.vector(np.array([0.0, 0.0, thrust[i]]))
        twist = types("geometry_msgs/msg/Twist", linear, types.vector(rate[i]))
        yield types("geometry_msgs/msg/TwistStamped", types.header(int(stamp), BODY_FRAME), twist)


def _battery(types: _Types, series: Series) -> Iterator[Any]:
    """A current drawn is negative, as ROS has it; what is not known is NaN."""
    voltage, current, cells = (series.numbers(field) for field in ("voltage", "current", "cells"))
    unknown, none = float("nan"), np.zeros(0, np.float32)
    for i, stamp in enumerate(series.stamp):
        count = int(cells[i]) if cells[i] >= 1 else 0
        each = np.full(count, unknown, np.float32)  # number of cells known, their voltages not
        numbers = (float(voltage[i]), unknown, -float(current[i]), unknown, unknown, unknown, unknown)
        state = (2, 0, 3, True)  # discharging, health unknown, lithium polymer, present
        header = types.header(int(stamp), BODY_FRAME)
        yield types("sensor_msgs/msg/BatteryState", header, *numbers, *state, each, none, "", "")


def _joy(types: _Types, series: Series) -> Iterator[Any]:
    """Axes are the channels with 1000 to 2000 us as -1 to 1."""
    channels = series.numbers("channels", series.width("channels"))
    axes = ((channels - 1500.0) / 500.0).astype(np.float32)
    for i, stamp in enumerate(series.stamp):
        header = types.header(int(stamp), BODY_FRAME)
        yield types("sensor_msgs/msg/Joy", header, axes[i], np.zeros(0, np.int32))


def _mode(types: _Types, series: Series) -> Iterator[Any]:
    """`PREVIOUS -> MODE: reason; reason`."""
    for message in series.values:
        reasons = "; ".join(message.get("reasons") or [])
        change = f"{message.get('previous') or ''} -> {message.get('mode') or ''}".strip()
        yield types("std_msgs/msg/String", f"{change}: {reasons}" if reasons else change)


def _event(types: _Types, series: Series) -> Iterator[Any]:
    for message in series.values:
        yield types("std_msgs/msg/String", f"{message.get('level') or 'info'}: {message.get('text') or ''}")


def _into_body(wxyz: np.ndarray, world: np.ndarray) -> np.ndarray:
    """Vectors (n, 3) in the world turned into the body's frame by the inverse of quaternions (n, 4)."""
    w, u = wxyz[:, :1], -wxyz[:, 1:]
    cross = np.cross(u, world)
    return world + 2 * (w * cross + np.cross(u, cross))


TOPICS = (
    Topic("/odometry", "nav_msgs/msg/Odometry", "odometry", _odometry),
    Topic("/imu", "sensor_msgs/msg/Imu", "imu", _imu),
    Topic("/command", "geometry_msgs/msg/TwistStamped", "command", _command),
    Topic("/battery", "sensor_msgs/msg/BatteryState", "battery", _battery),
    Topic("/rc", "sensor_msgs/msg/Joy", "rc", _joy),
    Topic("/sticks", "sensor_msgs/msg/Joy", "sticks", _joy),
    Topic("/mode", "std_msgs/msg/String", "mode", _mode),
    Topic("/event", "std_msgs/msg/String", "event", _event),
)
"""The topics of a bag."""
