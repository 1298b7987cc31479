"""MAVLink 2 frames: the messages that a flight needs, from bytes and to bytes.

A frame is 0xFD, length, flags, sequence, system, component, id (3 bytes), payload, checksum; zeros at the end of a
payload are left out (https://mavlink.io/en/guide/serialization.html). The layouts are those of `common.xml` and
`ardupilotmega.xml`: fields in the order of the wire, and the byte that the definition adds to the checksum.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import islice
from typing import Any

START, HEADER, SIGNED, SIGNATURE = 0xFD, 10, 0x01, 13
"""First byte of a frame, length of its header, the flag of a signed one, and the length of the signature."""
OLD_START = 0xFE
"""First byte of a frame of MAVLink 1, which is not read."""
LARGEST = HEADER + 255 + 2 + SIGNATURE


@dataclass(frozen=True)
class MessageLayout:
    """How a message is laid out."""

    name: str
    id: int
    extra: int
    """The byte that the definition of the message adds to the checksum."""
    fields: tuple[tuple[str, str], ...]
    """(name, format of `struct`) in the order of the wire. `4f` is an array, `16s` a text."""

    @cached_property
    def packing(self) -> struct.Struct:
        """All fields, little endian."""
        return struct.Struct("<" + "".join(kind for _, kind in self.fields))

    def pack(self, values: Mapping[str, Any]) -> bytes:
        """The payload. Fields that are left out are zero."""
        flat: list[Any] = []
        for name, kind in self.fields:
            count, text = _count(kind), kind.endswith("s")
            given = values.get(name, b"" if text else (0,) * count if count > 1 else 0)
            flat += list(given) if count > 1 else [given]
        payload = self.packing.pack(*flat).rstrip(b"\0")
        return payload or b"\0"

    def unpack(self, payload: bytes) -> dict[str, Any]:
        """The fields of a payload. Bytes that a newer definition adds at its end are not used."""
        values = iter(self.packing.unpack(payload[: self.packing.size].ljust(self.packing.size, b"\0")))
        told: dict[str, Any] = {}
        for name, kind in self.fields:
            count = _count(kind)
            told[name] = tuple(islice(values, count)) if count > 1 else next(values)
        return told


def _count(kind: str) -> int:
    return 1 if kind.endswith("s") or len(kind) == 1 else int(kind[:-1])


def _layout(name: str, id: int, extra: int, fields: str) -> MessageLayout:
    """`fields` is a list of name:format, separated by blanks."""
    pairs = [part.partition(":") for part in fields.split()]
    return MessageLayout(name, id, extra, tuple((name, kind) for name, _, kind in pairs))


_IMU = ["xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro", "xmag", "ymag", "zmag"]
LAYOUTS = (
    _layout("HEARTBEAT", 0, 50, "custom_mode:I type:B autopilot:B base_mode:B system_status:B mavlink_version:B"),
    _layout(
        "SYS_STATUS", 1, 124, "sensors_present:I sensors_enabled:I sensors_health:I load:H voltage_battery:H "
        "current_battery:h drop_rate:H errors:H counts:4H battery_remaining:b present_extended:I enabled_extended:I "
        "health_extended:I",
    ),
    _layout("PARAM_REQUEST_READ", 20, 214, "param_index:h target_system:B target_component:B param_id:16s"),
    _layout("PARAM_VALUE", 22, 220, "param_value:4s param_count:H param_index:H param_id:16s param_type:B"),
    _layout("RAW_IMU", 27, 144, f"time_usec:Q {' '.join(f'{name}:h' for name in _IMU)} id:B temperature:h"),
    _layout(
        "ATTITUDE_QUATERNION", 31, 246, "time_boot_ms:I q1:f q2:f q3:f q4:f rollspeed:f pitchspeed:f yawspeed:f "
        "offset:4f",
    ),
    _layout("RC_CHANNELS", 65, 118, "time_boot_ms:I channels:18H chancount:B rssi:B"),
    _layout("COMMAND_LONG", 76, 152, "params:7f command:H target_system:B target_component:B confirmation:B"),
    _layout(
        "COMMAND_ACK", 77, 143, "command:H result:B progress:B result_param2:i target_system:B target_component:B"
    ),
    _layout(
        "SET_ATTITUDE_TARGET", 82, 49, "time_boot_ms:I q:4f body_roll_rate:f body_pitch_rate:f body_yaw_rate:f "
        "thrust:f target_system:B target_component:B type_mask:B",
    ),
    _layout(
        "HIGHRES_IMU", 105, 93, f"time_usec:Q {' '.join(f'{name}:f' for name in _IMU)} abs_pressure:f "
        "diff_pressure:f pressure_alt:f temperature:f fields_updated:H id:B",
    ),
    _layout("TIMESYNC", 111, 34, "tc1:q ts1:q"),
    _layout(
        "AUTOPILOT_VERSION", 148, 178, "capabilities:Q uid:Q flight_sw_version:I middleware_sw_version:I "
        "os_sw_version:I board_version:I vendor_id:H product_id:H flight_custom:8s middleware_custom:8s os_custom:8s "
        "uid2:18s",
    ),
    _layout("STATUSTEXT", 253, 83, "severity:B text:50s id:H chunk_seq:B"),
    _layout(
        "ODOMETRY", 331, 91, "time_usec:Q x:f y:f z:f q:4f vx:f vy:f vz:f rollspeed:f pitchspeed:f yawspeed:f "
        "pose_covariance:21f velocity_covariance:21f frame_id:B child_frame_id:B reset_counter:B estimator_type:B "
        "quality:b",
    ),
    _layout(
        "ESC_TELEMETRY_1_TO_4", 11030, 144, "voltage:4H current:4H totalcurrent:4H rpm:4H count:4H temperature:4B"
    ),
)  # fmt: skip
"""The messages that are read or sent."""
BY_NAME = {layout.name: layout for layout in LAYOUTS}
BY_ID = {layout.id: layout for layout in LAYOUTS}


def _crc_table() -> tuple[int, ...]:
    table = []
    for byte in range(256):
        crc = byte
        for _ in range(8):
            crc = (crc >> 1) ^ (0x8408 if crc & 1 else 0)
        table.append(crc)
    return tuple(table)


_TABLE = _crc_table()


def checksum(data: bytes) -> int:
    """CRC-16/MCRF4XX: the polynomial 0x1021 reflected, beginning with 0xFFFF."""
    crc = 0xFFFF
    for byte in data:
        crc = (crc >> 8) ^ _TABLE[(crc ^ byte) & 0xFF]
    return crc


def encode(name: str, values: Mapping[str, Any], *, sequence: int, system: int, component: int) -> bytes:
    """The frame of a message, from a system and component. Fields that are left out are zero."""
    layout = BY_NAME[name]
    payload = layout.pack(values)
    head = bytes([len(payload), 0, 0, sequence & 0xFF, system, component]) + layout.id.to_bytes(3, "little")
    return bytes([START]) + head + payload + struct.pack("<H", checksum(head + payload + bytes([layout.extra])))


@dataclass(frozen=True)
class MavlinkMessage:
    """A message that has come."""

    name: str
    system: int
    component: int
    fields: dict[str, Any]


@dataclass
class FrameReader:
    """Reads frames from a stream of bytes. What is no frame is skipped and counted."""

    skipped: int = 0
    """Number of bytes so far that belong to no frame."""
    bad_checksums: int = 0
    """Number of frames of known messages so far whose checksum was wrong."""
    old: int = 0
    """Number of bytes so far where a frame of MAVLink 1 may begin."""
    _rest: bytearray = field(default_factory=bytearray)

    def feed(self, data: bytes) -> Iterator[MavlinkMessage]:
        """The messages that are complete now. Those of other kinds than `LAYOUTS` are left out."""
        rest = self._rest
        rest += data
        while True:
            start = rest.find(START)
            gone = len(rest) if start < 0 else start
            self.old += rest.count(OLD_START, 0, gone)
            self.skipped += gone
            del rest[:gone]
            if len(rest) < HEADER:
                return
            end = HEADER + rest[1] + 2 + (SIGNATURE if rest[2] & SIGNED else 0)
            if rest[2] & ~SIGNED:  # flags that nobody knows: the frame must not be read
                self._skip()
                continue
            if len(rest) < end:
                return
            layout, body = BY_ID.get(int.from_bytes(rest[7:HEADER], "little")), HEADER + rest[1]
            if layout is None:
                if body + 2 > len(rest) or not self._plausible(end):
                    self._skip()
                else:
                    del rest[:end]
                continue
            said = int.from_bytes(rest[body : body + 2], "little")
            if checksum(bytes(rest[1:body]) + bytes([layout.extra])) != said:
                self.bad_checksums += 1
                self._skip()
                continue
            yield MavlinkMessage(layout.name, rest[5], rest[6], layout.unpack(bytes(rest[HEADER:body])))
            del rest[:end]

    def _plausible(self, end: int) -> bool:
        """Whether another frame begins where one of an unknown kind ends, or nothing more has come."""
        return len(self._rest) == end or self._rest[end] == START

    def _skip(self) -> None:
        self.skipped += 1
        del self._rest[0]
