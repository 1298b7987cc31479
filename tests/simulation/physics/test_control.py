"""Each command mode does what it says."""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.control import COMMAND_MODES, command_limits
from e2efly.simulation.physics import Physics, State, rotation
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.body import rotor_thrust
from e2efly.simulation.physics.state import split
from e2efly.simulation.physics.step import step
from e2efly.validation.flight_controller import FlightController
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

pytestmark = pytest.mark.usefixtures("x64")

STEPS = 300  # 10 s
BATCH = 2
TURNS = 4


@pytest.fixture(scope="module")
def answer(fly: Callable[..., State], vacuum: Vehicle) -> Callable[..., State]:
    """(mode, two commands) -> 10 s of flight under each from hovering without drag, (t, 2, ...)."""

    def run(mode: str, *commands: tuple[float, ...], plant: Vehicle = vacuum) -> State:
        assert len(commands) == BATCH
        physics = Physics.of(vacuum, mode, dtype=np.float64)
        state = State.hovering(vacuum, jnp.zeros((BATCH, 3)))
        return fly(physics, plant, state, jnp.broadcast_to(jnp.asarray(commands), (STEPS, BATCH, 4)))

    return run


def level(s: State) -> np.ndarray:
    return np.asarray(rotation.yaw_pitch_roll(s.quaternion))


def test_rotor_thrust(answer: Callable[..., State], vacuum: Vehicle) -> None:
    asked = ((1.0, 2.0, 3.0, 4.0), (0.0, 1.5, 9.0, 1.5))
    path = answer("rotor_thrust", *asked)
    low, high = vacuum.thrust_range
    reached = np.stack(rotor_thrust(Airframe.of(vacuum, 0.005), split(path.rotor_speed[-1])), -1)
    np.testing.assert_allclose(reached, np.clip(asked, low, high), rtol=1e-9)


def test_body_rates_and_collective_thrust(answer: Callable[..., State], vacuum: Vehicle) -> None:
    asked = np.array([[12.0, 0.5, -0.3, 1.0], [9.0, 100.0, -100.0, 100.0]])
    path = answer("ctbr", *asked.tolist())
    within = np.clip(asked[:, 1:], -vacuum.body_rate_max, vacuum.body_rate_max)
    np.testing.assert_allclose(path.body_rate[30, 0], within[0], atol=2e-3)  # after 1 s
    np.testing.assert_allclose(path.body_rate[-1], within, rtol=1e-2)
    collective = sum(rotor_thrust(Airframe.of(vacuum, 0.005), split(path.rotor_speed[-1]))) / vacuum.mass
    np.testing.assert_allclose(collective, asked[:, 0], rtol=1e-2)


def test_attitude_and_collective_thrust(answer: Callable[..., State], vacuum: Vehicle) -> None:
    path = answer("attitude", (11.0, 0.3, -0.2, 1.0), (9.0, -0.5, 0.4, -3.0))
    np.testing.assert_allclose(level(path)[[60, -1]], [[[1.0, -0.2, 0.3], [-3.0, 0.4, -0.5]]] * 2, atol=2e-2)
    np.testing.assert_allclose(level(path)[-1], [[1.0, -0.2, 0.3], [-3.0, 0.4, -0.5]], atol=1e-6)
    collective = sum(rotor_thrust(Airframe.of(vacuum, 0.005), split(path.rotor_speed[-1]))) / vacuum.mass
    np.testing.assert_allclose(collective, [11.0, 9.0], rtol=1e-6)


def test_acceleration(answer: Callable[..., State]) -> None:
    asked = np.array([[2.0, -1.0, 0.5, 0.7], [-3.0, 1.0, -2.0, -2.0]])
    path = answer("acceleration", *asked.tolist())
    np.testing.assert_allclose(path.velocity[-1] - path.velocity[-31], asked[:, :3], atol=1e-6)
    np.testing.assert_allclose(level(path)[60, :, 0], asked[:, 3], atol=5e-2)


