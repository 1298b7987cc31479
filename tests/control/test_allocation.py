"""The mixer's rules: exact where they can be, inside the limits always, and the nearest wrench by the rule `qp`."""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import lsq_linear

from e2efly.control.allocation import THRUST, TILT, YAW, Allocation, ThrustLimits, nearest
from e2efly.control.vectors import Vec3
from e2efly.simulation.physics import Mixer
from e2efly.validation.flight_controller import PlainRateLoop
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix
from tests.gradients import central, reverse

pytestmark = pytest.mark.usefixtures("x64")


def lopsided(name: str, share: float, mixer: str = "") -> Vehicle:
    """A vehicle with its centre of mass ahead of the middle by a share of the way to its foremost rotors."""
    vehicle = load_vehicle(name)
    ahead = share * vehicle.rotor_position[:, 0].max()
    return dataclasses.replace(vehicle, centre_of_mass=np.array([ahead, 0.0, 0.0]), mixer=mixer)


VEHICLES: dict[str, Callable[[], Vehicle]] = {
    "hexa": lambda: load_vehicle("hexa"),
    "octo": lambda: load_vehicle("octo"),
    "lopsided hexa": lambda: lopsided("hexa", 0.15),
    "quadrotor by qp": lambda: dataclasses.replace(load_vehicle("vis_r"), mixer="qp"),
}
OTHERS: dict[str, Callable[[], Vehicle]] = {
    "lopsided quadrotor": lambda: lopsided("vis_r", 0.2),
    "lopsided quadrotor by Betaflight": lambda: lopsided("vis_r", 0.2, "betaflight"),
    "lopsided hexa by shift": lambda: lopsided("hexa", 0.15, "shift"),
}


def mix(vehicle: Vehicle, wrench: np.ndarray) -> np.ndarray:
    """Rotor thrusts (n, N) for [collective, torques] (n, 4)."""
    found = Mixer.of(vehicle, np.float64).thrusts(jnp.asarray(wrench[:, 0]), Vec3.of(jnp.asarray(wrench[:, 1:])))
    return np.stack(found, axis=-1)


def units(vehicle: Vehicle) -> np.ndarray:
    """The torques and the thrust whose errors are of the same weight before the priorities."""
    arm = np.linalg.norm(allocation_matrix(vehicle)[1:3], axis=0).mean()
    if vehicle.centre_of_mass is not None:
        arm = np.linalg.norm(vehicle.rotor_position - vehicle.centre_of_mass[:2], axis=1).mean()
    return vehicle.mass * GRAVITY * np.array([1.0, arm, arm, vehicle.torque_ratio])


def demands(vehicle: Vehicle, n: int = 60) -> np.ndarray:
    """Wrenches of which most are more than the rotors can give, (n, 4)."""
    rng = np.random.default_rng(0)
    most = vehicle.thrust_to_weight
    turns = rng.normal(0, 0.15 * most, (3, n))
    asked = np.stack([rng.uniform(0.2, most, n), *turns], axis=1)
    return asked * units(vehicle)


@pytest.mark.parametrize("name", [*VEHICLES, *OTHERS])
def test_a_wrench_that_rotors_can_give_is_given(name: str) -> None:
    """But by Betaflight's rule on a lopsided frame, which scales torques down too early."""
    vehicle = (VEHICLES | OTHERS)[name]()
    (low, high), rng, pseudo = (
        vehicle.thrust_range,
        np.random.default_rng(1),
        np.linalg.pinv(allocation_matrix(vehicle)),
    )
    wrench = rng.uniform(low, high, (400, vehicle.rotor_count)) @ allocation_matrix(vehicle).T
    plain = wrench @ pseudo.T
    inside = ((plain > low) & (plain < high)).all(1)
    assert inside.sum() > 20
    given = np.isclose(mix(vehicle, wrench), plain, rtol=1e-9).all(1)
    assert given[inside].mean() == 1.0 if "Betaflight" not in name else 0.5 < given[inside].mean() < 1.0
    for size in (1.0, 1e3):
        thrusts = mix(vehicle, size * demands(vehicle))
        assert low <= thrusts.min() and thrusts.max() <= high


@pytest.mark.parametrize("name", VEHICLES)
def test_the_nearest_wrench_is_that_of_an_exact_solver(name: str) -> None:
    vehicle = VEHICLES[name]()
    (low, high), matrix, asked = vehicle.thrust_range, allocation_matrix(vehicle), demands(vehicle)
    scale = np.sqrt([THRUST, TILT, TILT, YAW]) / units(vehicle)

    def cost(thrusts: np.ndarray) -> np.ndarray:
        return np.sum((scale * (thrusts @ matrix.T - asked)) ** 2, axis=1)

    best = np.array([lsq_linear(scale[:, None] * matrix, scale * row, (low, high)).x for row in asked])
    saturated = ((best < low + 1e-6) | (best > high - 1e-6)).any(1)
    assert saturated.mean() > 0.5
    found, clipped = cost(mix(vehicle, asked)), cost(np.clip(asked @ np.linalg.pinv(matrix).T, low, high))
    assert np.all(found >= cost(best) - 1e-9)
    assert np.mean(found - cost(best)) < 0.02 * np.mean(clipped - cost(best))
    assert np.max(found - cost(best)) < 0.05 * np.max(clipped)


