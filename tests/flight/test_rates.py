"""Rate curves and throttle curve: the real firmware's, published values, and exact inverses."""

import itertools
import math
from dataclasses import replace

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from e2efly.flight.betaflight.rates import (
    RATES_TYPES,
    RateProfile,
    channel_to_stick,
    rate_to_stick,
    stick_to_channel,
    stick_to_rate,
)
from e2efly.flight.betaflight.settings_messages import RcTuning
from e2efly.flight.betaflight.throttle_curve import ThrottleCurve
from tests.flight.msp_golden import GOLDEN, payload

MIN_CHECK = 1040


def profile(kind: str, rc_rate: int, rate: int, expo: int = 0, limit: int = 1998, quick: bool = False) -> RateProfile:
    return RateProfile(kind, (rc_rate,) * 3, (rate,) * 3, (expo,) * 3, (limit,) * 3, quick)


def degrees(p: RateProfile, stick: float) -> float:
    return math.degrees(stick_to_rate(p, 0, stick))


@pytest.mark.parametrize("i", range(len(GOLDEN["curves"])))
def test_rates_and_throttle_are_the_real_firmwares(i: int) -> None:
    curve = GOLDEN["curves"][i]
    tuning = RcTuning.parse(payload(curve["rc_tuning"]))
    throttle = replace(tuning.throttle, min_check=MIN_CHECK)
    roll_pitch, yaw = curve["deadband"]
    for channels, shown in curve["rows"]:
        for axis, (band, sign) in enumerate(((roll_pitch, 1), (roll_pitch, 1), (yaw, -1))):
            stick = sign * channel_to_stick(channels[1 + axis], 1500, band)
            assert math.degrees(stick_to_rate(tuning.rates, axis, stick)) == pytest.approx(shown[axis], abs=0.51)
        assert throttle.throttle_of(channels[0]) * 1000 == shown[3]


def test_recorded_curves_cover_every_type_and_a_deadband() -> None:
    kinds = {RcTuning.parse(payload(curve["rc_tuning"])).rates.rates_type for curve in GOLDEN["curves"]}
    assert kinds == set(RATES_TYPES)
    assert any(any(curve["deadband"]) for curve in GOLDEN["curves"])


@pytest.mark.parametrize(
    ("p", "half", "full"),
    [
        (profile("ACTUAL", 7, 67), 185.0, 670.0),  # 70 x + 600 x^2
        (profile("ACTUAL", 67, 67), 335.0, 670.0),  # linear
        (profile("ACTUAL", 80, 10), 400.0, 800.0),  # a full rate below the centre's counts for nothing
        (profile("BETAFLIGHT", 100, 70), 153.846, 666.667),
        (profile("BETAFLIGHT", 250, 0), 977.0, 1954.0),  # 200 (2.5 + 14.54 * 0.5)
        (profile("KISS", 100, 70), 153.846, 666.667),
        (profile("QUICK", 100, 67), 154.023, 670.0),  # 200 x / (1 - x (1 - 200/670))
        (profile("QUICK", 100, 67, 50), 128.076, 670.0),
        (profile("QUICK", 100, 67, 50, quick=True), 96.264, 670.0),
        (profile("RACEFLIGHT", 37, 80), 259.0, 666.0),  # 370 x (1 + 0.8 x)
        (profile("ACTUAL", 7, 67, limit=300), 185.0, 300.0),
    ],
)
def test_values_computed_by_hand(p: RateProfile, half: float, full: float) -> None:
    assert degrees(p, 0.5) == pytest.approx(half, abs=1e-2)
    assert degrees(p, -1.0) == pytest.approx(-full, abs=1e-2)
    assert math.degrees(p.max_rate[1]) == pytest.approx(full, abs=1e-2)


profiles = st.builds(
    profile, st.sampled_from(RATES_TYPES), st.integers(1, 255), st.integers(0, 255), st.integers(0, 100),
    st.integers(200, 1998), st.booleans(),
)  # fmt: skip


@settings(max_examples=500)
@given(profiles, st.integers(0, 2), st.floats(-1, 1))
@example(profile("BETAFLIGHT", 241, 0, 22, 200), 0, 3.1e-225)  # Newton's step falls out of the bracket by rounding
def test_the_inverse_is_exact(p: RateProfile, axis: int, stick: float) -> None:
    rate = stick_to_rate(p, axis, stick)
    found = rate_to_stick(p, axis, rate)
    assert stick_to_rate(p, axis, found) == pytest.approx(rate, rel=1e-9, abs=1e-9)
    if 1e-9 < abs(rate) < p.max_rate[axis] * (1 - 1e-9):
        assert found == pytest.approx(stick, abs=1e-9)


