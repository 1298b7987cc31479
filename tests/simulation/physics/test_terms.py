"""The terms of the physics that a vehicle's file may leave out: what they conserve, their limits, their gradients."""

import dataclasses
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax.flatten_util import ravel_pytree
from scipy.spatial.transform import Rotation

from e2efly.control.vectors import Vec3
from e2efly.simulation.physics import INTEGRATORS, Physics, RateLoop, State, started, step
from e2efly.simulation.physics.airframe import Airframe
from e2efly.simulation.physics.body import accelerations, angular_acceleration
from e2efly.simulation.physics.state import Parts
from e2efly.vehicles.vehicle import Vehicle, inertia_tensor, rotor_arms, terms
from e2efly.vehicles.vehicle_rules import BATTERY, reached_share
from tests.gradients import central, reverse
from tests.terms import VALUES

pytestmark = pytest.mark.usefixtures("x64")

NOTHING: dict[str, Any] = {
    "rotor_inertia": 0.0,
    "motor_time_constant_down": 0.035,
    "centre_of_mass": [0.0, 0.0, 0.0],
    "inertia_products": [0.0, 0.0, 0.0],
    "drag_torque": [0.0, 0.0, 0.0],
    "rate_integral_gain": [0.0, 0.0, 0.0],
    "gyro_time_constant": 1e-6,
    "nominal_voltage": 14.8,
    "battery_voltage": 14.8,
    "voltage_sag": 0.0,
    "speed_per_volt": 1.0,
    "rotor_speed_ceiling": [1e6] * 4,
    "rotor_axis": [[0.0, 0.0, 1.0]] * 4,
    "inflow_loss": 0.0,
}
"""Values at which a term does nothing."""
ACTING = VALUES | {"rotor_speed_ceiling": [2210.0, 2220.0, 2230.0, 1700.0]}
"""Values at which each number of a term acts in a step near hover."""


def having(vehicle: Vehicle, *names: str, values: dict[str, Any] = VALUES) -> Vehicle:
    """The vehicle with these terms; none of a battery's stands alone."""
    names = (*names, *BATTERY) if set(names) & set(BATTERY) else names
    return dataclasses.replace(vehicle, **{name: np.asarray(values[name]) for name in names})


def turned(state: State, vector: np.ndarray) -> np.ndarray:
    """Body vectors in the world, (t, 3)."""
    return Rotation.from_quat(np.array(state.quaternion), scalar_first=True).apply(vector)


def angular_momentum(vehicle: Vehicle, path: State) -> np.ndarray:
    """Of body and rotors together, world, (t, 3): rotors turn against their reaction torque."""
    own = np.array(path.body_rate) @ inertia_tensor(vehicle)
    rotors = 0.0 if vehicle.rotor_inertia is None else -vehicle.rotor_inertia
    own[:, 2] += rotors * np.sum(vehicle.rotor_spin * np.array(path.rotor_speed), axis=-1)
    return turned(path, own)


def test_every_term_is_tested() -> None:
    assert set(VALUES) == set(NOTHING) == {f.name for f in terms()}


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_terms_of_no_size_change_nothing(integrator: str, vis_r: Vehicle, random_state: Callable[..., State]) -> None:
    command = jnp.asarray([12.0, 2.0, -3.0, 1.0])

    def end(vehicle: Vehicle) -> State:
        physics = Physics.of(vehicle, integrator=integrator, dtype=np.float64)
        return step(physics, physics.nominal, random_state(3), command, wind=jnp.asarray([1.0, -2.0, 0.5]))

    with_terms = dataclasses.replace(vis_r, **{name: np.asarray(value) for name, value in NOTHING.items()})
    before, after = jax.tree.leaves(end(vis_r)), jax.tree.leaves(end(with_terms))
    for a, b in zip(before, after[: len(before)], strict=True):
        np.testing.assert_allclose(b, a, rtol=1e-12, atol=1e-12)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("integrator", ["semi_implicit", "rk3"])
