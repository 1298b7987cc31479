"""Hardware in the loop in a scene from a file: what it shows, what it counts as collisions, what it refuses."""

import dataclasses
import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import trimesh

from e2efly.commands import hil
from e2efly.commands.cli import run
from e2efly.commands.options import parse
from e2efly.commands.render import Render
from e2efly.config import AHEAD
from e2efly.courses.origin import Origin
from e2efly.environment import random_key
from e2efly.flight.pose.pose_source import PlantSource
from e2efly.flight.sight.shared import place
from e2efly.policy.odometry import Sample
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import Scene, Solids
from e2efly.validation.candidate import candidate
from e2efly.validation.plant import RigidState
from e2efly.validation.rehearse_hil import RehearsalPlan, draw
from e2efly.validation.scene_files import SceneFile, beside, ground_of, load_world
from e2efly.validation.scenery import Scenery
from e2efly.validation.virtual_world import STRUCK_S, Node
from e2efly.viewing.places import find_place
from tests.validation.test_hil_images import Kept

ROOM = "[[solids]]\nkind = 'box'\ncentre = [5, 0, 1.5]\nsize = [0.1, 4, 1.5]\n"
UP = 1.5
"""Where avoid is flown, m over the ground."""


def box(size: tuple[float, ...], centre: tuple[float, ...]) -> trimesh.Trimesh:
    mesh = trimesh.creation.box(size)
    mesh.apply_translation(centre)
    return mesh


def scan(path: Path, *more: trimesh.Trimesh, scale: float = 1.0, floor: bool = True) -> Path:
    """A scan of one piece: a floor of 40 x 20 m, a thin wall 5 m before the start, and more."""
    pieces = [*([box((40, 20, 0.02), (10, 0, -0.01))] if floor else []), box((0.02, 8, 3), (5, 0, 1.5)), *more]
    whole = trimesh.util.concatenate(pieces)
    whole.apply_scale(scale)
    whole.export(path)
    return path


@pytest.fixture(scope="module")
def drawn() -> Scenery:
    """The scenery of avoid."""
    found = candidate("avoid")
    scenery = Scenery.draw(found.environment(next(iter(found.task.criteria().values()))), 3)
    assert scenery is not None
    return scenery


def shown(scenery: Scenery, x: float = 0.0, y: float = 0.0, z: float = UP) -> np.ndarray:
    level = np.array([1.0, 0.0, 0.0, 0.0])
    return scenery.image(0, RigidState(np.array([x, y, z]), np.zeros(3), level, np.zeros(3)), 0.0, 1)


def test_a_mesh_without_its_materials_is_shown_by_choice(tmp_path: Path) -> None:
    path = scan(tmp_path / "scan.obj")
    path.write_text(f"mtllib of_somebody_else.mtl\n{path.read_text().replace('mtllib', '#')}")
    with pytest.raises(ValueError, match=r"of_somebody_else.mtl' is missing; .*--no-scene-materials"):
        load_world(str(path))
    plain = SceneFile(str(path), materials=False)
    assert isinstance(load_world(plain.name, materials=plain.materials), MeshScene)
    assert plain.options == ["--scene", str(path), "--no-scene-materials"]
    assert not hil.parse(["avoid", "--pose", "udp:1", *plain.options]).options.scene_materials
    assert not parse(Render, "render", [str(path), "--no-scene-materials"]).scene_materials
    with pytest.raises(ValueError, match=r"'of_somebody_else.mtl' is missing"):
        find_place(str(path), random_key(0))
    assert isinstance(find_place(str(path), random_key(0), materials=False).scene, MeshScene)
    for other in (str(tmp_path / "room.toml"), "forest"):
        with pytest.raises(ValueError, match=r"no materials|and materials of its own"):
            (load_world if other.endswith(".toml") else partial(find_place, key=random_key(0)))(other, materials=False)


