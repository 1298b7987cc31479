"""Logs of a Crazyflie's micro-SD deck (format 0xBC, version 2). The firmware writes their blocks at fixed frequencies.

Source of the layout: Bitcraze, crazyflie-firmware, `uart/sdcard logging` documentation and its reader `cfusdlog`.
"""

import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np

from e2efly.control import Quat
from e2efly.logs.recording import UNUSED, Record, Streams, listed
from e2efly.vehicles.gravity import GRAVITY

MAGIC = struct.pack("<BH", 0xBC, 2)
"""First bytes of a file: the format and its version."""
PWM = 65535.0
"""Full output of a motor."""
# Crazyflie: 1 front right, 2 rear right, 3 rear left, 4 front left (FLU); the vehicle's file: rear right, front right,
# rear left, front left
ORDER = (1, 0, 2, 3)
Turn = Callable[[np.ndarray], np.ndarray]


def _times(factor: float) -> Turn:
    return lambda x: x * factor


def _attitude(degrees: np.ndarray) -> np.ndarray:
    """Roll, pitch, yaw in degrees, of which the pitch is positive with the nose up, as wxyz."""
    roll, pitch, yaw = np.radians(degrees).T
    return Quat.of_euler(roll, -pitch, yaw).stack()


def _entries(group: str, names: str) -> tuple[str, ...]:
    return tuple(f"{group}.{name}" for name in names.split())


FIELDS: tuple[tuple[str, tuple[str, ...], Turn], ...] = (
    ("specific_force", _entries("acc", "x y z"), _times(GRAVITY)),
    ("body_rate", _entries("gyro", "x y z"), np.radians),
    ("motor", tuple(f"motor.m{i + 1}" for i in ORDER), _times(1 / PWM)),
    ("position", _entries("stateEstimate", "x y z"), np.asarray),
    ("position", _entries("stateEstimateZ", "x y z"), _times(1e-3)),
    ("velocity", _entries("stateEstimate", "vx vy vz"), np.asarray),
    ("velocity", _entries("stateEstimateZ", "vx vy vz"), _times(1e-3)),
    ("quaternion", _entries("stateEstimate", "qw qx qy qz"), np.asarray),
    ("quaternion", _entries("stateEstimate", "roll pitch yaw"), _attitude),
    ("voltage", ("pm.vbat",), np.asarray),
    ("voltage", ("pm.vbatMV",), _times(1e-3)),
)
"""For the streams of a record, the names of the Crazyflie's variables, and what makes SI units of them. The first whose
variables are all there counts. The firmware's pitch is that of its old body axes: nose up is positive."""


def read_crazyflie(path: Path) -> Record:
    """Read the complete samples of a log.

    Raises:
        ValueError: when the file is not such a log, or has none of the variables that are known here.
    """
    data = path.read_bytes()
    if data[: len(MAGIC)] != MAGIC:
        raise ValueError(f"{path}: does not begin with 0xBC and version 2; accepted: a Crazyflie's micro-SD log")
    (count,) = struct.unpack_from("<H", data, 3)
    at, events = 5, {}
    try:
        for _ in range(count):
            (number,) = struct.unpack_from("<H", data, at)
            name, at = _text(data, at + 2)
            (size,) = struct.unpack_from("<H", data, at)
            at += 2
            fields = []
            for _ in range(size):
                entry, at = _text(data, at)
                fields.append((entry[:-3], _NUMPY[entry[-2]]))
            events[number] = (name, fields)
    except (struct.error, ValueError, KeyError, IndexError):
        raise ValueError(f"{path}: breaks off in its header; accepted: a whole one") from None
    streams, used = Streams(), set()
    samples, left = _samples(data, at, events)
    if left:
        streams.notes.append(f"the last {left} bytes are no whole samples and are left out")
    for number, (name, fields) in events.items():
        rows = samples[number]
        for stream, names, turn in FIELDS:
            if {*names} <= {field for field, _ in fields} and len(rows):
                values = turn(np.stack([rows[field].astype(float) for field in names], -1))
                if streams.put(stream, rows["time"].astype(float) * 1e-6, values, name):
                    used |= {(number, field) for field in names}
    unused = [field for n, (_, fields) in events.items() for field, _ in fields if (n, field) not in used]
    if unused:
        streams.notes.append(f"variables that are not used: {listed(unused, UNUSED)}")
    return streams.record(path)


def _text(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(0, at)
    return data[at:end].decode("ascii"), end + 1


def _samples(
    data: bytes, at: int, events: dict[int, tuple[str, list[tuple[str, str]]]]
) -> tuple[dict[int, np.ndarray], int]:
    """All samples of each event up to the first invalid block, and how many bytes follow."""
    kinds = {
        n: np.dtype([("event", "<u2"), ("time", "<u8"), *((name, f"<{kind}") for name, kind in fields)])
        for n, (_, fields) in events.items()
    }
    if len(events) == 1:  # all samples have the same type: read them at once
        ((number, kind),) = kinds.items()
        rows = np.frombuffer(data, kind, (len(data) - at) // kind.itemsize, at)
        other = rows["event"] != number
        rows = rows[: int(np.argmax(other))] if other.any() else rows
        return {number: rows}, len(data) - at - rows.nbytes
    found: dict[int, list[bytes]] = {n: [] for n in events}
    sizes = {n: kind.itemsize for n, kind in kinds.items()}
    while at + 2 <= len(data):
        (number,) = struct.unpack_from("<H", data, at)
        if number not in sizes or at + sizes[number] > len(data):
            break
        found[number].append(data[at : at + sizes[number]])
        at += sizes[number]
    return {n: np.frombuffer(b"".join(found[n]), kinds[n]) for n in events}, len(data) - at


_NUMPY = {"B": "u1", "b": "i1", "H": "u2", "h": "i2", "I": "u4", "i": "i4", "f": "f4", "d": "f8", "Q": "u8", "q": "i8"}
