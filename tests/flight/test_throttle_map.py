"""The map from thrust to throttle: what it learns, how fast, and what it must not be talked into."""

import dataclasses
import json
import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st

from e2efly.flight.pilot.throttle_map import (
    GAIN_RANGE,
    GAIN_RATE,
    SCALE_RANGE,
    SCALE_RATE,
    ThrottleHistory,
    ThrottleMap,
    as_json,
    from_json,
    learn,
    update,
)
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle

VEHICLE = load_vehicle("vis_r")
NEW = ThrottleMap.of(VEHICLE)
RATE = 50
NOISE = 0.5
"""Of the accelerometer, m/s^2."""
NONSENSE = (math.nan, math.inf, -math.inf, 0.0, -9.81, 100 * GRAVITY, 1e300)


def hover(
    seconds: float,
    scale: float = 1.0,
    gain: float = 2.0,
    voltage: Callable[[float], float | None] = lambda t: 3.9,
    begin: ThrottleMap = NEW,
    seed: int = 0,
) -> list[ThrottleMap]:
    """Hover with a vehicle whose factor and voltage gain are `scale` and `gain`; the map after each measurement."""
    noise, m, maps = np.random.default_rng(seed), begin, []
    for k in range(round(seconds * RATE)):
        volts = voltage(k / RATE)
        throttle = m.throttle(GRAVITY, volts)
        sag = 1 + gain * ((3.9 if volts is None else volts) / 3.9 - 1)
        m = update(m, throttle, m.nominal(throttle) * scale * sag + NOISE * noise.normal(), volts, 1 / RATE)
        maps.append(m)
    return maps


def test_the_vehicle_file_is_the_start() -> None:
    low, high = VEHICLE.thrust_range
    assert NEW.force(0.0) == pytest.approx(4 * low / VEHICLE.mass)
    assert NEW.force(1.0) == pytest.approx(4 * high / VEHICLE.mass)
    idle, full = NEW.speed
    assert idle + NEW.throttle(GRAVITY) * (full - idle) == pytest.approx(VEHICLE.hover_rotor_speed)


MAPS = st.builds(
    lambda scale, gain, last: dataclasses.replace(NEW, scale=scale, gain=gain, last_voltage=last),
    st.floats(*SCALE_RANGE), st.floats(*GAIN_RANGE), st.none() | st.floats(3.0, 4.35),
)  # fmt: skip
VOLTAGES = st.none() | st.floats(3.0, 4.35)


@hypothesis_settings(deadline=None)
@given(MAPS, st.floats(0, 1), VOLTAGES)
def test_force_and_throttle_are_inverse(m: ThrottleMap, throttle: float, voltage: float | None) -> None:
    assert m.throttle(m.force(throttle, voltage), voltage) == pytest.approx(throttle, abs=1e-9)


@hypothesis_settings(deadline=None)
@given(MAPS, st.floats(-1e3, 1e3), st.floats(0, 100), VOLTAGES)
def test_the_throttle_rises_with_the_force_and_stays_within_its_ends(
    m: ThrottleMap, force: float, more: float, voltage: float | None
) -> None:
    assert 0.0 <= m.throttle(force, voltage) <= m.throttle(force + more, voltage) <= 1.0


@pytest.mark.parametrize("scale", [0.7, 1.3])
def test_converges_from_30_percent_wrong_within_5_s_of_hover(scale: float) -> None:
    for seed in range(3):
        maps = hover(8.0, scale, seed=seed)
        wrong = np.array([m.force(0.3, 3.9) / NEW.force(0.3, 3.9) / scale - 1 for m in maps])
        assert np.abs(wrong[5 * RATE :]).max() < 0.01
        assert maps[-1].residual < 2 * NOISE


@pytest.mark.parametrize("scale", [0.7, 1.3])
@pytest.mark.parametrize("mismatch", [-0.015, 0.0, 0.015])
def test_a_delay_that_is_off_by_15_ms_while_the_throttle_varies_does_little_harm(scale: float, mismatch: float) -> None:
    noise, m, history = np.random.default_rng(1), NEW, ThrottleHistory()
    delay, lag, dt = 0.02, 0.035, 0.002
    throttle = rotor = NEW.throttle(GRAVITY)
    sent = [rotor] * round(delay / dt)
    for k in range(round(8.0 / dt)):
        t = k * dt
        if k % 5 == 0:  # a control step: 1 Hz up and down, 40 % of the weight
            throttle = m.throttle(GRAVITY * (1 + 0.4 * math.sin(2 * math.pi * t)), 3.9)
            history.add(t, throttle)
        sent.append(throttle)
        rotor += (sent.pop(0) - rotor) * dt / lag
        if k % 10 == 9:
            believed = delay + lag + mismatch
            met = history.between(t - believed - 0.01, t - believed + 0.01)
            if met is not None:
                m = update(m, met, NEW.nominal(rotor) * scale + NOISE * noise.normal(), 3.9, 0.02)
        if t > 5.0:
            assert m.scale == pytest.approx(scale, rel=0.025)


