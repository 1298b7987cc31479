"""Vehicles with any number of rotors, level and tilted: the wrench of the rotors, hover, and quadrotors as before."""

import dataclasses
import json
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.control import COMMAND_MODES
from e2efly.control.vectors import Quat, Vec3
from e2efly.simulation.physics import Physics, State, step
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.body import accelerations, gyroscopic_torque
from e2efly.simulation.physics.state import Parts, split
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle, inertia_tensor
from tests.gradients import central, reverse

pytestmark = pytest.mark.usefixtures("x64")

BEFORE = Path(__file__).parents[2] / "data" / "quadrotor_flights.json"
"""End states of quadrotors under violent commands, wind and uneven rotors, by the physics of 2026-11-28, which had four
rotors in every formula."""
PARTS = "position", "velocity", "quaternion", "body_rate", "rotor_speed"


def tilted(name: str, angle: float = 0.3, **changes: np.ndarray) -> Vehicle:
    """A shipped vehicle whose rotors are alternately tilted about their arms, above its centre of mass."""
    vehicle = load_vehicle(name)
    x, y = vehicle.rotor_position.T
    way = np.sin(angle) * vehicle.rotor_spin / np.hypot(x, y)
    axis = np.stack([y * way, -x * way, np.full(len(x), np.cos(angle))], axis=1)
    places = np.pad(vehicle.rotor_position, ((0, 0), (0, 1)), constant_values=0.04)
    return dataclasses.replace(vehicle, rotor_axis=axis, rotor_position=places, **changes)


LOPSIDED = {"centre_of_mass": np.array([0.012, -0.02, -0.01])}
FRAMES = {
    "quadrotor": lambda: load_vehicle("vis_r"),
    "hexacopter": lambda: load_vehicle("hexa"),
    "octocopter": lambda: load_vehicle("octo"),
    "lopsided hexacopter": lambda: dataclasses.replace(load_vehicle("hexa"), **LOPSIDED),
    "tilted hexacopter": lambda: tilted("hexa"),
    "tilted and lopsided octocopter": lambda: tilted("octo", **LOPSIDED),
}


