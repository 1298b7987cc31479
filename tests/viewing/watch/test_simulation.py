"""A policy in flight with hands on it."""

from dataclasses import replace

import jax
import numpy as np
import pytest
import viser

from e2efly.environment import Env, random_key
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import act_of
from e2efly.vehicles.loading import load_vehicle
from e2efly.viewing.watch.simulation import Hands, Simulation, held, under
from e2efly.viewing.watch.viewer import Viewer


def simulation(count: int = 2, task: str = "hover") -> Simulation:
    """Hovering vehicles."""
    found = candidate(task)
    suite = found.task.criteria()[task]
    return Simulation(found.environment(suite), found.flown.body, suite, act_of(found.policy), count)


@pytest.fixture(scope="module")
def hover() -> Simulation:
    return simulation()


def after(source: Simulation, steps: int) -> np.ndarray:
    """(n, 3) where the vehicles are so many steps later."""
    return [source.step(0) for _ in range(steps)][-1].position


@pytest.mark.whole
def test_untouched_vehicles_fly_as_in_the_environment() -> None:
    found = candidate("hover")
    env = found.environment(found.task.criteria()["hover"])
    widened = held(env)
    state, _ = env.reset(random_key(1), 3)
    wide, _ = widened.reset(random_key(1), 3)
    action = 0.3 * jax.random.normal(random_key(2), (3, 4))
    for _ in range(20):
        state, _ = env.step(state, action, restart=False)
        wide, _ = widened.step(under(widened, wide, Hands()), action, restart=False)
    assert np.allclose(state.vehicle.position, wide.vehicle.position, atol=1e-6)
    assert np.allclose(state.vehicle.quaternion, wide.vehicle.quaternion, atol=1e-6)


def test_hands_change_the_vehicle_in_flight(hover: Simulation) -> None:
    hover.begin()
    hover.hands = Hands()
    before = after(hover, 60)
    hover.hands = replace(Hands(), thrust=0.2)  # too little to stay up
    falling = after(hover, 15)
    hover.hands = Hands()
    assert (falling[:, 2] < before[:, 2] - 0.3).all()


def test_a_heavier_vehicle_is_also_harder_to_turn(hover: Simulation) -> None:
    env = hover.env
    state, _ = env.reset(random_key(0), 2)
    heavy = under(env, state, Hands(mass=2.0, delay=0.1, wind=np.array([1.0, 2.0, 0.0])))
    assert np.allclose(heavy.plant["mass"], 2 * float(env.physics.nominal.mass))
    assert np.allclose(heavy.plant["inertia"], 2 * np.asarray(env.physics.nominal.inertia))
    assert np.allclose(heavy.action_latency, 0.1)
    assert np.allclose(heavy.wind, [1.0, 2.0, 0.0])


def test_the_mass_is_relative_to_the_vehicle_that_flies(hover: Simulation) -> None:
    """Not to the one for which its flight controller is tuned."""
    other = replace(hover.env, physics=hover.env.physics.flying(load_vehicle("vis_h")))
    state, _ = other.reset(random_key(0), 2)
    told = under(other, state, Hands(mass=1.0, thrust=1.0))
    for name in ("mass", "inertia", "thrust_map"):
        np.testing.assert_allclose(told.plant[name], state.plant[name], rtol=1e-6, err_msg=name)


def test_a_moved_goal_is_flown_to(hover: Simulation) -> None:
    hover.begin()
    hover.hands = Hands()
    goal = hover.goal_now(0)
    after(hover, 90)
    hover.move(np.array([0.8, -0.4, 0.0]))
    frame = [hover.step(0) for _ in range(90)][-1]
    assert np.allclose(hover.goal_now(0), goal + np.array([0.8, -0.4, 0.0]), atol=1e-5)
    assert np.linalg.norm(frame.position - hover.goal_now(0), axis=1).max() < 0.15


def test_a_thrown_vehicle_is_pushed_once(hover: Simulation) -> None:
    hover.begin()
    after(hover, 60)
    hover.throw()
    pushed = np.linalg.norm(hover.step(0).velocity, axis=1)
    later = np.linalg.norm([hover.step(0) for _ in range(90)][-1].velocity, axis=1)
    assert (pushed > 0.5).all()
    assert (later < 0.3).all()


def test_frames_tell_commands_and_what_came_of_them(hover: Simulation) -> None:
    frame = hover.step(1)
    assert set(frame.series) == {"speed (m/s)", "roll rate (rad/s)", "pitch rate (rad/s)", "yaw rate (rad/s)"}
    assert len(frame.series["roll rate (rad/s)"]) == 2
    assert frame.goal is not None


def test_what_stands_is_drawn_once_per_world() -> None:
    found = candidate("race")
    suite = next(iter(found.task.criteria().values()))
    source = Simulation(found.environment(suite), found.flown.body, suite, act_of(found.policy), 1)
    stage = source.stage_of(0)
    assert source.stage_of(0) is stage
    assert len(stage.bodies) == 4  # gates
    assert [thing.text for thing in stage.things if hasattr(thing, "text")] == ["1", "2", "3", "4"]
    assert isinstance(source.env, Env)


def test_a_page_shows_every_vehicle_of_a_world() -> None:
    race = simulation(1, "race_duel")
    frame = race.step(0)
    assert frame.position.shape[0] == frame.together == race.count == 2
    viewer = Viewer(viser.ViserServer(port=0, verbose=False))
    viewer.show(race.stage_of(0), race.origin, frame, 0.1)
    for body in viewer._bodies:
        assert len(body.batched_colors) == len(body.batched_positions)
        np.testing.assert_allclose(body.batched_positions[:2], frame.position + viewer._offset, atol=1e-5)
    assert len(viewer._goals) == 2
    viewer.server.stop()


def test_a_load_is_shown_where_it_hangs_and_moves_with_the_world() -> None:
    """The page draws it and its cable; a moved goal takes it along with its vehicle."""
    flown = simulation(task="hover_payload")
    viewer = Viewer(viser.ViserServer(port=0, verbose=False))
    for _ in range(2):
        frame = flown.step(0)
        assert frame.load is not None
        assert np.all(np.linalg.norm(frame.load - frame.position, axis=1) < 1.01)
        viewer.show(flown.stage_of(0), flown.origin, frame, 0.1)
        np.testing.assert_allclose(viewer._load.position, frame.load[0] + viewer._offset, atol=1e-5)
        flown.move(np.array([5.0, 0.0, 0.0]))
    viewer.server.stop()
