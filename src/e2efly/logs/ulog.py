"""PX4's logs (.ulg), and which of PX4's topics make a record. In ROS 2 the same topics are the messages of px4_msgs.

Source of the layout: PX4 user guide, "ULog file format". All numbers are little endian.
"""

import re
import struct
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from e2efly.logs.flight_log import mapped
from e2efly.logs.recording import UNUSED, Record, Streams, listed

MAGIC = b"ULog\x01\x12\x35"
"""First bytes of a file."""
SAMPLES = 5_000_000
"""Largest number of samples that are read from a file."""
RPM = 2 * np.pi / 60
_SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
_HEAD, _DATA = struct.Struct("<HB"), struct.Struct("<H")
_BEGIN = 16  # bytes before the first message
_KINDS = frozenset(b"BFIMPQARDLCSO")  # kinds of messages
_TYPES = {
    "int8_t": "i1", "uint8_t": "u1", "int16_t": "i2", "uint16_t": "u2", "int32_t": "i4", "uint32_t": "u4",
    "int64_t": "i8", "uint64_t": "u8", "float": "f4", "double": "f8", "bool": "u1", "char": "u1",
}  # fmt: skip
_LARGEST = 65_535  # bytes of a message
_DEEPEST = 8  # formats within formats
_FOUR = (0, 1, 2, 3)
_FLIP = np.array([1.0, -1.0, -1.0])
"""Factors from FRD to FLU: forward stays, left is minus right, up is minus down."""
ORDER = (3, 0, 1, 2)
"""Rotors of a quadrotor X of PX4 and ArduPilot in our order. Theirs: front right, rear left, front left, rear right."""
ASSUMED = (
    "the rotors are taken to be numbered as PX4 and ArduPilot number those of a quadrotor X (front right, rear left, "
    "front left, rear right); --columns takes another order, as m1=m2 m2=m1"
)
"""What a note says of a log that does not tell where its rotors are."""
ROTORS = ("motor", "rotor_speed")
"""Streams with a number for each rotor."""
_QUADRANTS = ((-1, 1), (1, 1), (-1, -1), (1, -1))  # of our rotors: signs of their places, forward and right
_CORNERS = ("rear right", "front right", "rear left", "front left")
_QUADROTOR = 2  # of MAV_TYPE
_PLUS = range(5000, 6000)  # of SYS_AUTOSTART before 1.14: quadrotors +
_FIRST_MOTOR = 101  # number of the output function of motor 1
_WIDTHS = (800.0, 2200.0)  # us: of pulses to an ESC that is armed


class Taken(NamedTuple):
    """How a stream is made from a topic of PX4."""

    stream: str
    topic: str
    fields: tuple[str, ...]
    turn: Callable[[np.ndarray], np.ndarray]
    """(n, k) PX4's numbers -> (n, k) ours. Of rotors, in PX4's order still."""


def _flip(x: np.ndarray) -> np.ndarray:
    return x * _FLIP


def _enu(x: np.ndarray) -> np.ndarray:
    return x[:, [1, 0, 2]] * [1.0, 1.0, -1.0]


def _attitude(q: np.ndarray) -> np.ndarray:
    """Attitudes of body FRD in NED as body FLU in ENU, wxyz."""
    w, x, y, z = q.T
    # half turns: about (1, 1, 0) / sqrt 2 from NED to ENU, about x from FLU to FRD
    s = np.sqrt(0.5)
    a, b, c, d = -s * (x + y), s * (w + z), s * (w - z), s * (y - x)  # ENU * q
    return np.stack([-b, a, d, -c], -1)  # ... * FLU


def _entries(name: str, entries: tuple[int, ...] = (0, 1, 2)) -> tuple[str, ...]:
    return tuple(name.format(i) for i in entries)


def _shares(pulses: np.ndarray) -> np.ndarray:
    """Pulses, us, as shares of the largest output. Without a pulse there is no output.

    Raises:
        ValueError: when they are no pulses.
    """
    least, most = _WIDTHS
    there = pulses[np.nan_to_num(pulses) > 0]
    if len(there) and not least <= np.min(there) <= np.max(there) <= most:
        span = f"{np.min(there):g} to {np.max(there):g}"
        raise ValueError(f"its outputs are {span}; accepted: pulses of {least:g} to {most:g} us, as 1000 to 2000")
    return np.maximum((pulses - 1000) / 1000, 0.0)