@pytest.mark.parametrize("name", VALUES)
def test_gradients_of_a_step_with_a_term(name: str, integrator: str, vis_r: Vehicle) -> None:
    """By state, command and the term's own values, against central differences; in flight and at rest."""
    vehicle = having(vis_r, name, values=ACTING)
    physics = Physics.of(vehicle, integrator=integrator, control_rate=100.0, dtype=np.float64)
    level = jnp.asarray([1.0, 0, 0, 0])
    flying = {
        "state": State(
            jnp.asarray([0.1, -0.2, 0.3]),
            jnp.asarray([2.0, -1.0, 0.7]),
            jnp.asarray(np.array([0.9, 0.1, -0.3, 0.2]) / np.linalg.norm([0.9, 0.1, -0.3, 0.2])),
            jnp.asarray([1.3, -2.5, 1.2]),
            jnp.asarray([2.0, 2.1, 2.2, 2.05]),
            RateLoop.at_rest(vehicle, jnp.asarray([1.2, -2.4, 1.25])),
        ),
        "command": jnp.asarray([11.0, 1.0, -2.0, 0.7]),
        "term": jnp.ones(np.shape(ACTING[name])),
    }
    still = RateLoop.at_rest(vehicle, jnp.zeros(3))
    rest = State(jnp.zeros(3), jnp.zeros(3), level, jnp.zeros(3), jnp.full(4, 2.0), still)
    points = [flying, {**flying, "state": rest, "command": jnp.asarray([8.0, 0.0, 0.0, 0.0])}]
    structure = ravel_pytree(flying)[1]

    def run(rows: jax.Array) -> jax.Array:
        i = jax.vmap(structure)(rows)
        plant = dataclasses.replace(physics.nominal, **{name: np.asarray(ACTING[name]) * i["term"]})
        state = dataclasses.replace(i["state"], rotor_speed=1000 * i["state"].rotor_speed)
        end = step(physics, plant, state, i["command"])
        return jnp.concatenate(jax.tree.leaves(dataclasses.replace(end, rotor_speed=end.rotor_speed / 1000)), axis=-1)

    rows = jnp.stack([ravel_pytree(point)[0] for point in points])
    with jax.disable_jit():
        numeric = np.asarray(central(run, rows))
        exact = np.asarray(reverse(run, rows, numeric.shape[1]))
    np.testing.assert_allclose(exact, numeric, atol=1e-6, rtol=1e-6)
    size = np.size(ACTING[name])
    assert np.all(np.max(np.abs(exact[0][:, -size:]), axis=0) > 1e-8)  # each of its numbers matters


@pytest.mark.parametrize("integrator", ["semi_implicit", "rk3", "rk4"])
def test_body_and_rotors_keep_their_angular_momentum(
    integrator: str, stone: Vehicle, random_state: Callable[..., State], fly_open_loop: Callable[..., State]
) -> None:
    """Nothing pushes; the rotors speed up and slow down, and the body turns for it."""
    vehicle, rng = having(stone, "rotor_inertia"), np.random.default_rng(2)
    commands = jnp.asarray(rng.uniform(500, 3500, (10, 1, 4)).repeat(20, 0))
    start = random_state(4, (1,))
    path = fly_open_loop(integrator, vehicle, start, commands, jnp.zeros((1, 3)), 0.002, 10)
    whole = jax.tree.map(lambda first, later: jnp.concatenate([first, later[:, 0]]), start, path)
    momentum = angular_momentum(vehicle, whole)
    alone = angular_momentum(stone, whole)
    size = np.linalg.norm(momentum[0])
    assert np.ptp(alone, axis=0).max() > size  # the rotors take and give more than there is in all
    drift = {"semi_implicit": 2e-3}.get(integrator, 1e-6)  # of first order
    np.testing.assert_allclose(momentum, momentum[:1].repeat(len(momentum), 0), atol=drift * size)


def test_a_rotor_that_speeds_up_turns_the_body_the_other_way(
    stone: Vehicle, fly_open_loop: Callable[..., State]
) -> None:
    """By hand: the body takes what the rotors gain, and a rotor whose reaction torque is up turns clockwise."""
    vehicle = having(stone, "rotor_inertia")
    start = dataclasses.replace(State.hovering(vehicle, jnp.zeros((1, 3))), rotor_speed=jnp.full((1, 4), 2000.0))
    commands = jnp.broadcast_to(2000.0 + 300 * (vehicle.rotor_spin > 0), (50, 1, 4))
    path = fly_open_loop("rk3", vehicle, start, commands, jnp.zeros((1, 3)), 0.01, 2)
    expected = vehicle.rotor_inertia * 2 * 300 / vehicle.inertia[2]
    np.testing.assert_allclose(path.body_rate[-1, 0], [0, 0, expected], rtol=1e-5, atol=1e-12)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_rotors_slow_down_with_a_lag_of_their_own(
    integrator: str, vis_r: Vehicle, fly_open_loop: Callable[..., State]
) -> None:
    """By the closed form of either step, after one period and after many; one that is where it should be stays."""
    vehicle = having(vis_r, "motor_time_constant_down")
    told = np.array([3000.0, 1000.0, 2000.0, 1500.0])
    start = dataclasses.replace(State.hovering(vehicle, jnp.zeros((1, 3))), rotor_speed=jnp.full((1, 4), 2000.0))
    commands = jnp.broadcast_to(told, (30, 1, 4))
    path = fly_open_loop(integrator, vehicle, start, commands, jnp.zeros((1, 3)), 0.004, 1)
    t, lag = 0.004 * np.arange(1, 31)[:, None], np.array([0.035, 0.06, 0.035, 0.06])
    np.testing.assert_allclose(path.rotor_speed[:, 0], told + (2000 - told) * np.exp(-t / lag), rtol=1e-12)


