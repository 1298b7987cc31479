"""The hall that is seen by a LiDAR: what stands in it, what touches, and what its rays measure."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.environment import Env, random_key
from e2efly.runs import presets
from e2efly.simulation.scenes.camera import look, mount
from e2efly.simulation.scenes.scene import Solids, clearance
from e2efly.tasks.hall import LIDAR, HallConfig
from e2efly.tasks.hall.goal import HallRoute
from e2efly.tasks.hall.world import Hall, HallWorld
from e2efly.tasks.task import Flier, Shape, at_rest

SHAPE = Shape(0.05, 0.12)
PERIOD = 1 / 30
NOW = jnp.zeros(1)


def make(**changes: Any) -> Hall:
    return Hall(HallConfig(**changes), SHAPE, PERIOD, 7)


def world(place: tuple[float, float], crate: bool, turn: float = 0.0, radius: float = 0.4) -> HallWorld:
    """One obstacle in an empty hall."""
    trees = Solids.of("cylinder", [[[*place, 1.5]]], [[[radius, 1.5]]])
    return HallWorld(jnp.full(1, 4.0), trees, jnp.full((1, 1), crate), jnp.full((1, 1), turn))


def test_a_hall_has_pillars_crates_and_walls_and_a_clear_start() -> None:
    task, n = make(), 400
    state, memory = jax.jit(Hall.start, static_argnums=2)(task, random_key(0), n)
    c, there = task.config, np.asarray(memory.trees.active)
    area = c.forest.length * c.forest.width
    assert 0.9 * c.forest.density * area < there.sum(1).mean() <= c.forest.density * area
    assert np.asarray(memory.crate)[there].mean() == pytest.approx(c.crates, abs=0.02)
    gap = np.asarray(clearance(task.scene(memory), state.position, jnp.zeros(n)))
    assert gap.min() > 1.0
    assert 1.9 < np.abs(np.asarray(state.position)[:, 1]).max() <= c.sideways


@pytest.mark.parametrize(
    ("place", "crate", "turn", "gap"),
    [
        ((5.0, 0.0), False, 0.0, 0.6),  # a pillar of 0.4 m, a metre off
        ((5.0, 0.0), True, 0.0, 1 - 0.4 / math.sqrt(2)),  # the face of a crate in the same circle
        ((5.0, 0.0), True, math.pi / 4, 0.6),  # its corner
    ],
)
def test_obstacles_have_the_size_of_their_circle(place: Any, crate: bool, turn: float, gap: float) -> None:
    scene = make().scene(world(place, crate, turn))
    found = clearance(scene, jnp.array([[4.0, 0.0, 1.5]]), NOW)
    assert float(found[0]) == pytest.approx(gap, abs=1e-4)


@pytest.mark.parametrize(
    ("place", "hit"),
    [((5.0, 0.3), False), ((5.0, 0.55), False), ((5.0, 0.45), True), ((20.0, 3.9), True), ((20.0, -3.7), False)],
)
def test_pillars_and_walls_are_touched(place: tuple[float, float], hit: bool) -> None:
    """A pillar of 0.4 m at (5, 0), a vehicle of 0.12 m, walls whose faces are 3.95 m from the middle."""
    state, task = at_rest(jnp.array([[*place, 1.5]])), make()
    inside = math.hypot(place[0] - 5.0, place[1]) < 0.4
    out = task.advance(world((5.0, 0.0), crate=False), state, state, jnp.ones(1), jnp.zeros(1, bool))[1]
    assert bool(out.crashed[0]) == (hit or inside)
    assert bool(out.terminated[0]) == bool(out.crashed[0])


def test_the_lidar_measures_the_distance_to_pillar_and_walls() -> None:
    scene, place = make().scene(world((5.0, 0.0), crate=False)), jnp.array([[2.0, 1.0, 1.5]])
    assert 64 <= LIDAR.width * LIDAR.height <= 256
    image = np.asarray(look(LIDAR, scene.at(NOW), mount(LIDAR, 1), place, jnp.eye(1, 4)))[0]
    middle = image[1]  # a ring that is almost level
    angle = -((np.arange(64) + 0.5) / 64 * 2 - 1) * math.pi
    up = math.radians(30) / 8
    left, right = (int(np.abs(angle - a).argmin()) for a in (math.pi / 2, -math.pi / 2))
    assert middle[left] == pytest.approx(2.95 / math.cos(up), abs=0.02)
    assert middle[right] == pytest.approx(4.95 / math.cos(up), abs=0.03)
    at_pillar = int(np.abs(angle - math.atan2(-1.0, 3.0)).argmin())
    assert middle[at_pillar] == pytest.approx((math.sqrt(10) - 0.4) / math.cos(up), abs=0.05)


def test_the_expert_flies_beside_what_stands_ahead() -> None:
    task, ahead = make(), Flier.usual(jnp.array([[2.0, 0.1, 1.5]]), jnp.array([[4.0, 0.0, 0.0]]))
    velocity, _ = task.expert(world((5.0, 0.0), crate=True), ahead)
    assert 0.1 < float(jnp.arctan2(velocity[0, 1], velocity[0, 0])) < 1.1
    assert float(jnp.linalg.norm(velocity[0, :2])) == pytest.approx(4.0, rel=1e-3)


def test_the_policy_is_told_the_way_and_shown_the_rays() -> None:
    config = presets.preset("hall", "dagger", "robust")
    env = Env.of(config.task, config.reward, config.env)
    assert [field.name for field in env.task.fields] == ["desired_velocity", "height"]
    state, _ = jax.jit(Env.reset, static_argnums=2)(env, random_key(0), 8)
    (image,) = state.images
    assert image.shape == (8, 4, 64)
    assert 0 < float(image.min()) < 4.0 < float(image.max()) <= LIDAR.reach[1]
    judged = config.task.criteria()
    assert {suite.speed for suite in judged.values()} == {(2.5, 2.5), (4.0, 4.0)}
    assert all(suite.collisions_end for suite in judged.values())


def test_in_flight_it_is_the_hall_of_the_training() -> None:
    course = HallRoute(speed=2.0).course(SHAPE, PERIOD)
    assert dataclasses.asdict(course.goal.config) == dataclasses.asdict(HallConfig())
    assert course.points == [(30.0, 0.0, 1.5)]
