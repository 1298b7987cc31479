"""Worlds of triangles: the same as solids to a camera, honest about files, and how far away they are."""

import dataclasses
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from PIL import Image

from e2efly.config import CameraConfig
from e2efly.simulation.physics.rotation import from_euler
from e2efly.simulation.scenes import camera, cast
from e2efly.simulation.scenes.mesh import parts
from e2efly.simulation.scenes.meshes.distance import DistanceGrid, clearance
from e2efly.simulation.scenes.meshes.load import load_mesh_scene, mesh_scene_names
from e2efly.simulation.scenes.meshes.mesh_cast import cast as mesh_cast
from e2efly.simulation.scenes.meshes.mesh_scene import MeshPart, MeshScene
from e2efly.simulation.scenes.scene import COLOURS, GATE, GROUND, OBSTACLE, SKY, WALL, Scene
from e2efly.simulation.scenes.shapes import FAR
from tests.simulation.scenes.test_cast import LEVEL, crowd

CONFIG = CameraConfig(width=80, height=48, fov=(1.4, 1.0))
AHEAD = np.array([[0.0, 0.0, 2.0]], np.float32)


def solid(mesh: trimesh.Trimesh, name: str = "thing", **about: Any) -> MeshPart:
    return MeshPart(name, np.asarray(mesh.vertices), np.asarray(mesh.faces), **about)


def box(extents: Any = (1.0, 1.0, 1.0), centre: Any = (0.0, 0.0, 0.0), name: str = "thing", **about: Any) -> MeshPart:
    mesh = trimesh.creation.box(extents)
    mesh.apply_translation(centre)
    return solid(mesh, name, **about)


def see(
    scene: MeshScene, position: Any = AHEAD, quaternion: Any = LEVEL, channels: tuple[str, ...] = cast.CHANNELS
) -> dict[str, np.ndarray]:
    n = len(position)
    turned = jnp.broadcast_to(jnp.asarray(quaternion), (n, 4))
    pose = camera.pose(camera.mount(CONFIG, n), jnp.asarray(position, jnp.float32), turned)
    light = dataclasses.replace(cast.usual_light(n), checker=np.zeros(n, np.float32))
    return jax.tree.map(np.asarray, mesh_cast(scene, *pose, camera.pattern(CONFIG), channels, light))