def test_velocity(answer: Callable[..., State], vis_r: Vehicle) -> None:
    asked = np.array([[2.0, -1.0, 0.5, 0.7], [-3.0, 1.0, -2.0, -2.0]])
    path = answer("velocity", *asked.tolist())
    np.testing.assert_allclose(path.velocity[60], asked[:, :3], atol=2e-2)
    np.testing.assert_allclose(path.velocity[-1], asked[:, :3], atol=1e-6)
    np.testing.assert_allclose(level(path)[-1, :, 0], asked[:, 3], atol=1e-3)
    path = answer("velocity", *asked.tolist(), plant=vis_r)  # a proportional law: drag leaves an error
    np.testing.assert_allclose(path.velocity[-1], asked[:, :3], atol=0.03)


def test_position(answer: Callable[..., State], vis_r: Vehicle) -> None:
    asked = np.array([[2.0, -1.0, 0.5, 0.7], [-5.0, 4.0, -3.0, 3.0]])
    path = answer("position", *asked.tolist(), plant=vis_r)
    np.testing.assert_allclose(path.position[-1], asked[:, :3], atol=1e-3)
    np.testing.assert_allclose(level(path)[-1], [[0.7, 0, 0], [3.0, 0, 0]], atol=1e-3)
    np.testing.assert_allclose(path.velocity[-1], 0, atol=5e-3)
    overshoot = np.max(np.asarray(path.position) * np.sign(asked[:, :3]) - np.abs(asked[:, :3]))
    assert overshoot < 0.05


def test_cascade_keeps_its_limits(answer: Callable[..., State], vacuum: Vehicle) -> None:
    path = answer("position", (100.0, 0.0, 0.0, 0.0), (0.0, -100.0, -100.0, 0.0))
    assert np.all(np.abs(path.velocity) < vacuum.speed_max + 0.1)
    np.testing.assert_allclose(path.velocity[-1], [[5, 0, 0], [0, -5, -2]], atol=1e-3)
    path = answer("acceleration", (100.0, 0.0, 0.0, 0.0), (100.0, 100.0, -100.0, 0.0))
    tilt = np.arccos(np.asarray(rotation.to_matrix(path.quaternion)[..., 2, 2]))
    assert tilt.max() < vacuum.tilt_max + 0.15
    assert tilt[-1, 1] == pytest.approx(vacuum.tilt_max, abs=1e-3)  # 100 m/s^2 sideways of 0.1 g up
    np.testing.assert_allclose(path.velocity[-1, 0] - path.velocity[-31, 0], [8, 0, 0], atol=1e-3)


@pytest.mark.parametrize("mode", ["attitude", "acceleration", "velocity", "position"])
def test_recovers_from_any_attitude(mode: str, fly: Callable[..., State], vis_r: Vehicle) -> None:
    """Upside down, on its side, and headed the other way: level and headed right within 3 s, without a NaN."""
    angles = jnp.asarray([[jnp.pi, 0, 0], [0, jnp.pi / 2, 0], [0, 0, jnp.pi], [jnp.pi, 0, jnp.pi / 2]])
    state = State.hovering(vis_r, jnp.zeros((TURNS, 3)))
    state = dataclasses.replace(state, quaternion=rotation.from_euler(*angles.T))
    hover = jnp.asarray([GRAVITY if mode == "attitude" else 0.0, 0, 0, 0])
    path = fly(Physics.of(vis_r, mode, dtype=np.float64), vis_r, state, jnp.broadcast_to(hover, (90, TURNS, 4)))
    assert all(np.all(np.isfinite(leaf)) for leaf in jax.tree.leaves(path))
    np.testing.assert_allclose(level(path)[-1, :, 0], 0, atol=0.05)
    assert np.min(rotation.to_matrix(path.quaternion[-1])[..., 2, 2]) > 0.9


