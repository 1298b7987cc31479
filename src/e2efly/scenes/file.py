"""Scene files: one world as TOML, for people to write. docs/vision.md describes the format."""

import dataclasses
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.physics.rotation import from_euler
from e2efly.scenes.scene import CLASSES, USUAL_CLASS, Scene, Solids, join
from e2efly.scenes.shapes import SHAPES
from e2efly.vehicles.names import unknown
from e2efly.vehicles.tables import number, numbers, read_table, shown, text

_NEEDED = {"kind", "centre", "size"}
_MORE = {"roll", "pitch", "yaw", "class", "colour", "path"}
_PATH = {"cosine", "sine", "rate"}


def load_scene(path: Path, n: int = 1) -> Scene:
    """The world of a file, n times over.

    Raises:
        ValueError: naming the file, the solid, the key, the value and what is accepted.
    """
    path = Path(path)
    table = read_table(path)
    if extra := set(table) - {"ground", "solids"}:
        raise ValueError(f"{path}: has {sorted(extra)}; accepted: ground (m, or false for none) and solids")
    ground = table.get("ground", 0.0)
    height = None if ground is False else number(f"{path}: ground", ground, " of metres, or false for none")
    solids: dict[str, list[Solids]] = {}
    listed = table.get("solids", [])
    if not isinstance(listed, list):
        raise ValueError(f"{path}: solids is {shown(listed)}; accepted: a list of tables, each begun by [[solids]]")
    for i, entry in enumerate(listed):
        kind, one = _solid(f"{path}: solids[{i}]", entry)
        solids.setdefault(kind, []).append(one)
    joined = {kind: join(*each) for kind, each in solids.items()}
    scene = Scene.of(joined, 1, height)
    return jax.tree.map(lambda x: jnp.repeat(x, n, axis=0), scene)


def _solid(where: str, entry: Any) -> tuple[str, Solids]:
    if not isinstance(entry, dict) or not _NEEDED <= set(entry) <= _NEEDED | _MORE:
        found = sorted(entry) if isinstance(entry, dict) else shown(entry)
        raise ValueError(f"{where} has {found}; accepted: kind, centre, size, and perhaps {', '.join(sorted(_MORE))}")
    kind = text(f"{where}.kind", entry["kind"])
    if kind not in SHAPES:
        raise ValueError(f"{where}.kind: {unknown('kind', kind, SHAPES)}")
    names = SHAPES[kind].names
    size = numbers(f"{where}.size", entry["size"], len(names), f" ({', '.join(names)})")
    lengths = size[:2] if kind == "pad" else size
    if np.any(lengths <= 0) or (kind == "pad" and size[2] not in (0, 1, 2)):
        raise ValueError(f"{where}.size is {entry['size']}; accepted: positive numbers ({', '.join(names)})")
    label = text(f"{where}.class", entry.get("class", CLASSES[USUAL_CLASS[kind]]))
    if label not in CLASSES:
        raise ValueError(f"{where}.class: {unknown('class', label, CLASSES)}")
    colour = entry.get("colour")
    if colour is not None:
        colour = numbers(f"{where}.colour", colour, 3, " in [0, 1]")
        if np.any((colour < 0) | (colour > 1)):
            raise ValueError(f"{where}.colour is {entry['colour']}; accepted: 3 numbers in [0, 1]")
    centre = numbers(f"{where}.centre", entry["centre"], 3, " of metres")
    one = Solids.of(kind, centre[None, None], size[None, None], label=CLASSES.index(label), colour=colour)
    angles = [
        jnp.full((1, 1), number(f"{where}.{name}", entry.get(name, 0.0), " of degrees"))
        for name in ("roll", "pitch", "yaw")
    ]
    one = dataclasses.replace(one, quaternion=from_euler(*(jnp.radians(angle) for angle in angles)))
    return kind, _on_path(where, one, entry["path"]) if "path" in entry else one


def _on_path(where: str, one: Solids, path: Any) -> Solids:
    if not isinstance(path, dict) or "rate" not in path or not set(path) <= _PATH:
        raise ValueError(f"{where}.path is {shown(path)}; accepted: rate (rad/s), and cosine and sine ([x, y, z], m)")
    ways = [numbers(f"{where}.path.{name}", path.get(name, [0.0] * 3), 3, " of metres") for name in ("cosine", "sine")]
    rate = number(f"{where}.path.rate", path["rate"], " of rad/s")
    cosine, sine = (jnp.asarray(way, jnp.float32)[None, None] for way in ways)
    return dataclasses.replace(one, cosine=cosine, sine=sine, rate=jnp.full((1, 1), rate, jnp.float32))
