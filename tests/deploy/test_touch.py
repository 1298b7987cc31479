"""The ground, felt without poses: vehicles that sink by their throttle, and accelerometers of every kind."""

from collections.abc import Callable

import numpy as np
import pytest

from e2efly.deploy.pilot.touch import SUPPORT_S, Touch, dip, feel, seen
from e2efly.vehicles.vehicle import GRAVITY

DT, LAG = 0.02, 3
"""Between two measurements, s; of them until the force shows the throttle."""
Sensor = Callable[[float, int], float]
"""(true force along the body's z axis, number of the measurement) -> what is told, m/s^2."""


def sink(
    sensor: Sensor,
    ground_at: float = 1.0,
    seconds: float = 4.0,
    *,
    overdue_at: float = 99.0,
    late: float = 0.0,
    lost: float = 0.0,
) -> float | None:
    """When the ground is felt, s; None: never. It touches after `ground_at` s with 0.8 m/s.

    Commands arrive, and measurements are asked for, `late` s before the answers come; a share of them is `lost`.
    """
    random, touch, shock = np.random.default_rng(0), Touch(), 0.0
    sent = [0.98 * GRAVITY] * (LAG + round(late / DT))
    for k in range(round(seconds / DT)):
        now = k * DT
        thrust = sent.pop(0)
        on_ground = now >= ground_at
        shock = 25.0 if on_ground and now < ground_at + 1.5 * DT else 0.5 * shock
        force = max(GRAVITY, thrust) if on_ground else thrust
        told = sensor(force + shock + random.normal(0, 0.1), k)
        if random.random() >= lost:
            touch = feel(seen(touch, (0.0, 0.0, round(50 * told)), thrust, now), told, thrust, now - late, DT)
        if touch.carried:
            return now
        wanted = 0.98 * GRAVITY
        touch = dip(touch, now, overdue=now >= overdue_at, beyond=told - thrust)
        sent.append(wanted * touch.factor(now))
    return None


@pytest.mark.parametrize("scale", [0.9, 0.95, 1.0, 1.05, 1.15])
@pytest.mark.parametrize("bias", [-1.5, 0.0, 1.0])
def test_a_touch_is_felt_at_once_whatever_scale_and_bias(scale: float, bias: float) -> None:
    felt = sink(lambda force, k: scale * force + bias)
    assert felt is not None and 1.0 < felt < 1.8


@pytest.mark.parametrize(("late", "lost"), [(0.17, 0.0), (0.1, 0.5), (0.0, 0.7)])
def test_over_a_slow_or_bad_link_the_ground_is_felt_later_and_never_in_the_air(late: float, lost: float) -> None:
    felt = sink(lambda force, k: force, overdue_at=2.0, seconds=12.0, late=late, lost=lost)
    assert felt is not None and 1.0 < felt < 7.0
    assert sink(lambda force, k: force, 99.0, 12.0, overdue_at=0.5, late=late, lost=lost) is None


@pytest.mark.parametrize("scale", [0.9, 1.0, 1.15])
def test_in_the_air_nothing_is_felt_though_the_ground_is_overdue_or_a_gust_hits(scale: float) -> None:
    assert sink(lambda force, k: scale * force, 99.0, overdue_at=0.5) is None
    assert sink(lambda force, k: scale * force + (6.0 if k % 40 == 0 else 0.0), 99.0) is None


def test_a_soft_touch_is_felt_once_the_ground_is_overdue() -> None:
    assert sink(lambda force, k: min(force, GRAVITY), overdue_at=99.0) is None
    felt = sink(lambda force, k: min(force, GRAVITY + 0.01 * (k % 3)), overdue_at=2.0)
    assert felt is not None and 2.0 < felt < 2.8


@pytest.mark.parametrize(
    "sensor",
    [lambda force, k: -force, lambda force, k: 0.0, lambda force, k: GRAVITY],
    ids=["negated", "zero", "frozen"],
)
def test_a_broken_accelerometer_never_feels_the_ground_in_the_air(sensor: Sensor) -> None:
    assert sink(sensor, 99.0, overdue_at=0.5) is None


def test_what_carries_the_vehicle_is_told_after_a_while() -> None:
    touch = Touch()
    for k in range(50):
        touch = feel(touch, GRAVITY, 0.7 * GRAVITY, k * DT, DT)
        assert touch.rests is ((k + 1) * DT >= SUPPORT_S - 1e-9)
    assert not feel(touch, 0.75 * GRAVITY, 0.7 * GRAVITY, 2.0, DT).rests


def test_an_accelerometer_that_repeats_itself_or_is_far_from_the_thrust_cannot_feel_the_ground() -> None:
    def after_a_second(told: Sensor) -> Touch:
        touch = Touch()
        for k in range(50):
            force = told(GRAVITY, k)
            touch = feel(seen(touch, (0.0, 0.0, force), GRAVITY, k * DT), force, GRAVITY, k * DT, DT)
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
    assert again.frozen and not again.carried and again.usual is None
    assert not seen(again, (1.0, 2.0, 501.0), None, 0.6).frozen
