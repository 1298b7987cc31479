"""MSP messages about the identity and the state of a controller. Payloads become frozen dataclasses in SI units.

Each `parse` takes the payload of a reply. It accepts a longer payload, as later firmware sends it. For a shorter one,
it raises a `ValueError` that names the message. The layouts are those of Betaflight, MSP 1.44 to 1.49; `versions` lists
their differences. All functions are pure.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, radians
from typing import Any, ClassVar

from e2efly.flight.attitude import Attitude
from e2efly.flight.betaflight.codec import MspFrame
from e2efly.flight.betaflight.msp_names import arming_disabled

SET_RAW_RC = 200
"""Codes of the messages that tell the controller to do something."""
CHANNEL_RANGE = (886, 2114)
"""The range of the channels that are sent, µs. It is inside the default range of valid pulses, 885 to 2115."""
_GYRO_RANGE = 2000.0
MAX_CHANNELS = 18
"""The largest number of channels that the controller accepts."""


def unpack(name: str, layout: str, payload: bytes) -> tuple[Any, ...]:
    """Read the beginning of a payload, little endian.

    Raises:
        ValueError: the payload is too short. The message of the error names the MSP message.
    """
    size = struct.calcsize("<" + layout)
    if len(payload) < size:
        raise ValueError(f"MSP {name}: the payload has {len(payload)} bytes; accepted: {size} or more")
    return struct.unpack_from("<" + layout, payload)


def text(payload: bytes) -> str:
    """The bytes up to the first zero as text. Bytes that are not ASCII become escape sequences."""
    return payload.split(b"\0")[0].decode("ascii", "backslashreplace")


@dataclass(frozen=True)
class ApiVersion:
    """MSP version."""

    CODE: ClassVar[int] = 1
    version: tuple[int, int]
    """Major and minor."""

    @staticmethod
    def parse(payload: bytes) -> "ApiVersion":
        """Read a reply."""
        _, major, minor = unpack("API_VERSION", "3B", payload)
        return ApiVersion((major, minor))


@dataclass(frozen=True)
class FcVariant:
    """The firmware."""

    CODE: ClassVar[int] = 2
    variant: str
    """`BTFL` is Betaflight."""

    @staticmethod
    def parse(payload: bytes) -> "FcVariant":
        """Read a reply."""
        return FcVariant(text(unpack("FC_VARIANT", "4s", payload)[0]))


@dataclass(frozen=True)
class FcVersion:
    """Version of the firmware."""

    CODE: ClassVar[int] = 3
    version: tuple[int, int, int]
    """Major, minor and patch. From 2025.12 on: years since 2000, month and patch."""
    text: str = ""
    """The version as the firmware writes it, with the mark of an early build: 2026.6.0-rc1. Empty up to 4.6."""

    @staticmethod
    def parse(payload: bytes) -> "FcVersion":
        """Read a reply."""
        version, size = unpack("FC_VERSION", "3B", payload), payload[3] if len(payload) > 3 else 0
        return FcVersion(version, text(payload[4 : 4 + size]))


@dataclass(frozen=True)
class BuildInfo:
    """The build of the firmware."""

    CODE: ClassVar[int] = 5
    built: str
    """Day and time."""
    revision: str
    """Short git revision."""

    @staticmethod
    def parse(payload: bytes) -> "BuildInfo":
        """Read a reply."""
        day, time, revision = unpack("BUILD_INFO", "11s8s7s", payload)
        return BuildInfo(f"{text(day)} {text(time)}", text(revision))


@dataclass(frozen=True)
class Name:
    """Name of the craft."""

    CODE: ClassVar[int] = 10
    name: str
    """The name that its owner set. May be empty."""

    @staticmethod
    def parse(payload: bytes) -> "Name":
        """Read a reply."""
        return Name(text(payload))


@dataclass(frozen=True)
class StatusEx:
    """The state of the controller."""

    CODE: ClassVar[int] = 150
    cycle_time: float
    """Period of the PID loop, s."""
    boxes: int
    """Bit i: the i-th mode of `BoxIds` is active."""
    cpu_load: float
    """Load of the processor, 0 to 1."""
    rate_profile: int
    """Index of the active rate profile, from 0."""
    arming_disabled: tuple[str, ...]
    """Why it cannot be armed, the most serious reason first. Empty: it can."""

    @staticmethod
    def parse(payload: bytes) -> "StatusEx":
        """Read a reply."""
        cycle, _, _, low, _, load, _, rate, extra = unpack("STATUS_EX", "HHHIBHBBB", payload)
        extra &= 15
        layout = f"HHHIBHBBB{extra}sBIB"
        *_, high, count, flags, _ = unpack("STATUS_EX", layout, payload)
        boxes = low | int.from_bytes(high, "little") << 32
        return StatusEx(cycle * 1e-6, boxes, load / 100, rate, arming_disabled(flags, count))

    def active(self, ids: Sequence[int]) -> frozenset[int]:
        """Permanent ids of the active modes, given those of `BoxIds`."""
        return frozenset(box for i, box in enumerate(ids) if self.boxes >> i & 1)


@dataclass(frozen=True)
class RawImu:
    """Accelerometer and gyro, in the body frame FLU."""

    CODE: ClassVar[int] = 102
    acceleration: tuple[int, int, int]
    """Specific force in counts. The number of counts for 1 g depends on the sensor, and MSP does not report it."""
    body_rate: tuple[float, float, float]
    """Body rates, rad/s. MSP carries counts and does not report their scale. The scale assumes that the gyro's full
    range is 2000 deg/s, as Betaflight sets it."""

    @staticmethod
    def parse(payload: bytes) -> "RawImu":
        """Read a reply."""
        ax, ay, az, *gyro = unpack("RAW_IMU", "6h", payload)
        x, y, z = (radians(count * _GYRO_RANGE / 32768) for count in gyro)
        return RawImu((ax, ay, az), (x, y, z))


@dataclass(frozen=True)
class Motor:
    """The commands to the motors."""

    CODE: ClassVar[int] = 104
    throttle: tuple[float, ...]
    """Throttle of each motor in use, in the controller's order: 0 is stopped (1000 µs), 1 is full (2000 µs)."""

    @staticmethod
    def parse(payload: bytes) -> "Motor":
        """Read a reply."""
        return Motor(tuple((pulse - 1000) / 1000 for pulse in unpack("MOTOR", "8H", payload) if pulse))


