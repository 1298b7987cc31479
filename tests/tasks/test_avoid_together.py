"""Several vehicles in the same forest: their starts, their verdict, and the expert that knows them."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.environment import random_key
from e2efly.simulation.physics import State
from e2efly.tasks import company
from e2efly.tasks.avoid_together import AvoidTogetherConfig
from e2efly.tasks.avoid_together.world import AvoidTogether
from e2efly.tasks.task import Flier, Shape, at_rest

SHAPE = Shape(0.05, 0.12)
PERIOD = 1 / 30


def make(**changes: Any) -> AvoidTogether:
    return AvoidTogether(AvoidTogetherConfig(**changes), SHAPE, PERIOD, 7)


def placed(position: Any, velocity: Any = (0.0, 0.0, 0.0)) -> State:
    state = at_rest(jnp.asarray(position, jnp.float32))
    return dataclasses.replace(state, velocity=jnp.broadcast_to(jnp.asarray(velocity, jnp.float32), (len(position), 3)))


def without_trees(task: AvoidTogether, n: int) -> Any:
    _, memory = task.start(random_key(0), n)
    return dataclasses.replace(memory, trees=dataclasses.replace(memory.trees, active=memory.trees.active & False))


def judged(task: AvoidTogether, memory: Any, position: Any) -> tuple[Any, Any]:
    state = placed(position)
    n = len(position)
    return task.advance(memory, state, state, jnp.full(n, 1.0), jnp.zeros(n, bool))


def test_a_world_has_one_forest_and_its_vehicles_start_apart() -> None:
    task = make(agents=3)
    state, memory = jax.jit(lambda key: task.start(key, 300))(random_key(1))
    for part in (memory.trees.centre, memory.trees.active, memory.trees.size):
        by_world = np.asarray(part).reshape(100, 3, *part.shape[1:])
        assert np.all(by_world == by_world[:, :1])
    assert len({tuple(x) for x in np.asarray(memory.trees.centre)[::3, 0]}) == 100
    y = np.sort(np.asarray(state.position)[:, 1].reshape(100, 3), axis=1)
    assert np.diff(y, axis=1).min() >= 1.0 - 1e-5 and np.abs(y).max() <= 3.0
    first = np.asarray(state.position)[::3, 1]
    assert (first < -1).any() and (first > 1).any() and (np.abs(first) < 1).any()  # in any order
    away = np.linalg.norm(np.asarray(memory.trees.centre)[..., :2] - np.asarray(state.position)[:, None, :2], axis=-1)
    assert (away - np.asarray(memory.trees.size)[..., 0])[np.asarray(memory.trees.active)].min() > 1.9


def test_ways_through_the_forest_run_beside_each_other() -> None:
    task = make(agents=3)
    state, memory = task.start(random_key(1), 30)
    along = dataclasses.replace(state, position=state.position.at[:, 0].add(35.0))
    for where in (state, along):
        wanted = np.asarray(task.observe(memory, jnp.zeros(30), where))[:, :2]
        np.testing.assert_allclose(wanted, np.stack([memory.speed, np.zeros(30)], axis=-1), atol=1e-5)


def test_a_touch_ends_the_world_and_no_other() -> None:
    task = make(agents=2)
    memory = without_trees(task, 4)
    _, outcome = judged(task, memory, [[5, 0, 1.5], [5, 0.2, 1.5], [5, -1, 1.5], [5, 1, 1.5]])
    assert outcome.terminated.tolist() == [True, True, False, False]
    assert outcome.crashed.tolist() == [True, True, False, False] and not np.any(outcome.success)


def test_a_world_succeeds_when_all_are_past_the_end() -> None:
    task = make(agents=2)
    memory, outcome = judged(task, without_trees(task, 2), [[41, 0, 1.5], [20, 1, 1.5]])
    assert not np.any(outcome.success) and not np.any(outcome.terminated)
    memory, outcome = judged(task, memory, [[60, 30, 1.5], [39, 1, 1.5]])  # what happens behind does not count
    assert not np.any(outcome.terminated)
    _, outcome = judged(task, memory, [[60, 30, 1.5], [41, 1, 1.5]])
    assert np.all(outcome.success) and np.all(outcome.terminated)


def test_a_touch_that_ends_no_episode_is_no_success() -> None:
    task = make(agents=2, collisions_end=False)
    memory, outcome = judged(task, without_trees(task, 2), [[5, 0, 1.5], [5, 0.2, 1.5]])
    assert not np.any(outcome.terminated) and np.all(outcome.crashed)
    _, outcome = judged(task, memory, [[41, 0, 1.5], [41, 2, 1.5]])
    assert np.all(outcome.terminated) and not np.any(outcome.success)


def test_the_expert_flies_around_another_that_stands_in_its_way() -> None:
    task = make(agents=2)
    memory = without_trees(task, 2)
    memory = dataclasses.replace(memory, speed=jnp.full(2, 5.0))
    for y, turns in ((0.0, True), (4.0, False)):
        state = placed([[5, 0, 1.5], [8, y, 1.5]], [5.0, 0.0, 0.0])
        still = dataclasses.replace(state, velocity=state.velocity.at[1].set(0.0))
        with_others = dataclasses.replace(memory, bodies=company.all_others(still, 2))
        velocity, _ = task.expert(with_others, Flier.usual(still.position, still.velocity))
        assert (abs(float(jnp.arctan2(velocity[0, 1], velocity[0, 0]))) > 0.05) == turns
    ahead = dataclasses.replace(
        memory, bodies=company.all_others(state, 2)
    )  # one that flies as fast is in nobody's way
    velocity, _ = task.expert(ahead, Flier.usual(state.position, state.velocity))
    assert abs(float(jnp.arctan2(velocity[0, 1], velocity[0, 0]))) < 0.05


def test_cameras_see_the_others() -> None:
    task = make(agents=3)
    _, memory = task.start(random_key(0), 3)
    balls = task.scene(memory).solids["sphere"]
    assert balls.centre.shape == (3, 2, 3) and np.all(np.asarray(balls.active))


def test_starts_need_space() -> None:
    with pytest.raises(ValueError, match=r"task.sideways is 3.0; accepted: 3.5 m or more, so that 8 vehicles start"):
        AvoidTogetherConfig(agents=8).check(30.0, 0.05)