def test_it_never_jumps() -> None:
    sagged, full = hover(3.0, 1.3, 4.0, lambda t: 3.5), hover(3.0, 1.0, 0.0, lambda t: 4.3)
    for maps in (hover(3.0, 0.5), hover(3.0, 2.0), sagged, full):
        for before, after in zip([NEW, *maps], maps, strict=False):
            assert abs(after.scale - before.scale) <= SCALE_RATE / RATE + 1e-12
            assert abs(after.gain - before.gain) <= GAIN_RATE / RATE + 1e-12
            for voltage in (3.3, 3.9, 4.3):
                assert abs(after.throttle(GRAVITY, voltage) - before.throttle(GRAVITY, voltage)) < 0.01
    # a long silence is no licence to jump, either
    assert abs(update(NEW, 0.4, 20.0, 3.9, 60.0).scale - 1) <= SCALE_RATE * 0.1 + 1e-12


@pytest.mark.parametrize("gain", [1.0, 3.0])
def test_learns_how_thrust_falls_with_the_voltage(gain: float) -> None:
    maps = hover(120.0, 1.0, gain, lambda t: 4.15 - 0.6 * t / 120.0)
    assert maps[-1].gain == pytest.approx(gain, abs=0.3)
    wrong = [m.force(0.4, 4.15 - 0.6 * k / RATE / 120) / NEW.nominal(0.4) /
             (1 + gain * ((4.15 - 0.6 * k / RATE / 120) / 3.9 - 1)) - 1 for k, m in enumerate(maps)]  # fmt: skip
    assert np.abs(wrong[5 * RATE :]).max() < 0.02
    # with what it has learned, a full battery is right at once
    full = maps[-1].force(0.4, 4.15) / NEW.nominal(0.4)
    assert full == pytest.approx(1 + gain * (4.15 / 3.9 - 1), rel=0.03)


def test_without_a_voltage_the_factor_alone_is_learned() -> None:
    last = hover(6.0, 0.8, voltage=lambda t: None)[-1]
    assert last.scale == pytest.approx(0.8, rel=0.01)
    assert last.gain == 2.0 and last.last_voltage is None


def test_a_voltage_that_is_lost_counts_as_the_last() -> None:
    known = hover(6.0, voltage=lambda t: 3.6)[-1]
    for lost in (None, 0.0, math.nan, math.inf, 16.8):
        assert known.throttle(GRAVITY, lost) == known.throttle(GRAVITY, 3.6)
        assert update(known, 0.4, 10.0, lost, 0.02).last_voltage == 3.6


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *(("force", force) for force in NONSENSE), *(("dt", dt) for dt in (0.0, -0.02, math.nan, math.inf)),
        ("throttle", math.nan), ("throttle", 0.0),
    ],
)  # fmt: skip
def test_what_cannot_be_is_not_learned_from(name: str, value: float) -> None:
    good = {"throttle": 0.4, "force": 10.0, "voltage": 3.9, "dt": 0.02}
    assert update(NEW, **good) is not NEW
    assert update(NEW, **good | {name: value}) is NEW


NUMBERS = st.floats(allow_nan=True, allow_infinity=True) | st.floats(0, 30)


@hypothesis_settings(deadline=None)
@given(st.lists(st.tuples(st.floats(0, 1), NUMBERS, st.none() | NUMBERS | st.floats(3, 4.4), NUMBERS), max_size=40))
def test_whatever_is_measured_it_stays_finite_bounded_and_able_to_learn(
    story: list[tuple[float, float, float | None, float]],
) -> None:
    m = NEW
    for entry in story:
        m = update(m, *entry)
        assert SCALE_RANGE[0] <= m.scale <= SCALE_RANGE[1] and GAIN_RANGE[0] <= m.gain <= GAIN_RANGE[1]
        assert 0 <= m.throttle(GRAVITY, entry[2]) <= 1
        covariance = np.array(m.covariance)
        assert (np.linalg.eigvalsh(covariance) > 0).all() and (np.diag(covariance) <= [0.05 + 1e-9, 0.5 + 1e-9]).all()
        assert math.isfinite(m.residual)


def test_one_wild_measurement_in_hover_moves_the_throttle_little() -> None:
    settled = hover(10.0)[-1]
    for force in (0.31 * GRAVITY, 3.9 * GRAVITY):
        m = update(settled, settled.throttle(GRAVITY, 3.9), force, 3.9, 0.02)
        m = update(m, m.throttle(GRAVITY, 3.9), GRAVITY, 3.9, 0.02)  # as far as the rate lets it
        assert abs(m.throttle(GRAVITY, 3.9) / settled.throttle(GRAVITY, 3.9) - 1) < 0.01


