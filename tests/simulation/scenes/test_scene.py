"""Worlds: what is near, what moves, and what a file or a generator makes of them."""

import dataclasses
import math
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import ClutterConfig, ForestConfig
from e2efly.courses.solids import CLASSES, SIZES
from e2efly.environment import random_key
from e2efly.simulation.scenes.faces import bodies
from e2efly.simulation.scenes.file import load_scene
from e2efly.simulation.scenes.generate import clutter, corridor, forest, room
from e2efly.simulation.scenes.scene import Scene, Solids, clearance, distances
from e2efly.simulation.scenes.shapes import FAR


def ball(centre: Any, radius: float = 0.5, **about: Any) -> Solids:
    return Solids.of("sphere", np.asarray(centre, float)[None, None], [radius], **about)


def at(*point: float) -> jax.Array:
    return jnp.asarray([point], jnp.float32)


NOW = jnp.zeros(1)


class TestClearance:
    def test_is_the_distance_to_what_is_nearest(self) -> None:
        scene = Scene.of(
            {"sphere": ball((3.0, 0.0, 2.0)), "box": Solids.of("box", [[[0.0, 2.0, 2.0]]], [1.0, 1.0, 1.0])}, 1
        )
        assert float(clearance(scene, at(0.0, 0.0, 2.0), NOW)[0]) == pytest.approx(1.0)
        assert float(clearance(scene, at(2.0, 0.0, 2.0), NOW)[0]) == pytest.approx(0.5)
        assert float(clearance(scene, at(1.0, -2.0, 0.2), NOW)[0]) == pytest.approx(0.2)
        assert float(clearance(scene, at(3.0, 0.0, 2.0), NOW)[0]) == pytest.approx(-0.5)

    def test_does_not_know_what_is_not_there(self) -> None:
        scene = Scene.of({"sphere": ball((1.0, 0.0, 2.0), active=False)}, 1, ground=None)
        assert float(clearance(scene, at(1.0, 0.0, 2.0), NOW)[0]) >= FAR
        assert np.all(np.isfinite(jax.grad(lambda p: clearance(scene, p, NOW)[0])(at(1.0, 0.0, 2.0))))

    def test_gradient_against_differences(self) -> None:
        rng = np.random.default_rng(0)
        solids = {
            kind: Solids.of(kind, rng.uniform(-2, 2, (40, 2, 3)), rng.uniform(0.2, 0.5, (40, 2, len(names))))
            for kind, names in SIZES.items()
        }
        scene, time = Scene.of(solids, 40, ground=-3.0), jnp.zeros(40)
        p = jnp.asarray(rng.uniform(-2, 2, (40, 3)), jnp.float32)
        gradient = jax.grad(lambda p: jnp.sum(clearance(scene, p, time)))(p)
        f = jax.jit(lambda p: clearance(scene, p, time))
        numeric = jnp.stack([(f(p + 1e-3 * e) - f(p - 1e-3 * e)) / 2e-3 for e in jnp.eye(3)], axis=1)
        same = np.abs(gradient - numeric).max(axis=1) < 0.01
        assert np.mean(same) >= 0.9  # the others change from one nearest to another
        np.testing.assert_allclose(np.linalg.norm(gradient, axis=1), 1.0, atol=1e-3)

    def test_each_solid_has_its_distance(self) -> None:
        balls = Solids.of("sphere", [[[1.0, 0.0, 0.0], [0.0, 3.0, 0.0]]], [0.5], active=[[True, True]])
        np.testing.assert_allclose(distances("sphere", balls, at(0.0, 0.0, 0.0), NOW), [[0.5, 2.5]], rtol=1e-6)


