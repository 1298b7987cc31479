"""Scene files: one world as TOML, for people to write. docs/vision.md describes the format."""

import dataclasses
import math
import tomllib
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.physics.rotation import from_euler
from e2efly.scenes.scene import CLASSES, Scene, Solids, join
from e2efly.scenes.shapes import SHAPES
from e2efly.vehicles.names import unknown

_NEEDED = {"kind", "centre", "size"}
_MORE = {"roll", "pitch", "yaw", "class", "colour", "path"}
_PATH = {"cosine", "sine", "rate"}


def load_scene(path: Path, n: int = 1) -> Scene:
    """N copies of the world in a file.

    Raises:
        ValueError: naming the file, the solid, the key, the value and what is accepted.
    """
    try:
        table = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not a TOML file: {error}") from None
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}; accepted: the path of a .toml file") from None
    if extra := set(table) - {"ground", "solids"}:
        raise ValueError(f"{path}: has {sorted(extra)}; accepted: ground (m, or false for none) and solids")
    ground = table.get("ground", 0.0)
    if ground is True or not isinstance(ground, bool | int | float) or not math.isfinite(ground):
        raise ValueError(f"{path}: ground is {ground!r}; accepted: a height in m, or false for none")
    solids: dict[str, list[Solids]] = {}
    listed = table.get("solids", [])
    if not isinstance(listed, list):
        raise ValueError(f"{path}: solids is {listed!r}; accepted: a list of tables, each begun by [[solids]]")
    for i, entry in enumerate(listed):
        kind, one = _solid(f"{path}: solids[{i}]", entry)
        solids.setdefault(kind, []).append(one)
    joined = {kind: join(*each) for kind, each in solids.items()}
    scene = Scene.of(joined, 1, None if ground is False else float(ground))
    return jax.tree.map(lambda x: jnp.repeat(x, n, axis=0), scene)


def _solid(where: str, entry: Any) -> tuple[str, Solids]:
    if not isinstance(entry, dict) or not _NEEDED <= set(entry) <= _NEEDED | _MORE:
        found = sorted(entry) if isinstance(entry, dict) else entry
        raise ValueError(f"{where} has {found}; accepted: kind, centre, size, and perhaps {', '.join(sorted(_MORE))}")
    kind = entry["kind"]
    if kind not in SHAPES:
        raise ValueError(f"{where}.kind: {unknown('kind', str(kind), SHAPES)}")
    names = SHAPES[kind].names
    size = _numbers(f"{where}.size", entry["size"], len(names), f" ({', '.join(names)})")
    lengths = size[:2] if kind == "pad" else size
    if np.any(lengths <= 0) or (kind == "pad" and size[2] not in (0, 1, 2)):
        raise ValueError(f"{where}.size is {entry['size']}; accepted: positive numbers ({', '.join(names)})")
    label = entry.get("class", {"gate": "gate", "pad": "pad"}.get(kind, "obstacle"))
    if label not in CLASSES:
        raise ValueError(f"{where}.class: {unknown('class', str(label), CLASSES)}")
    colour = entry.get("colour")
    if colour is not None:
        colour = _numbers(f"{where}.colour", colour, 3, " in [0, 1]")
        if np.any((colour < 0) | (colour > 1)):
            raise ValueError(f"{where}.colour is {entry['colour']}; accepted: 3 numbers in [0, 1]")
    centre = _numbers(f"{where}.centre", entry["centre"], 3, " of metres")
    one = Solids.of(kind, centre[None, None], size[None, None], label=CLASSES.index(label), colour=colour)
    angles = [
        jnp.full((1, 1), float(_numbers(f"{where}.{name}", entry.get(name, 0.0), None, " of degrees")))
        for name in ("roll", "pitch", "yaw")
    ]
    one = dataclasses.replace(one, quaternion=from_euler(*(jnp.radians(angle) for angle in angles)))
    return kind, _on_path(where, one, entry["path"]) if "path" in entry else one


def _on_path(where: str, one: Solids, path: Any) -> Solids:
    if not isinstance(path, dict) or "rate" not in path or not set(path) <= _PATH:
        raise ValueError(f"{where}.path is {path!r}; accepted: rate (rad/s), and cosine and sine ([x, y, z], m)")
    ways = [_numbers(f"{where}.path.{name}", path.get(name, [0.0] * 3), 3, " of metres") for name in ("cosine", "sine")]
    rate = _numbers(f"{where}.path.rate", path["rate"], None, " of rad/s")
    cosine, sine = (jnp.asarray(way, jnp.float32)[None, None] for way in ways)
    return dataclasses.replace(one, cosine=cosine, sine=sine, rate=jnp.full((1, 1), float(rate), jnp.float32))


def _numbers(where: str, value: Any, count: int | None, what: str) -> np.ndarray:
    items = value if isinstance(value, list) else [value]
    good = isinstance(value, list) == (count is not None) and len(items) == (count or 1)
    if not good or not all(type(x) in (int, float) and math.isfinite(x) for x in items):
        raise ValueError(
            f"{where} is {value!r}; accepted: {'a finite number' if count is None else f'{count} finite numbers'}{what}"
        )
    return np.asarray(value, np.float64)
