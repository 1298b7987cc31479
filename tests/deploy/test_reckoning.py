"""Braking without odometry: by the velocity seen last, carried on by accelerometer and attitude."""

import math

import numpy as np
import pytest

from e2efly.deploy.msp.messages import Attitude
from e2efly.deploy.odometry import Odometry
from e2efly.deploy.reckoning import BRAKE_S, LONGEST_STEP, Reckoning, reckon, seen, settle, trimmed
from e2efly.vehicles.vehicle import GRAVITY

DT = 0.02
"""Between two measurements, s."""


def moving(velocity: complex, yaw: float) -> Odometry:
    turned = np.array([math.cos(yaw / 2), 0.0, 0.0, math.sin(yaw / 2)])
    return Odometry(0.0, np.zeros(3), np.array([velocity.real, velocity.imag, -0.2]), turned, np.zeros(3))


def test_the_velocity_is_told_along_the_heading() -> None:
    assert seen(moving(1 + 0j, math.pi / 2), 3.0).velocity == pytest.approx((0.0, -1.0, -0.2))
    # it looks along x, and the odometry says that it looks to the left
    assert seen(moving(1 + 0j, math.pi / 2), 3.0, math.pi / 2).velocity == pytest.approx((1.0, 0.0, -0.2))


@pytest.mark.parametrize("yaw", [0.0, 2.2])
@pytest.mark.parametrize("error", [0.0, math.pi / 2, -2.0, math.pi])
@pytest.mark.parametrize("sees", [True, False])
def test_it_brakes_whatever_the_error_of_the_heading_once_that_is_known(yaw: float, error: float, sees: bool) -> None:
    """With odometry that goes on, and with odometry that ends as the braking begins."""
    velocity, roll, pitch = 1.5 - 0.8j, 0.0, 0.0
    known: Reckoning | None = seen(moving(velocity, yaw + error), 0.0, error)
    for k in range(round(BRAKE_S / DT)):
        attitude = Attitude(roll, pitch, 0.0)
        lifted = GRAVITY / (math.cos(roll) * math.cos(pitch))
        velocity += lifted * complex(math.cos(roll) * math.sin(pitch), -math.sin(roll)) * np.exp(1j * yaw) * DT
        now = (k + 1) * DT
        known = reckon(known, attitude, (0.0, 0.0, lifted), now)
        if sees:
            known = seen(moving(velocity, yaw + error), now, error)
        assert known is not None
        wanted = settle(attitude, now, known.velocity).rate
        roll, pitch = roll + float(wanted.x) * DT, pitch + float(wanted.y) * DT
        assert abs(velocity) < 1.75
    assert abs(velocity) < 0.35


@pytest.mark.parametrize("wrong", [0.75, 1.0, 1.3])
@pytest.mark.parametrize("climb", [-1.0, 0.0, 2.0])
def test_it_sinks_though_the_throttle_map_is_wrong(wrong: float, climb: float) -> None:
    """The thrust that comes is another than the one that is asked for; the height is reckoned, too."""
    level, trim, up, height = Attitude(0.0, 0.0, 0.0), 0.0, climb, 1.0
    odometry = Odometry(
        0.0, np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, climb]), np.array([1.0, 0, 0, 0]), np.zeros(3)
    )
    known: Reckoning | None = seen(odometry, 0.0)
    top = height
    for k in range(round(4.0 / DT)):
        assert known is not None
        trim = trimmed(trim, k * DT, known.velocity[2], DT)
        thrust = wrong * float(settle(level, k * DT, known.velocity, trim).thrust)
        height, up = height + up * DT, up + (thrust - GRAVITY) * DT
        known, top = reckon(known, level, (0.0, 0.0, thrust), (k + 1) * DT), max(top, height)
        assert up < max(climb, 0.0) + 0.4
        if k * DT > 2.5:
            assert -1.4 < up < -0.5
    assert known is not None
    assert known.height == pytest.approx(height, abs=1e-6) and known.top == pytest.approx(top, abs=1e-6)


def test_after_a_pause_nothing_is_known() -> None:
    level, force = Attitude(0.0, 0.0, 0.0), (0.0, 0.0, GRAVITY)
    known = seen(moving(1 + 0j, 0.0), 5.0)
    assert reckon(known, level, force, 5.0 + LONGEST_STEP + 0.01) is None
    assert reckon(known, None, force, 5.01) is None
    assert reckon(None, level, force, 5.01) is None
    still = reckon(known, level, force, 5.05)
    assert still is not None and still.velocity == pytest.approx((1.0, 0.0, -0.2))
