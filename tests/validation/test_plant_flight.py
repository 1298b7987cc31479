"""Flights by the runtime: what is recorded, when they end, what happens when something breaks."""

import dataclasses
from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import ImuConfig
from e2efly.courses.gates import Gates
from e2efly.courses.references import through_points
from e2efly.courses.tracks import RaceTrack
from e2efly.policy.goal import Course, Shape
from e2efly.policy.loader import load_policy
from e2efly.policy.runtime import Runtime
from e2efly.simulation.physics import State
from e2efly.simulation.sensors.imu import ImuState, measure
from e2efly.tasks.hover.goal import HoverRoute
from e2efly.tasks.land.goal import LandRoute
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.race.goal import RaceGoal
from e2efly.tasks.track import TrackConfig
from e2efly.tasks.track.goal import TrackGoal, TrackMemory
from e2efly.validation.fleet import FleetFlight, FleetMission, fly_all
from e2efly.validation.plant import RigidState
from e2efly.validation.plants.mujoco import MujocoPlant
from e2efly.validation.plants.simulator import SimulatorPlant
from e2efly.validation.reality import Reality
from e2efly.vehicles.loading import load_vehicle
from tests.validation.alone import fly

START = RigidState(np.array([0.5, -0.5, 3.2]), np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3))
SHAPE, PERIOD = Shape(0.05, 0.12), 1 / 30
GOAL = HoverRoute(target=(0.0, 0.0, 3.0)).course(SHAPE, PERIOD)


class Recorded:
    """A plant that writes down what it is told, and may break."""

    name = "recorded"
    state = START

    def __init__(self, breaks_at: int = 10**9) -> None:
        self.told: list[tuple[float, float]] = []
        self._breaks_at = breaks_at

    def reset(self, state: RigidState) -> None:
        self.state = state

    def step(self, command: np.ndarray, dt: float) -> None:
        if len(self.told) >= self._breaks_at:
            raise OSError("the link is gone")
        self.told.append((float(command[0]), dt))

    def leave(self) -> None: ...

    def close(self) -> None: ...


@pytest.fixture
def hover(policy_of: Callable[..., Path]) -> Runtime:
    return Runtime.of(load_policy(policy_of("hover")), GOAL, load_vehicle("vis_r"))


def test_hover_in_mujoco_ends_at_the_target(hover: Runtime) -> None:
    flight = fly(hover, MujocoPlant(load_vehicle("vis_r")), START, 6.0, hover.policy.contract.latency_s)
    assert flight.fault == ""
    assert flight.position.shape == (181, 3)
    assert flight.observation.shape == (180, hover.policy.contract.observation_size)
    np.testing.assert_allclose(flight.position[0], START.position)
    np.testing.assert_allclose(flight.position[-1], GOAL.goal.config.target, atol=0.03)
    # rows belong together: the observation of a step is of the state that it starts from, the command of its action
    np.testing.assert_allclose(flight.observation[7, :3], GOAL.goal.config.target - flight.position[7], atol=1e-6)
    np.testing.assert_allclose(flight.command[7], hover.policy.command(flight.action[7]), atol=1e-9)


def test_commands_act_the_latency_after_the_observation(hover: Runtime) -> None:
    plant, period = Recorded(), 1 / 30
    flight = fly(hover, plant, START, 4 * period, 0.06)
    hovering = hover.policy.command(np.array(hover.policy.contract.hover_action))[0]
    heard = [(hovering, period), (hovering, 0.06 - period), (flight.command[0, 0], 2 * period - 0.06)]
    assert plant.told[:3] == [pytest.approx(x, rel=1e-6) for x in heard]
    assert sum(dt for _, dt in plant.told) == pytest.approx(4 * period)


def test_landing_ends_at_the_ground(policy_of: Callable[..., Path]) -> None:
    vehicle = load_vehicle("vis_r")
    goal = LandRoute().course(Shape(vehicle.feet_height, vehicle.radius), PERIOD)
    runtime = Runtime.of(load_policy(policy_of("land", 0.3)), goal, vehicle)
    start = dataclasses.replace(START, position=np.array([0.2, 0.0, 1.0]))
    flight = fly(runtime, MujocoPlant(vehicle), start, 10.0, 0.06)
    assert flight.time[-1] < 9
    assert flight.position[-1, 2] <= vehicle.feet_height
    assert flight.position[-2, 2] > vehicle.feet_height


class Dragged(Recorded):
    """A plant that is pulled along a line at 20 m/s, whatever it is told."""

    def step(self, command: np.ndarray, dt: float) -> None:
        super().step(command, dt)
        self.state = dataclasses.replace(self.state, position=self.state.position + np.array([20.0 * dt, 0.0, 0.0]))


