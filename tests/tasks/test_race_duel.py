"""Races against others: the places of start, the verdict of the world, and who wins."""

import dataclasses
import itertools
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import EnvConfig, RewardConfig
from e2efly.environment import Env, random_key
from e2efly.policy.goal import Shape
from e2efly.policy.others import FAR
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.race_duel import RaceDuelConfig
from e2efly.tasks.race_duel.goal import RaceDuelRoute
from e2efly.tasks.race_duel.world import RaceDuel
from e2efly.tasks.task import at_rest
from e2efly.validation.duels import Duels


def environment(**changes: Any) -> Env:
    return Env.of(RaceDuelConfig(**changes), RewardConfig({"progway": 1.0, "apart": 1.0}), EnvConfig())


def test_racers_start_behind_each_other_in_random_order() -> None:
    env = environment(agents=4, spacing=0.7, position=0.2)
    state, _ = env.reset(random_key(0, 0, 0), 64)
    gates = env.task.track
    along = np.array([np.cos(gates.start_yaw), np.sin(gates.start_yaw)])
    place = (np.asarray(state.vehicle.position)[:, :2] - gates.start[:2]).reshape(16, 4, 2)
    ahead = place @ along
    np.testing.assert_allclose(np.sort(ahead, axis=1), np.broadcast_to(0.7 * np.arange(4), (16, 4)), atol=0.2)
    assert len({tuple(np.argsort(row)) for row in ahead}) > 5
    near = np.linalg.norm(place[:, :, None] - place[:, None], axis=-1) + np.eye(4)
    assert near.min() > 2 * env.task.shape.radius


def test_scattered_racers_start_in_front_of_different_gates() -> None:
    env = environment(scattered=1.0, laps=0)
    state, _ = env.reset(random_key(0, 0, 0), 32)
    gates, passed = env.task.track, np.asarray(state.memory.passed)
    before = np.asarray(gates.position)[passed] - np.asarray(state.vehicle.position)
    axis = np.stack([gates.cos[passed], gates.sin[passed], np.zeros(32)], axis=-1)
    np.testing.assert_allclose(np.sum(before * axis, axis=1), 1.5, atol=0.31)
    assert np.all(passed[::2] != passed[1::2]) and set(passed.tolist()) == set(range(gates.count))
    (judged,) = RaceDuelConfig(scattered=1.0, blind=1.0).criteria().values()
    assert judged.scattered == 0 == judged.blind


def test_a_blind_racer_is_shown_nobody() -> None:
    env = environment(blind=1.0, laps=0)
    state, observation = env.reset(random_key(0, 0, 0), 4)
    np.testing.assert_allclose(observation[:, 6:9], np.broadcast_to([0, 0, FAR], (4, 3)), atol=1e-5)
    _, some = environment(blind=0.5, laps=0).reset(random_key(0, 0, 0), 64)
    assert 10 < np.sum(np.asarray(some)[:, 8] > 40) < 54


def test_a_racer_sees_the_race_and_the_other() -> None:
    env = environment()
    alone = Env.of(RaceConfig(), RewardConfig({"prog1": 1.0}), EnvConfig())
    names = [field.name for field in env.fields]
    assert [name for name in names if name not in ("others", "others_velocity")] == [f.name for f in alone.fields]
    state, observation = env.reset(random_key(0, 0, 0), 8)
    columns = np.cumsum([0, *(field.size for field in env.fields)])
    where = dict(zip(names, (slice(a, b) for a, b in itertools.pairwise(columns)), strict=True))
    position = np.asarray(state.vehicle.position)
    np.testing.assert_allclose(observation[0, where["others"]], position[1] - position[0], atol=1e-5)
    first = np.asarray(env.task.track.position)[:2]
    np.testing.assert_allclose(observation[3, where["gates"]], (first - position[3]).reshape(-1), atol=1e-5)


@pytest.fixture(scope="module")
def task() -> RaceDuel:
    return environment(laps=1).task


def through(task: RaceDuel, gate: int, aside: float = 0.0) -> tuple[Any, Any]:
    """Motion of one racer across a gate's plane, metres to its left."""
    g = task.track
    axis = np.array([g.cos[gate], g.sin[gate], 0.0])
    place = np.asarray(g.position[gate]) + aside * np.array([-axis[1], axis[0], 0.0])
    return place - 0.1 * axis, place + 0.1 * axis


def judged(task: RaceDuel, rows: list[tuple[Any, Any]], **memory: Any) -> tuple[Any, Any]:
    """The verdict on a step of two racers, whose races stand so."""
    _, world = task.start(random_key(0, 0, 0), 2)
    world = dataclasses.replace(world, **{name: jnp.asarray(value) for name, value in memory.items()})
    before, after = (at_rest(jnp.asarray(np.stack(p), jnp.float32)) for p in zip(*rows, strict=True))
    no = jnp.zeros(2, bool)
    return task.advance(world, before, after, jnp.full(2, 5.0), no)


def away(task: RaceDuel, gate: int) -> tuple[Any, Any]:
    """A place 1.5 m in front of a gate."""
    g = task.track
    place = np.asarray(g.position[gate]) - 1.5 * np.array([g.cos[gate], g.sin[gate], 0.0])
    return place, place


