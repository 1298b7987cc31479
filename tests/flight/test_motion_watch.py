"""Poses against inertial sensors: bodies that are moved along known ways, and poses that lie in every way."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from e2efly.flight.attitude import Attitude
from e2efly.flight.pilot.motion_watch import MotionWatch, feel, see
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY

RATE = 50.0
Lie = Callable[[Odometry], Odometry]


def changed(o: Odometry, **changes: np.ndarray) -> Odometry:
    parts = {"position": o.position, "velocity": o.velocity, "quaternion": o.quaternion, "body_rate": o.body_rate}
    return Odometry(o.time, **{**parts, **changes})


def flip(axis: int) -> Lie:
    sign = np.ones(3)
    sign[axis] = -1
    return lambda o: changed(o, velocity=sign * o.velocity)


LIES: dict[str, Lie] = {
    "x mirrored": flip(0),
    "y mirrored": flip(1),
    "z mirrored": flip(2),
    "velocity negated": lambda o: changed(o, velocity=-o.velocity),
    "velocity zero": lambda o: changed(o, velocity=0 * o.velocity),
    "NED": lambda o: changed(o, velocity=o.velocity[[1, 0, 2]] * [1, 1, -1]),
    "conjugated": lambda o: changed(o, quaternion=o.quaternion * [1, -1, -1, -1]),
    "yaw mirrored": lambda o: changed(o, quaternion=o.quaternion * [1, 1, 1, -1]),
}


def carried(
    lie: Lie = lambda o: o,
    *,
    speed: float = 1.0,
    turn: float = 0.6,
    late: float = 0.03,
    seconds: float = 4.0,
    scale: float = 1.0,
    thrust: float = 1.0,
    latest: float = math.inf,
    seed: int = 0,
) -> list[MotionWatch]:
    """The watch at each pose, of a body that swings along all axes and turns about all of them.

    Args:
        lie: what the pose source makes of the truth.
        speed: of the swinging, m/s.
        turn: of the turning, rad.
        late: age of the poses, s.
        seconds: how long, s.
        scale: of the accelerometer.
        thrust: of the throttle map's word, over the truth.
        latest: that is accepted, s.
        seed: of the noise.
    """
    random, watch, said, poses = np.random.default_rng(seed), MotionWatch(), [], []
    axes = np.array([[3.0, 0.0], [2.3, 1.0], [2.7, 0.5]])
    before = None
    for k in range(round(seconds * RATE)):
        t = k / RATE
        ease = min(t / 0.5, 1.0)
        swing = ease * np.sin(axes[:, 0] * t + axes[:, 1])
        velocity = speed * swing
        then = min(max(t - 1 / RATE, 0.0) / 0.5, 1.0) * np.sin(axes[:, 0] * max(t - 1 / RATE, 0.0) + axes[:, 1])
        acceleration = speed * (swing - then) * RATE
        roll, pitch, yaw = turn * swing
        attitude = Rotation.from_euler("ZYX", [yaw, pitch, roll])
        R = attitude.as_matrix()
        felt = acceleration + np.array([0, 0, GRAVITY])
        force = R.T @ felt + random.normal(0, 0.3, 3)
        gyro = np.zeros(3)
        if before is not None:
            gyro = RATE * (before.inv() * attitude).as_rotvec() + random.normal(0, 0.02, 3)
        before = attitude
        up = float(felt @ R[:, 2])
        watch = feel(watch, Attitude(roll, pitch, 0.0), scale * force, gyro, (thrust * up, 0.01 * GRAVITY), t)
        noisy = velocity + random.normal(0, 0.02, 3)
        poses.append(Odometry(t, np.zeros(3), noisy, attitude.as_quat(scalar_first=True), np.zeros(3)))
        while poses and poses[0].time + late <= t:
            watch = see(watch, lie(poses.pop(0)), latest)
            said.append(watch)
    return said


@pytest.mark.parametrize("speed", [0.0, 0.5, 2.0, 5.0])
@pytest.mark.parametrize("late", [0.0, 0.03, 0.1])
@pytest.mark.parametrize("turn", [0.0, 0.6])
def test_honest_poses_are_never_contradicted(speed: float, late: float, turn: float) -> None:
    for watch in carried(speed=speed, late=late, turn=turn, seconds=6.0):
        assert watch.problem is None and watch.opposed is None and watch.accelerometer_problem is None


@pytest.mark.parametrize("lie", LIES)
@pytest.mark.parametrize("late", [0.0, 0.06])
def test_every_lie_is_told_in_flight(lie: str, late: float) -> None:
    told = [k for k, watch in enumerate(carried(LIES[lie], late=late, speed=1.5)) if watch.problem is not None]
    assert told and told[0] / RATE < 2.5
    assert carried(LIES[lie], late=late, speed=1.5)[told[0]].problem is not None


@pytest.mark.parametrize("lie", ["z mirrored", "velocity negated", "NED"])
def test_opposed_poses_are_told_while_it_is_carried_and_taken_back_once_they_agree(lie: str) -> None:
    watches = carried(LIES[lie], speed=1.0, turn=0.2)
    assert any(watch.opposed is not None for watch in watches)
    assert any(watch.agrees for watch in carried(speed=1.0, turn=0.2))


def test_a_climb_with_mirrored_height_is_told_within_a_decimetre() -> None:
    watch, height, climb = MotionWatch(), 0.0, 0.0
    for k in range(100):
        t = k / RATE
        push = 2.0 if k > 25 else 0.0
        height, climb = height + climb / RATE, climb + push / RATE
        force = np.array([0.0, 0.0, GRAVITY + push])
        watch = feel(watch, Attitude(0.0, 0.0, 0.0), force, np.zeros(3), (GRAVITY, GRAVITY), t)
        seen = Odometry(t, np.zeros(3), np.array([0.0, 0.0, -climb]), np.array([1.0, 0, 0, 0]), np.zeros(3))
        watch = see(watch, seen)
        if watch.problem:
            break
    assert watch.problem is not None and 0.0 < height < 0.1


def test_an_accelerometer_that_poses_and_throttle_contradict_is_the_one_that_is_wrong() -> None:
    """It hovers, and the accelerometer breaks."""
    watch = MotionWatch()
    for k in range(200):
        force = np.array([0.0, 0.0, GRAVITY * (1.0 if k < 100 else -1.0)])
        watch = feel(watch, Attitude(0.0, 0.0, 0.0), force, np.zeros(3), (GRAVITY, 0.1), k / RATE)
        watch = see(watch, Odometry(k / RATE, np.zeros(3), np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3)))
        if watch.accelerometer_problem:
            break
    assert watch.accelerometer_problem is not None and watch.problem is None and 100 <= k < 135


@pytest.mark.parametrize("late", [0.0, 0.05, 0.1, 0.14])
def test_how_late_poses_are_is_measured_by_motion(late: float) -> None:
    lates = [watch.late for watch in carried(late=late, speed=2.0, turn=0.0, seconds=6.0)[100:]]
    assert np.median(lates) == pytest.approx(late, abs=0.03)
    problems = [w.problem for w in carried(late=late, speed=2.0, turn=0.0, seconds=6.0, latest=0.08)]
    assert any(problems) is (late > 0.08)


def test_silence_of_the_controller_is_no_contradiction() -> None:
    watch = MotionWatch()
    for k in range(100):
        t = k / RATE
        if k < 20:
            force = np.array([0.0, 0.0, GRAVITY])
            watch = feel(watch, Attitude(0.0, 0.0, 0.0), force, np.zeros(3), (GRAVITY, 0.1), t)
        velocity = np.array([0.0, 0.0, 0.0 if k < 20 else (k - 20) / RATE])
        watch = see(watch, Odometry(t, np.zeros(3), velocity, np.array([1.0, 0, 0, 0]), np.zeros(3)))
        assert watch.problem is None
