"""Read flight logs of many formats into records. The beginning of a file or its name shows its format."""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from e2efly.control import Quat, Vec3
from e2efly.identification.crazyflie import is_crazyflie, read_crazyflie
from e2efly.identification.csv_file import Column, read_csv
from e2efly.identification.record import MOTORS, Record, Stream

if TYPE_CHECKING:
    from e2efly.deploy.log.flight_log import Series

ACCEPTED = (
    "our .mcap, a .csv, a ROS 1 .bag, the folder of a ROS 2 bag, Betaflight's .bbl, .bfl or .bf, PX4's .ulg, or "
    "the log of a "
    "Crazyflie's micro-SD deck"
)
BLACKBOXES = (".bbl", ".bfl", ".bf")
"""Endings of the names of Betaflight's blackbox logs."""
_PART = re.compile(r"(?P<name>.+):(?P<begin>\d+(\.\d+)?)-(?P<end>\d+(\.\d+)?)")
_FLIP = np.array([1.0, -1.0, -1.0])
"""Factors from FRD to FLU: forward stays, left is minus right, up is minus down."""


def read_flights(path: Path, columns: Mapping[str, Column] | None = None) -> list[Record]:
    """The flights of a log. A blackbox can contain several.

    Args:
        path: the file, or the folder of a ROS 2 bag.
        columns: for columns of a record, the names of the columns in a CSV file.

    Raises:
        ValueError: naming the file, what is wrong with it and what is accepted.
    """
    if not path.exists():
        raise ValueError(f"log {str(path)!r} does not exist; accepted: {ACCEPTED}")
    if path.is_dir():
        return [read_bag(path)]
    if path.stat().st_size == 0:
        raise ValueError(f"{path}: is empty; accepted: {ACCEPTED}")
    if is_crazyflie(path):
        return [read_crazyflie(path)]
    kinds: dict[str, Callable[[Path], list[Record]]] = {
        ".csv": lambda p: [read_csv(p, columns)],
        ".mcap": lambda p: [read_mcap(p)],
        **dict.fromkeys(BLACKBOXES, read_betaflight),
        ".ulg": lambda p: [read_ulog(p)],
        ".bag": lambda p: [read_bag(p)],
    }
    kind = kinds.get(path.suffix.lower())
    if kind is None:
        raise ValueError(f"{path}: of no kind that is known here; accepted: {ACCEPTED}")
    return kind(path)


def read_part(path: Path, columns: Mapping[str, Column] | None = None) -> list[Record]:
    """The flights of a log. For LOG:BEGIN-END, only the part between these two times, s after the start of the log.

    Raises:
        ValueError: as for `read_flights`; when there is nothing between the two times.
    """
    asked = None if path.exists() else _PART.fullmatch(path.name)
    if asked is None:
        return read_flights(path, columns)
    begin, end = float(asked["begin"]), float(asked["end"])
    found = []
    for record in read_flights(path.with_name(asked["name"]), columns):
        first, length = record.span[0], record.duration
        if not begin < min(end, length):
            raise ValueError(
                f"{path}: is from {begin:g} to {end:g} s, of a log of {length:.1f} s; accepted: LOG:BEGIN-END in s "
                "after the log begins, BEGIN below END"
            )
        part = record.during(first + begin, first + end)
        kept = {name: stream for name, stream in part.streams.items() if len(stream.time)}
        found.append(replace(part, streams=kept, notes=(*record.notes, f"used from {begin:g} to {end:g} s, as asked")))
    return found


def read_mcap(path: Path) -> Record:
    """A flight log of e2efly (docs/telemetry.md).

    Raises:
        ValueError: as for `read_log`; when it has none of the channels that are used here.
    """
    from e2efly.deploy.log.flight_log import read_log

    log = read_log(path)
    streams: dict[str, Stream] = {}

    def take(name: str, channel: str, field: str, size: int | None, delay: str = "") -> None:
        series = log[channel]
        if not len(series):
            return
        values = series.numbers(field, size)
        values = values[:, None] if size is None else values
        time = series.time - (np.nan_to_num(series.numbers(delay)) if delay else 0.0)
        _put(streams, name, time, values)

    for name, size in (("position", 3), ("velocity", 3), ("quaternion", 4)):
        take(name, "odometry", name, size, "age")
    take("body_rate", "imu", "gyro", 3)
    take("specific_force", "imu", "specific_force", 3)
    take("motor", "motors", "values", 4)
    take("voltage", "battery", "voltage", None)
    commands = log["command"]
    if len(commands):
        values = np.column_stack([commands.numbers("collective_thrust"), commands.numbers("body_rate", 3)])
        _put(streams, "command", commands.time, values)
    channels = log["rc"]
    if len(commands) and len(channels):
        _put(streams, "setpoint", channels.time, _asked(streams["command"], channels))
    notes = (f"cut off: {log.cut_off}",) if getattr(log, "cut_off", "") else ()
    if "motor" in streams and streams["motor"].rate < MOTORS:
        notes += (
            f"motor outputs at {streams['motor'].rate:.0f} Hz: too few to show inertia and motor lag, and by commands "
            "alone they are as wrong as Betaflight's rate loop is unlike the simulation's; fly: e2efly fly excitation, "
            "or give the blackbox of the flight, too",
        )
    ages = log["odometry"].numbers("age") if len(log["odometry"]) else np.array([np.nan])
    age = float(np.nanmean(ages)) if np.isfinite(ages).any() else None
    return replace(_whole(path, streams, notes), pose_age=age)