TAKEN = (
    Taken("body_rate", "vehicle_angular_velocity", _entries("xyz[{}]"), _flip),
    Taken("body_rate", "sensor_combined", _entries("gyro_rad[{}]"), _flip),
    Taken("specific_force", "vehicle_acceleration", _entries("xyz[{}]"), _flip),
    Taken("specific_force", "sensor_combined", _entries("accelerometer_m_s2[{}]"), _flip),
    Taken("position", "vehicle_local_position", ("x", "y", "z"), _enu),
    Taken("velocity", "vehicle_local_position", ("vx", "vy", "vz"), _enu),
    Taken("quaternion", "vehicle_attitude", _entries("q[{}]", _FOUR), _attitude),
    Taken("motor", "actuator_motors", _entries("control[{}]", _FOUR), np.asarray),
    Taken("motor", "actuator_outputs", _entries("output[{}]", _FOUR), _shares),
    Taken("rotor_speed", "esc_status", _entries("esc[{}].esc_rpm", _FOUR), lambda x: np.abs(x) * RPM),
    Taken("setpoint", "vehicle_rates_setpoint", ("roll", "pitch", "yaw"), _flip),
    Taken("voltage", "battery_status", ("voltage_v",), np.asarray),
)
"""What is taken from PX4's topics. Of several that give a stream, that with the most samples counts in a log, else the
first of these."""
TIMES = ("timestamp_sample", "timestamp")
"""Fields with the time of a sample, us. The first that is there and not 0 counts."""
FUNCTIONS = _entries("esc[{}].actuator_function", _FOUR)
"""Fields that say which motor each ESC turns, from 1.13 on."""


def fields_of(topic: str) -> set[str]:
    """The fields of a topic that are used, by their paths."""
    return {*TIMES, *FUNCTIONS, *(name for each in TAKEN if each.topic == topic for name in each.fields)}


def numbering(parameters: Mapping[str, float]) -> tuple[tuple[int, ...], str]:
    """PX4's rotors in our order, and what a note says of them. There is no order if the vehicle is no quadrotor X."""
    count = int(parameters.get("CA_ROTOR_COUNT", 0)) if parameters.get("SYS_CTRL_ALLOC", 1) else 0
    if not count:
        kind, frame = (int(parameters.get(name, 0)) for name in ("MAV_TYPE", "SYS_AUTOSTART"))
        if kind not in (0, _QUADROTOR):
            return (), f"MAV_TYPE is {kind}; accepted: {_QUADROTOR}, a quadrotor"
        if frame in _PLUS:
            return (), f"SYS_AUTOSTART is {frame}, a quadrotor +; accepted: a quadrotor X"
        return ORDER, ASSUMED
    places = [tuple(parameters.get(f"CA_ROTOR{i}_P{axis}", 0.0) for axis in "XY") for i in range(min(count, 12))]
    signs = [(np.sign(x), np.sign(y)) for x, y in places]
    if sorted(signs) != sorted(_QUADRANTS):
        told = ", ".join(f"({x:g}, {y:g})" for x, y in places)
        return (), f"CA_ROTOR*_PX and _PY place the rotors at {told} m; accepted: a quadrotor X, one in each quadrant"
    order = tuple(signs.index(quadrant) for quadrant in _QUADRANTS)
    told = ", ".join(f"{corner} is {i + 1}" for corner, i in zip(_CORNERS, order, strict=True))
    return order, f"CA_ROTOR*_PX and _PY tell the order of the rotors: {told}"


