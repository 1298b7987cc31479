"""A flight of the simulator as other programs would have logged it, in their formats, units, axes and orders."""

import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from pyulog import ULog
from rosbags.rosbag1 import Writer as Bag1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2
from rosbags.typesys import get_types_from_msg
from scipy.spatial.transform import Rotation

from e2efly.logs.recording import Record, Stream
from e2efly.logs.ros_bag import _store
from e2efly.logs.scripts.ros_messages import encoded, full_name
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.vehicle import Vehicle

PX4 = (1, 2, 3, 0)
"""Our rotors in PX4's order: front right, rear left, front left, rear right."""
CRAZYFLIE = (1, 0, 2, 3)
"""Our rotors in a Crazyflie's order: front right, rear right, rear left, front left."""
ELSE = (2, 0, 1, 3)
"""Our rotors in an order of somebody who wired them as he liked."""
PLACES = ((-0.1, 0.1), (0.1, 0.1), (-0.1, -0.1), (0.1, -0.1))
"""Of our rotors, forward and to the right, m."""
MOTIONS = (
    "vehicle_angular_velocity", "vehicle_acceleration", "vehicle_local_position", "vehicle_attitude",
    "vehicle_rates_setpoint", "battery_status",
)  # fmt: skip
"""Topics of PX4 that have no rotors in them."""
FLIP = np.array([1.0, -1.0, -1.0])
RPM = 60 / (2 * math.pi)


def with_outputs(record: Record, exact: Record, body: Vehicle) -> Record:
    """The record with the outputs that led to its rotor speeds (an output of u gives u (1 + u) / 2 of the thrust), the
    body rates that the rate loop was asked for, and a battery.
    """
    speed, sent = exact.streams["rotor_speed"], record.streams["command"]
    driven = speed.values + body.motor_time_constant * np.gradient(speed.values, speed.time, axis=0)
    thrust = np.maximum(np.polyval(body.thrust_map, driven), 0.0)
    time = speed.time[speed.time > sent.time[0] + body.latency]
    asked = sent.values[np.searchsorted(sent.time, time - body.latency, side="right") - 1, 1:]
    more = {
        "motor": Stream(speed.time, np.clip(np.sqrt(0.25 + 2 * thrust / body.thrust_range[1]) - 0.5, 0.0, 1.0)),
        "setpoint": Stream(time, asked),
        "voltage": Stream(speed.time[::25], np.full((len(speed.time[::25]), 1), 16.07)),
    }
    return Record(record.path, {**record.streams, **more})


# PX4


def _ned(values: np.ndarray) -> np.ndarray:
    return values[:, [1, 0, 2]] * [1.0, 1.0, -1.0]


def _turned(quaternion: np.ndarray) -> np.ndarray:
    """Body FLU in ENU as body FRD in NED, wxyz."""
    world = Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    turned = world * Rotation.from_quat(quaternion[:, [1, 2, 3, 0]]) * Rotation.from_euler("x", math.pi)
    return turned.as_quat()[:, [3, 0, 1, 2]]


def px4_topics(record: Record, order: Sequence[int]) -> dict[str, tuple[str, Stream]]:
    """By PX4's topic, its fields, and its numbers. An array takes as many as it has entries."""
    found = record.streams

    def of(name: str, turn: Any) -> Stream:
        return Stream(found[name].time, turn(found[name].values))

    place = of("position", _ned)
    force = of("specific_force", lambda x: x * FLIP)
    both = Stream(force.time, np.hstack([force.values, np.zeros_like(force.values)]))
    motion = Stream(place.time, np.hstack([place.values, _ned(found["velocity"].values)]))
    return {
        "vehicle_angular_velocity": ("float[3] xyz", of("body_rate", lambda x: x * FLIP)),
        "sensor_combined": ("float[3] accelerometer_m_s2;float[3] gyro_rad", both),
        "vehicle_acceleration": ("float[3] xyz", of("specific_force", lambda x: x * FLIP)),
        "vehicle_local_position": ("float x;float y;float z;float vx;float vy;float vz", motion),
        "vehicle_attitude": ("float[4] q", of("quaternion", _turned)),
        "vehicle_rates_setpoint": ("float roll;float pitch;float yaw", of("setpoint", lambda x: x * FLIP)),
        "battery_status": ("float voltage_v", of("voltage", lambda x: x)),
        "esc_status": ("esc_report[4] esc", of("rotor_speed", lambda x: x[:, order] * RPM)),
        "actuator_motors": ("float[4] control", of("motor", lambda x: x[:, order])),
        "actuator_outputs": ("float[4] output", of("motor", lambda x: 1000 + 1000 * x[:, order])),
    }


