"""Trunks that swing: where they are, that a camera sees them there, that contact is judged there, that experts know."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import AHEAD, EnvConfig, ForestConfig, RewardConfig
from e2efly.environment import Env, random_key
from e2efly.simulation.scenes.scene import Solids
from e2efly.tasks.avoid import AvoidConfig
from e2efly.tasks.avoid.goal import AvoidMemory
from e2efly.tasks.avoid.world import Avoid, AvoidWorld
from e2efly.tasks.avoid_together import AvoidTogetherConfig
from e2efly.tasks.avoid_together.world import AvoidTogether
from e2efly.tasks.task import Flier, Shape, at_rest

SHAPE, PERIOD = Shape(0.1, 0.15), 1 / 30


def avoid(**options: Any) -> Avoid:
    return Avoid.of(AvoidConfig(**options), SHAPE, PERIOD, 4)


def crossing(times: Any) -> tuple[Any, AvoidWorld]:
    """Vehicles that hover at (10, 0, 1.5), and a trunk that swings across, through them at 1 s, at 3.1 m/s."""
    n = len(times)
    trunk = Solids.of("cylinder", jnp.tile(jnp.array([10.0, 0.0, 3.0]), (n, 1, 1)), jnp.array([0.2, 3.0]))
    swung = dataclasses.replace(trunk, cosine=jnp.tile(jnp.array([0.0, 2.0, 0.0]), (n, 1, 1)))
    swung = dataclasses.replace(swung, rate=jnp.full((n, 1), 2 * jnp.pi / 4.0))
    return at_rest(jnp.tile(jnp.array([10.0, 0.0, 1.5]), (n, 1))), AvoidWorld(jnp.full(n, 5.0), swung)


def test_a_trunk_touches_when_it_is_there_also_in_the_middle_of_a_step() -> None:
    state, world = crossing(times := jnp.array([0.5, 0.88, 0.9, 1.0, 1.5]))
    task = avoid(swing=1.0)
    _, outcome = task.advance(world, state, state, times, jnp.zeros(5, bool))
    # it reaches 0.35 m from its middle, and so the vehicle, at 0.888 s
    np.testing.assert_array_equal(outcome.crashed, [False, False, True, True, False])
    slow = dataclasses.replace(task, control_period=0.4, checks=16)  # there only within the step, not at its ends
    _, outcome = slow.advance(world, state, state, jnp.full(5, 1.2), jnp.zeros(5, bool))
    assert outcome.crashed.all()


def test_a_camera_sees_it_where_it_was_when_the_camera_looked() -> None:
    camera = dataclasses.replace(AHEAD, width=128, height=12, latency=(0.1, 0.1), noise_share=0.0, rate=30.0)
    sparse = AvoidConfig(swing=1.0, forest=ForestConfig(density=0.001, room=1))
    env = Env.of(sparse, RewardConfig({"imitate": 1.0}), EnvConfig(cameras=(camera,)))
    state, _ = jax.jit(lambda: env.reset(random_key(0), 1))()
    level = jnp.array([[1.0, 0.0, 0.0, 0.0]])
    vehicle = dataclasses.replace(state.vehicle, position=jnp.array([[2.0, 0.0, 1.5]]), quaternion=level)
    state = dataclasses.replace(state, memory=crossing([0.0])[1], vehicle=vehicle)
    step, off = jax.jit(lambda state: env.step(state, jnp.asarray(env.hover)[None], restart=False)[0]), []
    for k in range(1, 40):
        state = step(state)
        row = np.asarray(state.images[0])[0, 6]
        if k > 4:  # before, it was elsewhere
            left = (63.5 - np.flatnonzero((row > 7.0) & (row < 8.5)).mean()) / 64 * np.tan(camera.fov[0] / 2)
            off.append(8.0 * left - 2.0 * np.cos(np.pi / 2 * (k * PERIOD - 0.1)))
    assert np.abs(off).max() < 0.15  # a column is 0.12 m wide there, and the trunk moves 0.1 m a step
    assert abs(np.mean(off)) < 0.06


def test_trunks_swing_within_their_ranges_and_keep_the_start_clear() -> None:
    for task, n in ((avoid(swing=1.5), 64), (AvoidTogether.of(AvoidTogetherConfig(swing=1.5), SHAPE, PERIOD, 4), 64)):
        state, world = task.start(random_key(0), n)
        still, _ = avoid().start(random_key(0), n)
        trees = world.trees
        assert (n == 64 and isinstance(task, AvoidTogether)) or np.array_equal(state.position, still.position)
        period = 2 * np.pi / np.asarray(trees.rate)
        assert 3.0 - 1e-5 <= period.min() < 3.1 < 7.9 < period.max() <= 8.0 + 1e-5
        for time in (0.0, 1.3, 2.9):
            at = np.asarray(trees.position(jnp.full(n, time)))
            moved = np.linalg.norm(at - np.asarray(trees.centre), axis=-1)
            assert moved.max() <= 1.5 + 1e-5 and moved.max() > 1.4
            assert np.array_equal(at[..., 2], np.asarray(trees.centre)[..., 2])
            away = np.linalg.norm(at[..., :2] - np.asarray(state.position)[:, None, :2], axis=-1)
            assert (away - np.asarray(trees.size)[..., 0])[np.asarray(trees.active)].min() > 2.0


def test_trunks_that_stand_cost_nothing() -> None:
    state, world = avoid(swing_period=(1.0, 2.0)).start(random_key(0), 4)
    assert not np.any(world.trees.rate) and not np.any(world.trees.moves)
    arguments = (world, state, state, jnp.zeros(4), jnp.zeros(4, bool))
    programs = [str(jax.make_jaxpr(task.advance)(*arguments)) for task in (avoid(), avoid(swing=1.0))]
    assert programs[0] == str(jax.make_jaxpr(avoid(swing_period=(1.0, 2.0)).advance)(*arguments))
    assert programs[0].count(" cos ") < programs[1].count(" cos ")  # the expert of the second looks where they will be
    assert "trunk_speed" not in [part.name for part in AvoidConfig().domain()]
    assert AvoidConfig(swing=1.0).domain()[0].high == pytest.approx(2 * np.pi / 3)


def test_the_expert_flies_where_a_trunk_will_not_be() -> None:
    """A trunk that is in the way now, and gone when the vehicle comes; and the reverse."""
    state, world = crossing([0.0])
    flier = Flier.usual(state.position - jnp.array([3.0, 0.0, 0.0]), jnp.array([[5.0, 0.0, 0.0]]), jnp.array([1.0]))
    meets = dataclasses.replace(flier, time=jnp.array([0.4]))  # it comes to y = 0 with the vehicle
    sideways = [abs(float(avoid(swing=1.0).expert(world, each)[0][0, 1])) for each in (flier, meets)]
    assert sideways[0] < 1.0 < sideways[1]


def test_a_policy_is_shown_no_more_than_of_still_ones() -> None:
    _, world = avoid(swing=1.0).start(random_key(0), 4)
    assert type(Avoid.state(world)) is AvoidMemory
