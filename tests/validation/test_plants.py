"""The plants: MuJoCo against closed forms and against our own physics."""

import dataclasses
import sys
from collections.abc import Callable

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from e2efly.control import Vec3
from e2efly.simulation.physics import Physics, State, step
from e2efly.simulation.physics.mixer import Mixer
from e2efly.validation.flight_controller import PlainRateLoop, rotor_speed_of
from e2efly.validation.plant import Delay, Plant, RigidState
from e2efly.validation.plants import find_plant
from e2efly.validation.plants.airsim import AirsimPlant
from e2efly.validation.plants.betaflight import BetaflightPlant
from e2efly.validation.plants.mujoco import MujocoPlant, MujocoWorld
from e2efly.validation.plants.mujoco_model import STEP, world_xml
from e2efly.validation.plants.simulator import SimulatorPlant
from e2efly.vehicles.gravity import GRAVITY
from e2efly.vehicles.loading import load_vehicle
from e2efly.vehicles.vehicle import Vehicle

LEVEL = np.array([1.0, 0.0, 0.0, 0.0])
HOVER = np.array([GRAVITY, 0.0, 0.0, 0.0])


def at(height: float = 3.0, **changes: list[float]) -> RigidState:
    state = RigidState(np.array([0.0, 0.0, height]), np.zeros(3), LEVEL, np.zeros(3))
    return dataclasses.replace(state, **{name: np.array(value) for name, value in changes.items()})


def tumbling() -> RigidState:
    q = np.array([0.7, 0.4, -0.5, 0.3])
    return at(50.0, velocity=[3.0, -5.0, 2.0], quaternion=(q / np.linalg.norm(q)).tolist(), body_rate=[2.0, -3.0, 1.0])


@pytest.mark.parametrize("name", ["vis_r", "vis_h", "crazyflie"])
def test_mass_matrix_of_mujoco_is_the_vehicles(name: str) -> None:
    vehicle = load_vehicle(name)
    plant = MujocoPlant(vehicle)
    plant.reset(at(1.0))
    matrix = np.zeros((6, 6))
    mujoco.mj_fullM(plant.model, plant.data, matrix)
    mass = [vehicle.mass] * 3
    np.testing.assert_allclose(matrix, np.diag([*mass, *vehicle.inertia]), rtol=1e-9, atol=1e-15)


def test_rotors_push_and_twist_where_the_vehicle_has_them(vis_r: Vehicle) -> None:
    still = dataclasses.replace(vis_r, drag_linear=np.zeros(3), drag_quadratic=np.zeros(3))
    for i in range(4):
        thrust = np.full(4, vis_r.thrust_range[0])
        thrust[i] = 2.0
        plant = MujocoPlant(still, "rotor_thrust")
        plant.reset(at())
        plant.data.act[:] = rotor_speed_of(vis_r.thrust_map, thrust.tolist())
        plant.step(thrust, 1e-4)
        x, y = vis_r.rotor_position.T
        torque = [y @ thrust, -x @ thrust, vis_r.torque_ratio * vis_r.rotor_spin @ thrust]
        np.testing.assert_allclose(plant.state.body_rate / 1e-4, torque / vis_r.inertia, rtol=1e-3)
        assert plant.state.velocity[2] / 1e-4 == pytest.approx(thrust.sum() / vis_r.mass - GRAVITY, rel=1e-3)


@pytest.mark.usefixtures("x64")
def test_tilted_rotors_agree_with_our_physics() -> None:
    """Each rotor by itself, along its axis, with the momentum of the rotors, for half a second of violent thrusts."""
    hexa, rng = load_vehicle("hexa"), np.random.default_rng(0)
    axis = rng.normal(0.0, 0.2, (6, 3)) + np.array([0.0, 0.0, 1.0])
    places = np.column_stack([hexa.rotor_position, rng.uniform(-0.05, 0.05, 6)])
    vehicle = dataclasses.replace(
        hexa,
        rotor_axis=axis / np.linalg.norm(axis, axis=1, keepdims=True),
        rotor_position=places,
        rotor_inertia=5e-5,
        centre_of_mass=np.array([0.01, -0.02, 0.01]),
    )
    thrusts = np.repeat(rng.uniform(*vehicle.thrust_range, (10, 6)), 50, axis=0)
    physics = Physics.of(vehicle, "rotor_thrust", "rk4", 1000.0, dtype=np.float64)
    start, plant = tumbling(), MujocoPlant(vehicle, "rotor_thrust")
    arrays = start.position, start.velocity, start.quaternion, start.body_rate, np.full(6, vehicle.hover_rotor_speed)
    ours = fine(physics, State(*(jnp.asarray(x) for x in arrays)), jnp.asarray(thrusts))
    plant.reset(start)
    for command in thrusts:
        plant.step(command, 1e-3)
    np.testing.assert_allclose(ours.position[-1], plant.state.position, atol=1e-3)
    np.testing.assert_allclose(ours.velocity[-1], plant.state.velocity, atol=5e-3)
    np.testing.assert_allclose(ours.body_rate[-1], plant.state.body_rate, atol=2e-2)


