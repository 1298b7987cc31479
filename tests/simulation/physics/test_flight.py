"""Flights with a known end: free fall, a spinning body, motor lag, terminal velocity, wind, symmetries."""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.control import COMMAND_MODES
from e2efly.simulation.physics import INTEGRATORS, Physics, State, rotation
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.body import hover_rotor_speed, rotor_thrust
from e2efly.simulation.physics.state import split
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

pytestmark = pytest.mark.usefixtures("x64")


def physics_of(
    vehicle: Vehicle, mode: str = "rotor_thrust", integrator: str = "semi_implicit", **options: float
) -> Physics:
    return Physics.of(vehicle, mode, integrator, dtype=np.float64, **options)


def hover_thrusts(vehicle: Vehicle, steps: int) -> jax.Array:
    return jnp.full((steps, 4), vehicle.mass * GRAVITY / 4)


def at_rest(vehicle: Vehicle) -> State:
    return State.hovering(vehicle, jnp.zeros(3))


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("name", ["vis_r", "vis_h", "crazyflie"])
def test_hover_stays(name: str, integrator: str, fly: Callable[..., State]) -> None:
    vehicle = load_vehicle(name)
    end = fly(physics_of(vehicle, integrator=integrator), vehicle, at_rest(vehicle), hover_thrusts(vehicle, 60))
    start = at_rest(vehicle)
    assert float(hover_rotor_speed(vehicle)) == pytest.approx(vehicle.hover_rotor_speed, rel=1e-12)
    for part in ("position", "velocity", "quaternion", "body_rate", "rotor_speed"):
        np.testing.assert_allclose(
            getattr(end, part)[-1], getattr(start, part), atol=1e-10, err_msg=f"{part} under {integrator}"
        )


@pytest.mark.parametrize(("integrator", "sampled"), [("rk3", 0), ("rk4", 0), ("euler", -1), ("semi_implicit", 1)])
def test_free_fall(integrator: str, sampled: int, vis_r: Vehicle, stone: Vehicle, fly: Callable[..., State]) -> None:
    """-g t^2 / 2; the first-order methods take the velocity of the step's start or end: -g t (t -+ dt) / 2."""
    physics = physics_of(vis_r, integrator=integrator)
    dt, t = physics.control_period / physics.substeps, 2.0
    end = fly(physics, stone, at_rest(vis_r), hover_thrusts(vis_r, 60))
    np.testing.assert_allclose(end.velocity[-1], [0, 0, -GRAVITY * t], rtol=1e-12)
    np.testing.assert_allclose(end.position[-1], [0, 0, -GRAVITY * t * (t + sampled * dt) / 2], rtol=1e-12)


def test_a_free_body_keeps_angular_momentum_and_energy(
    vis_r: Vehicle, stone: Vehicle, random_state: Callable[..., State], fly: Callable[..., State]
) -> None:
    state = dataclasses.replace(random_state(0, (4,)), body_rate=random_state(1, (4,)).body_rate * 2)
    path = fly(physics_of(vis_r, integrator="rk4", largest_step=0.002), stone, state, hover_thrusts(vis_r, 60)[:, None])

    def conserved(s: State) -> tuple[jax.Array, jax.Array, jax.Array]:
        momentum = stone.inertia * s.body_rate
        spin = jnp.sum(momentum * s.body_rate, -1) / 2
        flight = jnp.sum(s.velocity**2, -1) / 2 + GRAVITY * s.position[..., 2]
        return rotation.rotate(s.quaternion, momentum), spin, flight

    for before, after in zip(conserved(state), conserved(path), strict=True):
        np.testing.assert_allclose(after, np.broadcast_to(before, after.shape), rtol=1e-7, atol=1e-9)
    assert np.max(np.abs(path.body_rate[-1] - state.body_rate)) > 0.5  # the rates themselves move
    np.testing.assert_allclose(np.linalg.norm(path.quaternion, axis=-1), 1, rtol=1e-14)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_motor_lag_is_exact_for_any_substep(
    integrator: str, vis_r: Vehicle, random_state: Callable[..., State], fly_open_loop: Callable[..., State]
) -> None:
    state, still = random_state(4, (6,)), jnp.zeros((6, 3))
    wanted = jnp.asarray(np.random.default_rng(5).uniform(300, 3500, (6, 4)))
    t = 0.02 * jnp.arange(1, 61)[:, None, None]
    expected = wanted + (state.rotor_speed - wanted) * jnp.exp(-t / vis_r.motor_time_constant)
    for substeps in (1, 3, 10):
        plant = jax.tree.map(lambda x: jnp.broadcast_to(x, (6, *np.shape(x))), vis_r)
        commands = jnp.broadcast_to(wanted, (60, 6, 4))
        path = fly_open_loop(integrator, plant, state, commands, still, 0.02, substeps)
        np.testing.assert_allclose(path.rotor_speed, expected, rtol=1e-12)


