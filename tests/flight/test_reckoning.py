"""Braking without odometry: by the velocity seen last, carried on by accelerometer and attitude."""

import dataclasses
import math

import numpy as np
import pytest

from e2efly.flight.attitude import Attitude
from e2efly.flight.pilot.flight_state import Flight, Mode
from e2efly.flight.pilot.guidance import descend
from e2efly.flight.pilot.hover import blind_time
from e2efly.flight.pilot.inertial import Inertial
from e2efly.flight.pilot.reckoning import (
    ANCHOR_S,
    ANCHORS,
    BRAKE_S,
    DOUBT,
    LONGEST_STEP,
    Reckoning,
    Reckonings,
    reckon,
    seen,
    settle,
    trimmed,
)
from e2efly.flight.pilot.touch import Touch
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY

DT, STILL = 0.02, (0.0, 0.0, 0.0)
"""Between two measurements, s; a body rate, rad/s."""


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
        known = reckon(known, attitude, (0.0, 0.0, lifted), (lifted, 0.0), STILL, now)
        if sees:
            known = seen(moving(velocity, yaw + error), now, error)
        assert known is not None
        wanted = settle(attitude, dataclasses.replace(known, since=0.0), 0.0).rate
        roll, pitch = roll + float(wanted.x) * DT, pitch + float(wanted.y) * DT
        assert abs(velocity) < 1.75
    assert abs(velocity) < 0.35


LEVEL = Attitude(0.0, 0.0, 0.0)


def descent(
    height: float, climb: float, *, scale: float = 1.0, wrong: float = 1.0, doubt: float = 0.01
) -> list[tuple[float, float, float]]:
    """Time, s, height, m, and vertical speed, m/s, until it touches.

    Args:
        height: in which the odometry is lost, m.
        climb: then, m/s.
        scale: of the accelerometer; 1: right.
        wrong: thrust that comes, over the one that the map promises.
        doubt: of the map.
    """
    odometry = Odometry(0.0, np.array([0, 0, height]), np.array([0, 0, climb]), np.array([1.0, 0, 0, 0]), np.zeros(3))
    known: Reckoning | None = seen(odometry, 0.0)
    trim, rows = 0.0, []
    for k in range(round(20.0 / DT)):
        assert known is not None
        rows.append((k * DT, height, climb))
        if height <= 0:
            return rows
        trim = trimmed(trim, known, 0.0, DT)
        promised = float(settle(LEVEL, known, 0.0, trim).thrust)
        thrust = wrong * promised
        height, climb = height + climb * DT, climb + (thrust - GRAVITY) * DT
        known = reckon(known, LEVEL, (0.0, 0.0, scale * thrust), (promised, doubt * promised), STILL, (k + 1) * DT)
    raise AssertionError(f"still {height:.2f} m high")


@pytest.mark.parametrize("scale", [0.9, 0.93, 0.95, 0.97, 0.98, 1.0, 1.02, 1.05, 1.1, 1.15, 0.0, -1.0])
@pytest.mark.parametrize("wrong", [0.99, 1.0, 1.01])
def test_however_wrong_the_accelerometer_it_sinks_by_a_throttle_map_that_is_known(scale: float, wrong: float) -> None:
    time, height, climb = np.array(descent(2.5, 0.0, scale=scale, wrong=wrong)).T
    assert height.max() <= 2.5 and climb[time > 1.0].max() < -0.15
    assert abs(climb[-1]) < (1.5 if wrong == 1.0 else 1.65)
    assert time[-1] < blind_time(2.5)  # the throttle is not cut before


@pytest.mark.parametrize("wrong", [0.8, 1.2])
@pytest.mark.parametrize("climb", [-1.0, 0.0, 2.0])
def test_a_map_that_was_never_learned_leaves_the_word_to_the_accelerometer(wrong: float, climb: float) -> None:
    time, height, speed = np.array(descent(1.5, climb, wrong=wrong, doubt=0.45)).T
    assert speed.max() < max(climb, 0.0) + 0.4 and height.max() < 1.5 + max(climb, 0.0) ** 2 / 4 + 0.1
    assert abs(speed[-1]) < 2.0 and time[-1] < blind_time(1.5, climb)


def test_the_speed_is_the_accelerometers_as_far_as_the_throttles_allows() -> None:
    known = seen(moving(0j, 0.0), 0.0)
    after = reckon(known, LEVEL, (0.0, 0.0, GRAVITY + 1.0), (GRAVITY - 1.0, 0.5), STILL, 0.1)
    assert after.velocity[2] == pytest.approx(-0.1) and after.lifted == pytest.approx(-0.3)
    assert after.doubt == pytest.approx(DOUBT + 0.05) and after.climb == pytest.approx(-0.3 + (DOUBT + 0.05) / 2)
    assert after.height == pytest.approx((after.lifted + after.doubt) * 0.1)


