"""Tasks that are flown by sight: what counts as touching, landing, passing."""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.courses.gates import Tracks
from e2efly.courses.solids import DISC, SQUARE, TRIANGLE
from e2efly.courses.tracks import load_track
from e2efly.environment import random_key
from e2efly.simulation.physics import State
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes.scene import Solids, clearance
from e2efly.tasks.avoid import AvoidConfig
from e2efly.tasks.land_visual import LandVisualConfig
from e2efly.tasks.race.any_goal import Ahead
from e2efly.tasks.race_clutter import THREE, RaceClutterConfig
from e2efly.tasks.race_clutter.world import ClutterWorld, _path
from e2efly.tasks.task import Flier, Outcome, Shape, at_rest, make_task, struck

SHAPE = Shape(0.05, 0.15)
PERIOD = 1 / 30


def at(position: Any, velocity: Any = (0.0, 0.0, 0.0), tilt: float = 0.0) -> State:
    position = jnp.atleast_2d(jnp.asarray(position, jnp.float32))
    n = len(position)
    turned = from_euler(jnp.full(n, tilt), jnp.zeros(n), jnp.zeros(n))
    state = at_rest(position)
    return dataclasses.replace(
        state, velocity=jnp.broadcast_to(jnp.asarray(velocity, jnp.float32), (n, 3)), quaternion=turned
    )


def judged(task: Any, memory: Any, before: State, after: State, time: float = 1.0) -> Outcome:
    n = after.position.shape[0]
    return task.advance(memory, before, after, jnp.full(n, time), jnp.zeros(n, bool))[1]


def pad(outline: int, yaw: float = 0.0) -> Solids:
    return Solids.of("pad", jnp.array([[[0.0, 0.0, 0.1]]]), jnp.array([0.25, 0.1, float(outline)]), yaw=yaw)


@pytest.mark.parametrize(
    ("place", "velocity", "tilt", "outline", "touched", "success"),
    [
        ((0.05, 0.05, 0.249), (0, 0, -0.3), 0.0, SQUARE, True, True),
        ((0.05, 0.05, 0.249), (0, 0, -0.3), 0.0, DISC, True, True),
        ((0.05, 0.05, 0.249), (0, 0, -0.3), 0.0, TRIANGLE, True, True),
        ((0.0, 0.0, 0.26), (0, 0, -0.3), 0.0, SQUARE, False, False),
        ((0.0, 0.0, 0.249), (0, 0, -0.6), 0.0, SQUARE, True, False),  # too fast
        ((0.0, 0.0, 0.249), (0, 0, -0.3), 0.4, SQUARE, True, False),  # tilted
        ((0.24, 0.24, 0.249), (0, 0, -0.3), 0.0, SQUARE, True, False),  # in its corner
        ((0.24, 0.24, 0.249), (0, 0, -0.3), 0.0, DISC, False, False),  # a disc has none
        ((0.0, -0.24, 0.249), (0, 0, -0.3), 0.0, TRIANGLE, False, False),  # beside the base of the triangle
        ((0.6, 0.0, 0.049), (0, 0, -0.3), 0.0, SQUARE, True, False),  # on the ground
    ],
)  # fmt: skip
def test_landing_counts_on_top_of_the_pad(
    place: Any, velocity: Any, tilt: float, outline: int, touched: bool, success: bool
) -> None:
    task = make_task(LandVisualConfig(), SHAPE, PERIOD)
    after = at(place, velocity, tilt)
    out = judged(task, pad(outline), after, after)
    assert (bool(out.terminated[0]), bool(out.success[0])) == (touched, success)


def test_pads_are_of_all_shapes_and_sizes_and_starts_over_them() -> None:
    task = make_task(LandVisualConfig(), SHAPE, PERIOD)
    state, memory = jax.jit(task.start, static_argnums=1)(random_key(0), 500)
    size = np.asarray(memory.size[:, 0])
    assert set(size[:, 2]) == {DISC, SQUARE, TRIANGLE}
    assert 0.2 <= size[:, 0].min() < 0.21 and 0.29 < size[:, 0].max() <= 0.3
    feet = np.asarray(state.position[:, 2]) - SHAPE.feet_height - 0.2
    assert feet.min() >= 1.0 and feet.max() <= 3.0 and np.abs(np.asarray(state.position[:, :2])).max() <= 1.0