def test_terminal_velocity(vis_r: Vehicle, stone: Vehicle, fly: Callable[..., State]) -> None:
    plant = dataclasses.replace(stone, drag_linear=vis_r.drag_linear, drag_quadratic=vis_r.drag_quadratic)
    physics = physics_of(vis_r, integrator="rk4", control_rate=7.5, largest_step=1 / 30)
    k1, k2 = vis_r.drag_linear[2], vis_r.drag_quadratic[2]
    falling = fly(physics, plant, at_rest(vis_r), hover_thrusts(vis_r, 300))
    expected = (-k1 + np.sqrt(k1**2 + 4 * k2 * vis_r.mass * GRAVITY)) / (2 * k2)
    assert float(falling.velocity[-1, 2]) == pytest.approx(-expected, rel=1e-9)

    quadratic = dataclasses.replace(plant, drag_linear=np.zeros(3))
    falling = fly(physics, quadratic, at_rest(vis_r), hover_thrusts(vis_r, 300))
    top, t = np.sqrt(vis_r.mass * GRAVITY / k2), np.arange(1, 301) / 7.5
    np.testing.assert_allclose(falling.velocity[:, 2], -top * np.tanh(GRAVITY * t / top), rtol=1e-7)


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_wind_is_a_moving_frame(
    integrator: str, vis_r: Vehicle, random_state: Callable[..., State], fly: Callable[..., State]
) -> None:
    physics, state, wind = physics_of(vis_r, "ctbr", integrator), random_state(2), jnp.asarray([3.0, -2.0, 1.0])
    commands = jnp.asarray(np.random.default_rng(3).normal([9.81, 0, 0, 0], [2, 1, 1, 1], (30, 4)))
    windy = fly(physics, vis_r, state, commands, wind)
    still = fly(physics, vis_r, dataclasses.replace(state, velocity=state.velocity - wind), commands, 0 * wind)
    carried = wind * (jnp.arange(1, 31) / 30)[:, None]
    np.testing.assert_allclose(windy.position, still.position + carried, atol=1e-11)
    np.testing.assert_allclose(windy.velocity, still.velocity + wind, atol=1e-11)
    np.testing.assert_allclose(windy.quaternion, still.quaternion, atol=1e-11)


COMMANDS = {
    "rotor_thrust": [1.9, 1.7, 2.0, 1.8],
    "rotor_share": [0.37, 0.33, 0.39, 0.35],
    "rotor_speed": [0.61, 0.57, 0.62, 0.59],
    "ctbr": [11.0, 1.0, -2.0, 0.7],
    "attitude": [10.0, 0.3, -0.2, 0.5],
    "acceleration": [1.0, -2.0, 0.5, 0.6],
    "velocity": [1.0, 0.5, -0.3, -0.4],
    "position": [0.5, 0.4, -0.2, 0.3],
}