class TestMoving:
    def moving(self) -> Scene:
        way = jnp.asarray([[[0.0, 1.0, 0.0]]])
        return Scene.of({"sphere": dataclasses.replace(ball((4.0, 0.0, 2.0)), sine=way, rate=jnp.full((1, 1), 2.0))}, 1)

    def test_along_its_path(self) -> None:
        scene, quarter = self.moving(), jnp.full(1, math.pi / 4)
        np.testing.assert_allclose(scene.solids["sphere"].position(quarter)[0, 0], [4.0, 1.0, 2.0], atol=1e-6)
        still = scene.at(quarter)
        for time in (NOW, quarter):
            np.testing.assert_allclose(still.solids["sphere"].position(time)[0, 0], [4.0, 1.0, 2.0], atol=1e-6)

    def test_what_is_thrown_falls(self) -> None:
        thrown = dataclasses.replace(
            ball((4.0, 0.0, 2.0)),
            velocity=jnp.asarray([[[-8.0, 0.0, 3.0]]]),
            acceleration=jnp.asarray([[[0, 0, -9.81]]]),
        )
        scene, late = Scene.of({"sphere": thrown}, 1), jnp.full(1, 0.5)
        where = [4.0 - 8.0 * 0.5, 0.0, 2.0 + 3.0 * 0.5 - 9.81 * 0.5**2 / 2]
        np.testing.assert_allclose(scene.solids["sphere"].position(late)[0, 0], where, atol=1e-6)
        np.testing.assert_allclose(scene.at(late).solids["sphere"].position(NOW)[0, 0], where, atol=1e-6)
        (then,), (body,) = bodies(scene, time=0.5), bodies(scene)
        np.testing.assert_allclose(then.quads.reshape(-1, 3).mean(0), where, atol=0.05)
        np.testing.assert_allclose(body.moved(0.5), np.subtract(where, [4.0, 0.0, 2.0]), atol=1e-6)
        np.testing.assert_allclose(then.moved(0.5), 0.0, atol=1e-6)

    def test_what_is_thrown_is_there_from_its_throw_until_it_is_under_the_ground(self) -> None:
        thrown = dataclasses.replace(
            ball((12.0, 0.0, -0.405)),
            velocity=jnp.asarray([[[-8.0, 0.0, 9.81]]]),
            acceleration=jnp.asarray([[[0, 0, -9.81]]]),
            since=jnp.ones((1, 1)),
        )  # at rest in height after 1 s, 4.5 m high
        scene = Scene.of({"sphere": thrown}, 1)
        for time, there in ((0.9, False), (1.1, True)):
            place = thrown.position(jnp.full(1, time))[:, 0]
            assert (float(clearance(scene, place, jnp.full(1, time))[0]) < 0) == there
            assert bool(scene.at(jnp.full(1, time)).solids["sphere"].active[0, 0]) == there
        (body,) = bodies(scene)
        lands = 1.0 + math.sqrt(2 * 4.5 / 9.81)
        assert body.moves
        assert [body.visible(t) for t in (0.99, 1.01, lands - 0.01, lands + 0.01)] == [False, True, True, False]
        np.testing.assert_allclose(body.quads.reshape(-1, 3).mean(0), [4.0, 0.0, 4.5], atol=0.05)  # where it is thrown
        np.testing.assert_allclose(body.moved(1.5), [-4.0, 0.0, -9.81 / 8], atol=1e-4)
        assert body.way is not None
        np.testing.assert_allclose(body.way[[0, -1], 0], [4.0, 4.0 - 8 * (lands - 1)], atol=0.05)
        assert bool(thrown.moves[0, 0])
        assert not bodies(Scene.of({"sphere": ball((4.0, 0.0, 2.0))}, 1))[0].moves