class TestSaved:
    def test_the_next_flight_goes_on_from_it(self) -> None:
        learned = hover(60.0, 0.8, 1.0, lambda t: 4.1 - 0.01 * t)[-1]
        again = from_json(as_json(learned), VEHICLE)
        assert again.learned == learned.learned and again.updates == learned.updates
        assert again.force(0.4, 3.7) == pytest.approx(learned.force(0.4, 3.7), rel=1e-3)
        assert hover(6.0, 1.2, begin=again)[-1].scale == pytest.approx(1.2, rel=0.01)  # it can still learn

    def test_another_vehicles_is_refused_by_its_hash(self) -> None:
        other = load_vehicle("vis_h")
        with pytest.raises(ValueError, match=f"vehicle_hash is '{VEHICLE.hash}'; accepted: '{other.hash}'"):
            from_json(as_json(NEW), other)

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("scale", 3.0), ("scale", "1"), ("scale", None), ("scale", True), ("gain", -1), ("voltage", 0),
            ("voltage", math.nan), ("updates", 1.5), ("updates", -1), ("updates", True), ("residual", math.inf),
            ("residual", [1.0]), ("vehicle_hash", 5),
        ],
    )  # fmt: skip
    def test_a_bad_value_is_named(self, name: str, value: object) -> None:
        text = json.dumps(json.loads(as_json(NEW)) | {name: value})
        with pytest.raises(ValueError, match=f"throttle map: {name} is .*; accepted: "):
            from_json(text, VEHICLE)

    @pytest.mark.parametrize(
        ("text", "told"),
        [
            *((text, "") for text in ("", "{", "[]", "{}", "null", "[" * 100_000, '{"scale": 1.0}')),
            (
                as_json(NEW).replace('"scale": 1.0', '"scale": 1.0, "scale": 1.5'),
                "not JSON: key .scale. is there twice",
            ),
            (json.dumps(json.loads(as_json(NEW)) | {"mass": 1.0}), "it has .*mass"),
        ],
    )
    def test_what_is_no_map_is_refused(self, text: str, told: str) -> None:
        with pytest.raises(ValueError, match=f"throttle map: {told}"):
            from_json(text, VEHICLE)


def test_the_history_gives_the_mean_over_a_stretch_and_forgets() -> None:
    history = ThrottleHistory(seconds=0.5)
    assert history.between(0.0, 1.0) is None
    for k in range(100):
        history.add(k * 0.01, float(k))
    assert history.between(0.90, 0.91) == pytest.approx(90.0)
    assert history.between(0.905, 0.925) == pytest.approx(0.25 * 90 + 0.5 * 91 + 0.25 * 92)
    assert history.between(0.985, 1.985) == pytest.approx(0.005 * 98 + 0.995 * 99)  # the last one holds
    assert history.between(0.3, 0.31) is None


def test_the_history_gives_the_swing_before_a_moment() -> None:
    history = ThrottleHistory()
    assert history.swing(1.0) == 0.0
    for time, throttle in ((0.0, 0.9), (0.5, 0.4), (0.9, 0.6), (1.1, 0.1)):
        history.add(time, throttle)
    assert history.swing(1.0) == pytest.approx(0.2)  # 0.4 was in force at the beginning, 0.9 no more, 0.1 not yet
    assert history.swing(0.8) == 0.0
    assert history.swing(0.6) == pytest.approx(0.5)


@pytest.mark.parametrize("harder", [0.15, -0.15])
def test_a_hard_second_after_a_hover_does_little_harm(harder: float) -> None:
    """A policy takes over and changes the throttle at every step; the rotors are slower than what is believed."""
    noise, history, dt = np.random.default_rng(0), ThrottleHistory(), 0.002
    m = hover(3.0)[-1]
    rotor = throttle = m.throttle(GRAVITY)
    before = m.scale
    for k in range(round(1.0 / dt)):
        t = k * dt
        if k % 5 == 0:
            throttle = m.throttle(GRAVITY) + harder * (1 if (t // 0.12) % 3 == 0 else -0.5)
            history.add(t, throttle)
        rotor += (throttle - rotor) * dt / 0.07
        if k % 10 == 9 and (met := history.felt(t)) is not None:
            force = NEW.nominal(rotor) + NOISE * noise.normal()
            m = update(m, met, force, 3.9, 0.02, history.swing(t))
    assert m.scale == pytest.approx(before, rel=0.006)  # without it 1.7 %


@pytest.mark.parametrize(("throttle", "swing"), [(0.95, 0.0), (0.7, 0.5)])
def test_where_motors_may_be_at_their_ends_nothing_is_learned(throttle: float, swing: float) -> None:
    """The mixer then gives thrust away for the body rates: half of it came in a policy's oscillation."""
    m = ThrottleMap.of(VEHICLE)
    assert learn(m, throttle, np.array([0.0, 0.0, 0.5 * m.force(throttle)]), 3.9, 0.02, swing) == m
    assert learn(m, 0.6, np.array([0.0, 0.0, 0.9 * m.force(0.6)]), 3.9, 0.02, 0.1) != m


@pytest.mark.parametrize("name", ["vis_r", "crazyflie", "hexa", "octo"])
def test_full_throttle_is_the_thrust_of_all_rotors(name: str) -> None:
    vehicle = load_vehicle(name)
    new = ThrottleMap.of(vehicle)
    assert new.nominal(1.0) == pytest.approx(float(vehicle.thrust_to_weight) * 9.81, rel=1e-3)
    assert new.nominal(new.throttle(9.81)) == pytest.approx(9.81, rel=1e-6)
