"""MSP messages about the settings of a controller. Payloads become frozen dataclasses in SI units.

Pure functions; see `messages`.
"""

import struct
from dataclasses import dataclass
from math import radians
from typing import ClassVar

from e2efly.flight.betaflight.messages import unpack
from e2efly.flight.betaflight.msp_names import (
    FAILSAFE_PROCEDURES,
    FAILSAFE_SWITCHES,
    FEATURES,
    RXFAIL_MODES,
    bits,
    named,
)
from e2efly.flight.betaflight.rates import RATES_TYPES, RateProfile
from e2efly.flight.betaflight.throttle_curve import LIMIT_TYPES, ThrottleCurve

FUNCTIONS = "AERT1234"
"""Letters of the functions of the eight mapped channels, in the controller's order: roll (A), pitch (E), yaw (R),
throttle (T), AUX1 to AUX4."""


@dataclass(frozen=True)
class FeatureConfig:
    """Features that are on."""

    CODE: ClassVar[int] = 36
    features: frozenset[str]
    """Their names."""

    @staticmethod
    def parse(payload: bytes) -> "FeatureConfig":
        """Read a reply."""
        return FeatureConfig(bits(unpack("FEATURE_CONFIG", "I", payload)[0], FEATURES))


@dataclass(frozen=True)
class BoardAlignment:
    """How the board is rotated in the airframe."""

    CODE: ClassVar[int] = 38
    angles: tuple[float, float, float]
    """`align_board_roll`, `_pitch`, `_yaw`, rad, in Betaflight's signs."""

    @staticmethod
    def parse(payload: bytes) -> "BoardAlignment":
        """Read a reply."""
        roll, pitch, yaw = map(radians, unpack("BOARD_ALIGNMENT_CONFIG", "3h", payload))
        return BoardAlignment((roll, pitch, yaw))


@dataclass(frozen=True)
class MixerConfig:
    """Kind of vehicle."""

    CODE: ClassVar[int] = 42
    mixer: int
    """`QUADX` for a quadrotor in X."""

    @staticmethod
    def parse(payload: bytes) -> "MixerConfig":
        """Read a reply."""
        return MixerConfig(unpack("MIXER_CONFIG", "BB", payload)[0])


@dataclass(frozen=True)
class RxConfig:
    """How the receiver's channels are read."""

    CODE: ClassVar[int] = 44
    min_check: int
    """A stick below this is low, µs."""
    mid: int
    """Centre of the sticks, µs."""
    smoothing: bool
    """RC smoothing is on: a low-pass filter acts on the sticks before they become rates."""

    @staticmethod
    def parse(payload: bytes) -> "RxConfig":
        """Read a reply."""
        mid, low, smoothing = unpack("RX_CONFIG", "3xHH24xB", payload)
        return RxConfig(low, mid, bool(smoothing))


@dataclass(frozen=True)
class RxMap:
    """The functions of the receiver's channels."""

    CODE: ClassVar[int] = 64
    channel: tuple[int, ...]
    """(8,) the index of the receiver's channel for roll, pitch, yaw, throttle, AUX1 to AUX4."""

    @staticmethod
    def parse(payload: bytes) -> "RxMap":
        """Read a reply."""
        channel = unpack("RX_MAP", "8B", payload)
        if sorted(channel) != list(range(8)):
            raise ValueError(f"MSP RX_MAP: the map is {list(channel)}; accepted: each of 0 to 7 once")
        return RxMap(channel)

    @property
    def letters(self) -> str:
        """The map in the form of the command line. `AETR1234`: roll comes first, then pitch, throttle and yaw."""
        return "".join(FUNCTIONS[self.channel.index(i)] for i in range(len(FUNCTIONS)))


@dataclass(frozen=True)
class FailsafeConfig:
    """What the controller does when the receiver's signal is lost."""

    CODE: ClassVar[int] = 75
    delay: float
    """How long the controller waits before stage 2, s."""
    throttle: int
    """Throttle channel during the failsafe landing, µs."""
    switch: str
    """What the failsafe switch does: one of `FAILSAFE_SWITCHES`."""
    procedure: str
    """What stage 2 does: one of `FAILSAFE_PROCEDURES`."""

    @staticmethod
    def parse(payload: bytes) -> "FailsafeConfig":
        """Read a reply."""
        # the second byte is the duration of the landing, in units of 0.1 s or 1 s, depending on the firmware
        delay, _, throttle, switch, _, procedure = unpack("FAILSAFE_CONFIG", "BBHBHB", payload)
        names = named(switch, FAILSAFE_SWITCHES), named(procedure, FAILSAFE_PROCEDURES)
        return FailsafeConfig(delay / 10, throttle, *names)