def put_topic(
    streams: Streams,
    topic: str,
    fields: Mapping[str, np.ndarray],
    without: Sequence[str] = (),
    order: Sequence[int] = ORDER,
) -> bool:
    """Add the streams that a topic gives. `fields` has (n,) numbers by the path of the field, such as `xyz[0]`. Streams
    of `without` are not wanted. `order`: PX4's rotors in our order; empty if they have none. Returns whether there is a
    new stream.
    """
    before = len(streams.found)
    wanted = [each for each in TAKEN if each.topic == topic and each.stream not in (*streams.found, *without)]
    times = [np.asarray(fields[name], float) for name in TIMES if name in fields]
    if wanted and not times:
        streams.notes.append(f"{topic} is left out: it has no time stamps")
        return False
    for each in wanted:
        if missing := [name for name in each.fields if name not in fields]:
            streams.notes.append(f"{topic} gives no {each.stream}: it has no field {missing[0]}")
            continue
        time = np.where(times[0] > 0, times[0], times[-1]) * 1e-6
        numbers = np.stack([np.asarray(fields[name], float) for name in each.fields], -1)
        numbers[~(np.abs(numbers) < 1e30)] = np.nan
        try:
            values = each.turn(numbers)
        except ValueError as error:
            streams.notes.append(f"{topic} gives no {each.stream}: {error}")
            continue
        if each.stream in ROTORS:
            if not order:
                continue
            values = values[:, _motors(fields)][:, order]
        if streams.put(each.stream, time, values, topic) and each.stream == "setpoint":
            streams.notes.append(f"the thrust of {topic} is a share of the largest, not m/s^2: it is not used")
    return len(streams.found) > before


def _motors(fields: Mapping[str, np.ndarray]) -> list[int]:
    """At which place each motor stands, by what the ESCs turn. Where the log does not say it, motors are in order."""
    turned = [int(np.median(fields[name])) - _FIRST_MOTOR for name in FUNCTIONS if name in fields and len(fields[name])]
    return [turned.index(i) for i in _FOUR] if sorted(turned) == [*_FOUR] else [*_FOUR]


def _moves(fields: Mapping[str, np.ndarray]) -> bool:
    """Whether every number of a topic changes."""
    numbers = [values for name, values in fields.items() if name not in (*TIMES, *FUNCTIONS)]
    return all(len(values) and np.ptp(values) > 0 for values in numbers)


def read_ulog(path: Path) -> Record:
    """A PX4 log, converted from NED and FRD to ENU and FLU.

    Raises:
        ValueError: when it is no such log, or when none of its topics is known here.
    """
    with mapped(path) as data:
        if data[: len(MAGIC)] != MAGIC:
            raise ValueError(f"{path}: does not begin as a PX4 log does; accepted: a .ulg file")
        log = _Log(data[:])
    streams, used = Streams(), set()
    order, told = numbering(log.parameters)
    if log.cut_off:
        streams.notes.append(log.cut_off)
    chosen = {}
    for topic in {each.topic: None for each in TAKEN}:
        instances = {n: log.fields(topic, n) for n in sorted(n for name, n in log.samples if name == topic)}
        number = next((n for n, fields in instances.items() if _moves(fields)), min(instances, default=0))
        chosen |= {(topic, number): instances[number]} if instances else {}
    for (topic, number), fields in sorted(chosen.items(), key=lambda each: -len(log.samples[each[0]])):
        if put_topic(streams, topic, fields, order=order):
            used.add((topic, number))
    if not order:
        streams.notes.append(f"{listed(ROTORS)} are left out: {told}")
    elif streams.found.keys() & {*ROTORS}:
        streams.notes.append(told)
    unused = [f"{name}[{i}]" if i else name for name, i in sorted(log.samples) if (name, i) not in used]
    if unused:
        streams.notes.append(f"topics that are not used: {listed(unused, UNUSED)}")
    return streams.record(path)


