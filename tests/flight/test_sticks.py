"""Commands to receiver channels and back, with the settings of a recorded controller."""

import math
from collections.abc import Sequence
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from e2efly.flight.betaflight import settings_messages
from e2efly.flight.betaflight.client import Client
from e2efly.flight.betaflight.controller import ControllerInfo, identify
from e2efly.flight.betaflight.rates import RateProfile
from e2efly.flight.betaflight.settings_messages import RcTuning
from e2efly.flight.betaflight.sticks import Sticks, sticks_of
from e2efly.flight.betaflight.throttle_curve import ThrottleCurve
from tests.flight.msp_golden import GOLDEN, payload
from tests.flight.test_msp_client import Wire
from tests.flight.test_msp_client import recorded as reply_of

LINEAR = RateProfile("ACTUAL", (67, 67, 67), (67, 67, 67), (0, 0, 0))
AETR = (0, 1, 3, 2, 4, 5, 6, 7)
STICKS = Sticks(LINEAR, ThrottleCurve(hover=50, min_check=1050), AETR)
TOP = math.radians(670)


class Answering(Wire):
    """A link whose other end is the recorded controller."""

    def send(self, data: bytes) -> None:
        self.inbox += b"".join(reply_of(frame.code) for frame in self.decoder.feed(data))


def recorded() -> ControllerInfo:
    return identify(Client(Answering()))


def received(sticks: Sticks, channels: Sequence[int]) -> tuple[int, ...]:
    """What `messages.Rc` reports if the controller has received these channels and the map is right, µs."""
    return (*(channels[index] for index in sticks.channel), *channels[8:])


def command_of(sticks: Sticks, channels: Sequence[int]) -> tuple[float, tuple[float, ...]]:
    """The throttle, 0 to 1, and the body rates, FLU, rad/s, that channels in the receiver's order command."""
    *pulses, throttle = (channels[index] for index in sticks.channel[:4])
    return sticks.throttle.throttle_of(throttle), tuple(sticks._rate(axis, pulse) for axis, pulse in enumerate(pulses))


def test_signs_order_and_scale() -> None:
    command = STICKS.channels_of(0.5, (TOP / 2, TOP / 4, TOP / 5), (2000, 1000))
    assert command.channels == (1750, 1625, 1525, 1400, 2000, 1000, 1500, 1500)  # yaw to the left: stick below centre
    assert command.saturated == ()


def test_at_rest() -> None:
    assert STICKS.channels_of(0.0, (0.0, 0.0, 0.0), (1000,) * 4).channels == (1500, 1500, 1000, 1500, *(1000,) * 4)


def test_a_map_of_another_order() -> None:
    mapped = replace(STICKS, channel=(1, 2, 3, 0, 7, 6, 5, 4))  # TAER, AUX reversed
    channels = mapped.channels_of(0.5, (TOP / 2, TOP / 4, TOP / 5), (1100, 1200, 1300, 1400, 1550, 1600)).channels
    assert channels == (1525, 1750, 1625, 1400, 1400, 1300, 1200, 1100, 1550, 1600)
    assert received(mapped, channels) == (1750, 1625, 1400, 1525, 1100, 1200, 1300, 1400, 1550, 1600)
    throttle, rates = command_of(mapped, channels)
    assert throttle == 0.5
    assert rates == pytest.approx((TOP / 2, TOP / 4, TOP / 5))


def test_saturation_is_reported_by_name_and_stays_in_range() -> None:
    command = STICKS.channels_of(1.2, (2 * TOP, -2 * TOP, 2 * TOP), ())
    assert command.channels[:4] == (2000, 1000, 2000, 1000)
    assert command.saturated == ("throttle", "roll", "pitch", "yaw")
    assert STICKS.channels_of(-0.1, (0, 0, 0), ()).saturated == ("throttle",)
    scaled = replace(STICKS, throttle=ThrottleCurve(hover=50, limit_type="SCALE", limit=80))
    assert scaled.channels_of(0.81, (0, 0, 0), ()).saturated == ("throttle",)
    off_centre = replace(STICKS, centre=1520)
    command = off_centre.channels_of(0.0, (TOP, -TOP, 0.0), ())
    assert command.channels[:2] == (2000, 1020)
    assert command.saturated == ("roll",)
    limited = replace(off_centre, rates=replace(LINEAR, rate_limit=(600, 600, 600)))
    assert limited.channels_of(0.0, (math.radians(600), 0.0, 0.0), ()).saturated == ()  # 2000 µs is enough for it


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_is_refused(bad: float) -> None:
    for i in range(4):
        values = [0.1] * 4
        values[i] = bad
        with pytest.raises(ValueError, match="four finite numbers"):
            STICKS.channels_of(values[0], values[1:], ())


