"""The heading's error, as a flight shows it: point masses that are pushed by their tilt, seen with noise."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from e2efly.deploy.heading_watch import HeadingWatch, watched
from e2efly.deploy.odometry import Odometry
from e2efly.vehicles.vehicle import GRAVITY

RATE = 100.0
Push = Callable[[float, complex, complex], complex]
"""(time, position, velocity) -> wanted acceleration as the controller sees the world, m/s^2."""


def swinging(t: float, position: complex, velocity: complex) -> complex:
    return 1.2 * complex(math.sin(3 * t), math.cos(2.1 * t))


def holding(t: float, position: complex, velocity: complex) -> complex:
    """A gentle hover about the origin."""
    return -1.5 * position - 2.0 * velocity


def attitude(push: complex, yaw: float) -> np.ndarray:
    """Level but for the tilt that gives the push, then turned about up by `yaw`: what a pose source reports."""
    tilt = math.atan(abs(push) / GRAVITY)
    axis = 1j * push / abs(push) if push else 1 + 0j
    c, s = math.cos(tilt / 2), math.sin(tilt / 2)
    w, x, y = c, s * axis.real, s * axis.imag
    cy, sy = math.cos(yaw / 2), math.sin(yaw / 2)
    return np.array([cy * w, cy * x - sy * y, cy * y + sy * x, sy * w])


def errors(
    push: Push, error: float, seconds: float, wind: Callable[[float], complex] = lambda t: 0j, seed: int = 0
) -> list[float | None]:
    """What the watch says at each odometry of a flight whose pose source is turned by `error`.

    The acceleration is `push` turned back by the error, 50 ms late, and the wind's.
    """
    random, watch, said = np.random.default_rng(seed), HeadingWatch(), []
    position, velocity, waiting = 0.05 + 0.02j, 0j, [0j] * 5
    for k in range(round(seconds * RATE)):
        t = k / RATE
        # the vehicle tilts as the controller asks in ITS frame; the world sees that turned back
        waiting.append(push(t, position, velocity) * np.exp(-1j * error))
        true = waiting.pop(0)
        velocity += (true + wind(t)) / RATE
        position += velocity / RATE
        noisy = velocity + complex(*random.normal(0.0, 0.01, 2))
        seen = attitude(true, 0.0)
        turn = np.array([math.cos(error / 2), 0, 0, math.sin(error / 2)])
        reported = compose(turn, seen)
        where = np.array([position.real, position.imag, 1.0])
        moving = np.array([noisy.real, noisy.imag, 0.0])
        watch = watched(watch, Odometry(t, where, moving, reported, np.zeros(3)))
        said.append(watch.error)
    return said


def compose(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    (aw, ax, ay, az), (bw, bx, by, bz) = a, b
    return np.array([
        aw * bw - ax * bx - ay * by - az * bz, aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx, aw * bz + ax * by - ay * bx + az * bw,
    ])  # fmt: skip


@pytest.mark.parametrize("error", [0.0, 0.5, -1.2, math.pi / 2, -2.6, 3.1])
def test_it_measures_the_error(error: float) -> None:
    said = [e for e in errors(swinging, error, 4.0)[150:] if e is not None]
    assert len(said) > 200
    assert max(abs(math.remainder(e - error, math.tau)) for e in said) < 0.12


@pytest.mark.parametrize("error", [2.0, -2.4, math.pi])
def test_it_tells_before_the_hover_is_lost(error: float) -> None:
    """Led by it the vehicle runs away from 5 cm; told within the first half metre a second it can be stopped."""
    said = errors(holding, error, 6.0)
    first = next(k for k, e in enumerate(said) if e is not None and abs(e) > 0.7)
    moved, position, velocity = 0j, 0.05 + 0.02j, 0j
    for _ in range(first):
        velocity += holding(0.0, position, velocity) * np.exp(-1j * error) / RATE
        position += velocity / RATE
        moved = velocity
    assert abs(moved) < 0.8


def test_nothing_is_told_by_a_quiet_hover() -> None:
    assert set(errors(holding, 0.0, 20.0)[300:]) == {None}


@pytest.mark.parametrize("seed", range(3))
def test_wind_and_gusts_are_no_wrong_heading(seed: int) -> None:
    gusts = np.random.default_rng(seed).normal(size=(60, 2)) * 1.5

    def wind(t: float) -> complex:
        return 0.8 + complex(*gusts[int(t / 0.7)]) * (math.sin(math.pi * (t / 0.7 % 1)) ** 2)

    said = [e for e in errors(holding, 0.0, 40.0, wind, seed) if e is not None]
    assert all(abs(e) < 0.7 for e in said)


def test_a_pause_begins_anew() -> None:
    watch = HeadingWatch()
    still = Odometry(0.0, np.zeros(3), np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3))
    for k in range(200):
        velocity = np.array([0.01 * k, 0.0, 0.0])
        watch = watched(watch, Odometry(k / RATE, np.zeros(3), velocity, attitude(1 + 0j, 1.0), np.zeros(3)))
    assert watch.power[0] > 0
    for later in (2.2, 1.0, 50.0):  # lost for a while, or the source's clock went back
        assert watched(watch, Odometry(later, still.position, still.velocity, still.quaternion, np.zeros(3))).power == (
            0.0, 0.0,
        )  # fmt: skip