class TestCast:
    @pytest.mark.whole
    def test_a_world_looks_the_same_as_solids_and_as_triangles(self) -> None:
        kinds = ("box", "gate", "sphere")
        solids = Scene.of({kind: some for kind, some in crowd(1, 7).solids.items() if kind in kinds}, 1)
        pose = camera.pose(camera.mount(CONFIG, 1), jnp.asarray(AHEAD), jnp.asarray(LEVEL))
        light = dataclasses.replace(cast.usual_light(1), checker=np.zeros(1, np.float32))
        theirs = cast.cast(solids, *pose, camera.pattern(CONFIG), cast.CHANNELS, light)
        mine = see(MeshScene.of(parts(solids, 0, 128)))
        assert 0.1 < np.mean(mine["label"] > GROUND) < 0.9
        limits = {"depth": 5e-3, "label": 0, "instance": 0, "normal": 0.05, "rgb": 0.02}
        for name, limit in limits.items():
            assert mine[name].shape == theirs[name].shape and mine[name].dtype == theirs[name].dtype
            assert np.mean(np.abs(mine[name] - np.asarray(theirs[name])) <= limit) > 0.997, name

    @pytest.mark.parametrize("sees", ["depth", "range", "mask"])
    def test_a_camera_looks_at_triangles_as_at_solids(self, sees: str) -> None:
        solids = Scene.of({kind: some for kind, some in crowd(1, 7).solids.items() if kind in ("box", "gate")}, 1)
        seen = dataclasses.replace(CONFIG, sees=sees, of="gate", reach=(0.5, 6.0))
        mount, pose = camera.mount(seen, 1), (jnp.asarray(AHEAD), jnp.asarray(LEVEL))
        theirs, mine = (camera.look(seen, world, mount, *pose) for world in (solids, MeshScene.of(parts(solids, 0))))
        assert mine.shape == theirs.shape and len(np.unique(np.asarray(mine))) > 1
        assert np.mean(np.abs(mine - theirs) <= 5e-3) > 0.997

    def test_depth_alone_is_that_among_others_and_misses_are_far(self) -> None:
        scene = MeshScene.of([box((1, 1, 1), (4.0, 0.0, 2.0))])
        images = see(scene)
        np.testing.assert_array_equal(images["depth"], see(scene, channels=("depth",))["depth"])
        missed = images["label"] == SKY
        assert 0.1 < np.mean(missed) < 0.97 and np.all(images["depth"][missed] == np.float32(FAR))
        np.testing.assert_allclose(images["depth"][~missed], 3.5, rtol=1e-6)
        assert np.all(images["instance"][~missed] == 2) and np.all(images["normal"][missed] == 0)

    def test_it_runs_inside_compiled_programs_for_many_cameras_and_under_vmap(self) -> None:
        scene = MeshScene.of([box((2, 2, 2), (6.0, 0.0, 2.0)), box((9, 9, 0.1), (0.0, 0.0, 0.0), "ground")])
        rng = np.random.default_rng(0)
        place = jnp.asarray(rng.uniform([-2, -2, 1], [2, 2, 3], (40, 3)), jnp.float32)
        pattern, mount = camera.pattern(CONFIG), camera.mount(CONFIG, 40)
        matrix = camera.pose(mount, place, jnp.tile(LEVEL, (40, 1)))[1]
        direct = mesh_cast(scene, place, matrix, pattern)["depth"]
        alone = [see(scene, place[i : i + 1], channels=("depth",))["depth"][0] for i in range(40)]
        np.testing.assert_allclose(direct, np.stack(alone), rtol=1e-5)

        @jax.jit
        def rolled(start: jax.Array) -> jax.Array:
            return jax.lax.scan(lambda p, _: (p + 0.1, mesh_cast(scene, p, matrix, pattern)["depth"]), start, None, 3)[
                1
            ]

        np.testing.assert_allclose(rolled(place)[0], direct, rtol=1e-5)
        by_world = jax.vmap(lambda p, m: mesh_cast(scene, p[None], m[None], pattern)["depth"][0])(place, matrix)
        np.testing.assert_allclose(by_world, direct, rtol=1e-5)

    def test_images_have_no_gradient_and_stop_none(self) -> None:
        scene, pattern = MeshScene.of([box((2, 2, 2), (6.0, 0.0, 2.0))]), camera.pattern(CONFIG)
        matrix = camera.pose(camera.mount(CONFIG, 1), jnp.asarray(AHEAD), jnp.asarray(LEVEL))[1]
        gradient = jax.grad(lambda p: jnp.sum(p**2) + mesh_cast(scene, p, matrix, pattern)["depth"].min())(
            jnp.asarray(AHEAD)
        )
        np.testing.assert_allclose(gradient, 2 * AHEAD)

    def test_in_an_object_a_camera_sees_its_inner_side(self) -> None:
        scene = MeshScene.of([box((4, 6, 8), (0.0, 0.0, 2.0), "wall")])
        images = see(scene)
        np.testing.assert_allclose(images["depth"], 2.0, rtol=1e-5)
        np.testing.assert_allclose(images["normal"][0, 24, 40], [-1, 0, 0], atol=1e-6)
        assert np.all(images["label"] == WALL)

    def test_a_texture_lies_where_its_coordinates_say(self) -> None:
        square = np.array([[3.0, 1.0, 1.0], [3.0, -1.0, 1.0], [3.0, -1.0, 3.0], [3.0, 1.0, 3.0]])
        faces = np.array([[0, 2, 1], [0, 3, 2]])
        uv = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])  # as seen from the camera
        texture = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]], np.uint8)
        rgb = see(MeshScene.of([MeshPart("sign", square, faces, uv=uv, texture=texture)]))["rgb"][0]
        quarter = {
            place: np.round(rgb[place] / rgb[place].max(), 3).tolist()
            for place in ((22, 38), (22, 42), (26, 38), (26, 42))
        }
        assert list(quarter.values()) == [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]]

    def test_a_channel_that_is_none_is_refused(self) -> None:
        with pytest.raises(ValueError, match=r"channels has \['colour'\]; accepted: depth"):
            see(MeshScene.of([box()]), channels=("colour",))