@dataclass(frozen=True)
class RxFailConfig:
    """What each channel becomes when the receiver's signal is lost."""

    CODE: ClassVar[int] = 77
    channels: tuple[tuple[str, int], ...]
    """For roll, pitch, yaw, throttle, AUX1, ...: one of `RXFAIL_MODES`, and the pulse for SET, µs."""

    @staticmethod
    def parse(payload: bytes) -> "RxFailConfig":
        """Read a reply."""
        entries = struct.iter_unpack("<BH", payload[: len(payload) // 3 * 3])
        return RxFailConfig(tuple((named(mode, RXFAIL_MODES), pulse) for mode, pulse in entries))


@dataclass(frozen=True)
class PidGains:
    """Gains of the rate loop in the active PID profile."""

    CODE: ClassVar[int] = 112
    pid: tuple[tuple[int, int, int], ...]
    """P, I, D of roll, pitch and yaw."""

    @staticmethod
    def parse(payload: bytes) -> "PidGains":
        """Read a reply."""
        v = unpack("PID", "9B", payload)
        return PidGains(((v[0], v[1], v[2]), (v[3], v[4], v[5]), (v[6], v[7], v[8])))


@dataclass(frozen=True)
class AdvancedConfig:
    """How the motors are driven."""

    CODE: ClassVar[int] = 90
    motor_idle: float
    """Output of an idling motor, 0 to 1: `motor_idle`, before MSP 1.47 `dshot_idle_value`."""

    @staticmethod
    def parse(payload: bytes) -> "AdvancedConfig":
        """Read a reply."""
        return AdvancedConfig(unpack("ADVANCED_CONFIG", "6xH", payload)[0] / 10_000)


@dataclass(frozen=True)
class PidAdvanced:
    """Settings of the active PID profile that act between throttle and motors."""

    CODE: ClassVar[int] = 94
    anti_gravity_gain: int
    """How much the gains of the rate loop grow while the throttle moves. 0: not at all."""
    throttle_boost: int
    """How much a fast change of the throttle is amplified. 0: not at all."""
    motor_output_limit: int
    """Largest motor output, %."""
    vbat_sag_compensation: int
    """The share of the battery's sag for which the controller compensates, %."""
    thrust_linear: int
    """How much the controller linearizes the thrust, which grows with the square of the motor outputs, %."""

    @staticmethod
    def parse(payload: bytes) -> "PidAdvanced":
        """Read a reply."""
        return PidAdvanced(*unpack("PID_ADVANCED", "21xH7xB16xB7xBB", payload))


@dataclass(frozen=True)
class RcTuning:
    """Rates and throttle curve."""

    CODE: ClassVar[int] = 111
    rates: RateProfile
    """The rate profile, from stick to body rate."""
    throttle: ThrottleCurve
    """The throttle curve, from throttle channel to throttle. Its `min_check` must be taken from `RxConfig`."""

    @staticmethod
    def parse(payload: bytes) -> "RcTuning":
        """Read a reply."""
        v = unpack("RC_TUNING", "8BxxBBBBBB3HB", payload)
        rc_roll, expo_roll, *rate, _, mid, expo = v[:8]
        expo_yaw, rc_yaw, rc_pitch, expo_pitch, limit_type, limit, *rate_limit, kind = v[8:]
        hover = payload[23] if len(payload) > 23 else None  # since MSP 1.47, which also has another curve
        rates = RateProfile(
            named(kind, RATES_TYPES),
            (rc_roll, rc_pitch, rc_yaw),
            (rate[0], rate[1], rate[2]),
            (expo_roll, expo_pitch, expo_yaw),
            (rate_limit[0], rate_limit[1], rate_limit[2]),
        )
        return RcTuning(rates, ThrottleCurve(mid, expo, hover, named(limit_type, LIMIT_TYPES), limit))


@dataclass(frozen=True)
class RcDeadband:
    """Deadbands of the sticks."""

    CODE: ClassVar[int] = 125
    deadband: int
    """Deadband of roll and pitch on each side of the centre, µs."""
    yaw_deadband: int
    """Deadband of yaw on each side of the centre, µs."""

    @staticmethod
    def parse(payload: bytes) -> "RcDeadband":
        """Read a reply."""
        return RcDeadband(*unpack("RC_DEADBAND", "BB", payload))


@dataclass(frozen=True)
class MotorConfig:
    """Motor outputs."""

    CODE: ClassVar[int] = 131
    count: int
    """Number of motors."""
    tells_speed: bool = False
    """Whether bidirectional DShot or an ESC sensor measures motor speeds. `MotorTelemetry` then reports them."""

    @staticmethod
    def parse(payload: bytes) -> "MotorConfig":
        """Read a reply."""
        (count,) = unpack("MOTOR_CONFIG", "6xB", payload)
        _, dshot, sensor = (*payload[7:10], 0, 0, 0)[:3]  # number of poles, and two flags since MSP 1.42
        return MotorConfig(count, bool(dshot or sensor))