@pytest.mark.whole
def test_a_collision_is_found_between_the_ends_of_a_control_step() -> None:
    trees = Solids.of("cylinder", jnp.array([[[0.0, 0.0, 2.0]]]), jnp.array([0.05, 2.0]))
    task = make_task(AvoidConfig(), Shape(0.05, 0.02), PERIOD, 7)
    memory = jax.tree.map(lambda x: x, dataclasses.replace(task.start(random_key(0), 1)[1], trees=trees))
    before, after = at((-0.3, 0.0, 1.5), (18.0, 0, 0)), at((0.3, 0.0, 1.5), (18.0, 0, 0))
    scene = task.scene(memory)
    for checks, found in ((1, False), (7, True)):
        hit = struck(scene, before, after, jnp.ones(1), PERIOD, checks, 0.02)
        assert bool(hit[0]) == found
    beside = [dataclasses.replace(s, position=s.position.at[:, 1].set(0.08)) for s in (before, after)]
    assert not struck(scene, *beside, jnp.ones(1), PERIOD, 7, 0.02)[0]


@pytest.mark.parametrize(("ends", "over"), [(True, True), (False, False)])
def test_the_forest_is_passed_untouched_inside_its_lane(ends: bool, over: bool) -> None:
    task = make_task(AvoidConfig(collisions_end=ends), SHAPE, PERIOD, 7)
    _, memory = task.start(random_key(1), 1)
    trees = dataclasses.replace(memory.trees, active=jnp.zeros_like(memory.trees.active))
    free = dataclasses.replace(memory, trees=trees)
    through = judged(task, free, at((39.9, 0, 1.5), (5, 0, 0)), at((40.05, 0, 1.5), (5, 0, 0)))
    assert through.success[0] and through.terminated[0] and not through.crashed[0]
    for place in ((20.0, 8.1, 1.5), (20.0, 0.0, 3.1), (20.0, 0.0, 0.04), (-5.1, 0.0, 1.5)):
        out = judged(task, free, at(place), at(place))
        assert out.terminated[0] and out.crashed[0] and not out.success[0]
    tree = np.asarray(memory.trees.centre[0, np.flatnonzero(np.asarray(memory.trees.active[0]))[0]])
    inside = at((tree[0], tree[1], 1.5))
    out = judged(task, memory, inside, inside)
    assert out.crashed[0] and bool(out.terminated[0]) == over and not out.success[0]


def test_a_forest_is_as_dense_as_asked_and_clear_of_the_start() -> None:
    task = make_task(AvoidConfig(), SHAPE, PERIOD, 7)
    state, memory = jax.jit(task.start, static_argnums=1)(random_key(2), 300)
    count = np.asarray(memory.trees.active).sum(axis=1).mean()
    assert 0.9 * 64 < count <= 64
    assert np.asarray(clearance(task.scene(memory), state.position, jnp.zeros(300))).min() > 1.0
    assert len(np.unique(np.asarray(memory.trees.centre[:, 0, 0]))) == 300


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("only", [-1, 0, 1, 2])
def test_clutter_leaves_gates_and_start_free(only: int) -> None:
    task = make_task(RaceClutterConfig(track=THREE, only=only), SHAPE, PERIOD, 7)
    n = 200
    state, memory = jax.jit(task.start, static_argnums=1)(random_key(3), n)
    scene, zero = task.scene(memory), jnp.zeros(n)
    assert np.asarray(clearance(scene, state.position, zero)).min() > SHAPE.radius
    obstacles = dataclasses.replace(scene, solids=memory.obstacles)
    tracks, gates = memory.tracks, memory.tracks.gates
    for gate in range(gates.count):
        there = gate < np.asarray(tracks.count)
        assert np.asarray(clearance(obstacles, gates.position[:, gate], zero))[there].min(initial=1.0) > 0.7
    second = gates.position[:, None, 1] - task.given.gates.position[None, :, 1]
    which = np.linalg.norm(second, axis=-1).argmin(axis=1)  # their second gates tell the tracks apart
    assert set(which) == ({0, 1, 2} if only < 0 else {only})
    given = jax.tree.map(lambda x: x[which], task.given)
    np.testing.assert_array_equal(tracks.count, given.count)
    assert {int(k) for k in given.count} <= {4, 5, 6}
    assert 0.25 < np.abs(np.asarray(gates.position - given.gates.position)).max() <= 0.3 + 1e-6
    turned = np.arctan2(gates.sin, gates.cos) - np.arctan2(given.gates.sin, given.gates.cos)
    turned = np.arctan2(np.sin(turned), np.cos(turned))
    assert 0.17 < np.abs(turned).max() <= 0.2 + 1e-5


