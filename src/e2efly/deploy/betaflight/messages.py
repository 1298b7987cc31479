"""MSP messages that tell what a controller is and what it does now: payloads to frozen dataclasses in SI units. Pure.

Each `parse` takes the payload of a reply, accepts the longer ones of later firmware, and raises a `ValueError` that
names the message for a shorter one. The layouts are Betaflight's, MSP 1.44 to 1.49; `versions` tells where they
differ.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from math import pi, radians
from typing import Any, ClassVar

from e2efly.deploy.attitude import Attitude
from e2efly.deploy.betaflight.codec import Frame
from e2efly.deploy.betaflight.names import BATTERY_STATES, SENSORS, arming_disabled, bits, named

SET_RAW_RC, EEPROM_WRITE, REBOOT = 200, 250, 68
"""Codes of what is told to the controller."""
CHANNEL_RANGE = (886, 2114)
"""Channels that are sent, µs: inside the pulses of 885 to 2115 that the controller believes unless set otherwise."""
_GYRO_RANGE = 2000.0
MAX_CHANNELS = 18
"""Channels that the controller takes."""


def unpack(name: str, layout: str, payload: bytes) -> tuple[Any, ...]:
    """Read the beginning of a payload, little endian.

    Raises:
        ValueError: naming the message, for a payload that is too short.
    """
    size = struct.calcsize("<" + layout)
    if len(payload) < size:
        raise ValueError(f"MSP {name}: the payload has {len(payload)} bytes; accepted: {size} or more")
    return struct.unpack_from("<" + layout, payload)


def text(payload: bytes) -> str:
    """Bytes up to the first zero as text, with what is no ASCII shown as escapes."""
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
    """Which firmware."""

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
    """Major, minor, patch; years since 2000, month, patch from 2025.12 on."""
    text: str = ""
    """As it writes it, with what marks an early build: 2026.6.0-rc1. Empty up to 4.6."""

    @staticmethod
    def parse(payload: bytes) -> "FcVersion":
        """Read a reply."""
        version, size = unpack("FC_VERSION", "3B", payload), payload[3] if len(payload) > 3 else 0
        return FcVersion(version, text(payload[4 : 4 + size]))


@dataclass(frozen=True)
class BuildInfo:
    """Which build of the firmware."""

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
    """As its owner set it; may be empty."""

    @staticmethod
    def parse(payload: bytes) -> "Name":
        """Read a reply."""
        return Name(text(payload))


@dataclass(frozen=True)
class StatusEx:
    """How the controller is."""

    CODE: ClassVar[int] = 150
    cycle_time: float
    """Period of the PID loop, s."""
    sensors: frozenset[str]
    """Sensors that it has."""
    boxes: int
    """Bit i: the i-th mode of `BoxIds` is active."""
    cpu_load: float
    """0 to 1."""
    pid_profile: int
    """From 0."""
    rate_profile: int
    """From 0."""
    arming_disabled: tuple[str, ...]
    """Why it will not arm, most serious first; empty: it would."""
    reboot_required: bool
    """Settings wait for a reboot."""

    @staticmethod
    def parse(payload: bytes) -> "StatusEx":
        """Read a reply."""
        cycle, _, sensors, low, pid, load, _, rate, extra = unpack("STATUS_EX", "HHHIBHBBB", payload)
        extra &= 15
        layout = f"HHHIBHBBB{extra}sBIB"
        *_, high, count, flags, state = unpack("STATUS_EX", layout, payload)
        boxes = low | int.from_bytes(high, "little") << 32
        disabled = arming_disabled(flags, count)
        return StatusEx(cycle * 1e-6, bits(sensors, SENSORS), boxes, load / 100, pid, rate, disabled, bool(state & 1))

    def active(self, ids: Sequence[int]) -> frozenset[int]:
        """Permanent ids of the active modes, given those of `BoxIds`."""
        return frozenset(box for i, box in enumerate(ids) if self.boxes >> i & 1)


@dataclass(frozen=True)
class RawImu:
    """Accelerometer and gyro, in the body frame FLU."""

    CODE: ClassVar[int] = 102
    acceleration: tuple[int, int, int]
    """Specific force in counts: how many make 1 g depends on the sensor and MSP does not tell."""
    body_rate: tuple[float, float, float]
    """Body rates, rad/s, if the gyro's full range is 2000 deg/s, as Betaflight sets it: MSP carries counts and does not
    tell their scale."""

    @staticmethod
    def parse(payload: bytes) -> "RawImu":
        """Read a reply."""
        ax, ay, az, *gyro = unpack("RAW_IMU", "6h", payload)
        x, y, z = (radians(count * _GYRO_RANGE / 32768) for count in gyro)
        return RawImu((ax, ay, az), (x, y, z))


@dataclass(frozen=True)
class Motor:
    """What the motors are told."""

    CODE: ClassVar[int] = 104
    throttle: tuple[float, ...]
    """Of each motor in use, in the controller's order: 0 stopped (1000 µs) to 1 (2000 µs)."""

    @staticmethod
    def parse(payload: bytes) -> "Motor":
        """Read a reply."""
        return Motor(tuple((pulse - 1000) / 1000 for pulse in unpack("MOTOR", "8H", payload) if pulse))


