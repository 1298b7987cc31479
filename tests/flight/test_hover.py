"""The controllers of take-off, hover and landing, and the blind descent."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import settings as hypothesis_settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from e2efly.control import COMMAND_MODES
from e2efly.flight.attitude import Attitude, attitude_of
from e2efly.flight.pilot.hover import (
    LEVEL_RATE,
    SINK_SPEED,
    FlightMotion,
    blind,
    blind_time,
    controlled,
    flight_gains,
    sink_time,
)
from e2efly.policy.odometry import Odometry
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle, vehicle_names
from e2efly.vehicles.vehicle import Vehicle

VEHICLE = load_vehicle("vis_r")


def phase_lost(crossover: float, delay: float, lags: list[float]) -> float:
    """Of a loop of an integrator, a delay and first-order lags at its crossover, rad, over the integrator's 90 deg."""
    return crossover * delay + sum(math.atan(crossover * lag) for lag in lags)


@pytest.mark.parametrize("name", vehicle_names())
@pytest.mark.parametrize("latency", [0.01, 0.06, 0.15])
def test_the_loops_keep_their_phase_over_the_latency(name: str, latency: float) -> None:
    vehicle = load_vehicle(name)
    gentle = flight_gains(vehicle, latency)
    rate_lag = 1 / float(np.min(vehicle.rate_gain[:2]))
    tilt = float(gentle.attitude_gain[0])
    # the attitude loop: half a radian lost at the most, so that 60 degrees of phase margin are left
    assert phase_lost(tilt, latency, [rate_lag]) <= 0.5
    # the velocity loop acts through the attitude loop; the position loop through both
    speed = float(gentle.velocity_gain[0])
    assert phase_lost(speed, latency, [rate_lag, 1 / tilt]) < math.radians(45)
    place = float(gentle.position_gain[0])
    assert phase_lost(place, latency, [rate_lag, 1 / tilt, 1 / speed]) < math.radians(50)
    # no gain is raised, and nothing but the gains is changed
    for gain in ("attitude_gain", "velocity_gain", "position_gain"):
        assert (getattr(gentle, gain) <= getattr(vehicle, gain) + 1e-12).all()
        assert (getattr(gentle, gain) > 0).all()
    assert gentle.mass == vehicle.mass and (gentle.rate_gain == vehicle.rate_gain).all()


def test_a_shorter_latency_allows_more() -> None:
    gains = [flight_gains(VEHICLE, latency).attitude_gain[0] for latency in (0.0, 0.03, 0.06, 0.2)]
    assert gains == sorted(gains, reverse=True) and len(set(gains)) == 4


@pytest.mark.parametrize("mode", [name for name, mode in COMMAND_MODES.items() if mode.controller])
def test_a_command_becomes_what_the_cascade_says(mode: str) -> None:
    q = np.array([0.9, 0.1, -0.2, 0.3])
    odometry = Odometry(0.0, np.array([1.0, 2, 3]), np.array([0.1, -0.2, 0.3]), q / np.linalg.norm(q), np.zeros(3))
    command = (1.5, 2.0, 3.5, 0.4)
    out, same = controlled(VEHICLE, mode, odometry, command), controlled(VEHICLE, mode, odometry, np.array(command))
    controller = COMMAND_MODES[mode].controller
    assert controller is not None
    wanted = controller(VEHICLE, FlightMotion.of(odometry), tuple(map(np.float64, command)))  # type: ignore[arg-type]
    for values in (out, same):
        assert np.isfinite([values.thrust, values.rate.x, values.rate.y, values.rate.z]).all()
        assert (values.thrust, values.rate) == (wanted.thrust, wanted.rate)


def fly_blind(
    seconds: float, *, roll: float = 0.0, pitch: float = 0.0, climb: float = 0.0, error: float = 0.0, seen: bool = True
) -> np.ndarray:
    """A rigid body with a rate loop of 40 ms lag behind a link of 20 ms; rows of t, tilt, height, vertical speed.

    Args:
        seconds: how long.
        roll: first angle, rad.
        pitch: first angle, rad.
        climb: first vertical speed, m/s.
        error: of the throttle map: so much more thrust comes than was asked for.
        seen: whether the controller tells its attitude.
    """
    dt, delay = 0.002, 10
    R = Rotation.from_euler("YX", [pitch, roll]).as_matrix()
    rate, height, rows, first = np.zeros(3), 0.0, [], climb
    asked = [(np.zeros(3), GRAVITY)] * (delay + 1)
    attitude = None
    for k in range(round(seconds / dt)):
        if k % 10 == 0 and seen:  # the controller's answer, in its steps of 0.1 deg
            angles = math.atan2(R[2, 1], R[2, 2]), -math.asin(max(-1.0, min(1.0, R[2, 0])))
            told = [math.radians(round(math.degrees(angle), 1)) for angle in angles]
            attitude = Attitude(told[0], told[1], 0.0)
        if k % 5 == 0:
            command = blind(attitude, k * dt, first)
            asked.append((np.array([command.rate.x, command.rate.y, command.rate.z], float), float(command.thrust)))
        else:
            asked.append(asked[-1])
        wanted, thrust = asked.pop(0)
        rate = rate + (wanted - rate) * dt / 0.04
        R = R @ Rotation.from_rotvec(rate * dt).as_matrix()
        rows.append((k * dt, math.acos(min(1.0, R[2, 2])), height, climb))
        climb += (thrust * (1 + error) * R[2, 2] - GRAVITY) * dt
        height += climb * dt
    return np.array(rows)


