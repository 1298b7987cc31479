"""A small log of every format that is read, made here."""

import math
import struct
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mcap.writer import CompressionType, Writer
from rosbags.rosbag1 import Writer as Bag1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Bag2

from e2efly.logs.mcap_file import PROFILE
from e2efly.logs.ros_bag import _store
from e2efly.logs.scripts.ros_messages import encoded, full_name
from e2efly.logs.telemetry import Telemetry

HALF = math.sqrt(0.5)
BLACKBOX = Path(__file__).parents[1] / "data" / "blackbox" / "sitl.bfl"
VARIABLES = (
    *(f"{sensor}.{axis}(f)" for sensor in ("acc", "gyro") for axis in "xyz"), *(f"motor.m{i}(H)" for i in (1, 2, 3, 4))
)  # fmt: skip

Message = tuple[str, str, dict[str, Any]]
"""Of ROS: topic, type in the form of ROS 1, content without its header."""


def crazyflie(path: Path, samples: int = 5, variables: tuple[str, ...] = (), values: tuple[float, ...] = ()) -> Path:
    """As the firmware writes it: header, then blocks of event, time in us and values."""
    names = [*VARIABLES, *variables]
    data = struct.pack("<BHHH", 0xBC, 2, 1, 0xFFFF) + b"fixedFrequency\0" + struct.pack("<H", len(names))
    data += b"".join(name.encode() + b"\0" for name in names)
    form = "<HQ" + "".join(name[-2] for name in names)
    for i in range(samples):
        motors = (655, 2 * 655, 3 * 655, 4 * 655)
        data += struct.pack(form, 0xFFFF, 1000 * (i + 1), 0.0, 0.1, 1.0, 180.0, 0.0, 90.0, *motors, *values)
    path.write_bytes(data)
    return path


def two_events(path: Path) -> Path:
    """The same firmware, which logs the battery more rarely than the gyroscope."""
    data = struct.pack("<BHH", 0xBC, 2, 2)
    for number, names in ((1, ("gyro.x(f)", "gyro.y(f)", "gyro.z(f)")), (2, ("pm.vbat(f)",))):
        data += struct.pack("<H", number) + b"event\0" + struct.pack("<H", len(names))
        data += b"".join(name.encode() + b"\0" for name in names)
    for i in range(20):
        data += struct.pack("<HQ3f", 1, 1000 * i, 0.0, 90.0, float(i))
        data += struct.pack("<HQf", 2, 1000 * i + 500, 3.9) if i % 5 == 0 else b""
    path.write_bytes(data)
    return path


def ulog(path: Path, formats: dict[str, str] | None = None) -> Path:
    """A PX4 log: format, subscription, data; falling forwards while turning right, nose to the east."""
    formats = formats or {
        "vehicle_angular_velocity": "uint64_t timestamp;float[3] xyz;",
        "vehicle_attitude": "uint64_t timestamp;float[4] q;",
    }

    def message(kind: bytes, content: bytes) -> bytes:
        return struct.pack("<Hc", len(content), kind) + content

    data = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0)
    data += message(b"B", bytes(40))
    data += b"".join(message(b"F", f"{name}:{fields}".encode()) for name, fields in formats.items())
    data += message(b"A", struct.pack("<BH", 0, 0) + b"vehicle_angular_velocity")
    data += message(b"A", struct.pack("<BH", 0, 1) + b"vehicle_attitude")
    for i in range(4):
        data += message(b"D", struct.pack("<HQ3f", 0, 1000 * (i + 1), 1.0, 2.0, 3.0))
        data += message(b"D", struct.pack("<HQ4f", 1, 1000 * (i + 1), HALF, 0.0, 0.0, HALF))
    path.write_bytes(data)
    return path


def telemetry(path: Path, compression: CompressionType = CompressionType.NONE) -> Path:
    """A flight log of e2efly, without checksums: what is damaged in it is read."""
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, enable_crcs=False, chunk_size=500)
        writer.start(profile=PROFILE, library="test")
        channels = {
            "odometry": b'{"age":0.004,"position":[0.1,2,3],"velocity":[4,0,0.5],"quaternion":[1,0,0,0]}',
            "imu": b'{"gyro":[1,2,3],"specific_force":[0,0.1,9.81]}',
            "command": b'{"collective_thrust":12,"body_rate":[0,-1,0.5]}',
            "rc": b'{"channels":[1500,1000,2000,1750]}',
            "battery": b'{"voltage":15.5}',
        }
        numbers = {name: writer.register_channel(name, "json", 0) for name in channels}
        for i in range(25):
            for name, data in channels.items():
                writer.add_message(numbers[name], (i + 1) * 10**7, data, (i + 1) * 10**7, i)
        writer.finish()
    return path


def odometry(x: float = 1.0) -> dict[str, Any]:
    """Facing world y, flying along world x."""
    pose = {"position": {"x": x, "y": 2.0, "z": 3.0}, "orientation": {"x": 0.0, "y": 0.0, "z": HALF, "w": HALF}}
    return {"pose": {"pose": pose}, "twist": {"twist": {"linear": {"x": 0.0, "y": -4.0, "z": 0.5}}}}


