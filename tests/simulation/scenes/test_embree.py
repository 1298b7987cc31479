"""Another engine's word: Embree on triangles of the same worlds."""

import jax.numpy as jnp
import numpy as np
import pytest
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from e2efly.config import CameraConfig
from e2efly.simulation.scenes import camera
from e2efly.simulation.scenes.cast import cast
from e2efly.simulation.scenes.mesh import tessellate
from e2efly.simulation.scenes.scene import Scene
from e2efly.simulation.scenes.shapes import FAR
from tests.simulation.scenes.test_cast import LEVEL, crowd

WORLDS = 6
CONFIG = CameraConfig(width=64, height=64, fov=(1.4, 1.4))


def by_embree(scene: Scene, world: int, origin: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Depth along each ray, and normals."""
    vertices, faces = tessellate(scene, world, 256)
    rays = EmbreeScene()
    mesh = TriangleMesh(rays, vertices.astype(np.float32)[faces])
    starts = np.ascontiguousarray(np.broadcast_to(origin, directions.shape), np.float32)
    found = rays.run(starts, np.ascontiguousarray(directions, np.float32), output=1)
    del mesh
    hit = found["primID"] >= 0
    normal = np.where(hit[:, None], found["Ng"], 0.0)
    return np.where(hit, found["tfar"], FAR), normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)


@pytest.mark.whole
def test_embree_sees_the_same_depth_and_normals() -> None:
    scene = crowd(WORLDS, 7)
    position = jnp.tile(jnp.array([[0.0, 0.0, 2.0]]), (WORLDS, 1))
    mount, pattern = camera.mount(CONFIG, WORLDS), camera.pattern(CONFIG)
    origin, matrix = camera.pose(mount, position, jnp.tile(LEVEL, (WORLDS, 1)))
    images = cast(scene, origin, matrix, pattern, ("depth", "normal", "label"))
    same, alike, hits = [], [], []
    for world in range(WORLDS):
        directions = pattern.directions.reshape(-1, 3) @ np.asarray(matrix[world]).T
        depth, normal = by_embree(scene, world, np.asarray(origin[world]), directions)
        mine, my_normal = np.asarray(images["depth"][world]).ravel(), np.asarray(images["normal"][world]).reshape(-1, 3)
        near = (mine < 30) | (depth < 30)
        same.append((np.abs(mine - depth) < 1e-3)[near])
        alike.append((np.abs(np.sum(my_normal * normal, axis=1)) > 0.99)[near & (np.abs(mine - depth) < 1e-3)])
        hits.append(np.mean(np.asarray(images["label"][world]) > 1))
    assert 0.1 < np.mean(hits) < 0.9
    assert np.mean(np.concatenate(same)) > 0.998
    assert np.mean(np.concatenate(alike)) > 0.998


def test_triangles_enclose_the_volume_of_the_solids() -> None:
    scene = crowd(1)
    for kind, volume in {
        "box": lambda s: 8 * s[0] * s[1] * s[2],
        "sphere": lambda s: 4 / 3 * np.pi * s[0] ** 3,
        "cylinder": lambda s: 2 * np.pi * s[0] ** 2 * s[1],
        "capsule": lambda s: 2 * np.pi * s[0] ** 2 * s[1] + 4 / 3 * np.pi * s[0] ** 3,
        "gate": lambda s: 8 * s[3] * ((s[0] + s[2]) * (s[1] + s[2]) - s[0] * s[1]),
    }.items():
        solids = scene.solids[kind]
        vertices, faces = tessellate(Scene.of({kind: solids}, 1, ground=None), 0, 256)
        expected = sum(volume(np.asarray(size)) for size in solids.size[0])
        np.testing.assert_allclose(trimesh.Trimesh(vertices, faces).volume, expected, rtol=3e-3, err_msg=kind)