def _asked(command: Stream, channels: "Series") -> np.ndarray:
    """The body rates that the channels of the remote control request, (n, 3) rad/s. NaN before the first command.

    The relation between pulses and rates is found from the log: smooth curves are fitted from the pulses to the
    commanded rates, at the delay at which they fit best.
    """
    time, pulses = channels.time, channels.numbers("channels", channels.width("channels"))[:, :3]
    x = (pulses - 1500) / 500
    best, least = np.full(x.shape, np.nan), np.inf
    for late in np.arange(0.0, 0.1, 0.002):
        at = np.searchsorted(command.time, time - late, side="right") - 1
        good = (at >= 0) & np.isfinite(x).all(1)
        if good.sum() < 20:
            continue
        curves = [np.polynomial.Polynomial.fit(x[good, i], command.values[at[good], 1 + i], 3) for i in range(3)]
        rates = np.stack([curve(x[:, i]) for i, curve in enumerate(curves)], -1)
        left = float(np.mean((rates[good] - command.values[at[good], 1:]) ** 2))
        if left < least:
            best, least = np.where((time >= command.time[0])[:, None], rates, np.nan), left
    return best


def read_betaflight(path: Path) -> list[Record]:
    """The sessions of a blackbox: body rates, motor outputs and the requested body rates.

    Raises:
        ValueError: as for `read_blackbox`.
    """
    from e2efly.deploy.log.blackbox import read_blackbox

    records = []
    for session in read_blackbox(path):
        streams: dict[str, Stream] = {}
        _put(streams, "body_rate", session.time, session.gyro)
        _put(streams, "motor", session.time, session.output)
        _put(streams, "setpoint", session.time, session.setpoint)
        hover = np.full((len(session.time), 1), np.nan)
        hover[:] = 9.81  # a blackbox has no thrust over mass; `step` needs only the rates
        _put(streams, "command", session.time, np.concatenate([hover, session.setpoint], 1))
        records.append(_whole(path, streams, (f"session {session.session}, {session.firmware}",)))
    return records


def read_ulog(path: Path) -> Record:
    """A PX4 log, converted from NED and FRD to ENU and FLU.

    Raises:
        ValueError: when it cannot be read, when the package pyulog is missing, or when none of its topics is known
            here.
    """
    try:
        from pyulog import ULog
    except ImportError as error:
        raise ValueError(
            f"{path}: the package pyulog is missing ({error}); accepted: pip install 'e2efly[px4]'"
        ) from None
    try:
        with path.open("rb") as file:
            data = {d.name: d.data for d in reversed(ULog(file).data_list)}  # of several instances, use the first
    except Exception as error:  # the reader does not check its input, so any exception is possible
        raise ValueError(f"{path}: no PX4 log that can be read ({type(error).__name__}: {error})") from None
    streams: dict[str, Stream] = {}

    def take(name: str, topic: str, fields: list[str], turn: Callable[[np.ndarray], np.ndarray]) -> None:
        if topic in data and all(f in data[topic] for f in fields) and name not in streams:
            found = data[topic]
            values = np.stack([np.asarray(found[f], float) for f in fields], -1)
            time = np.asarray(found.get("timestamp_sample", found["timestamp"]), float)
            time = np.where(time > 0, time, np.asarray(found["timestamp"], float)) * 1e-6
            _put(streams, name, time, turn(values))

    def flip(x: np.ndarray) -> np.ndarray:
        return x * _FLIP

    def enu(x: np.ndarray) -> np.ndarray:
        return x[:, [1, 0, 2]] * [1.0, 1.0, -1.0]

    def three(name: str) -> list[str]:
        return [f"{name}[{i}]" for i in range(3)]

    take("body_rate", "vehicle_angular_velocity", three("xyz"), flip)
    take("body_rate", "sensor_combined", three("gyro_rad"), flip)
    take("specific_force", "vehicle_acceleration", three("xyz"), flip)
    take("specific_force", "sensor_combined", three("accelerometer_m_s2"), flip)
    take("position", "vehicle_local_position", ["x", "y", "z"], enu)
    take("velocity", "vehicle_local_position", ["vx", "vy", "vz"], enu)
    take("quaternion", "vehicle_attitude", [f"q[{i}]" for i in range(4)], _ned_attitude)
    # PX4: 1 front right, 2 rear left, 3 front left, 4 rear right
    take("motor", "actuator_motors", [f"control[{i}]" for i in (3, 0, 1, 2)], lambda x: x)
    take("voltage", "battery_status", ["voltage_v"], lambda x: x)
    return _whole(path, streams)