class TestScene:
    def test_names_make_classes_and_instances(self) -> None:
        names = ("gate.001", "Wall_north", "table", "ground", "ground 2", "table")
        scene = MeshScene.of([box(centre=(3.0 * i, 0, 0), name=name) for i, name in enumerate(names)])
        assert scene.names == ("sky", "ground", "gate.001", "Wall_north", "table")
        np.testing.assert_array_equal(scene.label[::12], [GATE, WALL, OBSTACLE, GROUND, GROUND, OBSTACLE])
        np.testing.assert_array_equal(scene.instance[::12], [2, 3, 4, 1, 1, 4])

    def test_degenerate_triangles_are_dropped_and_counted(self) -> None:
        part = box()
        line = np.array([[0, 1, 0], [2, 2, 2]])
        scene = MeshScene.of([dataclasses.replace(part, faces=np.concatenate([part.faces, line]))])
        assert scene.dropped == 2 and len(scene.triangles) == 12 and np.all(np.isfinite(scene.normal))
        with pytest.raises(ValueError, match="no triangles of any area; accepted: at least one"):
            MeshScene.of([dataclasses.replace(part, faces=line)])

    @pytest.mark.parametrize(
        ("about", "told"),
        [
            ({"vertices": np.full((8, 3), np.nan)}, "object 'thing': vertices are not all finite"),
            ({"faces": np.array([[0, 1, 8]])}, "object 'thing': faces name vertices that are not there.*3 of 8"),
            ({"texture": np.zeros((2, 2, 3), np.uint8)}, "object 'thing': has a texture, but no texture coordinates"),
            ({"uv": np.full((8, 2), np.inf)}, "object 'thing': texture coordinates are not all finite"),
            ({"vertices": np.full((8, 3), 1e39)}, "object 'thing': vertices are not .* finite .*at most 10000"),
            ({"uv": np.full((8, 2), 1e308)}, "object 'thing': texture coordinates .*at most 10000 in size"),
            ({"colour": np.full(3, np.inf)}, "object 'thing': colours have shape"),
            ({"colour": np.ones((1, 3))}, r"object 'thing': colours have shape \(1, 3\).*accepted: 3 numbers in"),
            ({"label": 7}, "object 'thing': label is 7; accepted: 1 to 6"),
        ],
    )
    def test_what_is_wrong_is_named(self, about: dict[str, Any], told: str) -> None:
        with pytest.raises(ValueError, match=told):
            MeshScene.of([dataclasses.replace(box(), **about)])


def texture(colour: tuple[int, int, int] = (0, 200, 0)) -> Image.Image:
    return Image.new("RGB", (4, 4), colour)


def glb_scene() -> trimesh.Scene:
    """Two objects, y up: a textured plate as the ground, a gate painted red, moved by its node."""
    plate = trimesh.creation.box((4.0, 0.2, 4.0))
    material = trimesh.visual.material.PBRMaterial(name="grass", baseColorTexture=texture())
    plate.visual = trimesh.visual.TextureVisuals(uv=np.zeros((8, 2)), material=material)
    gate = trimesh.creation.box((1.0, 2.0, 3.0))
    red = trimesh.visual.material.PBRMaterial(name="red", baseColorFactor=[255, 0, 0, 255])
    gate.visual = trimesh.visual.TextureVisuals(material=red)
    scene = trimesh.Scene()
    scene.add_geometry(plate, node_name="ground", geom_name="plate")
    scene.add_geometry(
        gate, node_name="gate.001", geom_name="frame", transform=trimesh.transformations.translation_matrix((0, 1, -5))
    )
    return scene


OBJ = """mtllib things.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
vt 0 0
vt 1 1
o gate_one
usemtl red
f 1 2 3
usemtl leaf
f 1/1 3/2 4/1
o pad
usemtl red
f 1 2 5
"""
MTL = "newmtl red\nKd 1 0 0\nnewmtl leaf\nKd 0 0 0\nmap_Kd leaf.png\n"


def obj_files(folder: Path) -> Path:
    (folder / "things.obj").write_text(OBJ)
    (folder / "things.mtl").write_text(MTL)
    texture().save(folder / "leaf.png")
    return folder / "things.obj"


def gltf_files(folder: Path, **changes: Any) -> Path:
    """The two objects as text and a file for each buffer, with changes of the header."""
    for name, raw in trimesh.exchange.gltf.export_gltf(glb_scene()).items():
        (folder / name).write_bytes(raw)
    path = folder / "model.gltf"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))
    return path


