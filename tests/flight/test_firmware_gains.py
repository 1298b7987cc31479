"""Betaflight's gains for a vehicle: with them, its rate loop over the vehicle's rotors answers as the file says."""

from dataclasses import replace
from math import degrees

import numpy as np
import pytest

from e2efly.flight.betaflight.firmware_gains import LARGEST, gain_lines, gains_of, rate_gain_of
from e2efly.flight.betaflight.versions import RELEASES
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix

VEHICLES = ("vis_r", "vis_h", "crazyflie")
MIX = np.array([[-1, -1, 1, 1], [1, -1, 1, -1], [1, -1, -1, 1]])
"""Signs of Betaflight's QUADX mixer, as torques of body FLU: roll, pitch, yaw by motor."""
STEP_S, LONG_S = 0.001, 0.4


def by_file(vehicle: Vehicle, axis: int, size: float) -> np.ndarray:
    """The rate after a step of the command: torque J K (wanted - rate), behind the lag of the motors."""
    rate, torque, rates = 0.0, 0.0, []
    for _ in range(round(LONG_S / STEP_S)):
        torque += (vehicle.rate_gain[axis] * (size - rate) - torque) * STEP_S / vehicle.motor_time_constant
        rate += torque * STEP_S
        rates.append(rate)
    return np.array(rates)


def by_firmware(vehicle: Vehicle, axis: int, size: float, pid: tuple[int, int, int], idle: float) -> np.ndarray:
    """The rate with Betaflight's PID in its own units, deg/s and per mille, a delay, and rotors with their thrust map.

    The mixing, the rotors and the torque are those of the whole vehicle at hover thrust.
    """
    p, i, d = np.array(pid) * (0.032029, 0.244381, 0.000529)
    full, speed = vehicle.full_rotor_speed, np.full(4, vehicle.hover_rotor_speed)
    throttle = (vehicle.hover_rotor_speed / full - idle) / (1 - idle)
    rate, integral, rates = 0.0, 0.0, [0.0] * 5
    for _ in range(round(LONG_S / STEP_S)):
        seen, before = degrees(rates[-4]), degrees(rates[-5])
        error = degrees(size) - seen
        integral += i * error * STEP_S
        output = (p * error + integral - d * (seen - before) / STEP_S) / 1000
        motors = np.clip(throttle + output * MIX[axis], 0, 1)
        speed = speed + ((idle + (1 - idle) * motors) * full - speed) * STEP_S / vehicle.motor_time_constant
        thrusts = np.array([vehicle.rotor_thrust(w) for w in speed])
        rate += float(allocation_matrix(vehicle)[1 + axis] @ thrusts) / vehicle.inertia[axis] * STEP_S
        rates.append(rate)
    return np.array(rates[5:])


@pytest.mark.parametrize("name", VEHICLES)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_firmware_turns_the_vehicle_as_its_file_says(name: str, axis: int) -> None:
    vehicle = load_vehicle(name)
    gains = gains_of(vehicle)
    size = 0.2 * vehicle.body_rate_max[axis]
    file, firmware = by_file(vehicle, axis, size), by_firmware(vehicle, axis, size, gains.pid[axis], gains.idle)
    assert np.abs(firmware - file).max() < 0.12 * size


@pytest.mark.parametrize("name", VEHICLES)
def test_what_a_controller_has_is_told_in_the_files_units(name: str) -> None:
    vehicle = load_vehicle(name)
    pid = gains_of(vehicle).pid
    np.testing.assert_allclose(rate_gain_of(vehicle, pid), vehicle.rate_gain, rtol=0.12)  # they are whole numbers
    double = tuple((2 * p, i, d) for p, i, d in pid)
    assert all(now > 1.7 * k for now, k in zip(rate_gain_of(vehicle, double), vehicle.rate_gain, strict=True))


def test_gains_stay_within_what_the_firmware_takes() -> None:
    vehicle = load_vehicle("vis_r")
    for factor in (1e-3, 1e3):
        pids = gains_of(replace(vehicle, inertia=vehicle.inertia * factor)).pid
        assert all(1 <= p <= LARGEST and 0 <= i <= LARGEST and 0 <= d <= LARGEST for p, i, d in pids)


def test_the_lines_name_the_settings_of_each_release() -> None:
    gains = gains_of(load_vehicle("crazyflie"))
    lines = {release.name: gain_lines(gains, release) for release in RELEASES}
    assert {"set p_roll=10", "set anti_gravity_gain=0", "set motor_idle=1311", "set d_max_yaw=0"} <= set(lines["4.6"])
    assert {"set dshot_idle_value=1311", "set min_throttle=1131", "set d_min_roll=0"} <= set(lines["4.5"])