def as_ulog(
    path: Path,
    record: Record,
    topics: Sequence[str],
    parameters: Mapping[str, float],
    order: Sequence[int] = PX4,
    turned: Sequence[int] = (0, 1, 2, 3),
    idle: str = "",
) -> Path:
    """A log of PX4 with these of its topics. PX4's own library reads and writes it, so that it is one of its kind.

    `turned`: the motors that the ESCs turn, one after the other. `idle`: a topic that has an instance before the one
    that moves.
    """

    def message(kind: bytes, content: bytes) -> bytes:
        return struct.pack("<Hc", len(content), kind) + content

    known = px4_topics(record, order)
    parts = [b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0), message(b"B", bytes(40))]
    parts.append(message(b"F", b"esc_report:uint64_t timestamp;int32_t esc_rpm;uint8_t actuator_function;"))
    for topic in topics:
        parts.append(message(b"F", f"{topic}:uint64_t timestamp;{known[topic][0]};".encode()))
    for name, value in parameters.items():
        key = f"{'int32_t' if isinstance(value, int) else 'float'} {name}".encode()
        number = struct.pack("<i" if isinstance(value, int) else "<f", value)
        parts.append(message(b"P", bytes([len(key)]) + key + number))
    samples = []
    numbered = [(topic, 0, topic == idle) for topic in topics] + [(idle, 1, False)] * bool(idle)
    for number, (topic, instance, still) in enumerate(numbered):
        parts.append(message(b"A", struct.pack("<BH", instance, number) + topic.encode()))
        stream = known[topic][1]
        if still:
            stream = Stream(stream.time, np.full_like(stream.values, 900.0))
        for t, row in zip(stream.time, stream.values, strict=True):
            stamp = round(1e6 * (t + 1))
            data = struct.pack("<HQ", number, stamp)
            if topic == "esc_status":
                data += b"".join(struct.pack("<QiB", stamp, round(row[i]), 101 + i) for i in turned)
            else:
                data += struct.pack(f"<{len(row)}f", *row)
            samples.append((stamp, message(b"D", data)))
    parts += [data for _, data in sorted(samples, key=lambda each: each[0])]
    path.with_suffix(".made").write_bytes(b"".join(parts))
    ULog(str(path.with_suffix(".made"))).write_ulog(str(path))
    return path


# ROS

Rows = Iterator[tuple[float, str, str, dict[str, Any]]]
"""Time, topic, type in the form of ROS 1, content."""


def _xyz(values: np.ndarray) -> dict[str, float]:
    return dict(zip("xyz", map(float, values), strict=True))


def mavros(record: Record) -> Rows:
    """The topics of mavros, and our own commands."""
    found = record.streams
    for t, rate, force in zip(
        found["body_rate"].time, found["body_rate"].values, found["specific_force"].values, strict=True
    ):
        yield t, "/mavros/imu/data", "sensor_msgs/Imu", {
            "angular_velocity": _xyz(rate), "linear_acceleration": _xyz(force)
        }  # fmt: skip
    for t, p, v, q in zip(
        found["position"].time, *(found[name].values for name in ("position", "velocity", "quaternion")), strict=True
    ):
        own = Rotation.from_quat(q[[1, 2, 3, 0]]).inv().apply(v)  # nav_msgs has velocities in the body's frame
        pose = {"position": _xyz(p), "orientation": dict(zip("wxyz", map(float, q), strict=True))}
        yield t, "/mavros/local_position/odom", "nav_msgs/Odometry", {
            "pose": {"pose": pose}, "twist": {"twist": {"linear": _xyz(own)}}
        }  # fmt: skip
    for t, values in zip(found["rotor_speed"].time, found["rotor_speed"].values[:, PX4], strict=True):
        yield (
            t,
            "/mavros/esc_status",
            "mavros_msgs/ESCStatus",
            {"esc_status": [{"rpm": round(x * RPM)} for x in values]},
        )
    for t, values in zip(found["motor"].time, found["motor"].values[:, PX4], strict=True):
        yield t, "/mavros/rc/out", "mavros_msgs/RCOut", {"channels": [round(1000 + 1000 * x) for x in values] + [0] * 4}
    for t, values in zip(found["setpoint"].time, found["setpoint"].values, strict=True):
        yield t, "/mavros/setpoint_raw/target_attitude", "mavros_msgs/AttitudeTarget", {"body_rate": _xyz(values)}
    for t, values in zip(found["command"].time, found["command"].values, strict=True):
        yield t, "/quad/command", "geometry_msgs/TwistStamped", {
            "twist": {"linear": {"z": float(values[0])}, "angular": _xyz(values[1:])}
        }  # fmt: skip
    for t, (volts,) in zip(found["voltage"].time, found["voltage"].values, strict=True):
        yield t, "/mavros/battery", "sensor_msgs/BatteryState", {"voltage": float(volts)}


