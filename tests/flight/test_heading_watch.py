"""The heading's error, as a flight shows it: point masses that are pushed by their tilt, seen with noise."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from e2efly.flight.attitude import Attitude
from e2efly.flight.pilot.heading_watch import HeadingWatch, watched
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY

RATE = 100.0
Push = Callable[[float, complex, complex], complex]
"""(time, position, velocity) -> wanted acceleration as the controller sees the world, m/s^2."""


def swinging(t: float, position: complex, velocity: complex) -> complex:
    return 1.2 * complex(math.sin(3 * t), math.cos(2.1 * t))


def holding(t: float, position: complex, velocity: complex) -> complex:
    """A gentle hover about the origin."""
    return -1.5 * position - 2.0 * velocity


def attitude(push: complex) -> Attitude:
    """The flight controller's, of a vehicle that leans so that it is pushed."""
    x, y, z = np.array([push.real, push.imag, GRAVITY]) / math.hypot(abs(push), GRAVITY)
    return Attitude(roll=-math.asin(y), pitch=math.atan2(x, z), yaw=0.0)


def seen(t: float, velocity: complex, yaw: float) -> Odometry:
    moving = np.array([velocity.real, velocity.imag, 0.0])
    return Odometry(t, np.zeros(3), moving, np.array([math.cos(yaw / 2), 0, 0, math.sin(yaw / 2)]), np.zeros(3))


def flight(
    push: Push, error: float, seconds: float, wind: Callable[[float], complex] = lambda t: 0j, seed: int = 0
) -> list[tuple[float | None, complex]]:
    """What the watch says at each odometry of a flight whose heading is wrong by `error`, and the true velocity.

    The controller asks by the heading that it sees; the vehicle, whose own is 0, does so turned back, 50 ms late.
    """
    random, watch, said = np.random.default_rng(seed), HeadingWatch(), []
    position, velocity, waiting = 0.05 + 0.02j, 0j, [0j] * 5
    for k in range(round(seconds * RATE)):
        t = k / RATE
        waiting.append(push(t, position, velocity) * np.exp(-1j * error))
        leans = waiting.pop(0)
        velocity += (leans + wind(t)) / RATE
        position += velocity / RATE
        noisy = velocity + complex(*random.normal(0.0, 0.01, 2))
        watch = watched(watch, seen(t, noisy, error), attitude(leans))
        said.append((watch.error, velocity))
    return said


def errors(push: Push, error: float, seconds: float, *rest: Any) -> list[float | None]:
    return [told for told, _ in flight(push, error, seconds, *rest)]


@pytest.mark.parametrize("error", [0.0, 0.5, -1.2, math.pi / 2, -2.6, 3.1])
def test_it_measures_the_error(error: float) -> None:
    said = [e for e in errors(swinging, error, 4.0)[150:] if e is not None]
    assert len(said) > 200
    assert max(abs(math.remainder(e - error, math.tau)) for e in said) < 0.12


@pytest.mark.parametrize("error", [2.0, -2.4, math.pi])
def test_it_tells_before_the_hover_is_lost(error: float) -> None:
    """Led by it the vehicle runs away from 5 cm; at less than a metre a second it can be stopped."""
    told = [abs(velocity) for e, velocity in flight(holding, error, 6.0) if e is not None and abs(e) > 0.7]
    assert told[0] < 1.0


def test_nothing_is_told_by_a_quiet_hover() -> None:
    assert set(errors(holding, 0.0, 20.0)[300:]) == {None}


@pytest.mark.parametrize("seed", range(3))
def test_wind_and_gusts_are_no_wrong_heading(seed: int) -> None:
    gusts = np.random.default_rng(seed).normal(size=(60, 2)) * 1.5

    def wind(t: float) -> complex:
        return 0.8 + complex(*gusts[int(t / 0.7)]) * (math.sin(math.pi * (t / 0.7 % 1)) ** 2)

    said = [e for e in errors(holding, 0.0, 40.0, wind, seed) if e is not None]
    assert all(abs(e) < 0.7 for e in said)


@pytest.mark.parametrize("growth", [0.8, 1.4, 1.8, 2.2])
def test_a_push_that_grows_looks_like_one_and_is_corrected_at_once(growth: float) -> None:
    """What grows as a lost hover does cannot be told from one; what follows it is told right, and the brake with it."""

    def wind(t: float) -> complex:
        return 0.15 * math.exp(growth * min(t - 2.0, 1.4)) * (1 + 0.3j) if t > 2.0 else 0j

    said = errors(holding, 0.0, 2.0 + 1.4 + 3.0, wind)
    wrong = sum(told is not None and abs(told) > 0.7 for told in said) / RATE
    assert wrong < 0.5


def test_a_pause_begins_anew() -> None:
    watch = HeadingWatch()
    for k in range(200):
        watch = watched(watch, seen(k / RATE, 0.01 * k + 0j, 1.0), attitude(1 + 0j))
    assert watch.power[0] > 0
    for later in (2.2, 1.0, 50.0):  # lost for a while, or the source's clock went back
        assert watched(watch, seen(later, 0j, 0.0), attitude(0j)).power == (0.0, 0.0)