def test_what_is_not_known_is_taken_from_the_other() -> None:
    known = seen(moving(1 + 0j, 0.0), 5.0)
    by_force = reckon(known, LEVEL, (0.0, 0.0, GRAVITY - 1.0), None, STILL, 5.05)
    by_thrust = reckon(known, LEVEL, None, (GRAVITY - 1.0, 0.3), STILL, 5.05)
    assert by_force.climb == by_force.lifted == by_thrust.climb == by_thrust.lifted == pytest.approx(-0.25)
    level = reckon(known, None, (0.0, 0.0, GRAVITY), None, STILL, 5.05)
    assert level is not None and level.velocity == pytest.approx((1.0, 0.0, -0.2))
    assert reckon(known, LEVEL, (0.0, 0.0, GRAVITY), None, STILL, 5.0 + LONGEST_STEP + 0.01) is None
    assert reckon(known, LEVEL, None, None, STILL, 5.05) is None


@pytest.mark.parametrize("held", [0.2, -0.35])
def test_a_silence_counts_the_tilt_on_and_does_not_age_the_velocity(held: float) -> None:
    """Two seconds without a word, while the controller holds a tilt, and then while it turns."""
    for rate, told in ((0.0, held), (held / 2, 0.0)):
        known: Reckoning | None = dataclasses.replace(seen(moving(0j, 0.0), 0.0), attitude=Attitude(0.0, told, 0.0))
        speed, pitch = 0.0, told
        for k in range(round(2.0 / DT)):
            assert known is not None
            pitch += rate * DT
            speed += GRAVITY * math.tan(pitch) * DT
            known = reckon(known, None, None, (GRAVITY / math.cos(pitch), 0.1), (0.0, rate, 0.0), (k + 1) * DT)
        assert known.velocity[0] == pytest.approx(speed, rel=0.2) and abs(speed) > 1.5
        assert known.velocity[1] == pytest.approx(0.0, abs=0.01)
        assert known.since == pytest.approx(known.time)  # the time to brake begins once the controller is heard


def test_poses_that_go_on_through_a_silence_replace_the_older_ones() -> None:
    """Meanwhile the velocity that began with an old one was propagated with commands that may never have arrived."""
    reckonings = Reckonings()
    for k in range(round(3.0 / DT)):
        now = k * DT
        if now < 1.0 or k % 2:
            odometry = moving(0j, 0.0)
            reckonings = reckonings.seen(seen(odometry, now))
        reckonings = reckonings.on(lambda r, now=now: reckon(r, None, None, (0.5 * GRAVITY, 0.1), STILL, now + DT))
    oldest = reckonings.anchors[0]
    assert oldest.begun > 3.0 - (ANCHORS + 1) * ANCHOR_S - DT
    assert reckonings.alone(wrong=True).newest is not None
    assert oldest.climb > -0.5 * GRAVITY * (ANCHORS + 1) * ANCHOR_S


@pytest.mark.parametrize(("climb", "lean"), [(-2.5, 0.0), (-0.5, -0.1), (0.6, 0.05), (0.0, 0.0)])
def test_where_the_height_is_not_known_it_sinks_however_wrong_the_speed(climb: float, lean: float) -> None:
    """The speed is `climb` more than the true one, accelerometer and map tell `lean` m/s^2 too much, and the height is
    only known to be at most 4.5 m.
    """
    z, v, trim, tops = 2.5, 0.0, 0.0, [2.5]
    poses = Reckonings(Reckoning((0.0, 0.0, climb), climb, 0.05, 0.0, 0.0, 0.0, -30.0))
    told = Inertial(reckonings=poses.alone(wrong=False, height=4.5))
    flight, level = Flight(Mode.LAND, blind=True, lost=(0.0, 4.5, 0.0)), Attitude(0.0, 0.0, 0.0)
    for k in range(round(25 / DT)):
        now = (k + 1) * DT
        command, trim, told = descend(flight, told, level, trim, now, DT)
        force = float(command.thrust)
        v, z = v + (force - GRAVITY) * DT, z + v * DT
        tops.append(z)
        assert told.reckoned is not None
        on = reckon(told.reckoned, level, (0.0, 0.0, force + lean), (force + lean, 0.0), STILL, now)
        told = dataclasses.replace(told, reckonings=Reckonings(on), touch=Touch())
        if z < 0:
            break
    assert z < 0, "it does not stay in the air"
    assert max(tops) < 12.0
    if abs(climb) < 1:
        assert v > -4.0