class TestLoad:
    def test_glb(self, tmp_path: Path) -> None:
        glb_scene().export(tmp_path / "scene.glb")
        scene = load_mesh_scene(tmp_path / "scene.glb")
        assert scene.names == ("sky", "ground", "gate.001") and len(scene.triangles) == 24
        gate = scene.triangles[scene.instance == 2].reshape(-1, 3)
        np.testing.assert_allclose([gate.min(axis=0), gate.max(axis=0)], [[-0.5, 3.5, 0.0], [0.5, 6.5, 2.0]], atol=1e-6)
        weights = np.full(2, 1 / 3)
        faces = np.array([np.flatnonzero(scene.instance == i)[0] for i in (1, 2)])
        np.testing.assert_allclose(scene.colours(faces, weights, weights), [[0, 200 / 255, 0], [1, 0, 0]], atol=1e-6)
        raw = load_mesh_scene(tmp_path / "scene.glb", up="z", unit=0.01).triangles[scene.instance == 2]
        np.testing.assert_allclose(raw.reshape(-1, 3).max(axis=0), [0.005, 0.02, -0.035], atol=1e-6)

    def test_a_gltf_mesh_of_two_materials_is_one_object(self, tmp_path: Path) -> None:
        path = gltf_files(tmp_path)
        header = json.loads(path.read_text())
        header["meshes"][0]["primitives"] += header["meshes"].pop()["primitives"]
        for node in header["nodes"]:
            if node.get("mesh") == 1:
                del node["mesh"]
        path.write_text(json.dumps(header))
        scene = load_mesh_scene(path)
        assert scene.names == ("sky", "ground") and len(scene.triangles) == 24

    def test_obj(self, tmp_path: Path) -> None:
        scene = load_mesh_scene(obj_files(tmp_path))
        assert set(scene.names) == {"sky", "ground", "gate_one", "pad"}
        one = scene.instance == scene.names.index("gate_one")
        assert np.sum(one) == 2 and set(scene.label[one]) == {GATE}
        weights = np.full(2, 1 / 3)
        colours = scene.colours(np.flatnonzero(one), weights, weights)
        assert sorted(np.round(colours, 2).tolist()) == [[0.0, 0.78, 0.0], [1.0, 0.0, 0.0]]

    def test_ply_with_colours_of_vertices(self, tmp_path: Path) -> None:
        mesh = trimesh.creation.box()
        mesh.visual.vertex_colors = np.tile([0, 51, 255, 255], (8, 1)).astype(np.uint8)
        mesh.export(tmp_path / "wall.ply")
        scene = load_mesh_scene(tmp_path / "wall.ply")
        assert scene.names[2] == "wall" and set(scene.label) == {WALL}
        np.testing.assert_allclose(scene.colour[0, 0], [0.0, 0.2, 1.0], atol=1e-6)
        mesh.export(tmp_path / "wall.ply", encoding="ascii")
        np.testing.assert_allclose(load_mesh_scene(tmp_path / "wall.ply", up="y").bounds[1], 0.5, atol=1e-6)

    @pytest.mark.parametrize("mark", ["", "\ufeff"])
    def test_geometry_alone_is_read_by_choice(self, tmp_path: Path, mark: str) -> None:
        path = obj_files(tmp_path)
        first = f"{mark}v 0 0 0\nmtllib things.mtl\n"
        path.write_text(OBJ.replace("mtllib things.mtl\nv 0 0 0\n", first), encoding="utf-8")
        whole = load_mesh_scene(path)
        (tmp_path / "things.mtl").unlink()
        with pytest.raises(
            ValueError, match=r"'things.mtl' is missing; .*; or materials=False \(--no-scene-materials\)"
        ):
            load_mesh_scene(path)
        plain = load_mesh_scene(path, materials=False)
        assert sorted(map(tuple, plain.triangles.reshape(-1, 9))) == sorted(map(tuple, whole.triangles.reshape(-1, 9)))
        assert plain.names == whole.names and len(plain.textures) == 1
        np.testing.assert_allclose(plain.colour, np.repeat(COLOURS[plain.label][:, None], 3, axis=1))

    def test_a_gltf_and_a_ply_whose_textures_were_not_sent_along(self, tmp_path: Path) -> None:
        gltf_files(tmp_path, images=[{"uri": "grass.png"}], extensionsRequired=["KHR_texture_basisu"])
        trimesh.creation.box().export(tmp_path / "wall.ply", encoding="ascii")
        text = (tmp_path / "wall.ply").read_text()
        (tmp_path / "wall.ply").write_text(text.replace("element", "comment TextureFile wall.png\nelement", 1))
        for name, triangles in (("model.gltf", 24), ("wall.ply", 12)):
            with pytest.raises(ValueError, match=r"or materials=False \(--no-scene-materials\)"):
                load_mesh_scene(tmp_path / name)
            scene = load_mesh_scene(tmp_path / name, materials=False)
            assert len(scene.triangles) == triangles
            np.testing.assert_allclose(scene.colour, np.repeat(COLOURS[scene.label][:, None], 3, axis=1))
        with pytest.raises(ValueError, match="mesh scene 'garage' is the package's"):
            load_mesh_scene("garage", materials=False)

    @pytest.mark.parametrize(
        ("before", "after", "told"),
        [
            ("leaf.png", "bark.png", r"things.obj: material 'leaf': the texture 'bark.png' is missing; accepted"),
            ("leaf.png", "../leaf.png", r"the texture '../leaf.png' is missing; accepted: a file in the folder"),
            ("mtllib things", "mtllib stuff", r"things.obj: the file of materials 'stuff.mtl' is missing"),
            ("usemtl red\nf 1 2 3", "usemtl rod\nf 1 2 3", r"material 'rod' is missing; accepted: \['leaf', 'red'\]"),
            ("f 1 2 5", "f 1 2 9", r"things.obj: not a readable .obj file"),
            ("v 0 1 0", "v 0 nan 0", r"things.obj: object 'gate_one': vertices are not all finite"),
            ("v 0 1 0", "v 0 1e39 0", r"things.obj: object 'gate_one': vertices are not all finite"),
        ],
    )  # fmt: skip
    def test_what_is_wrong_in_an_obj_is_named(self, tmp_path: Path, before: str, after: str, told: str) -> None:
        path = obj_files(tmp_path)
        for file, text in ((path, OBJ), (tmp_path / "things.mtl", MTL)):
            file.write_text(text.replace(before, after))
        with pytest.raises(ValueError, match=told):
            load_mesh_scene(path)

    def test_what_is_wrong_in_others_is_named(self, tmp_path: Path) -> None:
        path, image = gltf_files(tmp_path, images=[{"uri": "grass.png"}]), tmp_path / "grass.png"
        texture().save(image)
        assert len(load_mesh_scene(path).textures) == 2
        image.write_bytes(b"no image")
        with pytest.raises(ValueError, match=r"model.gltf: object 'ground': the texture of .* 'grass' cannot be read"):
            load_mesh_scene(path)
        image.unlink()
        with pytest.raises(ValueError, match=r"model.gltf: the image 'grass.png' is missing; accepted: a file in"):
            load_mesh_scene(path)
        with pytest.raises(ValueError, match=r"model.gltf: requires KHR_draco_mesh_compression; accepted"):
            load_mesh_scene(gltf_files(tmp_path, extensionsRequired=["KHR_draco_mesh_compression"]))
        (tmp_path / "bad.glb").write_bytes(b"bad")
        with pytest.raises(ValueError, match=r"bad.glb: not a .glb file"):
            load_mesh_scene(tmp_path / "bad.glb")
        trimesh.PointCloud(np.eye(3)).export(tmp_path / "points.ply")
        with pytest.raises(ValueError, match=r"points.ply: object 'points' has no triangles; accepted: surfaces"):
            load_mesh_scene(tmp_path / "points.ply")
        with pytest.raises(ValueError, match=r"unknown mesh scene 'warehous'; did you mean 'warehouse'.*\.glb"):
            load_mesh_scene("warehous")
        with pytest.raises(ValueError, match=r"none.glb: there is no such file; accepted: the path of a .glb"):
            load_mesh_scene(tmp_path / "none.glb")
        with pytest.raises(ValueError, match=r"unit is 0; accepted: a positive number"):
            load_mesh_scene(tmp_path / "points.ply", unit=0)

    @pytest.mark.parametrize(
        ("header", "told"),
        [
            ([], r"its JSON is \[\]; accepted: an object"),
            ({"meshes": 3}, "meshes is 3; accepted: a list"),
            ({"meshes": [None]}, r"meshes\[0\] is None; accepted: an object"),
            ({"meshes": [{"primitives": {}}]}, r"meshes\[0\].primitives is \{\}; accepted: a list"),
            ({"meshes": [{"primitives": [{"mode": [4]}]}]}, r"meshes\[0\].primitives\[0\].mode is \[4\]; acc"),
            ({"images": [{"uri": 5}]}, r"images\[0\].uri is 5; accepted: a text"),
            ({"buffers": ["a"]}, r"buffers\[0\] is 'a'; accepted: an object"),
            ({"materials": [{"name": ["a"]}]}, r"materials\[0\].name is \['a'\]; accepted: a text"),
            ({"materials": [{"pbrMetallicRoughness": 1}]}, r"materials\[0\].pbrMetallicRoughness is 1; accepted: "),
            ({"extensionsRequired": [None]}, r"extensionsRequired\[0\] is None; accepted: a text"),
        ],
    )
    def test_json_of_the_wrong_types_is_named(self, tmp_path: Path, header: Any, told: str) -> None:
        (tmp_path / "model.gltf").write_text(json.dumps(header))
        with pytest.raises(ValueError, match=f"model.gltf: {told}"):
            load_mesh_scene(tmp_path / "model.gltf")

    @pytest.mark.parametrize("text", ["[" * 100_000, '{"asset": ' + "9" * 5000 + "}", "{"])
    def test_json_that_cannot_be_read_is_told(self, tmp_path: Path, text: str) -> None:
        (tmp_path / "model.gltf").write_text(text)
        with pytest.raises(ValueError, match=r"model.gltf: not a .gltf file: "):
            load_mesh_scene(tmp_path / "model.gltf")

    def test_distances_without_the_extra_name_the_package(self, monkeypatch: pytest.MonkeyPatch) -> None:
        """What `e2efly render garage` asks for first."""
        monkeypatch.delitem(sys.modules, "e2efly.simulation.scenes.meshes.embree", raising=False)
        monkeypatch.setitem(sys.modules, "embreex.mesh_construction", None)
        with pytest.raises(ValueError, match=r"mesh scenes need the package embreex\S*: pip install 'e2efly\[mesh\]'"):
            DistanceGrid.of(MeshScene.of([box()]), 0.5)

    def test_without_the_extra_the_package_is_named(self) -> None:
        program = (
            "import sys; sys.modules['embreex'] = None\n"
            "from e2efly.simulation.scenes.meshes.load import load_mesh_scene\n"
            "from e2efly.simulation.scenes.meshes.engines import engine\n"
            "engine(load_mesh_scene('garage'))"
        )
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
        assert "mesh scenes need the package embreex" in done.stderr and "pip install 'e2efly[mesh]'" in done.stderr

    @pytest.mark.parametrize("name", mesh_scene_names())
    def test_every_shipped_scene_is_whole_and_the_same_again(self, name: str) -> None:
        scene = load_mesh_scene(name)
        assert 5_000 < len(scene.triangles) < 20_000 and scene.dropped == 0 and len(scene.textures) > 4
        np.testing.assert_array_equal(scene.triangles, load_mesh_scene(name).triangles)
        poses = np.array([[0.0, 0.0, 1.6], [2.0, 0.0, 1.6]])
        images = see(scene, poses, from_euler(jnp.zeros(2), jnp.zeros(2), jnp.array([0.3, 3.0])))
        assert len(np.unique(images["instance"])) > 3 and images["rgb"].std() > 0.05
        assert images["rgb"].min() >= 0 and images["rgb"].max() <= 1


