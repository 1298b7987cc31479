"""Which of the firmware's mixers drives a vehicle's rotors."""

import dataclasses

import numpy as np
import pytest

from e2efly.flight.betaflight.mixers import MIXERS, mixer_of
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix


def turned(name: str, degrees: float) -> Vehicle:
    """A vehicle whose frame is turned to the left."""
    vehicle, angle = load_vehicle(name), np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return dataclasses.replace(vehicle, rotor_position=vehicle.rotor_position @ turn.T)


@pytest.mark.parametrize(
    ("name", "degrees", "mixer"),
    [
        ("vis_r", 0, "QUADX"), ("hexa", 0, "HEX6X"), ("hexa", 30, "HEX6"), ("octo", 0, "OCTOFLATX"),
        ("octo", 22.5, "OCTOFLATP"),
    ],
)  # fmt: skip
def test_the_mixers_outputs_turn_the_vehicle_about_their_axis_alone(name: str, degrees: float, mixer: str) -> None:
    vehicle = turned(name, degrees)
    found = mixer_of(vehicle)
    assert found.name == mixer
    assert sorted(found.motors) == list(range(len(MIXERS[mixer])))
    shares = found.shares * np.array([[1.0], [1.0], [-1.0 if found.reversed else 1.0]])
    wrench = allocation_matrix(vehicle)[1:] @ (shares * [[1.0], [1.0], [-1.0]]).T
    wrench /= np.abs(allocation_matrix(vehicle)[1:]).sum(1)[:, None]
    assert np.diag(wrench).min() > 0.5
    assert np.abs(wrench - np.diag(np.diag(wrench))).max() < 0.05


def test_frames_that_no_mixer_drives_are_refused_by_name() -> None:
    hexa = load_vehicle("hexa")
    tilted = dataclasses.replace(hexa, rotor_axis=np.tile([0.0, 0.0, 1.0], (6, 1)))
    unlike = dataclasses.replace(hexa, rotor_spin=np.array([1, 1, -1, -1, 1, -1]))
    for vehicle in (tilted, unlike, turned("vis_r", 45)):
        with pytest.raises(ValueError, match=f"vehicle '{vehicle.name}' has {vehicle.rotor_count} rotors as no mixer"):
            mixer_of(vehicle)


def test_a_quadrotor_needs_no_line_of_its_own_and_a_hexacopter_two() -> None:
    assert mixer_of(load_vehicle("vis_r")).lines == ()
    assert mixer_of(load_vehicle("hexa")).lines == ("mixer HEX6X", "set yaw_motors_reversed=ON")