def _ned_attitude(q: np.ndarray) -> np.ndarray:
    """Convert attitudes of body FRD in NED to body FLU in ENU, wxyz."""
    w, x, y, z = q.T
    # half turns: about (1, 1, 0) / sqrt 2 from NED to ENU, about x from FLU to FRD
    s = np.sqrt(0.5)
    turned = np.stack([-s * (x + y), s * (w + z), s * (w - z), s * (x - y)], -1)  # ENU * q
    a, b, c, d = turned.T
    return np.stack([-b, a, d, -c], -1)  # ... * FLU


def read_bag(path: Path) -> Record:
    """A ROS bag. It uses the first topic of each type: nav_msgs/Odometry, sensor_msgs/Imu, geometry_msgs/PoseStamped.

    Raises:
        ValueError: when it cannot be read, when the package rosbags is missing, or when it has no topic of these types.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError as error:
        raise ValueError(
            f"{path}: the package rosbags is missing ({error}); accepted: pip install 'e2efly[ros]'"
        ) from None
    rows: dict[str, list[list[float]]] = {}
    chosen: dict[str, str] = {}
    try:
        with AnyReader([path], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            kinds = sorted({c.topic: c.msgtype for c in reader.connections}.items())
            for topic, kind in kinds:
                if kind in _BAG and kind not in chosen:
                    chosen[kind] = topic
            wanted = [c for c in reader.connections if chosen.get(c.msgtype) == c.topic]
            for connection, _, raw in reader.messages(wanted) if wanted else ():
                message: Any = reader.deserialize(raw, connection.msgtype)
                stamp = message.header.stamp
                time = stamp.sec + stamp.nanosec * 1e-9
                for name, values in _BAG[connection.msgtype](message).items():
                    rows.setdefault(name, []).append([time, *values])
    except Exception as error:
        raise ValueError(f"{path}: no bag that can be read ({type(error).__name__}: {error})") from None
    if not chosen:
        there = ", ".join(f"{topic} ({kind})" for topic, kind in kinds) or "none"
        raise ValueError(f"{path}: has the topics {there}; accepted: one of {', '.join(_BAG)}")
    streams: dict[str, Stream] = {}
    for name, listed in rows.items():
        table = np.asarray(listed, float)
        _put(streams, name, table[:, 0], table[:, 1:])
    return _whole(path, streams)


def _of_odometry(message: Any) -> dict[str, list[float]]:
    pose, twist = message.pose.pose, message.twist.twist
    q, v = pose.orientation, twist.linear
    velocity = Quat(q.w, q.x, q.y, q.z).rotate(Vec3(v.x, v.y, v.z))  # nav_msgs has it in the body's frame
    return {
        "position": [pose.position.x, pose.position.y, pose.position.z],
        "quaternion": [q.w, q.x, q.y, q.z],
        "velocity": [velocity.x, velocity.y, velocity.z],
    }


def _of_pose(message: Any) -> dict[str, list[float]]:
    p, q = message.pose.position, message.pose.orientation
    return {"position": [p.x, p.y, p.z], "quaternion": [q.w, q.x, q.y, q.z]}


def _of_imu(message: Any) -> dict[str, list[float]]:
    w, a = message.angular_velocity, message.linear_acceleration
    return {"body_rate": [w.x, w.y, w.z], "specific_force": [a.x, a.y, a.z]}


_BAG: dict[str, Callable[[Any], dict[str, list[float]]]] = {
    "nav_msgs/msg/Odometry": _of_odometry,
    "sensor_msgs/msg/Imu": _of_imu,
    "geometry_msgs/msg/PoseStamped": _of_pose,
}


def _put(streams: dict[str, Stream], name: str, time: np.ndarray, values: np.ndarray) -> None:
    """Store the samples that are finite and whose times increase."""
    good = np.isfinite(time) & np.isfinite(values).all(1)
    time, values = time[good], values[good]
    latest = np.concatenate([[-np.inf], np.maximum.accumulate(time)[:-1]]) if len(time) else time
    rising = time > latest
    if rising.any():
        streams[name] = Stream(time[rising], values[rising])


def _whole(path: Path, streams: dict[str, Stream], notes: tuple[str, ...] = ()) -> Record:
    if not streams:
        raise ValueError(
            f"{path}: has nothing that is used here; accepted: body rates, forces, poses, motors or commands"
        )
    return Record(path, streams, notes)
