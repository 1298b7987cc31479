"""The mixer: exact where it can be, inside the limits always, attitude before thrust."""

import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.control.vectors import Vec3
from e2efly.simulation.physics import Mixer
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix

pytestmark = pytest.mark.usefixtures("x64")

NAMES = ["vis_r", "vis_h", "crazyflie"]


def mix(vehicle: Vehicle, wrench: np.ndarray) -> np.ndarray:
    """Rotor thrusts (n, 4) for [collective, torques] (n, 4)."""
    wrench = jnp.asarray(wrench)
    thrusts = Mixer.of(vehicle, np.float64).thrusts(wrench[:, 0], Vec3.of(wrench[:, 1:]))
    return np.stack(thrusts, axis=-1)


def wrenches(vehicle: Vehicle, seed: int, low: float, high: float, n: int = 300) -> tuple[np.ndarray, np.ndarray]:
    """Random thrusts between two fractions of the range, and the wrench of each."""
    thrust_min, thrust_max = vehicle.thrust_range
    fraction = np.random.default_rng(seed).uniform(low, high, (n, 4))
    thrusts = thrust_min + (thrust_max - thrust_min) * fraction
    return thrusts, thrusts @ allocation_matrix(vehicle).T


@pytest.mark.parametrize("name", NAMES)
def test_a_feasible_wrench_is_realised_exactly(name: str) -> None:
    vehicle = load_vehicle(name)
    thrusts, wrench = wrenches(vehicle, 0, 0.0, 1.0)
    np.testing.assert_allclose(mix(vehicle, wrench), thrusts, rtol=1e-9)


@pytest.mark.parametrize("name", NAMES)
def test_limits_hold_whatever_is_asked(name: str) -> None:
    vehicle = load_vehicle(name)
    low, high = vehicle.thrust_range
    for scale in (1.0, 10.0, 1e6):
        _, wrench = wrenches(vehicle, 1, -3 * scale, 3 * scale)
        thrusts = mix(vehicle, wrench)
        assert thrusts.min() >= low
        assert thrusts.max() <= high


@pytest.mark.parametrize("name", NAMES)
def test_attitude_goes_before_thrust(name: str) -> None:
    """A torque that four rotors can give at some thrust is given in full, and the thrust nearest to the asked one."""
    vehicle = load_vehicle(name)
    low, high = vehicle.thrust_range
    _, wrench = wrenches(vehicle, 2, 0.0, 1.0)
    for more, bound, nearest in ((4 * high, high, np.max), (-4 * high, low, np.min)):
        thrusts = mix(vehicle, wrench + np.array([more, 0, 0, 0]))
        np.testing.assert_allclose((thrusts @ allocation_matrix(vehicle).T)[:, 1:], wrench[:, 1:], atol=1e-12)
        np.testing.assert_allclose(nearest(thrusts, -1), bound, rtol=1e-12)


@pytest.mark.parametrize("name", NAMES)
def test_too_much_torque_is_scaled_not_turned(name: str) -> None:
    vehicle = load_vehicle(name)
    low, high = vehicle.thrust_range
    _, wrench = wrenches(vehicle, 3, -4.0, 4.0)
    spread = wrench.copy()
    spread[:, 0] = 0
    span = np.ptp(spread @ np.linalg.inv(allocation_matrix(vehicle)).T, axis=-1)
    wrench = wrench[span > high - low]
    span = span[span > high - low]
    assert len(wrench) > 50
    realised = mix(vehicle, wrench) @ allocation_matrix(vehicle).T
    np.testing.assert_allclose(realised[:, 1:], wrench[:, 1:] * ((high - low) / span)[:, None], atol=1e-12)


def test_limits_of_single_rotors(vis_r: Vehicle) -> None:
    limited = Mixer.of(vis_r, np.float64).limit(tuple(jnp.asarray([-1.0, 1.0, 5.0, 9.0])))
    np.testing.assert_allclose(limited, [vis_r.thrust_range[0], 1.0, 5.0, 5.12])