@pytest.fixture
def gentle() -> State:
    """A state from which no limit of a controller is met."""
    return State(
        position=jnp.asarray([0.1, -0.2, 0.3]),
        velocity=jnp.asarray([0.5, -0.3, 0.2]),
        quaternion=rotation.from_euler(jnp.asarray(0.2), jnp.asarray(-0.1), jnp.asarray(0.4)),
        body_rate=jnp.asarray([0.3, -0.5, 0.2]),
        rotor_speed=jnp.asarray([2000.0, 2100.0, 2200.0, 2050.0]),
    )


@pytest.mark.parametrize("mode", COMMAND_MODES)
def test_mirrored_flight(mode: str, vis_r: Vehicle, gentle: State, fly: Callable[..., State]) -> None:
    """Left and right exchanged: y, roll, yaw, roll rate and yaw rate change sign, and the rotors change sides."""

    def mirror(s: State) -> State:
        return State(
            s.position * jnp.array([1, -1, 1]), s.velocity * jnp.array([1, -1, 1]),
            s.quaternion * jnp.array([1, -1, 1, -1]), s.body_rate * jnp.array([-1, 1, -1]),
            s.rotor_speed[..., jnp.array([2, 3, 0, 1])],
        )  # fmt: skip

    physics, command = physics_of(vis_r, mode), np.array(COMMANDS[mode])
    mirrored = command[[2, 3, 0, 1]] if mode.startswith("rotor") else command * [1, -1, 1, -1]
    path = fly(physics, vis_r, gentle, jnp.broadcast_to(command, (15, 4)))
    other = fly(physics, vis_r, mirror(gentle), jnp.broadcast_to(mirrored, (15, 4)))
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-9), mirror(path), other)


@pytest.mark.parametrize("mode", COMMAND_MODES)
def test_no_compass_direction_is_special(mode: str, vis_r: Vehicle, gentle: State, fly: Callable[..., State]) -> None:
    """Start and command turned about world z: so is the flight."""
    angle = 0.7
    turn = rotation.from_euler(jnp.asarray(0.0), jnp.asarray(0.0), jnp.asarray(angle))

    def turned(s: State) -> State:
        return dataclasses.replace(
            s,
            position=rotation.rotate(turn, s.position),
            velocity=rotation.rotate(turn, s.velocity),
            quaternion=rotation.multiply(turn, s.quaternion),
        )

    physics, command = physics_of(vis_r, mode), jnp.asarray(COMMANDS[mode])
    level = jnp.append(rotation.rotate(turn, command[:3]), command[3] + angle)
    in_body = mode.startswith("rotor") or mode == "ctbr"
    other = command if in_body else command.at[3].add(angle) if mode == "attitude" else level
    path = fly(physics, vis_r, gentle, jnp.broadcast_to(command, (15, 4)))
    expected = fly(physics, vis_r, turned(gentle), jnp.broadcast_to(other, (15, 4)))
    jax.tree.map(lambda a, b: np.testing.assert_allclose(a, b, atol=1e-9), turned(path), expected)


def test_a_weaker_battery_sinks(vis_r: Vehicle, fly: Callable[..., State]) -> None:
    """The controller believes in the nominal vehicle: a plant with less thrust does not get more command."""
    weak = dataclasses.replace(vis_r, thrust_map=0.9 * vis_r.thrust_map)
    path = fly(
        physics_of(vis_r, "ctbr"), weak, at_rest(vis_r), jnp.broadcast_to(jnp.asarray([GRAVITY, 0, 0, 0]), (30, 4))
    )
    np.testing.assert_allclose(path.rotor_speed, vis_r.hover_rotor_speed, rtol=1e-9)
    thrust = rotor_thrust(Airframe.of(weak, 0.005), split(path.rotor_speed))[0][-1]
    assert float(thrust) == pytest.approx(0.9 * vis_r.mass * GRAVITY / 4, rel=1e-9)
    assert float(path.velocity[-1, 2]) == pytest.approx(-0.1 * GRAVITY, rel=0.02)
