"""The estimate of the motion by poses and sensors, and the commands of take-off and hover."""

import math

import numpy as np
import pytest

from e2efly.control import Ctbr, Quat, Vec3
from e2efly.flight.attitude import Attitude
from e2efly.flight.pilot import guidance
from e2efly.flight.pilot.estimate import OUTLIERS_S, RESTART_S, StateEstimate, enter, see
from e2efly.flight.pilot.flight_state import Flight, Mode, Target
from e2efly.flight.pilot.hover import LIFTED, rates_of
from e2efly.flight.pilot.hovering import Seen, UnderWay, hover_controller
from e2efly.flight.pose.conditions import Checks
from e2efly.policy.odometry import Odometry, Sample
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from tests.flight.test_pose_tracking import LEVEL, T, sample

HOVER, GROUND = Flight(Mode.HOVER), Flight()
PID = hover_controller("pid", load_vehicle("vis_r"), 0.06)


def hovered(flight: Flight, target: Target, odometry: Odometry, trim: float) -> tuple[Ctbr, float]:
    """The first command of a controller, and the trim."""
    parts = Vec3(*odometry.position), Vec3(*odometry.velocity), Quat(*odometry.quaternion), Vec3(*odometry.body_rate)
    command, _, trim = guidance.hover(PID, PID.begin(), flight, target, Seen(*parts), UnderWay(), trim, T)
    return command, trim


def told(before: StateEstimate, *samples: Sample, flight: Flight = HOVER, now: float | None = None) -> StateEstimate:
    for one in samples:
        before = see(before, [one], flight, None, one.received)
    return before if now is None else see(before, [], flight, None, now)


def good(flight: Flight = HOVER) -> StateEstimate:
    return told(StateEstimate(Checks(), 0.1), *(sample(k * T) for k in range(50)), flight=flight)


def test_one_outlier_ends_no_flight_but_outliers_that_last_do() -> None:
    before, off = good(), [sample(0.49 + k * T, quaternion=1.05 * LEVEL) for k in range(1, 20)]
    assert before.pose_problem is None
    assert told(before, off[0]).pose_problem is None
    lasting = round(OUTLIERS_S / T) + 1
    assert "length is 1.05" in (told(before, *off[:lasting]).pose_problem or "")


def test_a_source_that_falls_silent_is_told_with_its_own_problem() -> None:
    late = see(good(), [], HOVER, None, 51.0, "connection refused")
    assert late.pose_problem == "the newest is 0.51 s old (connection refused)"
    assert late.heading_error is None
    assert see(StateEstimate(Checks(), 0.1), [], GROUND, None, 51.0).pose_problem == "none has come"


@pytest.mark.parametrize(("flight", "flies_again"), [(GROUND, True), (HOVER, False)])
def test_a_vehicle_that_was_carried_elsewhere_is_tracked_anew_on_the_ground_alone(
    flight: Flight, flies_again: bool
) -> None:
    away = [sample(0.5 + k * T, x=9.0) for k in range(round(RESTART_S / T) + 60)]
    assert (told(good(flight), *away, flight=flight).pose_problem is None) is flies_again


def test_roll_and_pitch_of_controller_and_poses_are_compared() -> None:
    estimate = good()
    assert estimate.attitude_error(Attitude(0.1, -0.3, 2.0)) == pytest.approx(0.3)
    assert estimate.attitude_error(Attitude(math.tau + 0.1, 0.0, 0.0)) == pytest.approx(0.1)
    assert estimate.attitude_error(None) is None


def odometry(height: float, climb: float = 0.0, x: float = 0.0) -> Odometry:
    return Odometry(0.0, np.array([x, 0.0, height]), np.array([0.0, 0.0, climb]), LEVEL, np.zeros(3))


def test_a_take_off_does_not_tilt_before_it_has_left_the_ground() -> None:
    target, flight = Target((1.0, 1.0, 0.5), 0.7), Flight(Mode.TAKEOFF)
    standing, _ = hovered(flight, target, odometry(LIFTED - 0.01), 0.0)
    assert rates_of(standing) == (0.0, 0.0, 0.0)
    lifted, _ = hovered(flight, target, odometry(LIFTED + 0.01), 0.0)
    assert all(abs(rate) > 0.1 for rate in rates_of(lifted))


def test_the_trim_grows_while_a_take_off_does_not_climb_and_fades_in_the_air() -> None:
    target, trim = Target((0.0, 0.0, 0.5), 0.0, climb=0.4), 0.0
    for _ in range(100):
        command, trim = hovered(Flight(Mode.TAKEOFF), target, odometry(0.0), trim)
    assert trim == pytest.approx(guidance.TRIM_GAIN * 0.4)
    for _ in range(1000):
        command, trim = hovered(Flight(Mode.TAKEOFF), target, odometry(0.0), trim)
    assert trim == guidance.TRIM[1]  # it stands tethered: no more thrust than this is added
    hovering = Target((0.0, 0.0, 1.0), 0.0)
    for _ in range(round(guidance.TRIM_FADE / T)):
        command, trim = hovered(HOVER, hovering, odometry(1.0), trim)
    assert trim == pytest.approx(guidance.TRIM[1] / math.e)
    assert float(command.thrust) == pytest.approx(GRAVITY + trim)


def test_a_steady_hover_sends_body_rates_of_zero() -> None:
    target = Target((0.001, 0.0, 1.0), 0.0)  # they are held for long should the link fall silent
    command, _ = hovered(HOVER, target, odometry(1.0), 0.0)
    assert rates_of(command) == (0.0, 0.0, 0.0)


def test_what_was_propagated_from_the_ground_ends_with_the_take_off() -> None:
    """After some seconds it would be worse than what the poses have said since."""
    init, off, hover = (Flight(mode=mode) for mode in (Mode.INIT, Mode.TAKEOFF, Mode.HOVER))
    flying = enter(good(flight=init), init, off)
    assert flying.inertial.reckonings.grounded is not None
    assert enter(flying, off, hover).inertial.reckonings.grounded is None