def test_a_free_body_keeps_its_energy_and_its_angular_momentum(
    stone: Vehicle, random_state: Callable[..., State], fly_open_loop: Callable[..., State]
) -> None:
    """Of an inertia whose axes are not the body's."""
    vehicle = having(stone, "inertia_products")
    start = random_state(9, (1,))
    commands = jnp.zeros((100, 1, 4))
    path = fly_open_loop("rk4", vehicle, start, commands, jnp.zeros((1, 3)), 0.02, 20)
    whole = jax.tree.map(lambda first, later: jnp.concatenate([first, later[:, 0]]), start, path)
    momentum, tensor = angular_momentum(vehicle, whole), inertia_tensor(vehicle)
    energy = np.einsum("ti,ij,tj->t", whole.body_rate, tensor, whole.body_rate) / 2
    assert np.ptp(whole.body_rate, axis=0).min() > 0.5  # it tumbles
    np.testing.assert_allclose(energy, energy[0], rtol=1e-9)
    np.testing.assert_allclose(momentum, momentum[:1].repeat(len(momentum), 0), atol=1e-9 * np.linalg.norm(momentum[0]))


def test_eulers_equation_with_products_of_inertia(vis_r: Vehicle) -> None:
    vehicle, rng = having(vis_r, "inertia_products"), np.random.default_rng(2)
    rate, torque, tensor = 5 * rng.normal(size=(20, 3)), 0.1 * rng.normal(size=(20, 3)), inertia_tensor(vehicle)
    expected = np.linalg.solve(tensor, (torque - np.cross(rate, rate @ tensor)).T).T
    plant = Airframe.of(vehicle, 0.005)
    actual = angular_acceleration(plant, Vec3.of(jnp.asarray(rate)), Vec3.of(jnp.asarray(torque))).stack()
    np.testing.assert_allclose(actual, expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("axis", range(3))
def test_drag_slows_a_turn_about_an_axis_exponentially(
    axis: int, stone: Vehicle, fly_open_loop: Callable[..., State]
) -> None:
    vehicle, rate = having(stone, "drag_torque"), 5 * np.eye(3)[axis]
    start = dataclasses.replace(State.hovering(vehicle, jnp.zeros((1, 3))), body_rate=jnp.asarray(rate[None]))
    path = fly_open_loop("rk4", vehicle, start, jnp.zeros((50, 1, 4)), jnp.zeros((1, 3)), 0.02, 10)
    slowed = np.exp(-vehicle.drag_torque[axis] / vehicle.inertia[axis] * 0.02 * np.arange(1, 51))
    assert slowed[-1] < 0.7
    np.testing.assert_allclose(path.body_rate[:, 0], slowed[:, None] * rate, rtol=1e-9, atol=1e-12)


MEASURED = {
    0.089: 0.1201, 0.112: 0.1171, 0.134: 0.1129, 0.155: 0.1101, 0.176: 0.1059, 0.199: 0.1019, 0.225: 0.0974,
    0.246: 0.0935, 0.266: 0.0895, 0.287: 0.0865, 0.308: 0.0833,
}  # fmt: skip
"""Thrust coefficient of the propeller APC Slow Flyer 10x4.7 by advance ratio, in a wind tunnel at 6512 rpm: UIUC
Propeller Database (Brandt, Deters, Ananda, Dantsker and Selig), volume 1, run rd0841."""
STANDING, RADIUS = 0.1299, 0.127
"""Its thrust coefficient without inflow, at 6528 rpm (run kt0835), and its radius, m."""


def test_a_rotor_loses_thrust_to_inflow_as_a_propeller_in_a_wind_tunnel(vacuum: Vehicle) -> None:
    """The advance ratio is J = V / (n D) = pi V / (W R). The line whose slope is 1.08 stays within 3 % of the static
    thrust up to J = 0.31, whether the vehicle climbs or the wind blows.
    """
    vehicle = dataclasses.replace(vacuum, inflow_loss=np.asarray(1.08 * np.pi / RADIUS))
    plant, speed = Airframe.of(vehicle, 0.005), 6512 * 2 * np.pi / 60
    ratio = np.array([0.0, *MEASURED])
    climb = ratio * speed * RADIUS / np.pi
    still = State.hovering(vehicle, jnp.zeros((len(ratio), 3)))
    still = dataclasses.replace(still, rotor_speed=jnp.full((len(ratio), 4), speed))
    upward = jnp.asarray(np.outer(climb, [0.0, 0.0, 1.0]))

    def thrusts(velocity: jax.Array, wind: jax.Array) -> np.ndarray:
        parts = Parts.of(dataclasses.replace(still, velocity=velocity))
        return np.asarray(accelerations(plant, parts, Vec3.of(wind))[0].z) + 9.81

    climbing = thrusts(upward, 0 * upward)
    np.testing.assert_allclose(climbing, thrusts(0 * upward, -upward), rtol=1e-12)
    np.testing.assert_allclose(climbing[1:] / climbing[0], np.array([*MEASURED.values()]) / STANDING, atol=0.03)
    assert climbing[-1] < 0.7 * climbing[0]


def test_inflow_damps_a_turn_about_a_level_axis(vacuum: Vehicle) -> None:
    """By hand: a rotor beside a rolling vehicle's middle climbs at p y and loses `inflow_loss` p y / W of its thrust;
    about body z nothing is lost.
    """
    vehicle = having(vacuum, "inflow_loss")
    state = State.hovering(vehicle, jnp.zeros((2, 3)))
    turning = dataclasses.replace(state, body_rate=jnp.asarray([[2.0, 0.0, 0.0], [0.0, 0.0, 2.0]]))
    _, slowed = accelerations(Airframe.of(vehicle, 0.005), Parts.of(turning), None)
    arms, speed = rotor_arms(vehicle)[:, 1], vehicle.hover_rotor_speed
    torque = -np.sum(vehicle.rotor_thrust(speed) * VALUES["inflow_loss"] * 2.0 * arms**2 / speed)
    np.testing.assert_allclose(slowed.x, [torque / vehicle.inertia[0], 0.0], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(slowed.z, 0.0, atol=1e-9)


@pytest.fixture(scope="module")
def looped(vis_r: Vehicle) -> Vehicle:
    return having(vis_r, "rate_integral_gain", "gyro_time_constant")


def rolling(vehicle: Vehicle, command: list[float], seconds: float, share: list[float]) -> State:
    """The state after a command that holds so long, from hover, with rotors that push less than they should."""
    physics = Physics.of(vehicle, control_rate=100.0, dtype=np.float64)
    start = started(physics, physics.nominal, State.hovering(vehicle, jnp.zeros(3)))

    @jax.jit
    def fly(start: State) -> State:
        def one(state: State, _: None) -> tuple[State, None]:
            return step(physics, physics.nominal, state, jnp.asarray(command), rotor_share=jnp.asarray(share)), None

        return jax.lax.scan(one, start, None, round(100 * seconds))[0]

    return fly(start)


def test_an_integral_part_takes_away_what_is_left_of_a_rate_error(vis_r: Vehicle) -> None:
    """One rotor is 10 % weaker than the flight controller believes."""
    command, share = [9.81, 2.0, 0.0, 0.0], [1.0, 1.0, 1.0, 0.9]
    plain = rolling(vis_r, command, 3.0, share)
    held = rolling(having(vis_r, "rate_integral_gain"), command, 3.0, share)
    assert abs(plain.body_rate[0] - 2) > 0.2
    np.testing.assert_allclose(held.body_rate, [2, 0, 0], atol=0.01)


def test_the_integral_part_does_not_wind_up(vis_r: Vehicle) -> None:
    """Of a rotor that pushes nothing the vehicle falls over, whatever is asked."""
    vehicle = having(vis_r, "rate_integral_gain")
    end = rolling(vehicle, [9.81, 0.0, 0.0, 0.0], 3.0, [1.0, 1.0, 1.0, 0.0])
    most = vehicle.rate_gain * vehicle.body_rate_max
    assert np.isclose(np.abs(end.rate_loop.integral), most).any()
    assert np.all(np.abs(end.rate_loop.integral) <= most * (1 + 1e-12))


def test_the_filter_and_the_integral_by_their_closed_forms(stone: Vehicle) -> None:
    """A body that nothing turns rolls on; the rate loop sees it with the lag of its filter."""
    vehicle = having(stone, "rate_integral_gain", "gyro_time_constant")
    body = dataclasses.replace(vehicle, inertia=np.full(3, 1e3))
    physics = dataclasses.replace(Physics.of(vehicle, control_rate=50.0, dtype=np.float64), body=body)
    rate = np.array([1.0, 0.0, 0.0])
    start = State.hovering(vehicle, jnp.zeros(3))
    start = dataclasses.replace(start, body_rate=jnp.asarray(rate), rate_loop=RateLoop(jnp.zeros(3), jnp.zeros(3)))
    end = step(physics, body, start, jnp.asarray([0.0, 3.0, 0.0, 0.0]))
    t, lag = physics.control_period, vehicle.gyro_time_constant
    seen = 1 - np.exp(-t / lag)
    np.testing.assert_allclose(end.rate_loop.seen, [seen, 0, 0], rtol=1e-4, atol=1e-4)
    integral = vehicle.rate_integral_gain[0] * (3 * t - (t - lag * seen))
    np.testing.assert_allclose(end.rate_loop.integral, [integral, 0, 0], rtol=1e-4, atol=1e-3)


def test_without_an_integral_or_a_filter_the_state_has_neither(vis_r: Vehicle, looped: Vehicle) -> None:
    for vehicle, mode, leaves in ((vis_r, "ctbr", 5), (looped, "ctbr", 7), (looped, "rotor_thrust", 5)):
        physics = Physics.of(vehicle, mode)
        state = State.hovering(vehicle, jnp.zeros(3))
        assert len(jax.tree.leaves(started(physics, physics.nominal, state))) == leaves
        assert len(jax.tree.leaves(step(physics, physics.nominal, state, jnp.full(4, 2.0)))) == leaves


def test_full_rotors_turn_as_fast_as_the_sagging_battery_lets_them(vis_r: Vehicle, fly: Callable[..., State]) -> None:
    """By hand: where speed, thrust and voltage agree; and the shares by which a file is judged are those of flight."""
    vehicle = having(vis_r, "voltage_sag")
    physics = Physics.of(vehicle, "rotor_thrust", control_rate=100.0, dtype=np.float64)
    start = State.hovering(vehicle, jnp.zeros(3))
    path = fly(physics, vehicle, start, jnp.full((100, 4), vis_r.thrust_range[1]))
    speed = np.array(path.rotor_speed[-1, 0])
    thrust = 4 * vehicle.rotor_thrust(speed)
    voltage = 15.6 - 0.08 * thrust
    assert speed == pytest.approx(vis_r.full_rotor_speed * (voltage / 14.8) ** 0.9, rel=1e-5)
    assert thrust == pytest.approx(reached_share(vehicle) * 4 * vis_r.thrust_range[1], rel=1e-5)
    assert 0.8 < reached_share(vehicle) < 0.99


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_no_rotor_passes_its_ceiling(integrator: str, vis_r: Vehicle, fly: Callable[..., State]) -> None:
    """Each has its own; one that is above it slows down to it, and the battery does not lift it."""
    most = np.array([1500.0, 2000.0, 2500.0, 1e6])
    vehicle = dataclasses.replace(having(vis_r, "voltage_sag"), rotor_speed_ceiling=most)
    physics = Physics.of(vehicle, "rotor_thrust", integrator, control_rate=100.0, dtype=np.float64)
    path = fly(physics, vehicle, State.hovering(vehicle, jnp.zeros(3)), jnp.full((100, 4), vis_r.thrust_range[1]))
    speed = np.array(path.rotor_speed[-1])
    np.testing.assert_allclose(speed[:3], most[:3], rtol=1e-9)
    assert 2600 < speed[3] < vis_r.full_rotor_speed * (15.6 / 14.8)


def test_a_low_ceiling_is_part_of_the_thrust_that_a_vehicle_reaches(vis_r: Vehicle) -> None:
    vehicle = dataclasses.replace(vis_r, rotor_speed_ceiling=np.array([3000.0, 2500.0, 3000.0, 3000.0]))
    assert reached_share(vehicle) == pytest.approx(vis_r.rotor_thrust(2500.0) / vis_r.thrust_range[1])
    assert reached_share(vis_r) == pytest.approx(1)