def px4_msgs(record: Record, topics: Sequence[str]) -> Rows:
    """The topics of PX4 as its bridge to ROS 2 publishes them, with our own commands."""
    known = px4_topics(record, PX4)
    for topic in topics:
        kind = f"px4_msgs/{''.join(map(str.capitalize, topic.split('_')))}"
        form, stream = known[topic]
        names = [each.split(" ")[1] for each in form.split(";")]
        for t, row in zip(stream.time, stream.values, strict=True):
            stamp = round(1e6 * (t + 1))
            if topic == "esc_status":
                content = {"esc": [{"esc_rpm": round(x), "actuator_function": 101 + i} for i, x in enumerate(row)]}
            else:
                content = {names[0]: row} if len(names) == 1 and "[" in form else dict(zip(names, row, strict=True))
            yield t, f"/fmu/out/{topic}", kind, {"timestamp": stamp, **content}
    for t, topic, kind, content in mavros(record):
        if topic == "/quad/command":
            yield t, topic, kind, content


def _px4_definition(topic: str, form: str) -> str:
    words = {"float": "float32", "esc_report": "px4_msgs/EscReport"}
    fields = ["uint64 timestamp"]
    for each in form.split(";"):
        kind, name = each.split(" ")
        base, bracket, count = kind.partition("[")
        fields.append(f"{words[base]}{bracket}{count} {name}")
    inner = "uint64 timestamp\nint32 esc_rpm\nuint8 actuator_function\n"
    more = f"\n{'=' * 80}\nMSG: px4_msgs/EscReport\n{inner}" if topic == "esc_status" else ""
    return "\n".join(fields) + "\n" + more


def as_bag(path: Path, rows: Rows, record: Record | None = None) -> Path:
    """A bag of ROS 1 (a path that ends in .bag) or 2, written by rosbags. For messages of PX4, the `record` of them."""
    version = 1 if path.suffix == ".bag" else 2
    store = _store(version)
    if record is not None:
        store = type(store)()
        store.fielddefs.update(_store(version).fielddefs)
        store.types.update(_store(version).types)
        for topic, (form, _) in px4_topics(record, PX4).items():
            kind = f"px4_msgs/msg/{''.join(map(str.capitalize, topic.split('_')))}"
            own = get_types_from_msg(_px4_definition(topic, form), kind)
            store.register({name: fields for name, fields in own.items() if name not in store.fielddefs})
    written = Bag1(path) if version == 1 else Bag2(path, version=9, storage_plugin=StoragePlugin.MCAP)
    with written as writer:
        open_topics: dict[str, Any] = {}
        for t, topic, kind, content in sorted(rows, key=lambda row: row[0]):
            if topic not in open_topics:
                open_topics[topic] = writer.add_connection(topic, full_name(kind), typestore=store)
            stamp = round(1e9 * (t + 1))
            tree = (
                content if "timestamp" in content else {"header": {"stamp": stamp, "frame_id": "base_link"}, **content}
            )
            writer.write(open_topics[topic], stamp, encoded(store, version, kind, tree))
    return path


# Betaflight


def _unsigned(number: int) -> bytes:
    found = bytearray()
    while number > 0x7F:
        found.append(number & 0x7F | 0x80)
        number >>= 7
    return bytes([*found, number])


def _signed(number: int) -> bytes:
    return _unsigned(number << 1 if number >= 0 else (-number << 1) - 1)