def test_plants_refuse_rotors_that_they_do_not_drive_by_name() -> None:
    hexa = load_vehicle("hexa")
    with pytest.raises(ValueError, match=r"vehicle 'hexa' has 6 rotors; accepted by plant 'airsim': four level"):
        AirsimPlant(hexa, "ctbr")
    tilted = dataclasses.replace(hexa, rotor_axis=np.tile([0.0, 0.0, 1.0], (6, 1)))
    with pytest.raises(ValueError, match=r"vehicle 'hexa' has 6 rotors as no mixer of Betaflight's drives them"):
        BetaflightPlant(tilted, "ctbr")


def test_fall_with_rotors_that_spin_down_by_the_closed_form(vis_r: Vehicle) -> None:
    still = dataclasses.replace(vis_r, drag_linear=np.zeros(3), drag_quadratic=np.zeros(3))
    plant, t, lag = MujocoPlant(still), 0.5, vis_r.motor_time_constant
    plant.reset(at())
    plant.step(np.zeros(4), t)
    k2, k1, k0 = vis_r.thrust_map
    idle = vis_r.rotor_speed_min
    d = vis_r.hover_rotor_speed - idle
    once, twice = lag * (1 - np.exp(-t / lag)), lag / 2 * (1 - np.exp(-2 * t / lag))
    impulse = 4 * ((k2 * idle**2 + k1 * idle + k0) * t + (2 * k2 * idle + k1) * d * once + k2 * d**2 * twice)
    np.testing.assert_allclose(plant.state.velocity, [0, 0, impulse / vis_r.mass - GRAVITY * t], atol=2e-4)
    np.testing.assert_allclose(plant.rotor_speed, idle + d * np.exp(-t / lag), rtol=1e-6)


@pytest.mark.parametrize(("make", "drift"), [(MujocoPlant, 1e-9), (SimulatorPlant, 1e-4)])
def test_hovering_stays(make: Callable[[Vehicle], Plant], drift: float, vis_r: Vehicle) -> None:
    plant = make(vis_r)
    plant.reset(at())
    plant.step(HOVER, 2.0)
    np.testing.assert_allclose(plant.state.position, [0, 0, 3], atol=drift)
    np.testing.assert_allclose(plant.state.quaternion, LEVEL, atol=drift)


@jax.jit
def fine(physics: Physics, state: State, commands: jax.Array) -> State:
    """Our physics under a command each control period."""

    def one(state: State, command: jax.Array) -> tuple[State, State]:
        state = step(physics, physics.nominal, state, command)
        return state, state

    return jax.lax.scan(one, state, commands)[1]


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("name", ["vis_r", "crazyflie", "hexa", "octo"])
def test_a_tumbling_second_agrees_with_our_physics_at_the_same_step(name: str) -> None:
    """Same rate loop rate, 1 kHz; RK4 on both sides: what is left is two different programs. Saturates the mixer."""
    vehicle, start = load_vehicle(name), tumbling()
    rng = np.random.default_rng(0)
    low, high = np.array([0.0, *-vehicle.body_rate_max]), np.array([2 * GRAVITY, *vehicle.body_rate_max])
    commands = np.repeat(rng.uniform(low, high, (20, 4)), 50, axis=0)
    physics = Physics.of(vehicle, "ctbr", "rk4", 1000.0, dtype=np.float64)
    speed = np.full(vehicle.rotor_count, vehicle.hover_rotor_speed)
    arrays = (start.position, start.velocity, start.quaternion, start.body_rate, speed)
    ours = fine(physics, State(*(jnp.asarray(x) for x in arrays)), jnp.asarray(commands))
    plant, theirs = MujocoPlant(vehicle), []
    plant.reset(start)
    for command in commands:
        plant.step(command, 1e-3)
        theirs.append(plant.state)
    assert np.max([np.linalg.norm(s.body_rate) for s in theirs]) > (5 if vehicle.rotor_count == 4 else 3.8)
    np.testing.assert_allclose(ours.position, [s.position for s in theirs], atol=1e-3)
    np.testing.assert_allclose(ours.velocity, [s.velocity for s in theirs], atol=5e-3)
    np.testing.assert_allclose(ours.body_rate, [s.body_rate for s in theirs], atol=2e-2)
    np.testing.assert_allclose(ours.rotor_speed[-1], plant.rotor_speed, rtol=1e-3)


