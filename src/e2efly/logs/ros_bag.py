"""Bags of ROS 1 and 2: which of their topics make a record."""

import re
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config.names import unknown
from e2efly.control import Quat, Vec3
from e2efly.logs.bag_storage import BEGINNINGS, BagFile, BagTopic
from e2efly.logs.recording import UNUSED, Record, Streams, listed
from e2efly.logs.scripts.ros_topics import BODY_FRAME
from e2efly.logs.ulog import ASSUMED, ORDER, ROTORS, RPM, TAKEN, fields_of, put_topic

MESSAGES = 2_000_000
"""Largest number of messages that are decoded from a bag."""
FAR = 1e4
"""Distance from the origin beyond which a position is a place on the Earth, as in UTM coordinates, m."""
LATER = ("global", "gps", "gnss", "camera")
"""Words in the names of topics that are taken only where no other topic gives the stream."""
_DEFINITION, _ARRAY = 100_000, 4096  # characters of a definition, entries of an array in it
_PULSE = (1000.0, 1000.0)  # us: of no output, and from there to full output
_SEPARATOR = "\n" + "=" * 80 + "\n"
OWN = {
    "mavros_msgs/msg/AttitudeTarget": """std_msgs/Header header
uint8 type_mask
geometry_msgs/Quaternion orientation
geometry_msgs/Vector3 body_rate
float32 thrust
""",
    "mavros_msgs/msg/RCOut": "std_msgs/Header header\nuint16[] channels\n",
    "mavros_msgs/msg/ESCStatus": "std_msgs/Header header\nmavros_msgs/ESCStatusItem[] esc_status\n"
    + _SEPARATOR
    + "MSG: mavros_msgs/ESCStatusItem\nstd_msgs/Header header\nint32 rpm\nfloat32 voltage\nfloat32 current\n",
}
"""Types of messages that rosbags does not know, and that bags of ROS 2 did not define before its release of 2023."""

Row = dict[str, list[float]]
"""By stream, its numbers in one message."""


def _odometry(message: Any) -> Row:
    pose, v = message.pose.pose, message.twist.twist.linear
    q = pose.orientation
    velocity = Quat(q.w, q.x, q.y, q.z).rotate(Vec3(v.x, v.y, v.z))  # nav_msgs has it in the body's frame
    return _pose(pose.position, q) | {"velocity": [velocity.x, velocity.y, velocity.z]}


def _pose(p: Any, q: Any) -> Row:
    return {"position": [p.x, p.y, p.z], "quaternion": [q.w, q.x, q.y, q.z]}


def _imu(message: Any) -> Row:
    w, a = message.angular_velocity, message.linear_acceleration
    return {"body_rate": [w.x, w.y, w.z], "specific_force": [a.x, a.y, a.z]}


def _twist(message: Any) -> Row:
    """Our own commands. Other programs write velocities into this type."""
    if message.header.frame_id != BODY_FRAME:
        return {}
    v, w = message.twist.linear, message.twist.angular
    return {"command": [v.z, w.x, w.y, w.z]}


def _target(message: Any) -> Row:
    """The body rates that the autopilot was asked for. Its thrust is a share of the largest, not m/s^2."""
    w = message.body_rate
    return {} if message.type_mask & 7 else {"setpoint": [w.x, w.y, w.z]}


def _pulses(message: Any) -> Row:
    if len(message.channels) < len(ORDER):
        return {}
    return {"motor": [max(float(message.channels[i]) - _PULSE[0], 0.0) / _PULSE[1] for i in ORDER]}


def _escs(told: Sequence[Any]) -> Row:
    return {"rotor_speed": [abs(told[i].rpm) * RPM for i in ORDER]} if len(told) >= len(ORDER) else {}


def _actuators(message: Any) -> Row:
    speeds = message.angular_velocities if hasattr(message, "angular_velocities") else message.velocity
    return {"rotor_speed": [abs(float(speeds[i])) for i in ORDER]} if len(speeds) >= len(ORDER) else {}


TYPES: dict[str, Callable[[Any], Row]] = {
    "nav_msgs/msg/Odometry": _odometry,
    "geometry_msgs/msg/PoseStamped": lambda m: _pose(m.pose.position, m.pose.orientation),
    "geometry_msgs/msg/PoseWithCovarianceStamped": lambda m: _pose(m.pose.pose.position, m.pose.pose.orientation),
    "geometry_msgs/msg/TransformStamped": lambda m: _pose(m.transform.translation, m.transform.rotation),
    "sensor_msgs/msg/Imu": _imu,
    "sensor_msgs/msg/BatteryState": lambda m: {"voltage": [m.voltage]},
    "geometry_msgs/msg/TwistStamped": _twist,
    "mavros_msgs/msg/AttitudeTarget": _target,
    "mavros_msgs/msg/RCOut": _pulses,
    "mavros_msgs/msg/ESCStatus": lambda m: _escs(m.esc_status),
    "mavros_msgs/msg/ESCTelemetry": lambda m: _escs(m.esc_telemetry),
    "mav_msgs/msg/Actuators": _actuators,
    "actuator_msgs/msg/Actuators": _actuators,
}
"""What the types of messages give."""
PX4 = {f"px4_msgs/msg/{''.join(map(str.capitalize, each.topic.split('_')))}": each.topic for each in TAKEN}
"""The topics of PX4 by the types of messages that carry them."""
TWIST, COMMAND, TARGET = "geometry_msgs/msg/TwistStamped", "/command", "mavros_msgs/msg/AttitudeTarget"
POSES = ("position", "quaternion", "velocity")
"""These come from one topic, or from PX4's own: other topics may have other worlds."""


