"""Worlds of solids as triangles: to look at them elsewhere, and to be checked by other ray casters."""

from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float, Int

from e2efly.scenes.scene import Scene, to_world
from e2efly.scenes.shapes import DISC, SQUARE

GROUND = 500.0
"""Half the side of the square that stands for the ground, m."""


def tessellate(scene: Scene, world: int, segments: int = 64) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Vertices, m, and triangles of one world; round things are inscribed with so many segments around."""
    meshes = []
    ground = float(scene.ground[world])
    if ground > -GROUND:
        corners = GROUND * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) + [0.0, 0.0, ground]
        meshes.append(trimesh.Trimesh(corners, [[0, 1, 2], [0, 2, 3]], process=False))
    for kind in scene.kinds:
        solids = scene.solids[kind]
        turned = np.asarray(to_world(solids)[world], np.float64)
        for i in np.flatnonzero(np.asarray(solids.active[world])):
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = turned[i], solids.centre[world, i]
            for mesh in _meshes(kind, np.asarray(solids.size[world, i], np.float64), segments):
                mesh.apply_transform(pose)
                meshes.append(mesh)
    if not meshes:
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    whole: Any = trimesh.util.concatenate(meshes)
    return np.asarray(whole.vertices), np.asarray(whole.faces)


def _meshes(kind: str, size: np.ndarray, segments: int) -> list[trimesh.Trimesh]:
    create = trimesh.creation
    match kind:
        case "box":
            return [create.box(2 * size[:3])]
        case "sphere":
            return [create.uv_sphere(size[0], count=[segments // 2, segments])]
        case "cylinder":
            return [create.cylinder(size[0], 2 * size[1], sections=segments)]
        case "capsule":
            capsule = create.capsule(2 * size[1], size[0], count=[segments // 2, segments])
            capsule.apply_translation(-capsule.bounds.mean(axis=0))
            return [capsule]
        case "gate":
            width, height, bar, half = size
            bars = []
            for side in (-1, 1):
                upright = create.box([2 * half, bar, 2 * (height + bar)])
                upright.apply_translation([0.0, side * (width + bar / 2), 0.0])
                across = create.box([2 * half, 2 * width, bar])
                across.apply_translation([0.0, 0.0, side * (height + bar / 2)])
                bars += [upright, across]
            return bars
        case _:
            half, height, outline = size[:3]
            if outline == DISC:
                return [create.cylinder(half, 2 * height, sections=segments)]
            if outline == SQUARE:
                return [create.box([2 * half, 2 * half, 2 * height])]
            corners = half * np.array([[-1.0, -1.0], [1.0, -1.0], [0.0, 2.0]]) * [1.0, 1.0 / np.sqrt(3.0)]
            ends = [np.column_stack([corners, np.full(3, z)]) for z in (-height, height)]
            faces = [[0, 2, 1], [3, 4, 5]]
            for a, b in ((0, 1), (1, 2), (2, 0)):
                faces += [[a, b, b + 3], [a, b + 3, a + 3]]
            return [trimesh.Trimesh(np.vstack(ends), faces, process=False)]