@pytest.mark.parametrize("name", [*VEHICLES, *OTHERS])
def test_gradients_are_those_of_differences_where_rotors_saturate(name: str) -> None:
    vehicle = (VEHICLES | OTHERS)[name]()
    mixer, unit = Mixer.of(vehicle, np.float64), units(vehicle)

    def run(rows: jax.Array) -> jax.Array:
        wrench = rows * unit
        return jnp.stack(mixer.thrusts(wrench[..., 0], Vec3.of(wrench[..., 1:])), axis=-1)

    rows = jnp.asarray(demands(vehicle, 12) / unit)
    at_limits = np.isin(np.asarray(run(rows)), vehicle.thrust_range).any(1)
    assert at_limits.sum() > 3
    numeric = np.asarray(central(run, rows))
    exact = np.asarray(reverse(run, rows, numeric.shape[1]))
    np.testing.assert_allclose(exact, numeric, rtol=1e-5, atol=1e-5)
    assert np.abs(exact[at_limits]).max() > 0.1


@pytest.mark.parametrize("name", [*VEHICLES, *OTHERS])
@pytest.mark.parametrize("plain", [False, True])
def test_plain_numbers_are_mixed_as_arrays(name: str, plain: bool) -> None:
    vehicle = (VEHICLES | OTHERS)[name]()
    asked, loop = demands(vehicle, 30), PlainRateLoop(vehicle, plain)
    mixer = dataclasses.replace(Mixer.of(vehicle, np.float64), plain=jnp.asarray(1.0 * plain))
    arrays = np.stack(mixer.thrusts(jnp.asarray(asked[:, 0]), Vec3.of(jnp.asarray(asked[:, 1:]))), axis=-1)
    rows = [loop._mixed(row[0], (row[1], row[2], row[3])) for row in asked.tolist()]
    np.testing.assert_allclose(arrays, rows, rtol=1e-9, atol=1e-9)
    if plain:
        each = np.clip(asked @ np.linalg.pinv(allocation_matrix(vehicle)).T, *vehicle.thrust_range)
        np.testing.assert_allclose(arrays, each, rtol=1e-9)


@pytest.mark.parametrize(("share", "left"), [(0.1, 0.028), (0.2, 0.111)])
def test_full_thrust_turns_a_lopsided_vehicle_only_by_betaflights_rule(share: float, left: float) -> None:
    """One shift for all rotors is no pure thrust where the centre of mass is off the middle."""
    for mixer, torque in (("", 0.0), ("shift", 0.0), ("betaflight", left)):
        vehicle = lopsided("vis_r", share, mixer)
        arm = vehicle.rotor_position[:, 0].max()
        unit = vehicle.mass * GRAVITY * np.array([1.0, arm, arm, 1.0])
        full = np.array([[4 * vehicle.thrust_range[1], 0.0, 0.0, 0.0]])
        given = (mix(vehicle, full) @ allocation_matrix(vehicle).T / unit)[0]
        np.testing.assert_allclose(np.abs(given[1:]), [0.0, torque, 0.0], atol=1e-3)
        assert given[0] > 2.0
    assert Allocation.of(load_vehicle("vis_r")).rule == "betaflight"  # the same there, and cheaper


@pytest.mark.parametrize("name", ["lopsided quadrotor", "lopsided hexa by shift"])
def test_a_shift_keeps_the_direction_of_the_torque(name: str) -> None:
    vehicle = OTHERS[name]()
    low, high = vehicle.thrust_range
    asked = demands(vehicle) * np.array([1.0, 3.0, 3.0, 1.0])
    thrusts = mix(vehicle, asked)
    given = thrusts @ allocation_matrix(vehicle).T
    scale = np.sum(given[:, 1:] * asked[:, 1:], axis=1) / np.sum(asked[:, 1:] ** 2, axis=1)
    np.testing.assert_allclose(given[:, 1:], scale[:, None] * asked[:, 1:], atol=1e-9)
    assert scale.min() > 0 and scale.max() <= 1 + 1e-9
    less = scale < 1 - 1e-6  # as much of the torque as there is room for: a rotor is at each limit
    assert less.sum() > 5
    np.testing.assert_allclose(thrusts[less].min(1), low, atol=1e-9)
    np.testing.assert_allclose(thrusts[less].max(1), high, atol=1e-9)


def test_numbers_of_a_hexa_by_hand() -> None:
    """Six equal rotors: a thrust beyond all limits is the limit of each, and its torque is none."""
    found = Allocation.of(load_vehicle("hexa"))
    assert found.descent is not None and found.pull is not None
    matrices = found.matrix.tolist(), found.descent.tolist(), found.pull.tolist()
    for asked, each in ((60.0, 2.0), (6.0, 1.0)):
        thrusts = nearest(matrices, (asked, 0.0, 0.0, 0.0), ThrustLimits(0.0, 2.0, max, min))
        np.testing.assert_allclose(thrusts, each)