@pytest.mark.parametrize("mode", ["attitude", "position"])
def test_both_signs_of_a_quaternion_are_one_attitude(mode: str, fly: Callable[..., State], vis_r: Vehicle) -> None:
    """Also when both differ from the command's sign: the vehicle takes the shorter turn."""
    q = rotation.from_euler(jnp.asarray([0.4, -0.2]), jnp.asarray([-0.3, 0.1]), jnp.asarray([1.5, -2.5]))
    state = State.hovering(vis_r, jnp.zeros((TURNS, 3)))
    state = dataclasses.replace(state, quaternion=jnp.concatenate([q, -q]))
    hover = jnp.asarray([GRAVITY if mode == "attitude" else 0.0, 0, 0, 0])
    path = fly(Physics.of(vis_r, mode, dtype=np.float64), vis_r, state, jnp.broadcast_to(hover, (90, TURNS, 4)))
    np.testing.assert_allclose(path.position[:, 2:], path.position[:, :2], atol=1e-12)
    np.testing.assert_allclose(path.quaternion[:, 2:], -path.quaternion[:, :2], atol=1e-12)


def test_command_limits_of_the_paper(vis_r: Vehicle) -> None:
    top = 4 * 5.12 / 0.75
    expected = {
        "rotor_thrust": ([vis_r.thrust_range[0]] * 4, [5.12] * 4),
        "rotor_share": ([0] * 4, [1] * 4),
        "rotor_speed": ([0] * 4, [1] * 4),
        "ctbr": ([0, -10, -10, -4], [top, 10, 10, 4]),
        "attitude": ([0, -0.8, -0.8, -np.pi], [top, 0.8, 0.8, np.pi]),
        "acceleration": ([-8, -8, -8, -np.pi], [8, 8, 8, np.pi]),
        "velocity": ([-5, -5, -2, -np.pi], [5, 5, 2, np.pi]),
        "position": ([-3, -3, -3, -np.pi], [3, 3, 3, np.pi]),
    }
    assert set(expected) == set(COMMAND_MODES)
    for name, limits in expected.items():
        mode = COMMAND_MODES[name]
        np.testing.assert_allclose(command_limits(mode, vis_r, 3.0), limits, rtol=1e-12)
        assert len(mode.fields) == len(mode.units) == 4


@pytest.mark.parametrize("name", ["vis_h", "crazyflie"])
def test_the_gains_of_the_other_vehicles_fly(name: str, fly: Callable[..., State]) -> None:
    vehicle = load_vehicle(name)
    physics = Physics.of(vehicle, "position", dtype=np.float64)
    state = State.hovering(vehicle, jnp.zeros((BATCH, 3)))
    command = jnp.asarray([[1.0, 2.0, -1.0, 1.0], [-2.0, 0.5, 1.0, -3.0]])
    path = fly(physics, vehicle, state, jnp.broadcast_to(command, (STEPS, BATCH, 4)))
    np.testing.assert_allclose(path.position[-1], command[:, :3], atol=1e-2)
    np.testing.assert_allclose(level(path)[-1, :, 0], command[:, 3], atol=1e-2)


def test_rotors_go_to_the_share_of_the_speed_that_gives_their_largest_thrust(vis_r: Vehicle) -> None:
    physics = Physics.of(vis_r, "rotor_speed", dtype=np.float64)
    state = State.hovering(vis_r, jnp.zeros((1, 3)))
    command = jnp.asarray([[0.3, 0.6, 1.4, -0.2]])
    state = jax.jit(lambda s: jax.lax.fori_loop(0, 20, lambda _, s: step(physics, physics.nominal, s, command), s))(
        state
    )
    wanted = [0.3 * vis_r.full_rotor_speed, 0.6 * vis_r.full_rotor_speed, vis_r.full_rotor_speed, vis_r.rotor_speed_min]
    np.testing.assert_allclose(state.rotor_speed[0], wanted, rtol=1e-3)
    controller = FlightController(vis_r, "rotor_speed")
    thrusts = controller.thrusts(command[0].tolist(), [0.0] * 7, [0.0] * 6, 0.01)
    np.testing.assert_allclose(thrusts, [vis_r.rotor_thrust(w) for w in wanted], rtol=1e-6)
