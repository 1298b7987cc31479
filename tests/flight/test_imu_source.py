"""Motion by the IMU alone: at rest, in flight, carried, after a pause."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from e2efly.control import Quat
from e2efly.flight.pose.sources import open_source
from e2efly.flight.pose.sources.imu_alone import FILTERED_S, ImuSource
from e2efly.policy.odometry import Sample
from e2efly.vehicles.gravity import GRAVITY

DT = 0.01
BIAS, SCALE = np.array([0.01, -0.02, 0.005]), 1.02
UP = np.array([0.0, 0.0, GRAVITY])


def quaternion(turn: Rotation) -> np.ndarray:
    return np.roll(turn.as_quat(), 1)


def rested(turn: Rotation, seconds: float = 3.0) -> tuple[ImuSource, float]:
    """A source whose vehicle has stood with an attitude, with a gyroscope that is off and a wrong scale of forces."""
    source, time = ImuSource(), 100.0
    for _ in range(round(seconds / DT)):
        source.feel(time, BIAS, SCALE * turn.inv().apply(UP), standing=True)
        time += DT
    return source, time


def newest(source: ImuSource, time: float) -> Sample:
    (sample,) = source.read(time)
    return sample


def test_at_rest_it_is_level_at_the_origin_whatever_the_biases() -> None:
    turn = Rotation.from_euler("YX", [0.1, -0.2])
    source, time = rested(turn)
    sample = newest(source, time)
    np.testing.assert_allclose(sample.quaternion, quaternion(turn), atol=1e-6)
    np.testing.assert_array_equal(sample.position, np.zeros(3))
    assert sample.stamp == pytest.approx(time - DT)
    assert source.read(time) == []


def flown(seconds: float, tells: bool, loops: bool = False) -> tuple[np.ndarray, Sample]:
    """The true velocity and what is told after a flight that rolls and pitches. The sensors are sampled. The
    accelerometer is late by its filter, and the velocity as late as it.
    """
    source, time = rested(Rotation.identity())
    began, velocity = time, np.zeros(3)
    fine = DT / 50

    def attitude(t: float) -> Rotation:
        if loops:
            return Rotation.from_euler("y", 6.0 * t)
        return Rotation.from_euler("xy", [0.5 * (1 - math.cos(2 * t)), 0.4 * math.sin(3 * t)])

    def rate(t: float) -> np.ndarray:
        turn = attitude(t - 1e-5).inv() * attitude(t + 1e-5)
        return turn.as_rotvec() / 2e-5

    def force(t: float) -> np.ndarray:
        return np.array([0.2 * math.sin(t), 0.0, GRAVITY * (1.2 + 0.3 * math.sin(4 * t))])

    steps = round(seconds / DT)
    for i in range(steps):
        t = i * DT
        felt, at = force(max(t - FILTERED_S, 0.0)), (began + t, quaternion(attitude(t)))
        source.feel(began + t, rate(t) + BIAS, SCALE * felt, standing=False, attitude=at if tells else None)
        if t + FILTERED_S < (steps - 1) * DT - 1e-9:
            for k in range(50):
                velocity = velocity + fine * (attitude(t + k * fine).apply(force(t + k * fine)) - UP)
    return velocity, newest(source, began + seconds)


def test_in_a_loop_the_filter_of_the_accelerometer_turns_no_force_aside() -> None:
    velocity, sample = flown(math.pi / 3 * 1.5, True, loops=True)
    assert sample.velocity is not None and np.linalg.norm(velocity[:2]) > 2.0
    np.testing.assert_allclose(sample.velocity, velocity, atol=0.12)


@pytest.mark.parametrize("tells", [True, False])
def test_in_flight_it_follows_for_seconds(tells: bool) -> None:
    velocity, sample = flown(6.0, tells)
    assert sample.velocity is not None and np.linalg.norm(velocity) > 3.0
    np.testing.assert_allclose(sample.velocity, velocity, atol=0.015 * float(np.linalg.norm(velocity)))


def test_the_flight_controllers_attitude_corrects_where_up_is_and_not_the_heading() -> None:
    source, time = rested(Rotation.identity())
    theirs = Rotation.from_euler("zx", [1.0, 0.1])
    for _ in range(500):
        source.feel(time, BIAS, SCALE * UP, standing=False, attitude=(time, quaternion(theirs)))
        time += DT
    told = Quat.of(newest(source, time).quaternion)
    assert float(told.tilt()) == pytest.approx(0.1, abs=2e-3)
    assert float(told.yaw()) == pytest.approx(0.0, abs=0.02)


def test_it_tells_nothing_while_it_is_carried_and_starts_anew_where_it_is_put_down() -> None:
    source, time = rested(Rotation.identity())
    for _ in range(20):
        source.feel(time, np.array([0.0, 0.0, 1.0]), UP, standing=True)
        time += DT
    assert source.read(time) == [] and source.problem == "imu: it is being moved; put it down"
    for _ in range(60):
        source.feel(time, BIAS, UP, standing=True)
        time += DT
    assert source.read(time) == [] and source.problem == "imu: it has just been put down"
    for _ in range(120):
        time += DT
        source.feel(time, BIAS, UP, standing=True)
    assert newest(source, time).position.tolist() == [0.0, 0.0, 0.0] and source.problem is None


def test_rotors_that_idle_shake_it_and_do_not_carry_it() -> None:
    source, time = rested(Rotation.identity())
    random = np.random.default_rng(0)
    for _ in range(300):
        shaken = UP + random.normal(0.0, 1.0, 3)
        source.feel(time, BIAS + random.normal(0.0, 0.1, 3), shaken, standing=True)
        time += DT
        assert source.read(time), source.problem


def test_after_a_flight_it_is_levelled_anew_where_it_stands() -> None:
    source, time = rested(Rotation.identity())
    slope = Rotation.from_euler("x", 0.15)
    for _ in range(50):
        source.feel(time, BIAS, UP, standing=False)
        time += DT
    assert source.read(time)
    for _ in range(90):
        source.feel(time, BIAS, slope.inv().apply(UP), standing=True)
        time += DT
        assert source.read(time) == []
    for _ in range(300):
        source.feel(time, BIAS, slope.inv().apply(UP), standing=True)
        time += DT
    np.testing.assert_allclose(newest(source, time).quaternion, quaternion(slope), atol=1e-3)


def test_after_a_pause_in_flight_it_knows_nothing_until_it_stands() -> None:
    source, time = rested(Rotation.identity())
    newest(source, time)
    for pause in (DT, 0.3, DT, DT):
        time += pause
        source.feel(time, BIAS, UP, standing=False)
    assert source.read(time) == [] and source.problem == "imu: the IMU was silent for 0.30 s; accepted: at most 0.2 s"


def test_it_has_no_text_and_says_what_it_is() -> None:
    source = open_source("imu")
    assert source.describe() == "imu, which knows no place" and source.problem == "imu: the IMU has not been heard"
    with pytest.raises(ValueError, match="pose source is 'imu:here'; accepted: imu"):
        open_source("imu:here")
