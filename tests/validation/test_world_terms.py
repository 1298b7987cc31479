"""The rig's world, of vehicles with terms that their files may leave out: the same physics as the simulator's."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.simulation.physics import Physics, State, step
from e2efly.validation.world import FlownBody, World
from e2efly.vehicles.loading import load_vehicle

TERMS: dict[str, Any] = {
    "rotor_inertia": 1.5e-5,
    "motor_time_constant_down": 0.06,
    "centre_of_mass": np.array([0.004, -0.006, 0.03]),
    "inertia_products": np.array([1e-4, -2e-4, 5e-5]),
    "drag_torque": np.array([2e-3, 3e-3, 1e-3]),
    "nominal_voltage": 14.8,
    "battery_voltage": 14.4,
    "voltage_sag": 0.2,
    "inflow_loss": 60.0,
}


def test_the_rig_carries_the_same_body() -> None:
    plain = load_vehicle("vis_r")
    vehicle = dataclasses.replace(plain, **TERMS)
    motors, zero = np.array([0.45, 0.5, 0.55, 0.5]), np.zeros(3)
    begin = FlownBody(
        np.array([0.0, 0, 20]), np.array([3.0, -1, 0]), np.array([1.0, 0, 0, 0]), zero, np.full(4, 2100.0)
    )
    flown, without = (World(v).advance(begin, motors, 0.2) for v in (vehicle, plain))
    physics = Physics.of(vehicle, "rotor_thrust", "rk4", 1000.0)
    speed = motors * vehicle.full_rotor_speed
    thrusts = jnp.asarray(np.array([vehicle.rotor_thrust(w) for w in speed]), jnp.float32)
    state = State(*(jnp.asarray(getattr(begin, f.name), jnp.float32) for f in dataclasses.fields(FlownBody)))
    one = jax.jit(lambda state: step(physics, physics.nominal, state, thrusts))
    for _ in range(200):
        state = one(state)
    for f in dataclasses.fields(FlownBody):
        np.testing.assert_allclose(getattr(flown, f.name), getattr(state, f.name), rtol=1e-3, atol=2e-3)
    assert np.abs(flown.body_rate - without.body_rate).max() > 0.3


@pytest.mark.parametrize("name", ["rate_integral_gain", "gyro_time_constant"])
def test_the_firmware_has_a_rate_loop_of_its_own(name: str) -> None:
    from e2efly.validation.plants.betaflight import BetaflightPlant

    assert name not in BetaflightPlant.alters
    assert set(TERMS) <= BetaflightPlant.alters