def test_step_of_the_roll_rate_against_the_training_simulator(vis_r: Vehicle) -> None:
    """The training's steps of 5 ms cost at most 6 % of a step of 5 rad/s on the way up, 1 % after a third of a s."""
    plants = (SimulatorPlant(vis_r), MujocoPlant(vis_r))
    rates = []
    for plant in plants:
        plant.reset(at())
        path = []
        for _ in range(10):
            plant.step(np.array([GRAVITY, 5.0, 0.0, 0.0]), 1 / 30)
            path.append(plant.state.body_rate)
        rates.append(np.array(path))
    assert rates[1][0, 0] < 3 < rates[1][1, 0]  # it takes between one and two control periods to 60 %
    np.testing.assert_allclose(rates[0], rates[1], atol=0.3)
    np.testing.assert_allclose(rates[0][-1], rates[1][-1], atol=0.05)
    assert rates[1][-1, 0] == pytest.approx(5.0, abs=0.1)


def test_rate_loop_and_mixer_are_the_simulators(vis_r: Vehicle) -> None:
    """Over commands of which many saturate."""
    from e2efly.simulation.physics.body import gyroscopic_torque

    rng, mixer, law = np.random.default_rng(0), Mixer.of(vis_r, np.float64), PlainRateLoop(vis_r)
    saturated = 0
    for _ in range(200):
        command = np.array([rng.uniform(0, 28), *rng.uniform(-15, 15, 3)])
        rate = rng.uniform(-12, 12, 3)
        wanted = np.clip(command[1:], -vis_r.body_rate_max, vis_r.body_rate_max)
        torque = vis_r.inertia * vis_r.rate_gain * (wanted - rate)
        torque = torque + np.array(gyroscopic_torque(Vec3.of(vis_r.inertia), Vec3(*rate)).stack())
        ours = mixer.thrusts(vis_r.mass * command[0], Vec3(*(jnp.asarray(x) for x in torque)))
        theirs = law.thrusts(command.tolist(), rate.tolist(), 1e-3)
        np.testing.assert_allclose(theirs, np.array(ours), rtol=1e-5, atol=1e-5)
        saturated += max(theirs) == vis_r.thrust_range[1]
    assert saturated > 50


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("mode", "command"),
    [
        ("rotor_thrust", [1.9, 1.9, 1.85, 1.85]),
        ("rotor_speed", [0.62, 0.62, 0.61, 0.61]),
        ("attitude", [10.5, 0.2, -0.3, 0.4]),
        ("acceleration", [2.0, -1.0, 0.5, 0.3]),
        ("velocity", [1.0, 0.5, -0.5, 0.2]),
        ("position", [1.0, -0.5, 3.5, 0.0]),
    ],
)
def test_every_command_mode_flies_as_in_the_training_simulator(mode: str, command: list[float], vis_r: Vehicle) -> None:
    states = []
    for plant in (SimulatorPlant(vis_r, mode), MujocoPlant(vis_r, mode)):
        plant.reset(at())
        plant.step(np.array(command), 1.0)
        states.append(plant.state)
    moved = np.linalg.norm(states[1].position - [0, 0, 3])
    assert moved > 0.2
    np.testing.assert_allclose(states[0].position, states[1].position, atol=0.03 * moved)
    np.testing.assert_allclose(states[0].quaternion, states[1].quaternion, atol=0.02)