@pytest.mark.parametrize("bad", [999, 2001, 1500.5, math.nan])
def test_an_aux_channel_out_of_range_is_refused_by_name(bad: float) -> None:
    with pytest.raises(ValueError, match="AUX2 is"):
        STICKS.channels_of(0.0, (0, 0, 0), (1500, bad))


tunings = [
    (RcTuning.parse(payload(curve["rc_tuning"])), (curve["deadband"][0], *curve["deadband"]))
    for curve in GOLDEN["curves"]
]


@given(
    st.sampled_from(tunings), st.permutations(range(8)), st.floats(0, 1),
    st.tuples(*[st.floats(-1, 1)] * 3), st.integers(1480, 1520),
)  # fmt: skip
def test_there_and_back_within_one_step_of_the_channel(
    tuning: tuple[RcTuning, tuple[int, int, int]], order: list[int], throttle: float,
    share: tuple[float, float, float], centre: int,
) -> None:  # fmt: skip
    bands = (tuning[1][0], tuning[1][0], tuning[1][2])
    sticks = Sticks(tuning[0].rates, tuning[0].throttle, tuple(order), centre, bands)
    wanted = [part * rate for part, rate in zip(share, sticks.rates.max_rate, strict=True)]
    command = sticks.channels_of(throttle, wanted, ())
    assert all(1000 <= channel <= 2000 for channel in command.channels)
    back, rates = command_of(sticks, command.channels)
    again = sticks.channels_of(back, rates, ())
    if not command.saturated:
        assert command_of(sticks, again.channels) == (back, pytest.approx(rates))
    for axis, name in enumerate(("roll", "pitch", "yaw")):
        if name in command.saturated:
            continue
        index = sticks.channel[axis]
        near = [list(command.channels) for _ in range(2)]
        near[0][index] -= 1 + 2 * bands[axis]
        near[1][index] += 1 + 2 * bands[axis]
        ends = sorted(command_of(sticks, channels)[1][axis] for channels in near)
        assert ends[0] - 1e-9 <= wanted[axis] <= ends[1] + 1e-9


def test_the_real_firmware_gets_the_rates_that_are_asked_for() -> None:
    for curve in GOLDEN["curves"]:
        tuning = RcTuning.parse(payload(curve["rc_tuning"]))
        band, yaw = curve["deadband"]
        throttle = replace(tuning.throttle, min_check=1040)
        sticks = Sticks(tuning.rates, throttle, (1, 2, 3, 0, 4, 5, 6, 7), 1500, (band, band, yaw))
        for channels, (roll, pitch, yaw_rate, shown) in curve["rows"]:
            thrust, rates = command_of(sticks, channels)
            assert [math.degrees(rate) for rate in rates] == pytest.approx((roll, pitch, yaw_rate), abs=0.51)
            assert thrust * 1000 == shown
            sent = sticks.channels_of(thrust, rates, (1000,) * 4).channels
            assert command_of(sticks, sent) == pytest.approx((thrust, pytest.approx(rates)))


def test_sticks_of_a_recorded_controller() -> None:
    info = recorded()
    sticks = sticks_of(info)
    assert sticks.channel == (1, 2, 3, 0, 4, 5, 6, 7)
    assert sticks.throttle.min_check == 1040
    assert (sticks.centre, sticks.deadband) == (1500, (0, 0, 0))
    with pytest.raises(ValueError, match="feature 3D is on"):
        sticks_of(replace(info, features=frozenset({"3D"})))
    banded = sticks_of(replace(info, deadband=settings_messages.RcDeadband(5, 9)))
    assert banded.deadband == (5, 5, 9)