def test_random_tracks_are_others_in_every_world_and_their_gates_are_free() -> None:
    config = RaceClutterConfig()
    task, n = make_task(RaceClutterConfig(only=config.track.index("any")), SHAPE, PERIOD, 7), 200
    state, memory = jax.jit(task.start, static_argnums=1)(random_key(3), n)
    assert np.asarray(clearance(task.scene(memory), state.position, jnp.zeros(n))).min() > SHAPE.radius
    tracks, gates = memory.tracks, memory.tracks.gates
    assert {int(k) for k in tracks.count} == {3, 4, 5, 6}
    assert 0.2 < np.asarray(tracks.closed).mean() < 0.6
    second = np.asarray(gates.position[:, 1])
    assert len(np.unique(second, axis=0)) == n
    for gate in range(gates.count):
        there = gate < np.asarray(tracks.count)
        obstacles = dataclasses.replace(task.scene(memory), solids=memory.obstacles)
        free = np.asarray(clearance(obstacles, gates.position[:, gate], jnp.zeros(n)))
        least = np.minimum(0.7, np.asarray(gates.position[:, gate, 2]) - 1e-3)  # the ground may be nearer
        assert (free >= least)[there].all()
    mixed = make_task(config, SHAPE, PERIOD, 7)
    _, memory = jax.jit(mixed.start, static_argnums=1)(random_key(3), n)
    given = np.asarray(mixed.given.gates.position)[:, 1]
    known = np.linalg.norm(np.asarray(memory.tracks.gates.position)[:, None, 1] - given[:3], axis=-1).min(axis=1) < 0.53
    assert 0.6 < known.mean() < 0.9  # three of four


@pytest.mark.parametrize("track", THREE)
def test_one_of_several_tracks_is_the_track_alone(track: str) -> None:
    """Worlds with room for more gates than the track has differ in nothing that is seen, asked for or judged."""
    alone = make_task(RaceClutterConfig(track=(track,)), SHAPE, PERIOD, 7)
    among = make_task(RaceClutterConfig(only=THREE.index(track)), SHAPE, PERIOD, 7)
    own = Tracks.of(load_track(track).enlarged(2.0))
    wide = Tracks.of(load_track(track).enlarged(2.0), 6)
    place = at(own.gates.start[0] + np.array([1.0, 0.5, 0.0]), (3.0, 0.0, 0.0))
    count = int(own.count[0])
    for passed in range(count):
        seen = []
        for task, tracks in ((alone, own), (among, wide)):
            tracks = jax.tree.map(jnp.asarray, tracks)
            memory = ClutterWorld(tracks, jnp.array([passed]), speed=jnp.array([6.0]), obstacles={})
            seen.append(np.asarray(task.observe(memory, jnp.zeros(1), place)))
            assert np.asarray(task.scene(memory).solids["gate"].active).sum() == count
        np.testing.assert_array_equal(*seen)
    paths = [
        np.asarray(_path(jax.tree.map(jnp.asarray, tracks), place.position)[0])[0, : count + 2 - (not own.closed[0])]
        for tracks in (own, wide)
    ]
    np.testing.assert_array_equal(*paths)


