"""Scene files: one world of solids as TOML, written by hand, as docs/vision.md describes it. Imports no JAX."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.config.names import unknown
from e2efly.config.tables import number, numbers, read_table, shown, text

SIZES = {
    "box": ("half x", "half y", "half z"),
    "sphere": ("radius",),
    "cylinder": ("radius", "half length"),
    "capsule": ("radius", "half length"),
    "gate": (
        "half width of the opening", "half height of the opening", "width of the bars", "half depth of the bars",
    ),
    "pad": ("half width", "half height", "outline: 0 disc, 1 square, 2 triangle"),
}  # fmt: skip
"""Meaning of the size entries of each kind of solid, in m unless noted. Lengths are along the local z axis. A gate is
flown through along its x axis."""
DISC, SQUARE, TRIANGLE = 0, 1, 2
"""Outlines of a pad."""
CLASSES = ("sky", "ground", "obstacle", "gate", "pad", "wall", "vehicle")
"""Semantic classes."""
USUAL_CLASS = dict.fromkeys(SIZES, "obstacle") | {"gate": "gate", "pad": "pad"}
"""Class of each kind of solid, unless another is given."""
_NEEDED = {"kind", "centre", "size"}
_MORE = {"roll", "pitch", "yaw", "class", "colour", "path"}
_PATH = {"cosine", "sine", "rate"}


@dataclass(frozen=True)
class Orbit:
    """The path of a moving solid: centre + cosine cos(rate t) + sine sin(rate t)."""

    cosine: np.ndarray
    """(3,) world, m."""
    sine: np.ndarray
    rate: float
    """rad/s."""


@dataclass(frozen=True)
class Solid:
    """One solid of a file."""

    kind: str
    """A name of `SIZES`."""
    centre: np.ndarray
    """(3,) world, m."""
    size: np.ndarray
    """Values whose meaning is given by `SIZES`."""
    angles: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Roll, pitch, yaw of its frame, rad."""
    label: str = "obstacle"
    """A name of `CLASSES`."""
    colour: np.ndarray | None = None
    """(3,) RGB in [0, 1]. None: the default colour of its class."""
    path: Orbit | None = None
    """None: the solid does not move."""


def read_solids(path: Path) -> tuple[float | None, list[Solid]]:
    """The height of the ground in a file, m (None: no ground), and the solids of the file.

    Raises:
        ValueError: naming the file, the solid, the key, the value and what is accepted.
    """
    path = Path(path)
    table = read_table(path)
    if extra := set(table) - {"ground", "solids"}:
        raise ValueError(f"{path}: has {sorted(extra)}; accepted: ground (m, or false for none) and solids")
    ground = table.get("ground", 0.0)
    height = None if ground is False else number(f"{path}: ground", ground, " of metres, or false for none")
    listed = table.get("solids", [])
    if not isinstance(listed, list):
        raise ValueError(f"{path}: solids is {shown(listed)}; accepted: a list of tables, each begun by [[solids]]")
    return height, [_solid(f"{path}: solids[{i}]", entry) for i, entry in enumerate(listed)]


def _solid(where: str, entry: Any) -> Solid:
    if not isinstance(entry, dict) or not _NEEDED <= set(entry) <= _NEEDED | _MORE:
        found = sorted(entry) if isinstance(entry, dict) else shown(entry)
        raise ValueError(f"{where} has {found}; accepted: kind, centre, size, and perhaps {', '.join(sorted(_MORE))}")
    kind = text(f"{where}.kind", entry["kind"])
    if kind not in SIZES:
        raise ValueError(f"{where}.kind: {unknown('kind', kind, SIZES)}")
    names = SIZES[kind]
    size = numbers(f"{where}.size", entry["size"], len(names), f" ({', '.join(names)})")
    lengths = size[:2] if kind == "pad" else size
    if np.any(lengths <= 0) or (kind == "pad" and size[2] not in (DISC, SQUARE, TRIANGLE)):
        raise ValueError(f"{where}.size is {entry['size']}; accepted: positive numbers ({', '.join(names)})")
    label = text(f"{where}.class", entry.get("class", USUAL_CLASS[kind]))
    if label not in CLASSES:
        raise ValueError(f"{where}.class: {unknown('class', label, CLASSES)}")
    colour = entry.get("colour")
    if colour is not None:
        colour = numbers(f"{where}.colour", colour, 3, " in [0, 1]")
        if np.any((colour < 0) | (colour > 1)):
            raise ValueError(f"{where}.colour is {entry['colour']}; accepted: 3 numbers in [0, 1]")
    centre = numbers(f"{where}.centre", entry["centre"], 3, " of metres")
    roll, pitch, yaw = (
        math.radians(number(f"{where}.{name}", entry.get(name, 0.0), " of degrees"))
        for name in ("roll", "pitch", "yaw")
    )
    path = _path(where, entry["path"]) if "path" in entry else None
    return Solid(kind, centre, size, (roll, pitch, yaw), label, colour, path)


def _path(where: str, path: Any) -> Orbit:
    if not isinstance(path, dict) or "rate" not in path or not set(path) <= _PATH:
        raise ValueError(f"{where}.path is {shown(path)}; accepted: rate (rad/s), and cosine and sine ([x, y, z], m)")
    cosine, sine = (
        numbers(f"{where}.path.{name}", path.get(name, [0.0] * 3), 3, " of metres") for name in ("cosine", "sine")
    )
    return Orbit(cosine, sine, number(f"{where}.path.rate", path["rate"], " of rad/s"))
