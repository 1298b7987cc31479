"""Worlds of solids as triangles, to view them in other programs, and to check them with other ray casters."""

from typing import Any

import numpy as np
import trimesh
from jaxtyping import Float, Int

from e2efly.courses.solids import DISC, SQUARE
from e2efly.simulation.physics.rotation import to_matrix
from e2efly.simulation.scenes.meshes.mesh_scene import MeshPart
from e2efly.simulation.scenes.scene import Scene

GROUND = 500.0
"""Half the side of the square that represents the ground, m."""


def parts(scene: Scene, world: int, segments: int = 64) -> list[MeshPart]:
    """One world as the parts of a `MeshScene`. Round solids are inscribed with `segments` segments around.

    The ground comes first, then the solids in the order of their instance numbers.
    """
    found = []
    ground = float(scene.ground[world])
    if ground > -GROUND:
        corners = GROUND * np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]]) + [0.0, 0.0, ground]
        found.append(MeshPart("ground", corners, np.array([[0, 1, 2], [0, 2, 3]])))
    for kind in scene.kinds:
        solids = scene.solids[kind]
        turned = np.asarray(to_matrix(solids.quaternion[world]), np.float64)
        for i in np.flatnonzero(np.asarray(solids.active[world])):
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = turned[i], solids.centre[world, i]
            mesh: Any = trimesh.util.concatenate(_meshes(kind, np.asarray(solids.size[world, i], np.float64), segments))
            mesh.apply_transform(pose)
            look = {"colour": np.asarray(solids.colour[world, i]), "label": int(solids.label[world, i])}
            found.append(MeshPart(f"{kind} {i}", np.asarray(mesh.vertices), np.asarray(mesh.faces), **look))
    return found


def tessellate(scene: Scene, world: int, segments: int = 64) -> tuple[Float[np.ndarray, "v 3"], Int[np.ndarray, "f 3"]]:
    """Vertices, m, and triangles of one world. Round solids are inscribed, with `segments` segments around."""
    found = parts(scene, world, segments)
    if not found:
        return np.zeros((0, 3)), np.zeros((0, 3), int)
    before = np.cumsum([0] + [len(part.vertices) for part in found[:-1]])
    faces = [part.faces + first for part, first in zip(found, before, strict=True)]
    return np.concatenate([part.vertices for part in found]), np.concatenate(faces)


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
