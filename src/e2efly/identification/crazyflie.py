"""Logs of a Crazyflie's micro-SD deck (format 0xBC, version 2). The firmware writes their blocks at fixed frequencies.

Source of the layout: Bitcraze, crazyflie-firmware, `uart/sdcard logging` documentation and its reader `cfusdlog`.
"""

import struct
from pathlib import Path

import numpy as np

from e2efly.identification.record import Record, Stream
from e2efly.vehicles.vehicle import GRAVITY

MAGIC, VERSION = 0xBC, 2
PWM = 65535.0
"""Full output of a motor."""
_BLOCK = struct.Struct("<HQ")  # event, then time in us
# Crazyflie: 1 front right, 2 rear right, 3 rear left, 4 front left (FLU); the vehicle's file: rear right, front right,
# rear left, front left
ORDER = (1, 0, 2, 3)
FIELDS = {
    "specific_force": (("acc.x", "acc.y", "acc.z"), GRAVITY),
    "body_rate": (("gyro.x", "gyro.y", "gyro.z"), np.pi / 180),
    "motor": (tuple(f"motor.m{i + 1}" for i in ORDER), 1 / PWM),
    "position": (("stateEstimate.x", "stateEstimate.y", "stateEstimate.z"), 1.0),
    "velocity": (("stateEstimate.vx", "stateEstimate.vy", "stateEstimate.vz"), 1.0),
    "voltage": (("pm.vbat",), 1.0),
}
"""For each stream of a record, the names of the Crazyflie's variables and their factor to SI units."""


def is_crazyflie(path: Path) -> bool:
    """Whether a file begins like such a log."""
    with path.open("rb") as file:
        return file.read(3) == struct.pack("<BH", MAGIC, VERSION)


def read_crazyflie(path: Path) -> Record:
    """Read the complete samples of a log.

    Raises:
        ValueError: when the file is not such a log, or has none of the variables that are known here.
    """
    data = path.read_bytes()
    if data[:3] != struct.pack("<BH", MAGIC, VERSION):
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
                fields.append((entry[:-3], entry[-2]))
            events[number] = (name, fields)
    except (struct.error, ValueError, IndexError, UnicodeDecodeError):
        raise ValueError(f"{path}: breaks off in its header; accepted: a whole one") from None
    found = {n: _rows(data, at, n, events) for n in events}
    streams, notes = {}, []
    for number, (_, fields) in events.items():
        rows = found[number]
        if not len(rows):
            continue
        time = rows["time"].astype(float) * 1e-6
        rising = np.concatenate([[True], np.diff(time) > 0])
        if not rising.all():
            notes.append(f"{int((~rising).sum())} samples out of {len(time)} whose time does not rise are left out")
        for stream, (names, factor) in FIELDS.items():
            if stream not in streams and {*names} <= {name for name, _ in fields}:
                values = np.stack([rows[name].astype(float) for name in names], -1) * factor
                streams[stream] = Stream(time[rising], values[rising])
    if not streams:
        known = ", ".join(name for names, _ in FIELDS.values() for name in names)
        raise ValueError(f"{path}: holds no samples of variables that are known here; accepted: {known}")
    return Record(path, streams, tuple(notes))


def _text(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(0, at)
    return data[at:end].decode("ascii"), end + 1


def _rows(data: bytes, at: int, wanted: int, events: dict[int, tuple[str, list[tuple[str, str]]]]) -> np.ndarray:
    """All samples of an event, up to the first invalid block."""
    kinds = {
        n: np.dtype([("event", "<u2"), ("time", "<u8"), *((name, f"<{_NUMPY[kind]}") for name, kind in fields)])
        for n, (_, fields) in events.items()
    }
    if len(events) == 1:  # all rows have the same type: read them at once
        return _only(np.frombuffer(data, kinds[wanted], (len(data) - at) // kinds[wanted].itemsize, at), wanted)
    places = []
    while at + 2 <= len(data):
        (number,) = struct.unpack_from("<H", data, at)
        if number not in kinds or at + kinds[number].itemsize > len(data):
            break
        if number == wanted:
            places.append(at)
        at += kinds[number].itemsize
    joined = b"".join(data[p : p + kinds[wanted].itemsize] for p in places)
    return np.frombuffer(joined, kinds[wanted])


def _only(rows: np.ndarray, number: int) -> np.ndarray:
    good = rows["event"] == number
    return rows if good.all() else rows[: int(np.argmin(good))]


_NUMPY = {"B": "u1", "b": "i1", "H": "u2", "h": "i2", "I": "u4", "i": "i4", "f": "f4", "d": "f8", "Q": "u8", "q": "i8"}