@pytest.mark.parametrize("track", ["s_shaped", ()])
def test_tracks_are_several(track: Any) -> None:
    with pytest.raises(ValueError, match=r"task.track is .*; accepted: a tuple of one or more tracks"):
        make_task(RaceClutterConfig(track=track), SHAPE, PERIOD, 7)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"track": ("j_shaped", "j_shaped")}, r"task.track is .*; accepted: tracks of different names"),
        ({"only": 4.0}, "task.only is 4.0; accepted: whole numbers from -1 to 3"),
        ({"only": 0.5}, "task.only is 0.5; accepted: whole numbers from -1 to 3"),
    ],
)
def test_no_track_is_chosen_or_judged_silently(changes: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make_task(RaceClutterConfig(**changes), SHAPE, PERIOD, 7)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("only", [0, 1, 3])
def test_a_lap_in_clutter_is_the_gates_in_order_without_a_touch(only: int) -> None:
    empty = dataclasses.replace(RaceClutterConfig().clutter, obstacles=0.0)
    task = make_task(RaceClutterConfig(clutter=empty, only=only), SHAPE, PERIOD, 7)
    _, memory = task.start(random_key(4), 1)
    gates, count = memory.tracks.gates, int(memory.tracks.count[0])
    for gate in range(count):
        centre = np.asarray(gates.position[0, gate])
        axis = np.array([gates.cos[0, gate], gates.sin[0, gate], 0.0])
        np.testing.assert_allclose(task.goal(memory, jnp.zeros(1))[0], centre, atol=1e-5)
        np.testing.assert_allclose(Ahead.of(memory).axis[0, 0], axis, atol=1e-6)
        beside = [at(centre + 0.1 * s * axis + np.array([0.0, 0.0, 0.9]), 6 * axis) for s in (-1, 1)]
        lost = judged(task, memory, *beside)
        assert lost.terminated[0] and lost.crashed[0] and not lost.arrived[0]
        through = [at(centre + 0.1 * s * axis, 6 * axis) for s in (-1, 1)]
        memory, out = task.advance(memory, *through, jnp.ones(1), jnp.zeros(1, bool))
        assert out.arrived[0] and not out.crashed[0] and bool(out.success[0]) == (gate == count - 1)


def test_a_racer_is_to_look_at_its_gate_and_near_it_round_the_corner() -> None:
    task = make_task(RaceClutterConfig(track=("j_shaped",)), SHAPE, PERIOD, 7)
    _, memory = task.start(random_key(5), 1)
    memory = dataclasses.replace(memory, passed=jnp.array([2]))
    here, there = (np.asarray(memory.tracks.gates.position[0, i]) for i in (2, 3))
    for away, towards in ((6.0, here), (1.0, here + (there - here) * 4.0 / np.linalg.norm(there - here))):
        place = here - [away, 0.0, 0.0]
        wanted = np.arctan2(*(towards - place)[1::-1])
        assert float(task.desired_yaw(memory, at(place))[0]) == pytest.approx(wanted, abs=0.02)
    last = dataclasses.replace(memory, passed=jnp.array([4]))  # an open track has no gate behind it
    assert np.isfinite(task.desired_yaw(last, at(np.asarray(memory.tracks.gates.position[0, 4])))).all()


@pytest.mark.whole
def test_the_expert_flies_through_a_forest_at_the_commanded_speed() -> None:
    task = make_task(AvoidConfig(), SHAPE, PERIOD, 7)
    state, memory = task.start(random_key(6), 50)
    place, moving = state.position + jnp.array([15.0, 0.0, 0.0]), jnp.array([[5.0, 0.0, 0.0]] * 50)
    asked = task.desired_velocity(memory, memory.speed, dataclasses.replace(state, position=place))
    (way, yaw), bearing = task.expert(memory, Flier.usual(place, moving)), jnp.arctan2(asked[:, 1], asked[:, 0])
    np.testing.assert_allclose(np.linalg.norm(way[:, :2], axis=1), memory.speed, rtol=1e-5)
    assert 0.2 < np.mean(np.abs(way - asked)[:, :2].max(axis=1) > 0.1) < 1.0  # many are turned aside
    np.testing.assert_allclose(yaw, (jnp.arctan2(way[:, 1], way[:, 0]) + bearing) / 2, atol=1e-4)
    empty = dataclasses.replace(memory, trees=dataclasses.replace(memory.trees, active=memory.trees.active & False))
    np.testing.assert_allclose(task.expert(empty, Flier.usual(place, moving))[0][:, :2], asked[:, :2], atol=1e-4)