@dataclass
class _Series:
    """The messages of a topic, as numbers."""

    topic: BagTopic
    damaged: int = 0
    """Messages that cannot be decoded."""
    rows: dict[str, tuple[int, array]] = field(default_factory=dict)
    """By stream, or by field of PX4: number of columns, and the numbers one after the other, each row behind its
    time."""

    def take(self, data: bytes) -> None:
        """Decode a message."""
        store, kind = _store_of(self.topic), self.topic.kind
        message: Any = (store.deserialize_ros1 if self.topic.version == 1 else store.deserialize_cdr)(data, kind)
        if kind in PX4:
            time, found = 0.0, _fields(message, PX4[kind])
        else:
            stamp = message.header.stamp
            time, found = stamp.sec + stamp.nanosec * 1e-9, TYPES[kind](message)
        for name, values in found.items():
            width, numbers = self.rows.setdefault(name, (len(values) + 1, array("d")))
            if width == len(values) + 1:
                numbers.extend((time, *values))

    @property
    def offered(self) -> list[str]:
        """Its streams."""
        if self.topic.kind in PX4:
            return [each.stream for each in TAKEN if each.topic == PX4[self.topic.kind]]
        return list(self.rows)

    @property
    def far(self) -> bool:
        """Whether its positions are places on the Earth."""
        if "position" not in self.rows or self.topic.kind in PX4:
            return False
        return bool(np.median(np.abs(self._table("position")[:, 1:]).max(1)) > FAR)

    def put(self, streams: Streams, without: Sequence[str]) -> None:
        """Add its streams."""
        if self.topic.kind in PX4:
            columns = {name: self._table(name)[:, 1] for name in self.rows}
            least = min(map(len, columns.values()), default=0)
            put_topic(streams, PX4[self.topic.kind], {n: c[:least] for n, c in columns.items()}, without)
            return
        for name in self.rows:
            if name not in without:
                table = self._table(name)
                if name == "position" and self.far:
                    table[:, 1:] -= table[0, 1:]
                    streams.notes.append(f"positions of {self.topic.name} are places on the Earth: from the first one")
                streams.put(name, table[:, 0], table[:, 1:], self.topic.name)

    def _table(self, name: str) -> np.ndarray:
        """(n, 1 + k): time and numbers, in the order of time."""
        width, numbers = self.rows[name]
        table = np.array(numbers).reshape(-1, width)
        return table[np.argsort(table[:, 0], kind="stable")]


def _fields(message: Any, topic: str) -> dict[str, list[float]]:
    """The fields of a message of PX4 that are used, by their paths."""
    found = {}
    for path in fields_of(topic):
        value = message
        for part in filter(None, re.split(r"[.\[]", path)):
            value = value[int(part[:-1])] if part.endswith("]") else getattr(value, part, None)
            if value is None:
                break
        else:
            found[path] = [float(value)]
    return found


def read_bag(path: Path, topics: Sequence[str] = ()) -> Record:
    """A ROS bag: the folder of ROS 2, or one file. Types of messages that are read: `TYPES` and `PX4`.

    Where several topics give a stream, those near the origin come before those in coordinates of the Earth, and those
    that give more streams before those that give fewer. The notes say which one was taken. The `topics` that are named
    are taken before all others.

    Raises:
        ValueError: when it cannot be read, when the package rosbags is missing, when it does not have one of `topics`,
            or no topic of a type that is known.
    """
    try:
        _store(2)
    except ImportError as error:
        raise ValueError(
            f"{path}: the package rosbags is missing ({error}); accepted: pip install 'e2efly[ros]'"
        ) from None
    streams, known, others = Streams(), dict[BagTopic, _Series](), dict[BagTopic, str]()
    for file in _files(path):
        _read(file, known, others)
        if file.cut_off:
            streams.notes.append(f"{file.path.name}: {file.cut_off}")
    named = tuple(topic.name for topic in known)
    if missing := [name for name in topics if name not in named]:
        raise ValueError(f"{path}: --topics: {unknown('topic', missing[0], named)}")
    unused = listed((f"{topic.name} ({why})" for topic, why in others.items()), UNUSED)
    if not known:
        accepted = ", ".join((*TYPES, *PX4))
        told = "".join(f"; {note}" for note in streams.notes)
        raise ValueError(f"{path}: has the topics {unused or 'none'}{told}; accepted: one of {accepted}")
    _choose(list(known.values()), topics, streams)
    if streams.found.keys() & {*ROTORS}:
        streams.notes.append(ASSUMED)
    if unused:
        streams.notes.append(f"topics that are not used: {unused}")
    return streams.record(path)