IMU = {"angular_velocity": {"x": 1.0, "y": 2.0, "z": 3.0}, "linear_acceleration": {"x": 0.0, "y": 0.1, "z": 9.81}}
FLOWN: tuple[Message, ...] = (
    ("/odom", "nav_msgs/Odometry", odometry()),
    ("/imu", "sensor_msgs/Imu", IMU),
    ("/battery", "sensor_msgs/BatteryState", {"voltage": 15.5}),
)


def bag(path: Path, messages: tuple[Message, ...] = FLOWN, count: int = 20, storage: str = "SQLITE3") -> Path:
    """A bag of ROS 1 (a path that ends in .bag) or 2, with each of the messages 100 times a second."""
    version = 1 if path.suffix == ".bag" else 2
    store = _store(version)
    with Bag1(path) if version == 1 else Bag2(path, version=8, storage_plugin=StoragePlugin[storage]) as writer:
        own = {topic: writer.add_connection(topic, full_name(kind), typestore=store) for topic, kind, _ in messages}
        for i in range(count):
            stamp = 10**18 + i * 10**7
            for topic, kind, content in messages:
                tree = {"header": {"stamp": stamp, "frame_id": "base_link"}, **content}
                writer.write(own[topic], stamp, encoded(store, version, kind, tree))
    return path


def only(folder: Path, ending: str) -> Path:
    (found,) = folder.glob(f"*{ending}")
    return found


def table(path: Path) -> Path:
    """A CSV file with units in its header and a byte-order mark."""
    lines = ["t (ms),wx (deg/s),wy (deg/s),wz (deg/s),ax,ay,az,px,py,pz,qw,qx,qy,qz,extra"]
    for i in range(0, 3000, 20):
        a, b = math.sin(0.01 * i), math.cos(0.01 * i)
        q = f"{math.cos(0.1 * a):.6f},{math.sin(0.1 * a):.6f},{1e-4 * a:.6f},{1e-4 * b:.6f}"
        numbers = (i, 100 * b, a, b, 0.1 * a, 0.1 * b, 9.8 + 0.1 * a, a, b, 1 + 0.5 * a)
        lines.append(",".join(f"{x:.4f}" for x in numbers) + f",{q},x")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8-sig")
    return path


def blackbox(path: Path, size: int = 9000) -> Path:
    """The beginning of a blackbox that Betaflight's SITL wrote."""
    path.write_bytes(BLACKBOX.read_bytes()[:size])
    return path


def fly(log: Telemetry, start: float) -> None:
    """A fifth of a second of a flight, facing world y and flying along world x, by poses that are 4 ms old."""
    for i in range(20):
        now = start + 0.01 * i
        motion = {"position": [0.1 * i, 2.0, 3.0], "velocity": [4.0, 0.0, 0.5], "body_rate": [0.1, 0.2, 0.3]}
        log.record("odometry", now, {"age": 0.004, "quaternion": [HALF, 0.0, 0.0, HALF], **motion})
        log.record("imu", now, {"gyro": [1.0, 2.0, 3.0 + i], "specific_force": [0.0, 0.1, 9.81]})
        log.record("command", now, {"collective_thrust": 12.0, "body_rate": [0.0, -1.0, 0.5], "yaw": 0.0})
        log.record("motors", now, {"values": [0.1, 0.2, 0.3, 0.4]})
    log.record("battery", start, {"voltage": 15.5, "current": 8.0, "cells": 4})


def recorded(path: Path) -> Path:
    """A flight log as the bridge writes it."""
    start = time.monotonic()
    with Telemetry(path) as log:
        for i in range(20):
            log.record("imu", start + 0.01 * i, {"gyro": [1.0, 2.0, 3.0 + i], "specific_force": [0.0, 0.1, 9.81]})
    return path


SAMPLES: dict[str, Callable[[Path], Path]] = {
    "CSV": lambda folder: table(folder / "a.csv"),
    "flight log": lambda folder: telemetry(folder / "a.mcap"),
    "flight log of the bridge": lambda folder: recorded(folder / "b.mcap"),
    "bag of ROS 1": lambda folder: bag(folder / "a.bag"),
    "bag of ROS 2, sqlite3": lambda folder: only(bag(folder / "s"), ".db3"),
    "bag of ROS 2, MCAP": lambda folder: only(bag(folder / "m", storage="MCAP"), ".mcap"),
    "PX4": lambda folder: ulog(folder / "a.ulg"),
    "Crazyflie": lambda folder: crazyflie(folder / "log00"),
    "Crazyflie, two events": lambda folder: two_events(folder / "log01"),
    "blackbox": lambda folder: blackbox(folder / "a.bbl"),
}
"""A file of each format, by name."""
TOKENS = (
    b"\x28\xb5\x2f\xfd", b"H Product:Blackbox", b"\nH P interval:0/1\n", b"IPPP", b"E\xffEnd of log\0", b"\x06", b"nan",
    b"1e999", b"-9e15", b",,,", b'"', b"\n", b"[[[[[[", b"null", b"float[99999] x;", b"op=\x05", b"topic=",
    b"\x2f\x73\x13\x20\x25\x0c\xbb\x12",
)  # fmt: skip
"""What has a meaning in some of them."""


def bytes_of(folder: Path) -> dict[str, bytes]:
    folder.mkdir(parents=True, exist_ok=True)
    return {name: make(folder).read_bytes() for name, make in SAMPLES.items()}