@given(profiles, st.lists(st.floats(0, 1), min_size=2, max_size=20))
def test_curves_rise_and_are_odd(p: RateProfile, sticks: list[float]) -> None:
    rates = [stick_to_rate(p, 0, stick) for stick in sorted(sticks)]
    assert all(b >= a - 1e-12 * abs(a) for a, b in itertools.pairwise(rates))
    assert [stick_to_rate(p, 0, -stick) for stick in sorted(sticks)] == [-rate for rate in rates]


@given(profiles, st.floats(1.0, 100.0))
def test_beyond_the_largest_rate_the_stick_is_full(p: RateProfile, factor: float) -> None:
    assert rate_to_stick(p, 0, factor * p.max_rate[0] + 1.0) == 1.0
    assert rate_to_stick(p, 0, -factor * p.max_rate[0] - 1.0) == -1.0
    assert stick_to_rate(p, 0, -1.0) == -p.max_rate[0]


def test_refusals_name_the_value() -> None:
    for bad, word in [
        (("CUBIC", (1,) * 3, (1,) * 3, (1,) * 3), "rates_type is 'CUBIC'"),
        (("QUICK", (0, 1, 1), (1,) * 3, (1,) * 3), r"rc_rate is \(0, 1, 1\)"),
        (("KISS", (1,) * 3, (256, 1, 1), (1,) * 3), r"rate is \(256"),
        (("KISS", (1,) * 3, (1,) * 3, (1, 101, 1)), r"expo is \(1, 101"),
    ]:
        with pytest.raises(ValueError, match=word):
            RateProfile(*bad)
    with pytest.raises(ValueError, match="pitch rate is nan"):
        rate_to_stick(profile("ACTUAL", 7, 67), 1, math.nan)


@given(st.integers(1000, 2000), st.integers(0, 100))
def test_channels_and_sticks(channel: int, deadband: int) -> None:
    stick = channel_to_stick(channel, 1500, deadband)
    back = stick_to_channel(stick, 1500, deadband)
    assert back == (channel if abs(channel - 1500) > deadband else 1500)


throttles = st.builds(
    ThrottleCurve, st.integers(0, 100), st.integers(0, 100), st.none() | st.integers(0, 100),
    st.sampled_from(["OFF", "SCALE", "CLIP"]), st.integers(1, 100), st.integers(900, 1200),
)  # fmt: skip


@given(throttles, st.integers(1000, 2000), st.floats(-0.5, 1.5))
def test_throttle_inverse_is_the_lowest_channel_of_the_nearest_throttle(
    curve: ThrottleCurve, channel: int, wanted: float
) -> None:
    every = [curve.throttle_of(us) for us in range(1000, 2001)]
    assert every == sorted(every)
    assert curve.throttle_of(curve.channel_for(curve.throttle_of(channel))) == curve.throttle_of(channel)
    nearest = min(every, key=lambda throttle: (abs(throttle - wanted), throttle))
    assert curve.channel_for(wanted) == 1000 + every.index(nearest)
    assert curve.largest == max(every)


def test_throttle_curve_by_hand() -> None:
    plain = ThrottleCurve(min_check=1050)
    assert [plain.throttle_of(us) for us in (900, 1000, 1050, 1525, 2000, 2100)] == [0, 0, 0, 0.5, 1, 1]
    # thr_mid 50, expo 100, older firmware: point 2 is 500 - 300 * (30 / 50)^2, whole percents: 392
    old = ThrottleCurve(mid=50, expo=100, min_check=1000)
    assert old.throttle_of(1200) == 0.392
    assert ThrottleCurve(limit_type="SCALE", limit=80).throttle_of(1525) == pytest.approx(0.4)
    clipped = ThrottleCurve(limit_type="CLIP", limit=30)
    assert (clipped.throttle_of(1525), clipped.largest) == (0.3, 0.3)


def test_throttle_refusals_name_the_value() -> None:
    for values, word in [
        ({"limit_type": "CUT"}, "limit_type is 'CUT'"),
        ({"mid": 101}, "mid is 101"),
        ({"hover": -1}, "hover is -1"),
        ({"limit": 0}, "limit is 0"),
    ]:
        with pytest.raises(ValueError, match=word):
            ThrottleCurve(**values)
    with pytest.raises(ValueError, match="throttle is nan"):
        ThrottleCurve().channel_for(math.nan)