def _files(path: Path) -> list[BagFile]:
    """The files of a bag."""
    if not path.is_dir():
        return [BagFile(path)]
    found = []
    for file in sorted(path.iterdir()):
        if file.is_file():
            with file.open("rb") as opened:
                if opened.read(16).startswith(BEGINNINGS):
                    found.append(BagFile(file))
    if not found:
        raise ValueError(f"{path}: is a folder without files of a bag; accepted: one with .db3 or .mcap files")
    return found


def _read(file: BagFile, known: dict[BagTopic, "_Series"], others: dict[BagTopic, str]) -> None:
    """Decode the messages of a file that can be used. `others` gets the topics that cannot, and why."""
    count = 0
    for topic, data in file:
        if topic in others:
            continue
        if why := _refused(topic):
            others[topic] = why
            continue
        series = known.get(topic) or _Series(topic)
        try:
            series.take(data)
        except Exception as error:  # rosbags trusts the messages of a bag
            if topic in known:
                series.damaged += 1
            else:
                others[topic] = f"{topic.kind}: {type(error).__name__}: {error}"
            continue
        known[topic] = series
        count += 1
        if count == MESSAGES:
            file.cut_off = f"the first {MESSAGES} messages are read, and no more"
            return


def _refused(topic: BagTopic) -> str:
    """Why a topic cannot be used. Empty: it may be."""
    if topic.kind not in TYPES and topic.kind not in PX4:
        return topic.kind
    if topic.kind == TWIST and not topic.name.endswith(COMMAND):
        return f"{topic.kind}, which is a command only if its name ends in {COMMAND}"
    return ""


def _choose(known: list["_Series"], topics: Sequence[str], streams: Streams) -> None:
    """Put the streams of the best topics, and note which."""

    def rank(series: _Series) -> tuple[Any, ...]:
        name = series.topic.name
        wish = topics.index(name) if name in topics else len(topics)
        later = any(word in name.lower() for word in LATER)
        return wish, series.far, later, -len(series.offered), name

    posed = ""
    for series in sorted(known, key=rank):
        name, before = series.topic.name, set(streams.found)
        if series.damaged:
            streams.notes.append(f"{series.damaged} messages of {name} cannot be decoded and are left out")
        world = "PX4's" if series.topic.kind in PX4 else name
        apart = posed not in ("", world) and name not in topics
        series.put(streams, POSES if apart else [])
        taken = [stream for stream in streams.found if stream not in before]
        posed = posed or (world if set(taken) & set(POSES) else "")
        left = [stream for stream in series.offered if stream not in taken]
        told = f"; its {listed(left)} would be taken with --topics {name}" if left else ""
        streams.notes.append(f"{listed(taken) or 'nothing'} from {name}{told}")
        if series.topic.kind == TARGET:
            streams.notes.append(f"the thrust of {name} is a share of the largest, not m/s^2: it is not used")


@cache
def _store(version: int) -> Any:
    """The types of rosbags for ROS 1 or 2, and `OWN`."""
    from rosbags.typesys import get_types_from_msg

    from e2efly.logs.scripts.ros_messages import type_store

    store = type_store(version)
    for kind, text in OWN.items():
        store.register(get_types_from_msg(text, kind))
    return store


@lru_cache(maxsize=32)
def _store_of(topic: BagTopic) -> Any:
    """The types that a topic needs: the known ones, and what the bag defines beside them."""
    from rosbags.typesys import get_types_from_msg

    base, text = _store(topic.version), topic.definition
    if topic.kind in base.fielddefs:
        return base
    if not text:
        raise ValueError("the bag does not define this type; accepted: a bag in MCAP storage, which does")
    if len(text) > _DEFINITION:
        raise ValueError(f"its definition has {len(text)} characters; accepted: up to {_DEFINITION}")
    if max(map(int, re.findall(r"\[<?=?(\d{1,18})", text)), default=0) > _ARRAY:
        raise ValueError(f"its definition has a longer array; accepted: up to {_ARRAY} entries")
    store = type(base)()
    store.fielddefs.update(base.fielddefs)
    store.types.update(base.types)
    found = get_types_from_msg(text, topic.kind)
    store.register({kind: fields for kind, fields in found.items() if kind not in base.fielddefs})
    return store