def depth_of(wall: float, image: np.ndarray) -> float:
    """What the middle of an image of the tilted camera measures of a wall across, m away."""
    rows = image.shape[0]
    low = -math.tan(AHEAD.fov[1] / 2) * (2 * (rows // 2 + 0.5) / rows - 1)
    return wall / (math.cos(AHEAD.pitch) + low * math.sin(AHEAD.pitch))


@pytest.mark.parametrize("form", ["stl", "ply", "obj", "glb"])
def test_a_scan_of_any_format_is_shown_in_place_of_the_task_s_world(tmp_path: Path, drawn: Scenery, form: str) -> None:
    up = "z" if form == "glb" else None  # trimesh has written it as it was
    scenery = SceneFile(str(scan(tmp_path / f"scan.{form}")), up=up).put(drawn)
    image = shown(scenery, x=1.0)
    middle = image[image.shape[0] // 2, image.shape[1] // 2]
    assert middle == pytest.approx(depth_of(3.99, image), abs=1e-3)  # the wall, and no tree
    assert ground_of(scenery, "scene", 0.1).depth == pytest.approx(float(drawn.course.start[2]), abs=1e-4)


def test_a_unit_and_a_scene_file_of_solids_are_taken(tmp_path: Path, drawn: Scenery) -> None:
    solids = tmp_path / "room.toml"
    solids.write_text(ROOM)
    in_mm = SceneFile(str(scan(tmp_path / "scan.stl", scale=200.0)), unit=0.005)
    for file, wanted in ((SceneFile(str(solids)), 3.9), (in_mm, 3.99)):
        image = shown(file.put(drawn), x=1.0)
        middle = image[image.shape[0] // 2, image.shape[1] // 2]
        assert middle == pytest.approx(depth_of(wanted, image), abs=1e-3)


def test_what_stands_in_the_task_s_world_can_be_shown_beside(tmp_path: Path, drawn: Scenery) -> None:
    assert isinstance(drawn.scene, Scene)
    trees = int(np.sum(drawn.scene.solids["cylinder"].active))
    file, solids = scan(tmp_path / "scan.ply"), tmp_path / "room.toml"
    solids.write_text(ROOM)
    alone, both = (SceneFile(str(file), beside=b).put(drawn) for b in (False, True))
    assert isinstance(alone.scene, MeshScene) and isinstance(both.scene, MeshScene)
    assert len(both.scene.names) == len(alone.scene.names) + trees
    first = np.asarray(drawn.scene.solids["cylinder"].centre[0])[np.asarray(drawn.scene.solids["cylinder"].active[0])][
        0
    ]
    at = [np.array([*first[:2], UP])]
    assert (alone.nearest(at, [0.0], Origin()), both.nearest(at, [0.0], Origin())) > (0.5, 0.0)
    assert both.nearest(at, [0.0], Origin()) < 1.0 < alone.nearest(at, [0.0], Origin())
    mixed = SceneFile(str(solids), beside=True).put(drawn).scene
    assert isinstance(mixed, Scene) and mixed.kinds == ("box", "cylinder")
    moving = dataclasses.replace(Solids.of("sphere", [[[3, 0, 1]]], [[[0.3]]]), rate=np.ones((1, 1), np.float32))
    with pytest.raises(ValueError, match="world has a sphere that moves; accepted: a scene of solids"):
        beside(load_world(str(file)), Scene.of({"sphere": moving}, 1))


def test_a_collision_with_a_scan_stops_the_images_even_where_the_wall_is_thin(tmp_path: Path, drawn: Scenery) -> None:
    scenery = SceneFile(str(scan(tmp_path / "scan.stl"))).put(drawn)

    def flown(start: tuple[float, ...], speed: float, steps: int) -> tuple[Node, list[str], int]:
        """Ahead with one image every 40 ms."""
        samples, kept, said = list[Sample](), Kept(), list[str]()
        node = Node(scenery, PlantSource(lambda now: [samples.pop()]), [kept], Origin(), 1000.0, 0.1)  # pyright: ignore[reportArgumentType]
        for k in range(steps):
            now, velocity = 10 + 0.04 * k, np.array([speed, 0.0, 0.0])
            place = np.array(start) + 0.04 * k * velocity
            samples.append(Sample(now, place, np.array([1.0, 0.0, 0.0, 0.0]), now, velocity, np.zeros(3)))
            said.append(str(node.step(now, lambda now=now: now)))
        return node, said, len(kept.images)

    node, said, images = flown((0.0, 0.0, 0.08), 0.1, 4)  # it stands on the floor
    assert (set(said), images, node.collisions) == ({"images"}, 4, 0)
    node, said, images = flown((3.9, 0.0, UP), 8.0, 8)  # 13 cm before the wall, then 17 cm behind
    assert said[:4] == ["images"] * 4
    assert said[4] == "virtual collision at [5.18, 0.0, 1.5] m of the scene"
    assert said[5:] == ["no images: a virtual collision"] * 3
    assert (images, node.collisions) == (4, 1)
    assert STRUCK_S > 0.3
    _, said, _ = flown((3.9, 4.5, UP), 8.0, 8)  # beside the wall
    assert set(said) == {"images"}


@pytest.mark.whole
def test_worlds_that_nobody_can_fly_in_are_refused_before_anything_is_shown(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty, flat = tmp_path / "empty.stl", tmp_path / "flat.ply"
    empty.write_bytes(bytes(84))
    trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], process=False).export(flat)
    solids = tmp_path / "sky.toml"
    solids.write_text(f"ground = false\n{ROOM}")
    holed = scan(tmp_path / "holed.stl", floor=False)
    blocked = scan(tmp_path / "blocked.stl", box((0.1, 8, 4), (0, 0, 2)))
    name = "e2efly_test_hil_scene"
    place(name).unlink(missing_ok=True)
    for given, said in (
        (["--scene", str(solids)], "sky.toml has no ground under [0.00, "),
        (["--scene", str(holed)], "holed.stl has no ground under [0.00, "),
        (["--scene", str(holed)], "where its course begins; accepted: a scene with a floor there, at most 50 m below"),
        (["--scene", str(scan(tmp_path / "mm.stl", scale=200.0))], "mm.stl: is 8000 x 4000 x 604 m large; accepted"),
        (["--scene", str(scan(tmp_path / "um.stl", scale=1000.0))], "at most 10000 in size"),
        (["--scene", str(scan(tmp_path / "km.stl", scale=0.001))], "a longest side of 0.5 to 1000 m"),
        (["--scene", str(empty)], "empty.stl: "),
        (["--scene", str(flat)], "flat.ply: there are no triangles of any area; accepted: at least one"),
        (["--scene", str(blocked)], "blocked.stl has something 0.05 m from [0.00, "),
        (["--scene", "none.stl"], "none.stl: there is no such file"),
        (["--scene", "none.toml"], "none.toml"),
        (["--scene", "warehous"], "unknown mesh scene 'warehous'; did you mean 'warehouse'"),
        (["--scene", str(solids), "--scene-unit", "0.001"], "sky.toml: is in m with z up"),
        (["--scene-unit", "0.001"], "--scene-unit is 0.001; accepted: only with --scene"),
        (["--beside"], "--beside is True; accepted: only with --scene"),
    ):  # fmt: skip
        assert run(["hil", "avoid", "--image", f"image_0=shm:{name}", "--seconds", "1", *given]) == 2, given
        error = " ".join(capsys.readouterr().err.split())
        assert said in error, (given, error)
        assert not place(name).exists(), given


def test_a_course_that_leaves_the_scan_is_told(tmp_path: Path, drawn: Scenery) -> None:
    ground = ground_of(SceneFile(str(scan(tmp_path / "scan.ply"))).put(drawn), "scene", 0.1)
    assert ground.ends == pytest.approx(30.0, abs=0.6)  # the floor goes so far
    assert ground_of(drawn, "the world of the task", 0.1).ends == math.inf


def test_a_floor_of_solids_is_ground_where_there_is_no_plane(tmp_path: Path, drawn: Scenery) -> None:
    floor = tmp_path / "floor.toml"
    floor.write_text("ground = false\n[[solids]]\nkind = 'box'\ncentre = [0, 0, -0.5]\nsize = [4, 4, 0.25]\n")
    ground = ground_of(SceneFile(str(floor)).put(drawn), "scene", 0.1)
    assert ground.depth == pytest.approx(float(drawn.course.start[2]) + 0.25, abs=1e-4)
    assert ground.ends == pytest.approx(4.2, abs=0.4)


def test_a_rehearsal_flies_in_the_scene(tmp_path: Path) -> None:
    file = SceneFile(str(scan(tmp_path / "scan.stl")), unit=1.0, beside=True)
    plan = RehearsalPlan(candidate("avoid"), scene=file)
    scenery = draw(plan, 3, tmp_path / "track.toml").scenery
    assert isinstance(scenery.scene, MeshScene)
    assert file.options == ["--scene", file.name, "--scene-unit", "1.0", "--beside"]
    holed = SceneFile(str(scan(tmp_path / "holed.stl", floor=False)))
    with pytest.raises(ValueError, match="no ground under"):
        draw(dataclasses.replace(plan, scene=holed), 3, tmp_path / "track.toml")
