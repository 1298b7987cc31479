"""How near a path comes to triangles: exact, through sheets, and never because of the floor that it starts from."""

import math

import numpy as np
import pytest

from e2efly.simulation.scenes.meshes.mesh_scene import MeshPart, MeshScene
from e2efly.simulation.scenes.meshes.near import Near
from e2efly.simulation.scenes.scene import GATE, PAD
from tests.simulation.scenes.test_meshes import box


def sheet(size: float, name: str = "scan", height: float = 0.0) -> MeshPart:
    corners = size / 2 * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) + [0.0, 0.0, height]
    return MeshPart(name, corners, np.array([[0, 1, 2], [0, 2, 3]]))


def near(*parts: MeshPart) -> Near:
    return Near.of(MeshScene.of(parts))


def test_the_distance_is_exact_near_and_far() -> None:
    world = near(box((2, 2, 2), (5, 0, 0)), box((1, 1, 1), (-30, 0, 0)))
    for point, wanted in (
        ((3.7, 0.3, 0.1), 0.3),
        ((3.0, 2.0, 2.0), math.sqrt(3.0)),
        ((0, 0, 0), 4.0),
        ((-24, 0, 0), 5.5),
    ):
        assert world.distance(np.array([point])) == pytest.approx(wanted, abs=1e-5)
    path = np.linspace([0.0, 1.5, 0.0], [8.0, 1.5, 0.0], 40)  # along its side
    assert world.distance(path) == pytest.approx(0.5, abs=1e-5)


def test_what_is_farther_than_asked_may_count_as_nothing() -> None:
    world = near(box((2, 2, 2), (5, 0, 0)))
    assert world.distance(np.array([[3.8, 0, 0]]), within=0.3) == pytest.approx(0.2, abs=1e-5)
    assert world.distance(np.array([[0.0, 0, 0]]), within=0.3) == math.inf


def test_a_path_through_a_thin_wall_is_no_way() -> None:
    world = near(box((0.001, 4, 4), (1, 0, 0), "wall"))
    through, beside = np.array([[0.5, 0, 0], [1.5, 0, 0]]), np.array([[0.5, 3, 0], [1.5, 3, 0]])
    assert world.distance(through) == 0
    assert world.distance(beside) == pytest.approx(math.hypot(0.5, 1), abs=1e-3)
    assert world.distance(through[:1]) == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize("floor", ["ground", "scan"])
def test_near_the_floor_is_no_collision_and_through_it_is_one(floor: str) -> None:
    world = near(sheet(10, floor))
    assert world.distance(np.array([[0, 0, 0.05]])) == math.inf
    assert world.distance(np.array([[0, 0, 0.05], [0, 0, -0.05]])) == 0


def test_a_ceiling_of_a_scan_and_the_side_of_a_table_are_collisions() -> None:
    world = near(sheet(10), sheet(10, "scan", 2.5), box((1, 1, 0.1), (2, 0, 1)))
    assert world.distance(np.array([[0, 0, 2.4]])) == pytest.approx(0.1, abs=1e-5)
    assert world.distance(np.array([[1.4, 0, 1.0]])) == pytest.approx(0.1, abs=1e-5)


def test_only_ground_and_pads_bear_where_the_ground_is_named() -> None:
    world = near(sheet(10, "ground"), box((1, 1, 0.1), (2, 0, 1)), box((1, 1, 0.1), (-2, 0, 0.05), label=PAD))
    assert world.distance(np.array([[2, 0, 1.1]]), within=0.2) == pytest.approx(0.05, abs=1e-5)
    assert world.distance(np.array([[-2, 0, 0.15]]), within=0.2) == math.inf


def test_two_worlds_are_one() -> None:
    red, grid = np.full((2, 2, 3), (255, 0, 0), np.uint8), np.zeros((8, 2))
    first = MeshScene.of([sheet(10, "ground"), box((1, 1, 1), (2, 0, 1), "a", texture=red, uv=grid)])
    second = MeshScene.of(
        [box((1, 1, 1), (-2, 0, 1), "gate 1", label=GATE), box((1, 1, 1), (0, 3, 1), "b", texture=red, uv=grid)]
    )
    both = first.beside(second)
    assert both.names == ("sky", "ground", "a", "gate 1", "b")
    assert sorted(set(both.instance.tolist())) == [1, 2, 3, 4]
    assert [both.textures[t][0, 0].tolist() for t in (both.texture[2], both.texture[14], both.texture[-1])] == [
        [255, 0, 0], [255, 255, 255], [255, 0, 0],
    ]  # fmt: skip
    assert set(both.label[14:26].tolist()) == {GATE}
    np.testing.assert_array_equal(both.triangles[14:], second.triangles)
