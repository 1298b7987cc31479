"""CRTP packets: those that a flight needs, from bytes and to bytes.

A packet is a header, whose bits are port (4), two that are 1, and channel (2), and at most 30 bytes
(https://www.bitcraze.io/documentation/repository/crazyflie-firmware/master/functional-areas/crtp/). Links carry whole
packets; between a link and this module each is preceded by its length, one byte, so that a stream can carry them, too.
Layouts as in firmware 2025.09 to 2026.08. All vectors that enter or leave are body FLU or world ENU, SI units.
"""

import math
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

PARAMETERS, LOGS, LOCALIZATION, GENERIC_COMMANDER, HIGH_LEVEL, SUPERVISOR, PLATFORM, LINK_SERVICE = (
    2, 5, 6, 7, 8, 9, 13, 15,
)  # fmt: skip
"""Ports."""
NOTHING = 0xF3
"""A header with these bits carries nothing: it only asks for an answer, or is one."""
LARGEST = 30
"""Most bytes after the header."""
MANUAL, EXTERNAL_POSE = 11, 8
"""Types of a set-point of rates and thrust, and of a pose."""
LAND = 10
"""The high-level commander's landing with a speed. Its answers repeat this number."""
SET_POINTS_END = 0
"""A command to the generic commander: no set-points follow."""
FULL = 65535
"""Largest thrust of a set-point."""


@dataclass(frozen=True)
class CrtpPacket:
    """One packet."""

    port: int
    """0 to 15."""
    channel: int
    """0 to 3."""
    data: bytes = b""
    """At most 30 bytes."""

    def encode(self) -> bytes:
        """Header and data."""
        if len(self.data) > LARGEST:
            raise ValueError(f"CRTP packet: {len(self.data)} bytes; accepted: {LARGEST} at most")
        return bytes([self.port << 4 | 0x0C | self.channel]) + self.data

    def framed(self) -> bytes:
        """Length, header and data."""
        raw = self.encode()
        return bytes([len(raw)]) + raw


@dataclass
class PacketReader:
    """Reads framed packets from a stream of bytes."""

    _rest: bytearray = field(default_factory=bytearray)

    def feed(self, data: bytes) -> Iterator[CrtpPacket]:
        """The packets that are complete now. Those that carry nothing are left out."""
        self._rest += data
        for raw in whole(self._rest):
            if raw and raw[0] & NOTHING != NOTHING:
                yield CrtpPacket(raw[0] >> 4, raw[0] & 3, raw[1:])


def whole(rest: bytearray) -> Iterator[bytes]:
    """Take whole packets, without their lengths, off the front of framed bytes."""
    while rest and len(rest) > rest[0]:
        end = 1 + rest[0]
        raw = bytes(rest[1:end])
        del rest[:end]
        yield raw


def setpoint(rates: tuple[float, float, float], thrust: int) -> CrtpPacket:
    """Body rates, rad/s, and thrust, 0 (motors stopped) to 65535. The firmware's pitch is opposite to FLU's."""
    p, q, r = (math.degrees(rate) for rate in rates)
    return CrtpPacket(GENERIC_COMMANDER, 0, struct.pack("<BfffHB", MANUAL, p, 0.0 - q, r, thrust, 1))


def landing(descent: float, speed: float) -> CrtpPacket:
    """The request to the high-level commander to land where the vehicle is: `descent` m down, at a mean speed, m/s,
    with the yaw that it has.
    """
    every_group, relative, own_yaw = 0, True, True
    data = struct.pack("<BBf?f?f", LAND, every_group, descent, relative, 0.0, own_yaw, speed)
    return CrtpPacket(HIGH_LEVEL, 0, data)


def set_points_end() -> CrtpPacket:
    """Hand priority over to the high-level commander. Its set-points count until another packet brings one."""
    return CrtpPacket(GENERIC_COMMANDER, 1, struct.pack("<BI", SET_POINTS_END, 0))


def external_pose(position: Sequence[float], quaternion: Sequence[float]) -> CrtpPacket:
    """A pose for the estimator: position, m, and quaternion wxyz."""
    w, x, y, z = quaternion
    return CrtpPacket(LOCALIZATION, 1, struct.pack("<B7f", EXTERNAL_POSE, *position, x, y, z, w))


def arming(arm: bool, protocol: int) -> CrtpPacket:
    """The request to arm or to disarm. Since protocol 12 it has its own port."""
    return CrtpPacket(*((SUPERVISOR, 1) if protocol >= 12 else (PLATFORM, 0)), bytes([1, arm]))