class _Log:
    """The messages of a log, up to its end or up to where it is damaged."""

    def __init__(self, data: bytes) -> None:
        self._formats: dict[str, str] = {}
        self._sizes: dict[str, int] = {}
        self.samples: dict[tuple[str, int], list[bytes]] = defaultdict(list)
        """The data of each topic and instance."""
        self.cut_off = ""
        self.parameters: dict[str, float] = {}
        """The values of the parameters at the beginning."""
        topics: dict[int, tuple[str, int]] = {}
        at, lost, count = _BEGIN, 0, 0
        while at + _HEAD.size <= len(data):
            size, kind = _HEAD.unpack_from(data, at)
            begin, end = at + _HEAD.size, at + _HEAD.size + size
            if kind not in _KINDS or not size:
                found = data.find(_SYNC, at + 1)
                found = found + len(_SYNC) if found >= 0 else len(data)
                lost, at = lost + found - at, found
                continue
            if end > len(data):
                lost += len(data) - at
                break
            if kind == ord("F"):
                name, _, text = data[begin:end].decode("utf-8", "replace").partition(":")
                self._formats[name] = text
            elif kind == ord("P") and size > 1:
                place = begin + 1 + data[begin]
                form, _, name = data[begin + 1 : place].decode("utf-8", "replace").partition(" ")
                if form in _TYPES and end - place == np.dtype(_TYPES[form]).itemsize:
                    self.parameters.setdefault(name, float(np.frombuffer(data[place:end], f"<{_TYPES[form]}")[0]))
            elif kind == ord("A") and size > 3:
                instance, number = struct.unpack_from("<BH", data, begin)
                topics[number] = data[begin + 3 : end].decode("utf-8", "replace"), instance
            elif kind == ord("D") and size > _DATA.size:
                if count == SAMPLES:
                    self.cut_off = f"the first {SAMPLES} samples are read, and no more"
                    return
                (number,) = _DATA.unpack_from(data, begin)
                if number in topics:
                    self.samples[topics[number]].append(data[begin + _DATA.size : end])
                    count += 1
            at = end
        if lost:
            self.cut_off = f"{lost} bytes of the log are damaged or break off, and are left out"

    def fields(self, topic: str, instance: int) -> dict[str, np.ndarray]:
        """The samples of the fields that are used of a topic, (n,) each."""
        if not self._size(topic) or not (places := self._places(topic, fields_of(topic))):
            return {}
        least = max(place + np.dtype(form).itemsize for place, form in places.values())
        whole = [sample[:least] for sample in self.samples[topic, instance] if len(sample) >= least]
        form: Any = {
            "names": list(places), "offsets": [place for place, _ in places.values()],
            "formats": [form for _, form in places.values()], "itemsize": least,
        }  # fmt: skip
        table = np.frombuffer(b"".join(whole), np.dtype(form))
        return {name: table[name] for name in places}

    def _places(self, name: str, wanted: set[str]) -> dict[str, tuple[int, str]]:
        """The offset in bytes and the type of each wanted field of a format, by its path."""
        found: dict[str, tuple[int, str]] = {}
        at = 0
        for kind, count, field in self._fields(name):
            size = self._size(kind)
            inner = {path.partition(".")[2] for path in wanted if re.split(r"[.\[]", path, maxsplit=1)[0] == field}
            deep = {"": (0, f"<{_TYPES[kind]}")} if kind in _TYPES else self._places(kind, inner) if inner else {}
            for i in range(max(count, 1) if inner else 0):
                path = f"{field}[{i}]" if count else field
                for rest, (place, form) in deep.items():
                    if (whole := f"{path}.{rest}" if rest else path) in wanted:
                        found[whole] = at + i * size + place, form
            at += max(count, 1) * size
        return found

    def _size(self, kind: str, depth: int = 0) -> int:
        """Size of a type, bytes."""
        if kind in _TYPES:
            return np.dtype(_TYPES[kind]).itemsize
        if kind not in self._sizes:
            if depth > _DEEPEST:
                raise ValueError(f"the format {kind:.60} has too many formats within; accepted: {_DEEPEST}")
            parts = self._fields(kind)
            self._sizes[kind] = sum(max(count, 1) * self._size(part, depth + 1) for part, count, _ in parts)
            if self._sizes[kind] > _LARGEST:
                raise ValueError(f"the format {kind:.60} is larger than a message; accepted: {_LARGEST} bytes")
        return self._sizes[kind]

    def _fields(self, name: str) -> list[tuple[str, int, str]]:
        """The fields of a format: type, number of entries (0: a single one), name."""
        if name not in self._formats:
            raise ValueError(f"the format {name:.60} is not defined; accepted: a log with all formats")
        found = []
        for entry in filter(None, self._formats[name].split(";")):
            kind, _, field = entry.strip().partition(" ")
            kind, bracket, count = kind.partition("[")
            number = count.rstrip("]")
            if bracket and not (number.isdecimal() and 0 < int(number[:6]) <= _LARGEST):
                raise ValueError(f"a format has the field {entry:.60}; accepted: TYPE[NUMBER] NAME")
            found.append((kind, int(number[:6]) if bracket else 0, field))
        return found