@dataclass(frozen=True)
class MotorTelemetry:
    """How fast the motors turn."""

    CODE: ClassVar[int] = 139
    speed: tuple[float, ...]
    """Speed of each motor, in the controller's order, rad/s. It is also 0 for a motor that is not measured."""

    @staticmethod
    def parse(payload: bytes) -> "MotorTelemetry":
        """Read a reply."""
        (count,) = unpack("MOTOR_TELEMETRY", "B", payload)
        each = unpack("MOTOR_TELEMETRY", "B" + "I9x" * count, payload)[1:]  # after the speed: errors, heat, current
        return MotorTelemetry(tuple(turns * 2 * pi / 60 for turns in each))


@dataclass(frozen=True)
class Rc:
    """The channels as the controller uses them."""

    CODE: ClassVar[int] = 105
    channels: tuple[int, ...]
    """µs: roll, pitch, yaw, throttle, AUX1, ..., whatever the receiver's order."""

    @staticmethod
    def parse(payload: bytes) -> "Rc":
        """Read a reply."""
        unpack("RC", "4H", payload)
        return Rc(struct.unpack_from(f"<{len(payload) // 2}H", payload))


@dataclass(frozen=True)
class AttitudeReply(Attitude):
    """The controller's own estimate of its attitude. Its resolution is 0.1 deg, and 1 deg for the heading."""

    CODE: ClassVar[int] = 108

    @staticmethod
    def parse(payload: bytes) -> "AttitudeReply":
        """Read a reply."""
        roll, pitch, heading = unpack("ATTITUDE", "3h", payload)
        return AttitudeReply(radians(roll / 10), radians(pitch / 10), pi - radians((heading + 180) % 360))


@dataclass(frozen=True)
class BatteryState:
    """Battery."""

    CODE: ClassVar[int] = 130
    cells: int
    """Number of cells. 0: no battery found."""
    current: float
    """A."""
    voltage: float
    """V."""

    @staticmethod
    def parse(payload: bytes) -> "BatteryState":
        """Read a reply."""
        cells, *_, current, _, voltage = unpack("BATTERY_STATE", "BHBHhBH", payload)
        return BatteryState(cells, current / 100, voltage / 100)


def set_raw_rc(channels: Sequence[int]) -> MspFrame:
    """The frame that sends the receiver's channels to the controller.

    Channels are in µs, in the receiver's order, which `RxMap` maps: at least 4, at most `MAX_CHANNELS`. The controller
    sets channels that are left out to 0, which is not a valid pulse.

    Raises:
        ValueError: a channel, or the number of channels, is not valid. The message names it and what is accepted.
    """
    if not 4 <= len(channels) <= MAX_CHANNELS:
        raise ValueError(f"MSP SET_RAW_RC: {len(channels)} channels; accepted: 4 to {MAX_CHANNELS}")
    low, high = CHANNEL_RANGE
    for i, value in enumerate(channels):
        if not low <= value <= high or value != int(value):
            raise ValueError(f"MSP SET_RAW_RC: channel {i + 1} is {value!r}; accepted: whole µs, {low} to {high}")
    return MspFrame(SET_RAW_RC, struct.pack(f"<{len(channels)}H", *map(int, channels)))