def truth(p: np.ndarray, half: np.ndarray) -> np.ndarray:
    beyond = np.abs(p) - half
    return np.linalg.norm(np.maximum(beyond, 0), axis=-1) + np.minimum(beyond.max(axis=-1), 0)


class TestDistance:
    points = np.random.default_rng(0).uniform(-1.8, 1.8, (4000, 3)).astype(np.float32)

    @pytest.mark.parametrize("cell", [0.1, 0.2])
    def test_is_within_half_a_cell_of_a_sphere_and_a_box(self, cell: float) -> None:
        ball = DistanceGrid.of(MeshScene.of([solid(trimesh.creation.icosphere(4, 1.0))]), cell)
        half = np.array([1.0, 0.6, 0.3])
        brick = DistanceGrid.of(MeshScene.of([box(2 * half)]), cell, 1.6)
        for grid, true in ((ball, np.linalg.norm(self.points, axis=1) - 1), (brick, truth(self.points, half))):
            error = np.abs(np.asarray(clearance(grid, self.points)) - true)
            assert error.max() < 0.5 * cell and np.mean(error) < 0.1 * cell

    def test_gradient_against_differences_and_its_direction(self) -> None:
        grid = DistanceGrid.of(MeshScene.of([solid(trimesh.creation.icosphere(4, 1.0))]), 0.1, 0.5)
        p = jnp.asarray(self.points[:500])
        gradient = np.asarray(jax.grad(lambda p: jnp.sum(clearance(grid, p)))(p))
        numeric = np.stack(
            [(clearance(grid, p + 1e-3 * e) - clearance(grid, p - 1e-3 * e)) / 2e-3 for e in np.eye(3)], axis=1
        )
        assert np.mean(np.abs(gradient - numeric).max(axis=1) < 0.01) > 0.9  # the others cross from cell to cell
        near = np.abs(np.linalg.norm(p, axis=1) - 1) < 0.4
        outward = np.asarray(p / jnp.linalg.norm(p, axis=1, keepdims=True))
        assert np.min(np.sum(gradient * outward, axis=1)[near]) > 0.9

    def test_holes_do_no_harm(self) -> None:
        mesh = trimesh.creation.icosphere(4, 1.0)
        mesh.update_faces((np.arange(len(mesh.faces)) % 10 != 0) & (mesh.triangles_center[:, 2] < 0.8))
        grid = DistanceGrid.of(MeshScene.of([solid(mesh)]), 0.1)
        true = np.linalg.norm(self.points, axis=1) - 1
        clear = np.abs(true) > 0.1
        assert np.mean((np.asarray(clearance(grid, self.points)) < 0)[clear] == (true < 0)[clear]) > 0.98

    def test_a_room_is_free_and_what_stands_in_it_is_not(self) -> None:
        room = trimesh.creation.box((4.0, 4.0, 4.0))
        room.invert()
        things = [box(), box(centre=(0.5, 0.3, 0.4), name="other")]  # one into the other
        grid = DistanceGrid.of(MeshScene.of([solid(room, "wall"), *things]), 0.1)
        inside = (np.abs(self.points).max(axis=1) < 0.5) | (np.abs(self.points - [0.5, 0.3, 0.4]).max(axis=1) < 0.5)
        assert np.mean((np.asarray(clearance(grid, self.points)) < 0) == inside) > 0.995
        assert float(clearance(grid, jnp.array([[2.5, 0.0, 0.0]]))[0]) == pytest.approx(-0.5, abs=0.05)

    def test_outside_of_the_grid_the_way_to_it_is_added(self) -> None:
        grid = DistanceGrid.of(MeshScene.of([box()]), 0.25, 1.0)
        far = jnp.array([[4.5, 0.0, 0.0], [0.0, 0.0, -7.5]])
        np.testing.assert_allclose(clearance(grid, far), [4.0, 7.0], atol=0.05)
        np.testing.assert_allclose(jax.grad(lambda p: clearance(grid, p)[0])(far)[0], [1.0, 0.0, 0.0], atol=1e-5)

    @pytest.mark.parametrize(
        ("about", "told"),
        [
            ({"cell": 0.0}, "cell and margin are 0.0 and 1.0 m; accepted"),
            ({"cell": 0.001}, "cell is 0.001 m: a grid of .*; accepted: from 0.0.* m on"),
            ({"box": ((0, 0, 0), (1, -1, 1))}, "box is .*; accepted: lowest and highest corner"),
            ({"box": ((9, 9, 9), (10, 10, 10))}, "box: there is nothing of the scene in it"),
        ],
    )
    def test_what_is_wrong_is_named(self, about: dict[str, Any], told: str) -> None:
        with pytest.raises(ValueError, match=told):
            DistanceGrid.of(MeshScene.of([box()]), **about)