@pytest.mark.parametrize("frame", FRAMES)
def test_force_and_torque_are_the_sum_over_all_rotors(frame: str) -> None:
    """Of the physics' accelerations, against forces at points, rotor by rotor, in NumPy."""
    vehicle, rng = FRAMES[frame](), np.random.default_rng(0)
    vehicle = dataclasses.replace(vehicle, drag_linear=np.zeros(3), drag_quadratic=np.zeros(3))
    n, rate, velocity = vehicle.rotor_count, rng.normal(size=3), rng.normal(size=3)
    speed = vehicle.hover_rotor_speed * rng.uniform(0.5, 1.5, n)
    force, torque = np.zeros(3), np.zeros(3)
    centre = np.zeros(3) if vehicle.centre_of_mass is None else vehicle.centre_of_mass
    for i in range(n):
        axis = np.array([0.0, 0.0, 1.0]) if vehicle.rotor_axis is None else vehicle.rotor_axis[i]
        place = np.resize(np.append(vehicle.rotor_position[i], 0.0), 3) - centre
        push = vehicle.rotor_thrust(speed[i]) * axis
        force += push
        torque += np.cross(place, push) + vehicle.rotor_spin[i] * vehicle.torque_ratio * push
    arrays = jnp.zeros(3), velocity, np.array([1.0, 0, 0, 0]), rate
    state = State(*(jnp.asarray(x) for x in (*arrays, speed)))
    linear, angular = accelerations(Airframe.of(vehicle, 0.005), Parts.of(state), None)
    np.testing.assert_allclose(vehicle.mass * (linear.stack() + np.array([0, 0, 9.81])), force, rtol=1e-12, atol=1e-12)
    gyroscopic = gyroscopic_torque(Vec3.of(vehicle.inertia), Vec3.of(rate)).stack()
    found = inertia_tensor(vehicle) @ np.asarray(angular.stack()) + np.asarray(gyroscopic)
    np.testing.assert_allclose(found, torque, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("frame", ["hexacopter", "tilted and lopsided octocopter"])
def test_body_and_rotors_keep_their_angular_momentum(frame: str) -> None:
    """Nothing pushes; the rotors speed up and slow down about their axes, and the body turns for it."""
    flying = FRAMES[frame]()
    stone = {"thrust_map": np.array([1e-12, 0.0, -1.0]), "drag_linear": np.zeros(3), "drag_quadratic": np.zeros(3)}
    vehicle = dataclasses.replace(flying, rotor_inertia=1e-4, **stone)
    physics = Physics.of(flying, integrator="rk4", largest_step=0.001, dtype=np.float64)
    axes = np.tile([0.0, 0.0, 1.0], (vehicle.rotor_count, 1)) if vehicle.rotor_axis is None else vehicle.rotor_axis

    def momentum(state: State) -> np.ndarray:
        rotors = -vehicle.rotor_inertia * (vehicle.rotor_spin * np.asarray(state.rotor_speed)) @ axes
        own = inertia_tensor(vehicle) @ np.asarray(state.body_rate) + rotors
        return np.asarray(Quat.of(state.quaternion).rotate(Vec3.of(own)).stack())

    rng = np.random.default_rng(1)
    speed = jnp.asarray(flying.hover_rotor_speed * rng.uniform(0.2, 1.5, vehicle.rotor_count))
    begin = State(jnp.zeros(3), jnp.zeros(3), jnp.asarray([1.0, 0, 0, 0]), jnp.asarray(rng.normal(size=3)), speed)
    plant = jax.tree.map(jnp.asarray, vehicle)
    end = jax.jit(step)(physics, plant, begin, jnp.asarray([0.0, 0.0, 0.0, 0.0]))
    assert np.max(np.abs(end.rotor_speed - speed)) > 100.0
    np.testing.assert_allclose(momentum(end), momentum(begin), rtol=1e-6, atol=1e-6 * np.linalg.norm(momentum(begin)))


@pytest.mark.parametrize("frame", FRAMES)
@pytest.mark.parametrize("mode", ["ctbr", "rotor_thrust"])
def test_it_stays_in_hover(frame: str, mode: str) -> None:
    vehicle = FRAMES[frame]()
    if mode == "rotor_thrust" and "lopsided" in frame:
        with pytest.raises(AssertionError):  # equal thrusts turn it
            _hovers(vehicle, mode)
    else:
        _hovers(vehicle, mode)


def _hovers(vehicle: Vehicle, mode: str) -> None:
    physics = Physics.of(vehicle, mode, dtype=np.float64)
    command = jnp.asarray(COMMAND_MODES[mode].hover(vehicle))
    state = State.hovering(vehicle, jnp.asarray([0.0, 0.0, 2.0]))
    end = jax.jit(
        lambda state: jax.lax.fori_loop(0, 60, lambda _, s: step(physics, physics.nominal, s, command), state)
    )(state)
    at_rest = vehicle.centre_of_mass is None  # the rotors of a lopsided vehicle begin at equal speeds
    np.testing.assert_allclose(end.body_rate, 0.0, atol=1e-5 if at_rest else 5e-3)
    np.testing.assert_allclose(end.position, [0.0, 0.0, 2.0], atol=1e-5 if at_rest else 0.4)


@pytest.mark.parametrize(("frame", "mode"), [("hexacopter", "rotor_share"), ("tilted and lopsided octocopter", "ctbr")])
def test_gradients_of_a_step(frame: str, mode: str) -> None:
    """By state and command, in flight and where rotors saturate, against central differences."""
    vehicle, rng = FRAMES[frame](), np.random.default_rng(3)
    physics = Physics.of(vehicle, mode, control_rate=100.0, dtype=np.float64)
    n = vehicle.rotor_count
    commands = [[9.0, 0.2, -0.3, 0.1], [24.0, 4.0, -4.5, 1.5]]
    if mode == "rotor_share":
        commands = [rng.uniform(0.2, 0.8, n), np.where(np.arange(n) % 3, 0.6, 1.2)]
    quaternion = np.array([0.9, 0.1, -0.3, 0.2]) / np.linalg.norm([0.9, 0.1, -0.3, 0.2])
    state = np.concatenate([rng.normal(size=6), quaternion, 0.3 * rng.normal(size=3), rng.uniform(0.8, 1.2, n)])

    def run(rows: jax.Array) -> jax.Array:
        speed = vehicle.hover_rotor_speed * rows[..., 13 : 13 + n]
        begin = State(rows[..., :3], rows[..., 3:6], rows[..., 6:10], rows[..., 10:13], speed)
        end = step(physics, physics.nominal, begin, rows[..., 13 + n :])
        end = dataclasses.replace(end, rotor_speed=end.rotor_speed / vehicle.hover_rotor_speed)
        return jnp.concatenate([getattr(end, name) for name in PARTS], axis=-1)

    rows = jnp.stack([jnp.asarray(np.concatenate([state, command])) for command in commands])
    numeric = np.asarray(central(jax.jit(run), rows))
    exact = np.asarray(reverse(jax.jit(run), rows, numeric.shape[1]))
    np.testing.assert_allclose(exact, numeric, atol=2e-6, rtol=2e-6)
    assert np.isfinite(exact).all()
    assert np.abs(exact[0][:, -len(commands[0]) :]).max(0).min() > 1e-6  # each number of the command matters


@pytest.mark.parametrize("case", json.loads(BEFORE.read_text()), ids=lambda case: f"{case['vehicle']}-{case['mode']}")
def test_quadrotors_fly_as_before(case: dict) -> None:
    vehicle = load_vehicle(case["vehicle"])
    physics = Physics.of(vehicle, case["mode"], control_rate=100.0, dtype=np.float64)
    share, wind = jnp.asarray([1.0, 0.9, 1.0, 1.1]), jnp.asarray([1.0, -2.0, 0.5])
    start = State(*(jnp.asarray(x) for x in case["start"]))

    def one(state: State, command: jax.Array) -> tuple[State, None]:
        return step(physics, physics.nominal, state, command, wind=wind, rotor_share=share), None

    end = jax.jit(lambda state, commands: jax.lax.scan(one, state, commands)[0])(start, jnp.asarray(case["commands"]))
    found = np.concatenate([getattr(end, name) for name in PARTS])
    np.testing.assert_allclose(found, case["end"], rtol=1e-9, atol=1e-9)


def test_split_has_an_entry_for_each_rotor() -> None:
    assert [x.tolist() for x in split(jnp.arange(12.0).reshape(2, 6))] == [[i, i + 6.0] for i in range(6)]
