"""Load mesh scenes by name or from files. docs/meshes.md describes what is read from each format."""

import codecs
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np

from e2efly.config.names import unknown
from e2efly.simulation.scenes.meshes.engine import needed
from e2efly.simulation.scenes.meshes.links import WITHOUT, textured_materials
from e2efly.simulation.scenes.meshes.mesh_scene import MeshPart, MeshScene
from e2efly.simulation.scenes.meshes.procedural import SCENES

FORMATS = (".glb", ".gltf", ".obj", ".ply", ".stl")
"""Extensions of the files that can be read."""
_UP = {".glb": "y", ".gltf": "y", ".obj": "z", ".ply": "z", ".stl": "z"}
_NAMELESS = (".ply", ".stl")
"""Formats whose files contain one object without a name."""
_TURN = {"y": np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]]), "z": np.eye(3)}


def mesh_scene_names() -> list[str]:
    """Names of the scenes that the package makes."""
    return sorted(SCENES)


def load_mesh_scene(
    name_or_path: str | Path, up: Literal["y", "z"] | None = None, unit: float = 1.0, materials: bool = True
) -> MeshScene:
    """Load one of the package's mesh scenes by name, or any scene by the path of its file.

    Args:
        name_or_path: one of `mesh_scene_names`, or a file of one of `FORMATS`.
        up: axis of the file that points up. If left out: y for glTF files, by their rule (the file's -z is north), and
            z for all other files.
        unit: length of the file's unit, m.
        materials: whether the file's colours, materials and textures are used. False: every object has the colour of
            its class, and files of materials and textures may be missing. Geometry and classes are the same.

    Raises:
        ValueError: naming the file, the object or what it refers to, what is wrong and what is accepted; or the package
            that is missing.
    """
    path = Path(name_or_path)
    if path.suffix.lower() not in FORMATS:
        if str(name_or_path) not in SCENES:
            told = unknown("mesh scene", str(name_or_path), SCENES)
            raise ValueError(f"{told}, or the path of a file that ends in {', '.join(FORMATS)}")
        if (up, unit, materials) != (None, 1.0, True):
            raise ValueError(
                f"mesh scene {name_or_path!r} is the package's; accepted: unit, up and materials of a file"
            )
        return MeshScene.of(SCENES[str(name_or_path)]())
    if not path.is_file():
        raise ValueError(f"{path}: there is no such file; accepted: the path of a {', '.join(FORMATS)} file")
    if up not in (None, "y", "z"):
        raise ValueError(f"up is {up!r}; accepted: 'y', 'z'")
    if not (np.isfinite(unit) and unit > 0):
        raise ValueError(f"unit is {unit}; accepted: a positive number of metres")
    turn = unit * _TURN[up or _UP[path.suffix.lower()]]
    textured = textured_materials(path, materials)
    try:
        return MeshScene.of(list(_parts(path, turn, textured if materials else None)))
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _parts(path: Path, turn: np.ndarray, textured: set[str] | None) -> Iterator[MeshPart]:
    """The file's objects. `textured`: names of the materials that have a texture. None: no materials."""
    scene = _opened(path, textured is not None)
    objects = _objects(path)
    for node in scene.graph.nodes_geometry:
        pose, name = scene.graph[node]
        mesh = scene.geometry[name]
        named = _object(scene, node, name, mesh, objects) if path.suffix.lower() not in _NAMELESS else path.stem
        if not hasattr(mesh, "faces"):
            raise ValueError(
                f"object {named!r} has no triangles; accepted: surfaces (a point cloud needs meshing first)"
            )
        vertices = (mesh.vertices @ pose[:3, :3].T + pose[:3, 3]) @ turn.T
        faces = np.asarray(mesh.faces)
        if np.linalg.det(pose[:3, :3]) < 0:
            faces = faces[:, ::-1]
        try:
            yield MeshPart(named, vertices, faces, **({} if textured is None else _look(mesh, textured)))
        except ValueError as error:
            raise ValueError(f"object {named!r}: {error}") from None


def _opened(path: Path, materials: bool) -> Any:
    with needed("mesh"):
        import PIL.Image  # noqa: F401 - without it, trimesh leaves textures out
        import trimesh
        from trimesh.resolvers import FilePathResolver
    kind = path.suffix.lower()
    options: dict[str, Any] = {} if materials or kind == ".stl" else {"skip_materials": True}
    try:
        if kind == ".obj":  # without a byte-order mark, which would hide its first line
            text = io.BytesIO(path.read_bytes().removeprefix(codecs.BOM_UTF8))
            options |= {"split_objects": True, "file_type": "obj", "resolver": FilePathResolver(str(path))}
            return trimesh.load_scene(text, process=False, **options)
        return trimesh.load_scene(path, process=False, **options)
    except Exception as error:  # any error of a parser in a broken file
        raise ValueError(f"not a readable {path.suffix} file: {type(error).__name__}: {error}") from None


def _objects(path: Path) -> list[str]:
    """Names of an OBJ file's objects, longest first."""
    if path.suffix.lower() != ".obj":
        return []
    lines = path.read_text(encoding="utf-8-sig", errors="replace").splitlines()
    return sorted({line[2:].strip() for line in lines if line.startswith("o ")}, key=len, reverse=True)


def _object(scene: Any, node: str, name: str, mesh: Any, objects: list[str]) -> str:
    """Name of the object to which a piece belongs. An object has one piece for each of its materials."""
    if mesh.metadata.get("from_gltf_primitive"):
        return scene.graph.transforms.parents[node]
    return next((known for known in objects if name == known or name.startswith(f"{known}_")), node)


def _look(mesh: Any, textured: set[str]) -> dict[str, Any]:
    """Colours, texture and texture coordinates, in the form that a `Part` takes."""
    visual = mesh.visual
    if visual.kind != "texture":
        if not visual.defined:
            return {}
        by_face = visual.kind == "face"
        return {"colour": visual.face_colors[:, None, :3] / 255 if by_face else visual.vertex_colors[:, :3] / 255}
    material = visual.material
    simple = not hasattr(material, "baseColorTexture")
    image = material.image if simple else material.baseColorTexture
    factor = material.diffuse if simple else material.baseColorFactor
    if image is None:
        if (material.name or "") in textured:
            raise ValueError(
                f"the texture of material {material.name!r} cannot be read; accepted: PNG, JPEG, no spaces in the "
                f"name; or {WITHOUT}"
            )
        colour = np.ones(3) if factor is None else np.asarray(factor)[:3] / 255
        return {"colour": colour * _tint(visual)}
    try:
        texels = np.asarray(image.convert("RGB"))
    except OSError as error:
        raise ValueError(
            f"the texture of material {material.name!r} cannot be read: {error}; accepted: PNG, JPEG; or {WITHOUT}"
        ) from None
    tint = 1.0 if simple or factor is None else np.asarray(factor)[:3] / 255
    uv = None if visual.uv is None else np.asarray(visual.uv, np.float64)
    return {"texture": texels, "uv": uv, "colour": np.ones(3) * tint * _tint(visual)}


def _tint(visual: Any) -> Any:
    """Vertex colours that exist in addition to a material."""
    colour = visual.vertex_attributes.get("color")
    if colour is None:
        return 1.0
    colour = np.asarray(colour)
    return colour[:, :3] / (np.iinfo(colour.dtype).max if colour.dtype.kind == "u" else 1)