class TestGenerators:
    def test_a_forest_is_as_dense_as_asked_and_clear_of_start_and_goal(self) -> None:
        config = ForestConfig(density=0.1, length=40.0, width=12.0, clear=2.0, room=64)
        start, goal = (jnp.tile(jnp.array([x, 0.0, 1.5]), (500, 1)) for x in (0.0, 40.0))
        trees = forest(random_key(0), 500, config, start, goal)
        count = np.sum(trees.active, axis=1)
        taken_out = 0.1 * math.pi * 2.225**2  # about half a disc at each end
        assert count.mean() == pytest.approx(48 - taken_out, rel=0.03)
        xy, there = np.asarray(trees.centre[..., :2]), np.asarray(trees.active)
        for point in (start, goal):
            away = np.linalg.norm(xy - np.asarray(point)[:, None, :2], axis=-1) - np.asarray(trees.size[..., 0])
            assert away[there].min() > 2.0
        assert 0.0 < xy[..., 0].min() < 1.0 and 39.0 < xy[..., 0].max() < 40.0 and np.abs(xy[..., 1]).max() < 6.0
        np.testing.assert_allclose(trees.centre[..., 2], trees.size[..., 1], rtol=1e-6)  # they stand on the ground

    @pytest.mark.whole
    def test_clutter_is_of_all_kinds_and_clear_of_the_gates(self) -> None:
        gates = jnp.tile(jnp.array([[4.0, 0.0, 1.5], [8.0, 3.0, 2.0]]), (300, 1, 1))
        start = jnp.tile(jnp.array([[0.0, 0.0, 1.5]]), (300, 1, 1))
        config = ClutterConfig(obstacles=8.0, clear=0.5, moving=0.5)
        path = jnp.concatenate([start, gates], axis=1)
        solids = clutter(random_key(1), 300, config, path, path, 0.6)
        assert sorted(solids) == ["box", "capsule", "cylinder", "sphere"]
        assert 7.0 < sum(float(np.sum(s.active)) for s in solids.values()) / 300 < 8.2  # a few find no clear place
        scene = Scene.of(solids, 300, ground=None)
        for time in (0.0, 0.7, 1.9):
            for i in range(3):
                gap = clearance(scene, path[:, i], jnp.full(300, time))
                assert float(gap.min()) > 1.1 - 1e-4
        assert any(np.any(s.cosine != 0) for s in solids.values())

    def test_seeds(self) -> None:
        start, goal = (jnp.tile(jnp.array([x, 0.0, 1.5]), (3, 1)) for x in (0.0, 40.0))
        a, b, c = (forest(random_key(seed), 3, ForestConfig(), start, goal) for seed in (1, 1, 2))
        jax.tree.map(np.testing.assert_array_equal, a, b)
        assert np.all(np.asarray(a.centre) != np.asarray(c.centre)) and len(np.unique(a.centre[..., 0])) > 100

    def test_walls_stand_around_a_room_and_along_a_corridor(self) -> None:
        inside = Scene.of({"box": room(1, 6.0, 4.0, 3.0)}, 1)
        for point, gap in (
            ((0.0, 0.0, 1.5), 1.45),
            ((2.5, 0.0, 1.5), 0.45),
            ((0.0, 1.0, 1.5), 0.95),
            ((0.0, 0.0, 2.0), 0.95),
        ):
            assert float(clearance(inside, at(*point), NOW)[0]) == pytest.approx(gap, abs=1e-5)
        along = Scene.of({"box": corridor(1, 20.0, 3.0, 4.0)}, 1)
        assert float(clearance(along, at(10.0, 0.5, 2.0), NOW)[0]) == pytest.approx(0.95, abs=1e-5)


GOOD = """
ground = 0.5
[[solids]]
kind = "cylinder"
centre = [1.0, 2.0, 3.0]
size = [0.2, 1.0]
yaw = 90.0
class = "wall"
colour = [0.1, 0.2, 0.3]
path = { sine = [0.0, 1.0, 0.0], rate = 2.0 }
[[solids]]
kind = "cylinder"
centre = [5, 2, 3]
size = [0.3, 1.0]
[[solids]]
kind = "pad"
centre = [0, 0, 0.1]
size = [0.25, 0.1, 2]
"""