def test_it_stands_on_its_feet(vis_r: Vehicle) -> None:
    plant = MujocoPlant(vis_r)
    plant.reset(at(0.1, velocity=[0.2, 0.0, -0.3]))
    plant.step(np.zeros(4), 2.0)
    assert plant.state.position[2] == pytest.approx(vis_r.feet_height, abs=2e-3)
    assert np.linalg.norm(plant.state.velocity) < 0.01
    np.testing.assert_allclose(plant.state.quaternion, LEVEL, atol=0.01)


def test_the_xml_is_of_this_vehicle_and_stands_alone(vis_r: Vehicle) -> None:
    model = mujoco.MjModel.from_xml_string(world_xml([vis_r]))
    assert model.nu == 7
    heavier = mujoco.MjModel.from_xml_string(world_xml([dataclasses.replace(vis_r, mass=0.9)]))
    assert heavier.body_mass.sum() == pytest.approx(0.9)


@pytest.mark.parametrize("make", [MujocoPlant, SimulatorPlant])
def test_a_command_may_be_held_in_pieces(make: Callable[[Vehicle], Plant], vis_r: Vehicle) -> None:
    command, plant = np.array([11.0, 1.0, -0.5, 0.3]), make(vis_r)
    states = []
    for parts in ([1 / 30], [0.021, 1 / 30 - 0.021], [0.001] * 33 + [1 / 30 - 0.033]):
        plant.reset(at())
        for part in parts:
            plant.step(command, part)
        states.append(plant.state)
    for other in states[1:]:
        np.testing.assert_allclose(other.body_rate, states[0].body_rate, rtol=2e-2, atol=1e-6)
        np.testing.assert_allclose(other.position, states[0].position, atol=1e-5)


def test_a_reset_forgets_everything(vis_r: Vehicle) -> None:
    for plant in (MujocoPlant(vis_r), SimulatorPlant(vis_r)):
        states = []
        for _ in range(2):
            plant.reset(at())
            plant.step(np.array([15.0, 2.0, 2.0, 1.0]), 0.107)  # ends inside a physics step
            states.append(plant.state)
        np.testing.assert_array_equal(states[0].position, states[1].position)
        np.testing.assert_array_equal(states[0].body_rate, states[1].body_rate)


def company(vehicle: Vehicle, count: int) -> list[MujocoPlant]:
    plants = [MujocoPlant(vehicle) for _ in range(count)]
    MujocoWorld(plants, STEP)
    return plants


def test_two_vehicles_that_meet_push_each_other(vis_r: Vehicle) -> None:
    """They do not pass through each other, and what one loses of its momentum, the other gains."""
    still = dataclasses.replace(vis_r, drag_linear=np.zeros(3), drag_quadratic=np.zeros(3))
    plants = company(still, 2)
    for plant, x, speed in zip(plants, (0.0, 1.0), ([4.0, 0.5, 0.0], [0.0, 0.5, 0.0]), strict=True):
        plant.reset(dataclasses.replace(at(velocity=speed), position=np.array([x, 0.0, 3.0])))
    gaps, total = [], []
    for _ in range(25):
        for plant in plants:
            plant.step(HOVER, 0.02)
        gaps.append(plants[1].state.position[0] - plants[0].state.position[0])
        total.append(plants[0].state.velocity[:2] + plants[1].state.velocity[:2])
    assert 1.8 * still.radius < min(gaps) < 2 * still.radius
    assert plants[1].state.velocity[0] >= plants[0].state.velocity[0] > 1.0
    np.testing.assert_allclose(total, np.tile([4.0, 1.0], (25, 1)), atol=1e-6)