@pytest.mark.parametrize(("sideways", "ends"), [(0.0, 10.2), (0.45, 5.0)])
def test_a_race_ends_behind_its_last_gate_or_at_the_first_that_is_missed(
    sideways: float, ends: float, policy_of: Callable[..., Path]
) -> None:
    places, size = np.array([[5.0, 0.0, 2.0], [10.2, 0.0, 2.0]]), np.ones((2, 2))
    track = RaceTrack("two", False, np.array([0.0, 0.0, 2.0]), 0.0, places, np.zeros(2), size)
    goal = Course(RaceGoal(RaceConfig(), SHAPE, Gates.of(track), False), np.zeros(1, int), track.start)
    runtime = Runtime.of(load_policy(policy_of("race")), goal, load_vehicle("vis_r"))
    start = dataclasses.replace(START, position=np.array([0.0, sideways, 2.0]))
    flight = fly(runtime, Dragged(), start, 4.0, 0.0)
    assert ends < flight.position[-1, 0] < ends + 3 * 20 / 30  # seen by the question after the one that follows it
    assert flight.fault == ""


def test_a_reference_that_is_over_is_held_until_the_time_is_out(policy_of: Callable[..., Path]) -> None:
    rows = np.array([[t, 0.2 * t, 0.0, 3.0] for t in (0.0, 0.5, 1.0)])
    memory = TrackMemory(through_points(rows), np.zeros(1), np.zeros(1))
    goal = Course(TrackGoal(TrackConfig(), SHAPE), memory, rows[0, 1:])
    runtime = Runtime.of(load_policy(policy_of("track")), goal, load_vehicle("vis_r"))
    flight = fly(runtime, MujocoPlant(load_vehicle("vis_r")), START, 6.0, 0.06)
    assert flight.time[-1] == pytest.approx(6.0)
    np.testing.assert_allclose(flight.position[-1], [0.2, 0.0, 3.0], atol=0.03)


def test_a_plant_that_breaks_ends_the_flight_with_its_reason(hover: Runtime) -> None:
    flight = fly(hover, Recorded(breaks_at=7), START, 4.0, 0.0)
    assert flight.fault == "after 0.23 s: the link is gone"
    assert len(flight.action) == 7
    assert len(flight.position) == 8


def test_a_state_that_is_not_finite_ends_the_flight(hover: Runtime) -> None:
    class Diverges(Recorded):
        def step(self, command: np.ndarray, dt: float) -> None:
            super().step(command, dt)
            if len(self.told) == 3:
                self.state = dataclasses.replace(START, velocity=np.full(3, np.nan))

    flight = fly(hover, Diverges(), START, 4.0, 0.0)
    assert flight.fault == "after 0.07 s: velocity is [nan, nan, nan]; accepted: 3 finite numbers"
    assert np.isfinite(flight.velocity).all()


@pytest.mark.parametrize(
    ("duration", "latency", "said"),
    [(0.0, 0.0, "duration is 0.0 s"), (float("nan"), 0.0, "duration is nan"), (1.0, -0.1, "latency is -0.1")],
)
def test_what_cannot_be_flown_is_refused(hover: Runtime, duration: float, latency: float, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        fly(hover, Recorded(), START, duration, latency)


def test_processes_fly_what_one_process_flies(policy_of: Callable[..., Path]) -> None:
    vehicle = load_vehicle("vis_r")
    mission = FleetMission(policy_of("hover"), "mujoco", vehicle, vehicle, 0.3)
    starts = [dataclasses.replace(START, velocity=np.array([0.1 * i, 0.0, 0.0])) for i in range(7)]
    home, told = Reality(vehicle, 0.06), list[int]()
    flights = [FleetFlight(start, GOAL, home) for start in starts]
    alone, together = fly_all(mission, flights, processes=1), fly_all(mission, flights, told.append, processes=2)
    assert told == list(range(1, 8))
    for a, b in zip(alone, together, strict=True):
        np.testing.assert_array_equal(a.position, b.position)
        np.testing.assert_array_equal(a.command, b.command)
    with pytest.raises(ValueError, match="processes is 0; accepted: 1 or more"):
        fly_all(mission, flights, processes=0)


def test_a_policy_that_sees_an_imu_is_shown_what_training_would_measure(policy_of: Callable[..., Path]) -> None:
    still = ImuConfig(observed=True, gyro_noise=0.0, gyro_bias=0.0, accel_noise=0.0, accel_bias=0.0)
    policy, vehicle = load_policy(policy_of("hover", imu=still)), load_vehicle("vis_r")
    runtime = Runtime.of(policy, GOAL, vehicle, imu=True)
    flight = fly(runtime, SimulatorPlant(vehicle), START, 2.0, policy.contract.latency_s)
    assert flight.fault == ""
    parts = (flight.position, flight.velocity, flight.quaternion, flight.body_rate)
    at = [State(*(jnp.asarray(x[k], jnp.float32) for x in parts), jnp.zeros(4)) for k in range(len(flight.time))]
    rows = policy.contract.slices
    for k, row in enumerate(flight.observation):
        measured = ImuState.at(at[0])
        if k:
            measured = measure(still, jax.random.key(0), measured, at[k - 1], at[k], PERIOD)
        np.testing.assert_allclose(row[rows["gyroscope"]], measured.gyroscope, atol=1e-4)
        np.testing.assert_allclose(row[rows["accelerometer"]], measured.accelerometer, atol=2e-3)
    assert np.ptp(flight.observation[:, rows["accelerometer"]][:, 2]) > 0.3
