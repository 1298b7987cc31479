"""Flight and standing, told without poses: vehicles that fly or stand, and accelerometers and links of every kind."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from e2efly.flight.pilot.touch import AGAIN_S, LAGS, LONGEST_S, LOW, STILL, UNTOLD_S, Touch, feel, seen, wave
from e2efly.vehicles.gravity import GRAVITY

DT = 0.02
"""Between two measurements, s."""
Sensor = Callable[[float, int], float]
"""(true force along the body's z axis, number of the measurement) -> what is told, m/s^2."""


def descend(
    sensor: Sensor,
    ground_at: float,
    seconds: float,
    *,
    lag: float = 0.0,
    lost: float = 0.0,
    turn: float = 0.0,
    weight: float = 0.93,
    shock: float = 0.0,
    seed: int = 0,
) -> list[tuple[float, bool | None, float]]:
    """Time, s, what is told, and the thrust that is sent, m/s^2, of a blind descent at each control step.

    Args:
        sensor: the accelerometer.
        ground_at: when it touches, s.
        seconds: how long to go on.
        lag: how much later than usual the force follows, s.
        lost: the share of the replies that never come.
        turn: the body rate that is told, rad/s.
        weight: the thrust of the descent, in units of gravity.
        shock: force of the touch, m/s^2. It halves with each measurement.
        seed: of noise and losses.
    """
    random, touch, rows = np.random.default_rng(seed), Touch(), []
    sent = [weight * GRAVITY] * 60

    def thrust_at(earlier: float) -> float:
        return sent[-1 - round(earlier / DT)]

    last = 0.0
    for k in range(round(seconds / DT)):
        now = k * DT
        touch = touch.weigh(now)
        thrust = weight * GRAVITY * wave(now)
        sent.append(min(thrust, LOW * GRAVITY) if touch.weighs(now) else thrust)
        force = thrust_at(lag)
        if now >= ground_at:
            force, shock = max(GRAVITY, force) + shock, 0.5 * shock
        told = sensor(force + random.normal(0.0, 0.1), k)
        if random.random() >= lost:
            thrusts = tuple(thrust_at(earlier) for earlier in LAGS)
            touch = seen(touch, (0.0, 0.0, float(round(200 * told))), thrusts[0], now)
            touch, last = feel(touch, told, thrusts, turn, now, now - last), now
        rows.append((now, touch.stands(now), sent[-1]))
    return rows


def when(rows: list[tuple[float, bool | None, float]]) -> float:
    """When it is said to stand, s. Infinite: never."""
    return min((now for now, stands, _ in rows if stands), default=math.inf)


@pytest.mark.parametrize("lag", [0.0, 0.04, 0.1, 0.14, 0.2])
@pytest.mark.parametrize(("scale", "bias"), [(0.85, 0.0), (0.85, 1.0), (1.0, -1.5), (1.0, 0.0), (1.15, 1.0)])
def test_what_flies_is_never_said_to_stand_whatever_scale_bias_and_lag(lag: float, scale: float, bias: float) -> None:
    for lost in (0.0, 0.7):
        rows = descend(lambda force, k: scale * force + bias, math.inf, 15.0, lag=lag, lost=lost)
        assert when(rows) == math.inf
        assert lost or sum(stands is False for _, stands, _ in rows) > 0.8 * len(rows)  # nor is it weighed often


@pytest.mark.parametrize("hit", [25, 150])
def test_gusts_and_knocks_are_no_ground(hit: int) -> None:
    for size in (6.0, -5.0):
        rows = descend(lambda force, k, size=size: force + (size if k % hit < 3 else 0.0), math.inf, 15.0)
        assert when(rows) == math.inf


@pytest.mark.parametrize(("ground_at", "shock"), [(0.0, 0.0), (3.0, 25.0)], ids=["from the start", "after a touch"])
@pytest.mark.parametrize(
    ("scale", "bias"), [(0.85, 0.0), (0.85, 1.0), (1.0, -1.0), (1.0, 0.0), (1.15, -1.0), (1.15, 1.0)]
)
def test_what_stands_is_told_soon_whatever_scale_and_bias(
    ground_at: float, shock: float, scale: float, bias: float
) -> None:
    for seed in range(4):
        rows = descend(lambda force, k: scale * force + bias, ground_at, ground_at + 2.0, shock=shock, seed=seed)
        assert 0.0 < when(rows) - ground_at < 1.2


def test_a_touch_without_a_shock_is_told_a_little_later() -> None:
    for seed in range(4):
        assert 3.0 < when(descend(lambda force, k: force, 3.0, 6.0, seed=seed)) < 4.6


@pytest.mark.parametrize("seed", range(6))
def test_over_a_link_that_loses_seven_replies_of_ten_it_is_told_later(seed: int) -> None:
    assert 0.0 < when(descend(lambda force, k: force, 0.0, 6.0, lost=0.7, seed=seed)) < 3.0


BROKEN = {
    "negated": lambda force, k: -force,
    "dead": lambda force, k: 0.05 * math.sin(k),
    "zero": lambda force, k: 0.0,
    "frozen": lambda force, k: GRAVITY,
    "frozen in flight": lambda force, k: force if k < 200 else GRAVITY,
}


@pytest.mark.parametrize("kind", BROKEN)
@pytest.mark.parametrize("ground_at", [5.0, math.inf])
def test_a_broken_accelerometer_never_says_that_it_stands_and_is_found_unable(kind: str, ground_at: float) -> None:
    rows = descend(BROKEN[kind], ground_at, 10.0)
    assert when(rows) == math.inf
    assert rows[-1][1] is None


def test_where_the_height_is_that_of_the_ground_it_is_weighed_without_knowing_the_slope() -> None:
    touch = Touch()
    for k in range(3):  # too few for a slope
        touch = feel(seen(touch, (float(k), 0.0, 0.0), GRAVITY, k * DT), GRAVITY, (GRAVITY,) * 4, 0.0, k * DT, DT)
    assert touch.stands(2 * DT) is None
    assert not touch.weigh(3 * DT).weighs(3 * DT)
    assert touch.weigh(3 * DT, low=True).weighs(3 * DT)
    assert touch.tells(3 * DT) and not touch.tells(2 * DT + UNTOLD_S + DT)


def test_what_turns_is_not_said_to_stand_though_its_force_does_not_follow() -> None:
    assert when(descend(lambda force, k: GRAVITY + 0.01 * (k % 3), 3.0, 8.0, turn=2 * STILL)) == math.inf


def test_a_weighing_of_what_flies_is_broken_off_and_one_of_what_stands_ends_in_time() -> None:
    def low(sensor: Sensor, ground_at: float) -> list[float]:
        return [now for now, _, thrust in descend(sensor, ground_at, 8.0) if thrust <= LOW * GRAVITY]

    assert low(lambda force, k: force, math.inf) == []
    late = np.array(low(lambda force, k: force, 3.0))
    begins = late[np.diff(late, prepend=0.0) > 1.5 * DT]
    assert late.min() > 3.0 and len(begins) > 2 and np.diff(begins).min() > AGAIN_S - DT / 2
    assert all(late[(late >= begin) & (late < begin + AGAIN_S)].max() < begin + LONGEST_S for begin in begins)
    # a force that did not follow for a while, and then falls with the thrust: it flies
    touch = Touch(time=0.0, weighed=0.0, usual=GRAVITY, changed=0.0)
    assert touch.weighs(0.1)
    assert not feel(touch, LOW * GRAVITY, (LOW * GRAVITY,) * len(LAGS), 0.0, 0.1, DT).weighs(0.1)


def test_what_was_told_does_not_outlast_the_measurements() -> None:
    touch = Touch(time=1.0, changed=1.0, carried=1.0)
    assert touch.stands(1.1) is True
    assert touch.stands(1.6) is None
    assert Touch().stands(0.0) is None
    assert touch.afresh().stands(1.1) is None


def test_an_accelerometer_that_repeats_itself_or_measures_no_weight_cannot_tell() -> None:
    def after_a_second(told: Sensor) -> Touch:
        touch = Touch()
        for k in range(50):
            force = told(GRAVITY, k)
            touch = seen(touch, (0.0, 0.0, force), GRAVITY, k * DT)
            touch = feel(touch, force, (GRAVITY,) * len(LAGS), 0.0, k * DT, DT)
        return touch

    assert after_a_second(lambda force, k: force + 0.01 * (k % 3)).able(1.0)
    assert not after_a_second(lambda force, k: force + 0.01 * (k % 3)).able(2.0)
    assert not after_a_second(lambda force, k: force).able(1.0)
    assert not after_a_second(lambda force, k: -force + 0.01 * (k % 3)).able(1.0)
    assert not Touch().able(1.0)


def test_numbers_that_repeat_are_frozen_at_once_under_another_thrust_and_after_a_while_under_any() -> None:
    def after(seconds: float, thrust: Callable[[float], float | None]) -> Touch:
        touch = Touch()
        for k in range(round(seconds / DT) + 1):
            touch = seen(touch, (1.0, 2.0, 500.0), thrust(k * DT), k * DT)
        return touch

    assert not after(0.3, lambda now: GRAVITY).frozen
    assert after(0.3, lambda now: GRAVITY + 2.0 * now).frozen
    for thrust in (GRAVITY, None):
        assert not after(0.3, lambda now, thrust=thrust: thrust).frozen
        assert after(0.5, lambda now, thrust=thrust: thrust).frozen
    again = after(0.5, lambda now: None).afresh()
    assert again.frozen and again.carried == 0.0 and again.sums == ()
    assert not seen(again, (1.0, 2.0, 501.0), None, 0.6).frozen


@pytest.mark.parametrize(("rate", "enough"), [(50.0, 4), (10.0, 2), (4.0, 2)])
def test_a_slow_link_needs_fewer_measurements_to_show_the_weight(rate: float, enough: int) -> None:
    touch, low = Touch(), (LOW * GRAVITY,) * 4
    for k in range(enough):
        assert touch.stands(k / rate) is None
        touch = seen(touch, (float(k), 0.0, 0.0), low[0], k / rate)
        touch = feel(touch, GRAVITY, low, 0.0, k / rate, min(1 / rate, 0.1))
    assert touch.stands((enough - 1) / rate) is True
