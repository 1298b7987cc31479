"""Forces and torques on the rigid body."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from e2efly.control.vectors import Quat, Vec3
from e2efly.simulation.physics import State, body
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.state import split
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle, allocation_matrix, quantities

pytestmark = pytest.mark.usefixtures("x64")


def draws(seed: int, size: int, scale: float = 1.0, n: int = 200) -> np.ndarray:
    return scale * np.random.default_rng(seed).normal(size=(n, size))


def plant(vehicle: Vehicle) -> Airframe:
    return Airframe.of(vehicle, 0.005)


def test_drag_takes_energy_in_every_direction(vis_r: Vehicle) -> None:
    """The paper's k v v pushes a vehicle that flies backwards."""
    v = Vec3.of(jnp.asarray(draws(0, 3, 10.0)))
    force = body.drag(plant(vis_r), v)
    for f, u in ((force.x, v.x), (force.y, v.y), (force.z, v.z)):
        assert np.all(f * u < 0)


def test_gyroscopic_torque_does_no_work(vis_r: Vehicle) -> None:
    rate = Vec3.of(jnp.asarray(draws(1, 3, 10.0)))
    zero = jnp.zeros_like(rate.x)
    torque = body.angular_acceleration(plant(vis_r), rate, Vec3(zero, zero, zero)).stack() * vis_r.inertia
    power = np.sum(torque * rate.stack(), axis=-1)
    assert np.max(np.abs(torque)) > 0.01
    np.testing.assert_allclose(power, 0, atol=1e-14)


def test_eulers_equation(vis_r: Vehicle) -> None:
    rate, torque = draws(2, 3, 5.0), draws(3, 3, 0.1)
    expected = (torque - np.cross(rate, vis_r.inertia * rate)) / vis_r.inertia
    actual = body.angular_acceleration(plant(vis_r), Vec3.of(jnp.asarray(rate)), Vec3.of(jnp.asarray(torque))).stack()
    np.testing.assert_allclose(actual, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("name", ["vis_r", "vis_h", "crazyflie"])
def test_rotor_wrench_is_the_allocation_matrix(name: str) -> None:
    vehicle, thrust = load_vehicle(name), np.abs(draws(4, 4))
    collective, torque = body.rotor_wrench(plant(vehicle), split(jnp.asarray(thrust)))
    actual = np.concatenate([np.asarray(collective)[:, None], torque.stack()], axis=-1)
    np.testing.assert_allclose(actual, thrust @ allocation_matrix(vehicle).T, rtol=1e-12, atol=1e-14)


def test_thrust_map_and_its_inverse(vis_r: Vehicle) -> None:
    speed = jnp.linspace(vis_r.rotor_speed_min, vis_r.rotor_speed_max, 50)
    thrust = body.rotor_thrust(plant(vis_r), (speed,) * 4)
    np.testing.assert_allclose(thrust[2], [vis_r.rotor_thrust(float(s)) for s in speed], rtol=1e-12)
    np.testing.assert_allclose(body.rotor_speed_for(vis_r, thrust)[1], speed, rtol=1e-12)
    assert np.all(np.asarray(body.rotor_thrust(plant(vis_r), (jnp.linspace(0.0, 224.0, 9),) * 4)) == 0)


def test_acceleration_by_hand(vis_r: Vehicle, random_state: Callable[..., State]) -> None:
    state, wind, collective = random_state(5, (20,)), draws(6, 3, 3.0, 20), np.linspace(0, 20, 20)
    R = Rotation.from_quat(np.array(state.quaternion), scalar_first=True)
    v = R.inv().apply(np.array(state.velocity) - wind)
    force = -(vis_r.drag_linear * v + vis_r.drag_quadratic * v * np.abs(v)) + collective[:, None] * [0, 0, 1]
    expected = R.apply(force) / vis_r.mass - [0, 0, GRAVITY]
    attitude = Quat.of(state.quaternion)
    air = body.air_velocity(attitude, Vec3.of(state.velocity), Vec3.of(jnp.asarray(wind)))
    actual = body.acceleration(plant(vis_r), attitude, body.drag(plant(vis_r), air), jnp.asarray(collective))
    np.testing.assert_allclose(actual.stack(), expected, rtol=1e-12, atol=1e-12)


def test_a_vehicle_is_a_pytree_of_its_numbers(vis_r: Vehicle) -> None:
    doubled = jax.tree.map(lambda x: 2 * x, vis_r)
    assert (doubled.name, doubled.mass) == ("vis_r", 1.5)
    assert len(jax.tree.leaves(vis_r)) == len(quantities())
