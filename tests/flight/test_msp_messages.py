"""MSP messages: what the real firmware's replies mean, and refusals."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from e2efly.flight.betaflight import messages, mode_slots, settings_messages
from e2efly.flight.betaflight.client import MESSAGES
from e2efly.flight.betaflight.msp_names import BOXES, arming_disabled, bits
from tests.flight.msp_golden import GOLDEN, REPLIES, payload


def golden(kind: type) -> object:
    return kind.parse(payload(REPLIES[1][kind.CODE]))


def test_identity_as_recorded() -> None:
    assert golden(messages.FcVariant) == messages.FcVariant("BTFL")
    assert golden(messages.ApiVersion) == messages.ApiVersion((1, 47))
    assert golden(messages.FcVersion) == messages.FcVersion((4, 6, 0))
    assert golden(messages.Name) == messages.Name("golden one")


def test_settings_as_they_were_made() -> None:
    rx = golden(settings_messages.RxConfig)
    assert (rx.min_check, rx.mid) == (1040, 1500)
    assert rx.smoothing
    assert golden(settings_messages.RxMap).letters == "TAER1234"
    assert golden(settings_messages.FailsafeConfig).delay == pytest.approx(1.2)
    assert mode_slots.mode_ranges(golden(mode_slots.ModeRanges), golden(mode_slots.ModeLogic)) == (
        mode_slots.ModeRange(0, 0, 1700, 2100, 0),
        mode_slots.ModeRange(28, 1, 900, 2100, 1),
    )
    tuning = golden(settings_messages.RcTuning)
    assert tuning.rates == settings_messages.RateProfile("ACTUAL", (7, 7, 7), (67, 67, 67), (0, 0, 0))
    assert (tuning.throttle.mid, tuning.throttle.expo, tuning.throttle.hover) == (50, 0, 50)
    assert golden(settings_messages.MixerConfig) == settings_messages.MixerConfig(3)
    assert golden(settings_messages.MotorConfig) == settings_messages.MotorConfig(4)
    assert "RX_MSP" in golden(settings_messages.FeatureConfig).features
    assert {BOXES[box] for box in golden(mode_slots.BoxIds).ids} >= {"ARM", "ANGLE", "FAILSAFE"}


def test_state_as_recorded() -> None:
    status = golden(messages.StatusEx)
    assert 5e-5 < status.cycle_time < 1e-2
    assert status.active(golden(mode_slots.BoxIds).ids) == frozenset()
    assert golden(messages.Rc).channels[:5] == (1500, 1500, 1500, 1000, 1000)
    assert golden(messages.Motor).throttle == (0.0, 0.0, 0.0, 0.0)
    assert golden(messages.RawImu) == messages.RawImu((0, 0, 256), (0.0, 0.0, 0.0))


def test_body_rates_are_flu_as_the_firmware_senses_them() -> None:
    imu = messages.RawImu.parse(payload(GOLDEN["turning"]["imu"]))
    assert imu.body_rate == pytest.approx(GOLDEN["turning"]["body_rate"], rel=2e-3)


def test_attitude_and_acceleration_are_flu_as_the_firmware_senses_them() -> None:
    tilted = GOLDEN["tilted"]
    attitude = messages.AttitudeReply.parse(payload(tilted["attitude"]))
    assert (attitude.roll, attitude.pitch) == pytest.approx((tilted["roll"], tilted["pitch"]), abs=2e-3)
    assert attitude.yaw == pytest.approx(0.5, abs=0.01)
    roll, pitch = tilted["roll"], tilted["pitch"]
    up = (-math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll))
    force = messages.RawImu.parse(payload(tilted["imu"])).acceleration
    assert [count / 256 for count in force] == pytest.approx(up, abs=0.01)


def test_the_speeds_of_the_motors_are_radians_a_second() -> None:
    each = struct.pack("<IHBHHH", 12000, 35, 41, 1480, 320, 17)
    told = messages.MotorTelemetry.parse(bytes([4]) + 3 * each + struct.pack("<IHBHHH", 0, 10000, 0, 0, 0, 0))
    assert told.speed == pytest.approx((400 * math.pi, 400 * math.pi, 400 * math.pi, 0.0))
    with pytest.raises(ValueError, match="MSP MOTOR_TELEMETRY: the payload has 14 bytes; accepted: 27 or more"):
        messages.MotorTelemetry.parse(bytes([2]) + each)


@pytest.mark.parametrize(("dshot", "sensor", "tells"), [(0, 0, False), (1, 0, True), (0, 1, True)])
def test_a_controller_says_whether_it_measures_speeds(dshot: int, sensor: int, tells: bool) -> None:
    said = struct.pack("<3H4B", 0, 2000, 1000, 4, 14, dshot, sensor)
    assert settings_messages.MotorConfig.parse(said).tells_speed is tells
    assert not settings_messages.MotorConfig.parse(said[:7]).tells_speed  # MSP before 1.42


@pytest.mark.parametrize(("heading", "yaw"), [(0, 0.0), (90, -math.pi / 2), (180, math.pi), (350, math.radians(10))])
def test_yaw_is_positive_to_the_left(heading: int, yaw: float) -> None:
    assert messages.AttitudeReply.parse(struct.pack("<3h", 0, 0, heading)).yaw == pytest.approx(yaw)


def test_status_with_modes_beyond_32_and_the_older_last_flag() -> None:
    head = struct.pack("<HHHIBHBB", 250, 0, 33, 1 << 1, 0, 37, 4, 2)
    status = messages.StatusEx.parse(head + b"\x02\x05\x80" + struct.pack("<BIB", 26, 1 << 25 | 1 << 7, 1))
    assert status.boxes == 1 << 1 | 0x8005 << 32
    assert status.active([9] * 32 + [50, 27, 3]) == {9, 50, 3}
    assert status.arming_disabled == ("THROTTLE", "ARM_SWITCH")
    assert (status.cpu_load, status.rate_profile) == (0.37, 2)


def test_arming_flags_of_newer_firmware() -> None:
    assert arming_disabled(1 << 28 | 1 << 25, 29) == ("FLIP_SWITCH", "ARM_SWITCH")
    assert arming_disabled(1 << 29 | 1 << 30, 31) == ("BIT29", "ARM_SWITCH")
    assert bits(1 << 14 | 1 << 31, {14: "RX_MSP"}) == {"RX_MSP", "BIT31"}


def test_battery_units() -> None:
    battery = messages.BatteryState.parse(struct.pack("<BHBHhBH", 4, 1500, 158, 321, -250, 1, 1583))
    assert battery == messages.BatteryState(4, -2.5, 15.83)


def test_rates_of_firmware_older_than_the_hover_throttle() -> None:
    tuning = settings_messages.RcTuning.parse(payload(REPLIES[1][111])[:23])
    assert tuning.throttle.hover is None


@pytest.mark.parametrize("code", [code for code in MESSAGES if code not in (10, 34, 77, 119)])
def test_a_short_payload_is_refused_by_name_and_a_longer_one_accepted(code: int) -> None:
    kind, data = MESSAGES[code], payload(REPLIES[1][code])
    with pytest.raises(ValueError, match=r"MSP [A-Z_]+: the payload has \d+ bytes; accepted: \d+ or more"):
        kind.parse(data[:1])
    if code != 105:
        assert kind.parse(data + b"\0\0\0") == kind.parse(data)


@given(st.sampled_from(list(MESSAGES.values())), st.binary(max_size=200))
def test_any_payload_parses_or_is_refused(kind: type, data: bytes) -> None:
    try:
        kind.parse(data)
    except ValueError as error:
        assert len(str(error)) > 10


def test_what_stands_between_throttle_and_motors() -> None:
    assert golden(settings_messages.PidAdvanced) == settings_messages.PidAdvanced(80, 5, 100, 0, 0)
    payload = bytearray(57)
    payload[21], payload[22], payload[30], payload[47], payload[55], payload[56] = 6, 1, 1, 2, 3, 4
    assert settings_messages.PidAdvanced.parse(bytes(payload)) == settings_messages.PidAdvanced(262, 1, 2, 3, 4)


def test_the_rate_loop_and_the_idle_of_the_motors_are_the_firmwares_defaults() -> None:
    assert golden(settings_messages.PidGains).pid == ((45, 80, 30), (47, 84, 34), (45, 80, 0))
    assert golden(settings_messages.AdvancedConfig).motor_idle == 0.055


def test_a_map_that_is_no_permutation_is_refused() -> None:
    with pytest.raises(ValueError, match=r"RX_MAP: the map is \[0, 0"):
        settings_messages.RxMap.parse(bytes([0, 0, 1, 2, 3, 4, 5, 6]))


def test_set_raw_rc() -> None:
    assert messages.set_raw_rc([1000, 1500, 1501, 2000]).payload == struct.pack("<4H", 1000, 1500, 1501, 2000)
    for channels, words in [([1500] * 3, "3 channels"), ([1500] * 19, "19 channels")]:
        with pytest.raises(ValueError, match=words):
            messages.set_raw_rc(channels)
    for value in (885, 2115, 0, math.nan, 1500.5):
        with pytest.raises(ValueError, match="channel 2 is"):
            messages.set_raw_rc([1500, value, 1500, 1500])