def test_a_world_succeeds_when_all_have_finished(task: RaceDuel) -> None:
    last = task.race.count - 1
    world, out = judged(task, [through(task, last), away(task, 1)], passed=[last, 1])
    assert np.asarray(world.finished).tolist() == [True, False] and not np.any(out.terminated | out.success)
    _, out = judged(task, [away(task, 1), through(task, last)], passed=[last + 1, last], finished=[True, False])
    assert np.all(out.success) and np.all(out.terminated)
    _, out = judged(
        task,
        [away(task, 1), through(task, last)],
        passed=[last + 1, last],
        finished=[True, False],
        touched=[True, True],
    )
    assert np.all(out.terminated) and not np.any(out.success)


def test_a_missed_gate_ends_the_race_of_both_and_is_told_of_one(task: RaceDuel) -> None:
    world, out = judged(task, [through(task, 0, aside=3.0), away(task, 1)], passed=[0, 1])
    assert np.asarray(out.crashed).tolist() == [True, False] == np.asarray(world.out).tolist()
    assert np.all(out.terminated) and not np.any(out.success | world.touched)


def test_a_touch_ends_it_only_where_it_counts(task: RaceDuel) -> None:
    place = away(task, 1)
    beside = tuple(x + np.array([0.0, 0.0, 1.5 * float(task.shape.radius)]) for x in place)
    world, out = judged(task, [place, beside], passed=[1, 1])
    assert np.all(world.touched) and np.all(out.terminated) and np.all(out.crashed)
    mild = dataclasses.replace(task, config=dataclasses.replace(task.config, collisions_end=False))
    world, out = judged(mild, [place, beside], passed=[1, 1])
    assert np.all(world.touched) and not np.any(out.terminated)
    world, _ = judged(task, [place, beside], passed=[5, 1], finished=[True, False])
    assert np.asarray(world.touched).tolist() == [False, True]  # who has finished is not judged any more


def test_the_gap_to_the_other_has_a_gradient() -> None:
    env = environment(collisions_end=False)
    state, _ = env.reset(random_key(0, 0, 0), 2)
    near = dataclasses.replace(
        state.vehicle, position=state.vehicle.position.at[1].set(state.vehicle.position[0] + 0.2)
    )

    def gain(velocity: jax.Array) -> jax.Array:
        vehicle = dataclasses.replace(near, velocity=velocity)
        begun = dataclasses.replace(state, vehicle=vehicle)
        return jnp.sum(env.step(begun, jnp.zeros((2, 4)), restart=False)[1].terms["apart"])

    slope = np.asarray(jax.grad(gain)(jnp.zeros((2, 3))))
    assert np.all(np.isfinite(slope)) and slope[1, 2] > 0 > slope[0, 2]  # apart, upwards and downwards


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"track": "any"}, r"task.track is 'any'; accepted: one track"),
        ({"position": 0.5}, r"task.position is 0.5; accepted: less than half of task.spacing, 1 m"),
        ({"agents": 8}, r"task.spacing is 1.0; accepted: at most 0\.\d+ m.*8 racers"),
    ],
)
def test_what_has_no_place_is_refused(changes: Any, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        environment(**changes)


def test_a_racer_alone_sees_nobody() -> None:
    found = RaceDuelRoute().course(Shape(feet_height=0.05, radius=0.1), 1 / 30)
    body = at_rest(jnp.asarray(found.start[None], jnp.float32))
    seen = found.goal.observe(found.memory, np.zeros(1), jax.tree.map(np.asarray, body))
    np.testing.assert_allclose(seen[0, 6:9], [0, 0, FAR], atol=1e-5)


def test_who_finishes_first_and_touches_nobody_wins() -> None:
    inf = np.inf
    time = np.array([[5.0, 6.0], [6.0, 5.0], [inf, 5.0], [5.0, inf], [inf, inf], [5.0, 5.0]])
    touched = np.zeros((6, 2), bool)
    touched[4] = True
    out = np.isinf(time) & ~touched
    found = Duels(time, touched, out).as_json()
    assert (found["won"], found["lost"], found["touched"]) == (2 / 6, 2 / 6, 1 / 6)
    assert (found["out"], found["rival_out"], found["seconds"]) == (1 / 6, 1 / 6, 5.25)


def test_a_central_critic_knows_all_others_in_the_frame_of_its_vehicle() -> None:
    reward, asked = RewardConfig({"progway": 1.0}), EnvConfig(central_critic=True)
    env = Env.of(RaceDuelConfig(agents=3, spacing=0.7, position=0.2), reward, asked)
    state, _ = env.reset(random_key(0, 0, 0), 3)
    known = np.asarray(env.privileged(state))
    assert known.shape == (3, env.privileged_size) == (3, 12)
    assert environment().privileged_size == 0
    position, yaw = np.asarray(state.vehicle.position), float(env.task.track.start_yaw)
    turn = np.array([[np.cos(yaw), np.sin(yaw), 0], [-np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    np.testing.assert_allclose(
        known[1, :6], np.concatenate([turn @ (position[i] - position[1]) for i in (0, 2)]), atol=1e-5
    )
    with pytest.raises(ValueError, match=r"env.central_critic is True; accepted: False, as a world of race has one"):
        Env.of(RaceConfig(), reward, asked)
