"""Checks of the other files and objects that mesh files refer to.

`trimesh` ignores missing ones, these checks do not.
"""

import json
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from e2efly.config.tables import shown

WITHOUT = "materials=False (--no-scene-materials), which leaves out materials and gives every object its class's colour"
"""What can be done about a file whose materials are not complete."""

_PLAIN = ("KHR_materials_", "KHR_mesh_quantization", "KHR_texture_transform", "KHR_lights_punctual", "EXT_texture_webp")
"""Beginnings of the names of glTF extensions that a file may require. The triangles are correct without them."""
_TEXTURES = ("KHR_texture_", "EXT_texture_")
"""The same for the extensions that matter to textures alone."""

_KINDS = {dict: "an object", list: "a list", str: "a text", int: "a whole number"}
"""Names of these types in JSON."""


def textured_materials(path: Path, materials: bool = True) -> set[str]:
    """Names of the materials of a file that have a texture, after a check that everything the file refers to exists.

    Without `materials`, only what triangles need is looked for.

    Raises:
        ValueError: naming the file, the missing item, and what is accepted.
    """
    match path.suffix.lower():
        case ".obj":
            return _obj(path) if materials else set()
        case ".ply":
            return _ply(path) if materials else set()
        case ".stl":
            return set()  # the file has no materials
        case _:
            return _gltf(path, materials)


def _there(path: Path, what: str, name: str, remedy: str = f"; or {WITHOUT}") -> Path:
    folder = path.parent.resolve()
    other = (folder / name.replace("\\", "/")).resolve()
    if not other.is_relative_to(folder) or not other.is_file():
        raise ValueError(
            f"{path}: {what} {name!r} is missing; accepted: a file in the folder of the mesh or below it{remedy}"
        )
    return other


def _words(path: Path) -> Iterator[tuple[str, str]]:
    for line in path.read_text(encoding="utf-8-sig", errors="replace").splitlines():
        word, _, rest = line.strip().partition(" ")
        yield word.lower(), rest.strip()


def _obj(path: Path) -> set[str]:
    libraries, used = [], set()
    for word, rest in _words(path):
        if word == "mtllib":
            libraries.append(rest)
        elif word == "usemtl":
            used.add(rest)
    if len(libraries) > 1:
        raise ValueError(f"{path}: mtllib names {libraries}; accepted: one file of materials; or {WITHOUT}")
    known, textured, name = set(), set(), ""
    for library in libraries:
        for word, rest in _words(_there(path, "the file of materials", library)):
            if word == "newmtl":
                name = rest
                known.add(name)
            elif word == "map_kd":
                _there(path, f"material {name!r}: the texture", rest)
                textured.add(name)
    if lost := sorted(used - known):
        accepted = sorted(known) or "a file, by mtllib"
        raise ValueError(f"{path}: the material {lost[0]!r} is missing; accepted: {accepted}; or {WITHOUT}")
    return textured & used


def _ply(path: Path) -> set[str]:
    with path.open("rb") as file:
        for raw in file:
            words = raw.decode("utf-8", errors="replace").strip().split(maxsplit=2)
            if len(words) == 3 and words[0] == "comment" and words[1].lower() == "texturefile":
                _there(path, "the texture", words[2])
                return {""}
            if words == ["end_header"]:
                break
    return set()


def _gltf(path: Path, wanted: bool) -> set[str]:
    header = _header(path)
    names = _listed(path, header, "extensionsRequired", str)
    if required := [name for name in names if not name.startswith(_PLAIN if wanted else (*_PLAIN, *_TEXTURES))]:
        way = f"; or {WITHOUT}" if all(name.startswith(_TEXTURES) for name in required) else ""
        raise ValueError(
            f"{path}: requires {', '.join(required)}; accepted: files without compression of that kind{way}"
        )
    for kind in ("buffers", "images") if wanted else ("buffers",):
        for i, entry in enumerate(_listed(path, header, kind)):
            uri = _of_kind(path, f"{kind}[{i}].uri", entry.get("uri", "data:"), str)
            if not uri.startswith("data:"):
                _there(path, f"the {kind[:-1]}", unquote(uri), "" if kind == "buffers" else f"; or {WITHOUT}")
    for i, mesh in enumerate(_listed(path, header, "meshes")):
        modes = {
            _of_kind(path, f"meshes[{i}].primitives[{k}].mode", primitive.get("mode", 4), int)
            for k, primitive in enumerate(_listed(path, mesh, "primitives", at=f"meshes[{i}]."))
        }
        if other := modes - {4, 5}:
            name = mesh.get("name", "")
            raise ValueError(
                f"{path}: mesh {name!r} has primitives of mode {sorted(other)}; accepted: 4 (triangles) and 5"
            )
    textured = set()
    if not wanted:
        return textured
    for i, material in enumerate(_listed(path, header, "materials")):
        name = _of_kind(path, f"materials[{i}].name", material.get("name", ""), str)
        look = material.get("pbrMetallicRoughness", {})
        if "baseColorTexture" in _of_kind(path, f"materials[{i}].pbrMetallicRoughness", look, dict):
            textured.add(name)
    return textured


def _listed(path: Path, table: dict[str, Any], key: str, kind: type = dict, at: str = "") -> list[Any]:
    """The entries of a list in the JSON, all of one type. Empty if the list does not exist."""
    entries = _of_kind(path, at + key, table.get(key, []), list)
    return [_of_kind(path, f"{at}{key}[{i}]", entry, kind) for i, entry in enumerate(entries)]


def _of_kind(path: Path, where: str, value: Any, kind: type) -> Any:
    if type(value) is not kind:
        raise ValueError(f"{path}: {where} is {shown(value)}; accepted: {_KINDS[kind]}")
    return value


def _header(path: Path) -> dict[str, Any]:
    raw = path.read_bytes()
    try:
        if path.suffix.lower() == ".glb":
            magic, _, _, length, kind = struct.unpack("<4sII I4s", raw[:20])
            if magic != b"glTF" or kind != b"JSON":
                raise ValueError("its first bytes are not those of glTF")
            raw = raw[20 : 20 + length]
        header = json.loads(raw)
    except (struct.error, ValueError, RecursionError) as error:
        raise ValueError(f"{path}: not a {path.suffix} file: {error}") from None
    return _of_kind(path, "its JSON", header, dict)
