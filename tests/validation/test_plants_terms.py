"""MuJoCo as a plant, of vehicles with terms that their files may leave out, against our own physics."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.simulation.physics import Physics, State, started
from e2efly.validation.plant import RigidState
from e2efly.validation.plants.mujoco import HOLD, MujocoPlant
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle
from tests.validation.test_plants import fine

TERMS: dict[str, dict[str, Any]] = {
    "rotor inertia": {"rotor_inertia": 1.5e-5},
    "lag down": {"motor_time_constant_down": 0.06},
    "centre of mass": {"centre_of_mass": [0.004, -0.006, 0.03]},
    "drag torque": {"drag_torque": [2e-3, 3e-3, 1e-3]},
    "rate loop": {"rate_integral_gain": [60.0, 50.0, 20.0], "gyro_time_constant": 0.004},
    "battery": {"nominal_voltage": 14.8, "battery_voltage": 14.4, "voltage_sag": 0.2, "speed_per_volt": 0.9},
    "ceiling": {"rotor_speed_ceiling": [3000.0, 3300.0, 2800.0, 3600.0]},
    "inflow loss": {"inflow_loss": 60.0},
    "full inertia": {"inertia_products": [1e-4, -2e-4, 5e-5]},
}
"""Of the VIS-R's size."""
TERMS["all of them"] = {name: value for term in TERMS.values() for name, value in term.items()}


@pytest.fixture(scope="module")
def flown() -> Callable[[Vehicle, str], tuple[State, list[RigidState], np.ndarray]]:
    """A tumbling second of a vehicle in either physics, with saturated mixers: ours, MuJoCo's, its rotor speeds.

    Either runs the flight controller at the 4 kHz at which a vehicle does.
    """
    q = np.array([0.7, 0.4, -0.5, 0.3])
    start = RigidState(np.array([0.0, 0, 50]), np.array([3.0, -5, 2]), q / np.linalg.norm(q), np.array([2.0, -3, 1]))

    def fly(vehicle: Vehicle, mode: str) -> tuple[State, list[RigidState], np.ndarray]:
        rng, low = np.random.default_rng(0), np.array([0.0, *-vehicle.body_rate_max])
        high = np.array([2 * GRAVITY, *vehicle.body_rate_max])
        if mode == "rotor_thrust":
            low, high = np.full(4, 0.3), np.full(4, 4.0)
        commands = np.repeat(rng.uniform(low, high, (20, 4)), round(0.05 / HOLD), axis=0)
        physics = Physics.of(vehicle, mode, "rk4", 1 / HOLD, dtype=np.float64)
        arrays = (start.position, start.velocity, start.quaternion, start.body_rate)
        state = State(*(jnp.asarray(x) for x in (*arrays, np.full(4, vehicle.hover_rotor_speed))))
        ours = fine(physics, started(physics, vehicle, state), jnp.asarray(commands))
        plant, theirs = MujocoPlant(vehicle, mode, largest_step=HOLD), []
        plant.reset(start)
        for command in commands:
            plant.step(command, HOLD)
            theirs.append(plant.state)
        return ours, theirs, plant.rotor_speed

    return fly


@pytest.mark.whole(but=1)
@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize(
    ("term", "mode"),
    [
        (term, mode)
        for term in TERMS
        for mode in ("rotor_thrust", "ctbr")
        if (term, mode) != ("rate loop", "rotor_thrust")
    ],
)
def test_a_tumbling_second_with_a_term_agrees(
    term: str, mode: str, flown: Callable[[Vehicle, str], tuple[State, list[RigidState], np.ndarray]]
) -> None:
    plain = load_vehicle("vis_r")
    vehicle = dataclasses.replace(plain, **{name: np.asarray(value) for name, value in TERMS[term].items()})
    ours, theirs, speeds = flown(vehicle, mode)
    rates = np.array([s.body_rate for s in theirs])
    np.testing.assert_allclose(ours.position, [s.position for s in theirs], atol=1e-3)
    np.testing.assert_allclose(ours.velocity, [s.velocity for s in theirs], atol=1e-2)
    np.testing.assert_allclose(ours.body_rate, rates, atol=3e-2)
    np.testing.assert_allclose(ours.rotor_speed[-1], speeds, rtol=1e-3)
    without = np.array([s.body_rate for s in flown(plain, mode)[1]])
    assert np.abs(rates - without).max() > 0.3  # ten times what the two may differ by