def as_blackbox(
    path: Path, record: Record, version: str, poles: int | None = 14, motors: int = 4, fine: bool = False
) -> Path:
    """A session as Betaflight of this version logs it: setpoints from 4.0, rotor speeds from 4.5 on. Every frame is
    whole, which its format allows. The gyroscope is in deg/s, or in tenths if it is `fine`.
    """
    found, numbers = record.streams, tuple(map(int, version.split(".")))
    setpoints, speeds, unit = numbers >= (4,), numbers >= (4, 5), 10 if fine else 1
    names = [*(f"{name}[{i}]" for name in ("rcCommand", "gyroADC", "accSmooth") for i in range(3)), "vbatLatest"]
    names += [f"motor[{i}]" for i in range(motors)]
    names += [f"setpoint[{i}]" for i in range(4)] * setpoints + [f"eRPM[{i}]" for i in range(4)] * speeds
    every = ["loopIteration", "time", *names]

    def line(what: str, words: Sequence[Any]) -> str:
        return f"H Field {what}:{','.join(map(str, words))}\n"

    signed = [0, 0, *[1] * len(names)]
    head = "H Product:Blackbox flight data recorder by Nicholas Sherlock\nH Data version:2\nH I interval:1\n"
    head += "H P interval:1/1\n" + line("I name", every) + line("I signed", signed)
    head += line("I predictor", [0] * len(every)) + line("I encoding", [1 - s for s in signed])
    head += line("P predictor", [6, *[1] * (len(every) - 1)]) + line("P encoding", [9, *[0] * (len(every) - 1)])
    head += f"H Firmware type:Betaflight\nH Firmware revision:Betaflight {version}.0 (abc) STM32F7X2\n"
    head += "H minthrottle:1070\nH maxthrottle:2000\nH gyro_scale:0x3f800000\nH acc_1G:2048\nH vbatref:160\n"
    head += "H motorOutput:48,2047\n" if numbers >= (4,) else ""
    head += f"H motor_poles:{poles}\n" if poles and speeds else ""
    head += "H blackbox_high_resolution:1\n" if fine else ""
    time = found["motor"].time
    at = {
        name: found[name].values[np.clip(np.searchsorted(found[name].time, time), 0, len(found[name].time) - 1)]
        for name in ("body_rate", "specific_force", "setpoint", "rotor_speed", "voltage")
    }
    low, high = (48, 2047) if numbers >= (4,) else (1000, 2000)
    columns = [
        np.zeros((len(time), 3)), unit * np.degrees(at["body_rate"]), at["specific_force"] * 2048 / GRAVITY,
        at["voltage"] * (100 if numbers >= (4,) else 10), low + (high - low) * found["motor"].values,
        np.zeros((len(time), motors - 4)),
    ]  # fmt: skip
    if setpoints:
        columns += [unit * np.degrees(at["setpoint"]), np.zeros((len(time), 1))]
    if speeds:
        columns.append(at["rotor_speed"] * RPM * (poles or 14) / 2 / 100)
    frames = []
    for i, (t, row) in enumerate(zip(time, np.rint(np.hstack(columns)).astype(int).tolist(), strict=True)):
        frames.append(b"I" + _unsigned(i) + _unsigned(round(1e6 * t)) + b"".join(map(_signed, row)))
    path.write_bytes(head.encode() + b"".join(frames) + b"E\xffEnd of log\0")
    return path


# Crazyflie


def as_crazyflie(path: Path, record: Record) -> Path:
    """As the firmware's micro-SD deck writes it, poses and battery in an event of their own."""
    found = record.streams
    angles = Rotation.from_quat(found["quaternion"].values[:, [1, 2, 3, 0]]).as_euler("ZYX", degrees=True)
    at = found["position"].time
    volts = np.interp(at, found["voltage"].time, found["voltage"].values[:, 0])
    output = found["motor"]
    outputs = np.stack([np.interp(found["body_rate"].time, output.time, x) for x in output.values[:, CRAZYFLIE].T], -1)
    events = {
        "inner": (
            found["body_rate"].time,
            {"acc": ("f", "xyz", found["specific_force"].values / GRAVITY), "gyro": ("f", "xyz", np.degrees(
                found["body_rate"].values)), "motor": ("H", ("m1", "m2", "m3", "m4"), np.rint(65535 * outputs))},
        ),
        "outer": (
            at,
            {"stateEstimate": ("f", ("x", "y", "z", "vx", "vy", "vz", "roll", "pitch", "yaw"), np.hstack(
                [found["position"].values, found["velocity"].values, angles[:, ::-1] * [1.0, -1.0, 1.0]])),
             "pm": ("f", ("vbat",), volts[:, None])},
        ),
    }  # fmt: skip
    data, samples = struct.pack("<BHH", 0xBC, 2, len(events)), []
    for number, (name, (times, groups)) in enumerate(events.items()):
        fields = [f"{group}.{part}({kind})" for group, (kind, parts, _) in groups.items() for part in parts]
        data += struct.pack("<H", number) + name.encode() + b"\0" + struct.pack("<H", len(fields))
        data += b"".join(field.encode() + b"\0" for field in fields)
        form = "<HQ" + "".join(kind * len(parts) for kind, parts, _ in groups.values())
        kinds = "".join(kind * len(parts) for kind, parts, _ in groups.values())
        for t, row in zip(times, np.hstack([values for _, _, values in groups.values()]).tolist(), strict=True):
            numbers = [int(x) if kind == "H" else x for kind, x in zip(kinds, row, strict=True)]
            samples.append((t, struct.pack(form, number, round(1e6 * t), *numbers)))
    path.write_bytes(data + b"".join(sample for _, sample in sorted(samples, key=lambda each: each[0])))
    return path