class TestFile:
    def test_all_of_it_is_read(self, tmp_path: Path) -> None:
        file = tmp_path / "scene.toml"
        file.write_text(GOOD)
        scene = load_scene(file, 3)
        assert scene.worlds == 3 and scene.kinds == ("cylinder", "pad")
        columns = scene.solids["cylinder"]
        np.testing.assert_allclose(scene.ground, 0.5)
        np.testing.assert_allclose(columns.size[2, :, :2], [[0.2, 1.0], [0.3, 1.0]])
        np.testing.assert_allclose(columns.quaternion[1, 0], [math.sqrt(0.5), 0, 0, math.sqrt(0.5)], atol=1e-6)
        assert [CLASSES[int(i)] for i in columns.label[0]] == ["wall", "obstacle"]
        np.testing.assert_allclose(columns.colour[0, 0], [0.1, 0.2, 0.3])
        np.testing.assert_allclose(columns.position(jnp.full(3, math.pi / 4))[0, 0], [1.0, 3.0, 3.0], rtol=1e-6)

    def test_an_empty_file_is_level_ground(self, tmp_path: Path) -> None:
        (tmp_path / "scene.toml").write_text("")
        scene = load_scene(tmp_path / "scene.toml")
        assert not scene.solids and float(scene.ground[0]) == 0.0
        (tmp_path / "scene.toml").write_text("ground = false")
        assert float(load_scene(tmp_path / "scene.toml").ground[0]) == -FAR

    @pytest.mark.parametrize(
        ("before", "after", "told"),
        [
            ("ground = 0.5", 'ground = "low"', r"ground is 'low'; accepted: a finite number of metres, or"),
            ("ground = 0.5", "ground = 1e308", r"ground is 1e\+308; accepted: .*at most 10000 in size"),
            ('kind = "pad"', 'kind = ["pad"]', r"solids\[2\].kind is \['pad'\]; accepted: a text"),
            ('kind = "pad"', "kind = {pad = 1}", r"solids\[2\].kind is \{'pad': 1\}; accepted: a text"),
            ('class = "wall"', 'class = ["wall"]', r"solids\[0\].class is \['wall'\]; accepted: a text"),
            ("centre = [5, 2, 3]", "centre = [5, 1e39, 3]", r"\[1\].centre is \[5, 1e\+39, 3\]; .*at most 10000"),
            ("size = [0.2, 1.0]", "size = [0.2, 1" + "0" * 400 + "]", r"\[0\].size is \[0.2, 1000.*\.\.\.; .*most"),
            (", rate = 2.0", ", rate = 1e308", r"solids\[0\].path.rate is 1e\+308; accepted: .*at most 10000 in size"),
            ("ground = 0.5", "floor = 0.5", r"has \['floor'\]; accepted: ground"),
            ('kind = "pad"', 'kind = "ped"', r"solids\[2\].kind: .*'ped'.*pad"),
            ("size = [0.2, 1.0]", "size = [0.2]", r"\[0\].size is .*accepted: 2 finite numbers \(radius, half"),
            ("size = [0.2, 1.0]", "size = [-0.2, 1.0]", r"solids\[0\].size is \[-0.2, 1.0\]; accepted: positive"),
            ("size = [0.25, 0.1, 2]", "size = [0.25, 0.1, 3]", r"solids\[2\].size"),
            ("centre = [5, 2, 3]", "centre = [5, nan, 3]", r"solids\[1\].centre is \[5, nan, 3\]; accepted: 3 finite"),
            ('class = "wall"', 'class = "wal"', r"solids\[0\].class: .*'wal'"),
            ("0.2, 0.3]\npath", "0.2, 1.3]\npath", r"solids\[0\].colour is .*accepted: 3 numbers in \[0, 1\]"),
            (", rate = 2.0", "", r"solids\[0\].path is .*accepted: rate"),
            ("yaw = 90.0", 'yaw = "east"', r"solids\[0\].yaw is 'east'; accepted: a finite number of degrees"),
            ("yaw = 90.0", "heading = 90.0", r"solids\[0\] has \[.*'heading'.*accepted: kind, centre, size"),
            ("ground = 0.5", "ground = [", "not a TOML file"),
        ],
    )  # fmt: skip
    def test_what_is_wrong_is_named(self, tmp_path: Path, before: str, after: str, told: str) -> None:
        file = tmp_path / "scene.toml"
        assert before in GOOD
        file.write_text(GOOD.replace(before, after))
        with pytest.raises(ValueError, match=told):
            load_scene(file)

    def test_a_file_that_is_not_there_is_named(self, tmp_path: Path) -> None:
        with pytest.raises(ValueError, match=r"none.toml: No such file.*accepted: the path of a .toml file"):
            load_scene(tmp_path / "none.toml")