def test_vehicles_that_are_far_apart_fly_as_alone(vis_r: Vehicle) -> None:
    """Also with bodies of their own, and while another has left and falls."""
    bodies = [vis_r, dataclasses.replace(vis_r, mass=1.2 * vis_r.mass)]
    plants, commands = company(vis_r, 3), np.random.default_rng(0).uniform([8, -2, -2, -1], [14, 2, 2, 1], (30, 4))
    plants[1].meet(bodies[1])
    for i, plant in enumerate(plants):
        plant.reset(dataclasses.replace(at(velocity=[1.0, i, 0.0]), position=np.array([0.0, 9.0 * i, 9.0])))
        plant.disturb(np.array([i, 1.0, 0.0]), np.full(4, 1.0 - 0.1 * i))
    plants[2].leave()
    for command in commands:
        for plant in plants[:2]:
            plant.step(command, 0.02)
    for i, plant in enumerate(plants[:2]):
        alone = MujocoPlant(vis_r)
        alone.meet(bodies[i])
        alone.reset(dataclasses.replace(at(velocity=[1.0, i, 0.0]), position=np.array([0.0, 9.0 * i, 9.0])))
        alone.disturb(np.array([i, 1.0, 0.0]), np.full(4, 1.0 - 0.1 * i))
        for command in commands:
            alone.step(command, 0.02)
        for name in ("position", "velocity", "quaternion", "body_rate"):
            np.testing.assert_allclose(getattr(plant.state, name), getattr(alone.state, name), atol=1e-9)
    assert plants[2].state.velocity[2] < -3.0
    plants[0].step(commands[0], 0.02)
    with pytest.raises(ValueError, match=r"hold their commands for \[0.02, 0.01\] s; accepted: one time"):
        plants[1].step(commands[0], 0.01)


def sent(latency: float, count: int, period: float = 0.1) -> tuple[Delay, list[list[tuple[float, float]]]]:
    """Commands 1, 2, 3, ... at the starts of periods: what acts in each period, and for how long."""
    delay, heard = Delay.of(latency, np.zeros(4)), []
    for k in range(count):
        delay, parts = delay.send(np.full(4, k + 1.0), k * period).until(k * period, (k + 1) * period)
        heard.append([(float(command[0]), round(seconds, 6)) for command, seconds in parts])
    return delay, heard


@pytest.mark.parametrize(
    ("latency", "heard"),
    [
        (0.0, [[(1, 0.1)], [(2, 0.1)], [(3, 0.1)]]),
        (0.03, [[(0, 0.03), (1, 0.07)], [(1, 0.03), (2, 0.07)], [(2, 0.03), (3, 0.07)]]),
        (0.1, [[(0, 0.1)], [(1, 0.1)], [(2, 0.1)]]),
        (0.18, [[(0, 0.1)], [(0, 0.08), (1, 0.02)], [(1, 0.08), (2, 0.02)]]),
    ],
)
def test_a_command_acts_its_latency_later(latency: float, heard: list) -> None:
    assert sent(latency, 3)[1] == heard


def test_no_command_is_lost_or_kept_over_a_thousand_periods() -> None:
    delay, heard = sent(0.06, 1000, 1 / 30)
    assert [due for due, _ in delay.coming] == pytest.approx([999 / 30 + 0.06])
    assert all(sum(seconds for _, seconds in parts) == pytest.approx(1 / 30, abs=2e-6) for parts in heard)
    assert [parts[-1][0] for parts in heard] == list(range(1000))


@pytest.mark.parametrize("latency", [-0.01, float("nan"), float("inf")])
def test_a_latency_is_a_time(latency: float) -> None:
    with pytest.raises(ValueError, match=r"latency is .*; accepted: a finite number of seconds"):
        Delay.of(latency, np.zeros(4))


def test_bad_names_and_states_are_told(vis_r: Vehicle, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ValueError, match="unknown plant 'mujocco'; did you mean 'mujoco'"):
        find_plant("mujocco")
    for make in (MujocoPlant, SimulatorPlant):
        with pytest.raises(ValueError, match="unknown command mode 'ctrb'; did you mean 'ctbr'"):
            make(vis_r, "ctrb")
    with pytest.raises(ValueError, match=r"largest_step is 0.0; accepted: a positive number"):
        MujocoPlant(vis_r, largest_step=0.0)
    with pytest.raises(ValueError, match=r"velocity is \[nan, 0.0, 0.0\]; accepted: 3 finite numbers"):
        RigidState.of(at(velocity=[np.nan, 0.0, 0.0]))
    with pytest.raises(ValueError, match=r"quaternion is .*; accepted: a unit quaternion"):
        RigidState.of(at(quaternion=[2.0, 0.0, 0.0, 0.0]))
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(ValueError, match=r"plant 'mujoco' needs the package mujoco: pip install 'e2efly\[mujoco\]'"):
        find_plant("mujoco")
