"""Racing by eye: what the policy is shown, and what is kept from it."""

import dataclasses

import jax
import numpy as np
import pytest

from e2efly.config import EnvConfig, RewardConfig
from e2efly.environment import Env, random_key
from e2efly.policy.goal import Shape
from e2efly.runs.presets import preset
from e2efly.simulation.physics import State
from e2efly.tasks import TASKS
from e2efly.tasks.race_eyes import SENSED
from e2efly.tasks.race_eyes.goal import RaceEyesRoute
from e2efly.vehicles.gravity import GRAVITY

REWARD_OF_HOVER = RewardConfig({"prog2": 1.0})


def made(**changes: object) -> Env:
    config = preset("race_eyes", "dagger", "nominal")
    return Env.of(dataclasses.replace(config.task, **changes), config.reward, config.env)  # type: ignore[arg-type]


def test_a_policy_is_told_neither_where_it_is_nor_where_the_gates_are() -> None:
    env = made()
    assert tuple(field.name for field in env.fields) == SENSED
    state, observation = env.reset(random_key(0), 4)
    moved = dataclasses.replace(state.vehicle, position=state.vehicle.position + 5, velocity=state.vehicle.velocity + 3)
    np.testing.assert_allclose(env.shown(state, moved), observation, atol=1e-6)
    assert observation.shape == (4, env.observation_size)
    (image,) = state.images
    assert image.max() == 1.0 and image.mean() < 0.5  # the first gate


def test_names_choose_what_a_policy_observes_of_any_task() -> None:
    hover = TASKS["hover"]
    names = ("attitude", "body_rate", "position_error")
    env = Env.of(hover(observes=names), REWARD_OF_HOVER)
    assert {field.name for field in env.fields} == set(names)
    whole = Env.of(hover(), REWARD_OF_HOVER)
    for some in (names, ("attitude", "velocity"), tuple(field.name for field in whole.fields)):
        told = env.showing(some)
        assert {field.name for field in told.fields} == set(some), "what one policy is not shown, another may be"
        state, _ = whole.reset(random_key(1), 3)
        every = whole.shown(state, state.vehicle)
        at = np.cumsum([0, *(field.size for field in whole.fields)])
        parts = [every[:, a:b] for a, b, field in zip(at, at[1:], whole.fields, strict=False) if field.name in some]
        np.testing.assert_array_equal(told.shown(state, state.vehicle), np.concatenate(parts, axis=1))


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("attitude", "speed"), "task.observes has speed; accepted: some of position_error, attitude, velocity"),
        (("velocity",), "task.observes is velocity; accepted: with attitude"),
        ((), "task.observes is empty; accepted: with attitude"),
    ],
)
def test_what_cannot_be_observed_is_refused_by_name(names: tuple[str, ...], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        Env.of(TASKS["hover"](observes=names), REWARD_OF_HOVER, EnvConfig())


def test_a_task_that_observes_an_imu_has_one() -> None:
    names = ("attitude", "accelerometer")
    env = Env.of(TASKS["hover"](observes=names), REWARD_OF_HOVER, EnvConfig())
    assert {field.name for field in env.fields} == set(names)
    _, observation = env.reset(random_key(0), 2)
    np.testing.assert_allclose(np.linalg.norm(observation[:, -3:], axis=1), GRAVITY, rtol=1e-5)  # at rest


def test_its_worlds_are_the_tracks_enlarged_with_displaced_gates() -> None:
    env = made(track=("four_gates", "j_shaped"), gate_position=0.0, gate_yaw=0.0, scale=3.0)
    memory = env.reset(random_key(2), 64)[0].memory
    counts = np.unique(np.asarray(memory.tracks.count))
    assert len(counts) == 2, "each episode has one of the tracks"
    near = made(track=("four_gates",), scale=1.0, gate_position=0.0, gate_yaw=0.0).reset(random_key(2), 1)[0].memory
    mine = memory.tracks.gates.position[np.asarray(memory.tracks.count) == near.tracks.count[0]][0]
    there = np.asarray(near.tracks.gates.position[0, : int(near.tracks.count[0])])
    np.testing.assert_allclose(mine[: len(there)], there * [3, 3, 1], rtol=1e-6)


def test_a_route_enlarges_its_track_and_its_goal_shows_nothing() -> None:
    near, far = (RaceEyesRoute(scale=k, laps=k).course(Shape(0.05, 0.15), 1 / 30) for k in (1, 2))
    assert far.goal.fields == () and far.goal.config.laps == 2
    here = State(far.start[None], *(np.zeros((1, size)) for size in (3, 4, 3, 4)))  # type: ignore[arg-type]
    assert far.goal.observe(far.memory, np.zeros(1), here).shape == (1, 0)
    np.testing.assert_allclose(far.start[:2], 2 * near.start[:2])
    away = np.linalg.norm(far.start - far.goal.goal(far.memory, np.zeros(1))[0])
    assert far.goal.config.fence < away < far.goal.fence(far.memory)[0], "it may begin as far off as a start is"


def test_the_same_program_serves_every_draw() -> None:
    env = made()
    leaves, structure = jax.tree.flatten(env)
    other = jax.tree.flatten(made(gate_position=0.3))[1]
    assert structure == other and leaves