@pytest.mark.parametrize(("roll", "pitch"), [(40, 0), (-40, 0), (0, 40), (30, -30), (170, 0)])
def test_blind_it_levels(roll: float, pitch: float) -> None:
    t, tilt, _, _ = fly_blind(3.0, roll=math.radians(roll), pitch=math.radians(pitch)).T
    if abs(roll) + abs(pitch) < 90:
        assert tilt[t > 0.8].max() < math.radians(5)
    assert tilt[t > 1.7].max() < math.radians(3)


@pytest.mark.parametrize("error", [-0.02, 0.0, 0.0199])
@pytest.mark.parametrize("angle", [0.0, math.radians(40)])
def test_blind_it_sinks_slowly_and_never_climbs(error: float, angle: float) -> None:
    _, _, height, climb = fly_blind(8.0, roll=angle, error=error).T
    assert climb.max() < 0.03 and climb[-1] < -0.3
    assert np.abs(climb[height > -3.0]).max() < 2.6
    reached = np.flatnonzero(height < -3.0)
    assert len(reached) and reached[0] * 0.002 < blind_time(3.0)  # the throttle is not closed before


@pytest.mark.parametrize("climb", [3.0, 1.0, -1.0, -4.0])
def test_blind_a_climb_is_ended_and_a_fall_is_caught(climb: float) -> None:
    t, _, height, speed = fly_blind(6.0, climb=climb).T
    settled = np.abs(t - sink_time(climb) - 0.1).argmin()
    assert speed[settled] == pytest.approx(-SINK_SPEED, abs=0.15)
    assert height.max() <= max(climb, 0.0) ** 2 / 6.0 + max(climb, 0.0) * 0.03 + 1e-9
    landed = np.flatnonzero(height < -1.5)
    assert len(landed) and t[landed[0]] < blind_time(1.5, climb)


def test_blind_without_an_attitude_the_rates_are_zero() -> None:
    first, later = blind(None, 0.0), blind(None, sink_time() + 0.01)
    for command in (first, later):
        assert (command.rate.x, command.rate.y, command.rate.z) == (0, 0, 0)
    assert first.thrust < later.thrust < GRAVITY


@hypothesis_settings(deadline=None)
@given(st.floats(-math.pi, math.pi), st.floats(-math.pi / 2, math.pi / 2), st.floats(0, 100), st.floats(-10, 10))
def test_blind_it_asks_for_what_can_be_flown(roll: float, pitch: float, elapsed: float, climb: float) -> None:
    out = blind(Attitude(roll, pitch, 0.0), elapsed, climb)
    assert abs(out.rate.x) <= LEVEL_RATE and abs(out.rate.y) <= LEVEL_RATE and out.rate.z == 0
    assert 0 < out.thrust <= 2 * (GRAVITY + 3.0)
    assert out.rate.x * roll <= 0 and out.rate.y * pitch <= 0


@hypothesis_settings(deadline=None)
@given(st.floats(0, 50), st.floats(0, 50), st.floats(-5, 5))
def test_a_higher_descent_is_given_longer(height: float, more: float, climb: float) -> None:
    assert 1.8 <= blind_time(-1.0) <= blind_time(height, climb) <= blind_time(height + more, climb)


@hypothesis_settings(deadline=None)
@given(st.floats(-3.1, 3.1), st.floats(-1.55, 1.55), st.floats(-3.1, 3.1))
def test_roll_and_pitch_are_those_of_the_convention(roll: float, pitch: float, yaw: float) -> None:
    q = Rotation.from_euler("ZYX", [yaw, pitch, roll]).as_quat(scalar_first=True)
    for sign in (1, -1):
        found = attitude_of(*(sign * q))
        assert (found.roll, found.pitch) == pytest.approx((roll, pitch), abs=1e-6)


def test_hover_returns_from_a_metre_off_over_the_link() -> None:
    """Position loop, attitude loop, rate loop of 40 ms and a latency: it comes back without swinging past by much."""
    for name in vehicle_names():
        vehicle = load_vehicle(name)
        assert _swing(flight_gains(vehicle, 0.06), 0.06, 1 / float(np.min(vehicle.rate_gain[:2]))) < 0.1


def _swing(vehicle: Vehicle, latency: float, lag: float) -> float:
    """How far it flies past the point that it comes to from a metre away, in the plane, m."""
    dt, x, v, tilt, rate = 0.002, -1.0, 0.0, 0.0, 0.0
    newest, farthest = (0.0, GRAVITY), 0.0
    asked = [newest] * round(latency / dt)
    for k in range(round(10.0 / dt)):
        if k % 5 == 0:
            q = np.array([math.cos(tilt / 2), 0.0, math.sin(tilt / 2), 0.0])
            odometry = Odometry(0.0, np.array([x, 0, 1.0]), np.array([v, 0, 0]), q, np.array([0, rate, 0]))
            out = controlled(vehicle, "position", odometry, (0.0, 0.0, 1.0, 0.0))
            newest = float(out.rate.y), float(out.thrust)
        asked.append(newest)
        wanted, thrust = asked.pop(0)
        rate += (wanted - rate) * dt / lag
        tilt += rate * dt
        v += thrust * math.sin(tilt) * dt
        x += v * dt
        farthest = max(farthest, x)
    assert abs(x) < 0.01 and abs(v) < 0.01
    return farthest