@dataclass(frozen=True)
class MotorTelemetry:
    """How fast the motors turn."""

    CODE: ClassVar[int] = 139
    speed: tuple[float, ...]
    """Of each motor, in the controller's order, rad/s; 0 also of one that is not measured."""

    @staticmethod
    def parse(payload: bytes) -> "MotorTelemetry":
        """Read a reply."""
        (count,) = unpack("MOTOR_TELEMETRY", "B", payload)
        each = unpack("MOTOR_TELEMETRY", "B" + "I9x" * count, payload)[1:]  # behind the speed: errors, heat, current
        return MotorTelemetry(tuple(turns * 2 * pi / 60 for turns in each))


@dataclass(frozen=True)
class Rc:
    """The channels as the controller takes them."""

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
    """The controller's own estimate of its attitude, in steps of 0.1 deg; its heading in steps of 1 deg."""

    CODE: ClassVar[int] = 108

    @staticmethod
    def parse(payload: bytes) -> "AttitudeReply":
        """Read a reply."""
        roll, pitch, heading = unpack("ATTITUDE", "3h", payload)
        return AttitudeReply(radians(roll / 10), radians(pitch / 10), pi - radians((heading + 180) % 360))


@dataclass(frozen=True)
class Analog:
    """Battery and receiver."""

    CODE: ClassVar[int] = 110
    voltage: float
    """V."""
    current: float
    """A."""
    drawn_mah: float
    """Charge drawn, mA*h."""
    rssi: float
    """Strength of the receiver's signal, 0 to 1."""

    @staticmethod
    def parse(payload: bytes) -> "Analog":
        """Read a reply."""
        _, drawn, rssi, current, voltage = unpack("ANALOG", "BHHhH", payload)
        return Analog(voltage / 100, current / 100, drawn, rssi / 1023)


@dataclass(frozen=True)
class BatteryState:
    """Battery."""

    CODE: ClassVar[int] = 130
    cells: int
    """0: no battery found."""
    capacity_mah: float
    """As set, mA*h; 0: not set."""
    drawn_mah: float
    """Charge drawn, mA*h."""
    current: float
    """A."""
    voltage: float
    """V."""
    state: str
    """One of `BATTERY_STATES`."""

    @staticmethod
    def parse(payload: bytes) -> "BatteryState":
        """Read a reply."""
        cells, capacity, _, drawn, current, state, voltage = unpack("BATTERY_STATE", "BHBHhBH", payload)
        return BatteryState(cells, capacity, drawn, current / 100, voltage / 100, named(state, BATTERY_STATES))


@dataclass(frozen=True)
class Debug:
    """What the controller's `debug_mode` shows."""

    CODE: ClassVar[int] = 254
    values: tuple[int, ...]
    """As the mode defines them."""

    @staticmethod
    def parse(payload: bytes) -> "Debug":
        """Read a reply."""
        return Debug(unpack("DEBUG", "4h", payload))


def set_raw_rc(channels: Sequence[int]) -> Frame:
    """Tell the controller the receiver's channels. It takes those that are left out to be 0, which is no valid pulse.

    Args:
        channels: µs in the receiver's order, which `RxMap` maps: at least 4, at most `MAX_CHANNELS`.

    Raises:
        ValueError: naming the channel, its value and what is accepted.
    """
    if not 4 <= len(channels) <= MAX_CHANNELS:
        raise ValueError(f"MSP SET_RAW_RC: {len(channels)} channels; accepted: 4 to {MAX_CHANNELS}")
    low, high = CHANNEL_RANGE
    for i, value in enumerate(channels):
        if not low <= value <= high or value != int(value):
            raise ValueError(f"MSP SET_RAW_RC: channel {i + 1} is {value!r}; accepted: whole µs, {low} to {high}")
    return Frame(SET_RAW_RC, struct.pack(f"<{len(channels)}H", *map(int, channels)))
