"""The digital prototype: mass, centre of mass and inertia of a vehicle from a list of its parts.

The paper takes the inertia from a model of all parts (E2E-Fly, system identification). Each part is a body of uniform
density. Its inertia about the vehicle's centre of mass follows from the parallel-axis theorem.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.alignment.estimates import Estimate
from e2efly.alignment.purchases import Purchase, check_keys, read_ground, read_purchase
from e2efly.config.names import unknown
from e2efly.config.tables import number, numbers, read_table, shown, text
from e2efly.control import Quat, Vec3

DRAWS = 4000
"""Number of draws of the Monte Carlo simulation over the tolerances. It gives a standard deviation within 1.1 %."""
_KEYS = {
    "name", "shape", "size", "mass", "place", "angles", "tolerance", "file", "battery", "price_usd", "date", "source",
    "estimate",
}  # fmt: skip
_TOLERANCES = {"mass", "size", "place"}


@dataclass(frozen=True)
class Part:
    """One kind of part, at one or several places."""

    name: str
    shape: str
    """A name of `SHAPES`, or mesh."""
    size: np.ndarray
    """Dimensions of the shape, m. For a mesh, the factor on its coordinates."""
    mass: float
    """Mass of one part, kg."""
    places: np.ndarray
    """Positions of the centres (for a mesh: of its origin), body axes FLU, any common origin, (n, 3) m."""
    turn: np.ndarray
    """Rotation matrix from the part's own axes to the body axes, (3, 3)."""
    mass_sigma: float
    """Standard deviation of the mass, kg."""
    size_sigma: float
    """Standard deviation of each dimension, m. For a mesh, of the factor."""
    place_sigma: float
    """Standard deviation of the position, m per axis."""
    purchase: Purchase
    """Where to buy it, and where its numbers come from."""
    battery: bool = False
    """Whether it is the battery."""
    unit: tuple[np.ndarray, np.ndarray] | None = None
    """For a mesh at factor 1: its centre of mass, m, and its inertia about that point divided by its mass, m^2."""


@dataclass(frozen=True)
class Prototype:
    """Mass, centre of mass and inertia of a list of parts, with standard deviations."""

    mass: float
    """Mass, kg."""
    mass_sigma: float
    centre: np.ndarray
    """Centre of mass, relative to the origin of the list, FLU, (3,) m."""
    inertia: np.ndarray
    """Inertia about the centre of mass, body axes, (3, 3) kg*m^2."""
    inertia_sigma: np.ndarray


def _box(size: np.ndarray) -> np.ndarray:
    x, y, z = np.moveaxis(size**2, -1, 0)
    return np.stack([y + z, x + z, x + y], -1) / 12


def _cylinder(size: np.ndarray) -> np.ndarray:
    radius, height = size[..., 0] / 2, size[..., 1]
    across = (3 * radius**2 + height**2) / 12
    return np.stack([across, across, radius**2 / 2], -1)


def _tube(size: np.ndarray) -> np.ndarray:
    outer, inner, height = size[..., 0] / 2, size[..., 1] / 2, size[..., 2]
    square = outer**2 + inner**2
    across = (3 * square + height**2) / 12
    return np.stack([across, across, square / 2], -1)


def _sphere(size: np.ndarray) -> np.ndarray:
    return np.repeat((size / 2) ** 2 * 0.4, 3, -1)


SHAPES: dict[str, tuple[str, Callable[[np.ndarray], np.ndarray]]] = {
    "box": ("length, width, height", _box),
    "cylinder": ("diameter, height", _cylinder),
    "tube": ("outer diameter, inner diameter, height", _tube),
    "sphere": ("diameter", _sphere),
}
"""For each shape, the entries of `size`, and the function that computes from them the inertia about the centre divided
by the mass, m^2. The axis of cylinders and tubes is their own z axis."""


def prototype(parts: tuple[Part, ...]) -> Prototype:
    """Combine the parts. The standard deviations come from a Monte Carlo simulation over the tolerances, which are
    assumed to be independent.
    """
    rng = np.random.default_rng(0)
    one = tuple(x[0] for x in _add(parts, np.zeros, 1))
    drawn = [x.std(0) for x in _add(parts, rng.standard_normal, DRAWS)]
    return Prototype(float(one[0]), float(drawn[0]), one[1], one[2], drawn[2])


def _add(
    parts: tuple[Part, ...], error: Callable[[tuple[int, ...]], np.ndarray], draws: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mass, centre of mass and inertia of the whole, for `draws` draws. In each, every part deviates by `error` times
    its tolerances.
    """
    masses, places, inertias = [], [], np.zeros((draws, 3, 3))
    for part in parts:
        for place in part.places:
            mass = np.maximum(part.mass + part.mass_sigma * error((draws,)), 0.0)
            size = np.maximum(part.size + part.size_sigma * error((draws, len(part.size))), 0.0)
            if part.unit is None:
                own, centre = SHAPES[part.shape][1](size)[:, :, None] * np.eye(3), np.zeros((draws, 3))
            else:
                own, centre = part.unit[1] * size[:, :, None] ** 2, part.unit[0] * size
            masses.append(mass)
            places.append(place + part.place_sigma * error((draws, 3)) + centre @ part.turn.T)
            inertias += mass[:, None, None] * (part.turn @ own @ part.turn.T)
    m, r = np.stack(masses), np.stack(places)
    centre = np.einsum("nd,ndi->di", m, r) / m.sum(0)[:, None]
    d = r - centre
    steiner = np.einsum("nd,ndk,ndk->d", m, d, d)[:, None, None] * np.eye(3) - np.einsum("nd,ndi,ndj->dij", m, d, d)
    return m.sum(0), centre, inertias + steiner


def estimates(path: Path, centre: bool = False) -> list[Estimate]:
    """Mass and inertia of a vehicle from its list of parts.

    With `centre`, also its centre of mass forward and left of the list's origin, which must be the middle between the
    rotors. Its height is left at 0: where the drag acts is not known.

    Raises:
        ValueError: as for `read_parts`.
    """
    found, source = prototype(read_parts(path)), f"{path.name}, parts list"
    placed = Estimate("centre_of_mass", found.centre * [1.0, 1.0, 0.0], np.full(3, np.nan), source)
    return [
        Estimate("mass", np.array(found.mass), np.array(found.mass_sigma), source),
        Estimate("inertia", np.diag(found.inertia), np.diag(found.inertia_sigma), source),
        *([placed] if centre else []),
    ]


def read_parts(path: Path) -> tuple[Part, ...]:
    """A list of parts from a TOML file: tables `[[part]]` (docs/identification.md).

    Raises:
        ValueError: naming the file, the part, the key, the value and what is accepted.
    """
    listed = _listed(path)["part"]
    return tuple(_part(f"{path}: part {i}", entry, path.parent) for i, entry in enumerate(listed, 1))


def read_on_the_ground(path: Path) -> tuple[Purchase, ...]:
    """What a list of parts names beside the vehicle: tables `[[ground]]`. Errors are as for `read_parts`."""
    listed = _listed(path)["ground"]
    return tuple(read_ground(f"{path}: ground {i}", entry) for i, entry in enumerate(listed, 1))


def _listed(path: Path) -> dict[str, list[Any]]:
    table = {"ground": [], **read_table(path)}
    lists = all(isinstance(entries, list) for entries in table.values())
    if set(table) != {"part", "ground"} or not lists or not table["part"]:
        found = ", ".join(key for key in table if table[key]) or "none"
        raise ValueError(f"{path}: has the keys {found}; accepted: tables [[part]], one or more, and [[ground]]")
    return table


def _part(where: str, entry: Any, folder: Path) -> Part:
    check_keys(where, entry, "part", _KEYS)
    if missing := [key for key in ("name", "shape", "mass", "place") if key not in entry]:
        raise ValueError(f"{where}: missing key {', '.join(map(repr, missing))}")
    name = text(f"{where}: name", entry["name"])
    where = f"{where} ({name})"
    shape = text(f"{where}: shape", entry["shape"])
    if shape != "mesh" and shape not in SHAPES:
        raise ValueError(f"{where}: {unknown('shape', shape, [*SHAPES, 'mesh'])}")
    tolerance = entry.get("tolerance", {})
    if not isinstance(tolerance, dict) or set(tolerance) - _TOLERANCES:
        raise ValueError(f"{where}: tolerance is {shown(tolerance)}; accepted: a table of {', '.join(_TOLERANCES)}")
    off = {key: _at_least(f"{where}: tolerance.{key}", value, 0.0) for key, value in tolerance.items()}
    unit = None
    if shape == "mesh":
        size = np.array([positive(f"{where}: size", entry.get("size", 1.0))])
        unit = _mesh(where, folder / text(f"{where}: file", entry.get("file", "")))
    else:
        if "file" in entry:
            raise ValueError(f"{where}: file is {shown(entry['file'])}; accepted only where shape is 'mesh'")
        size = _size(where, shape, entry.get("size"))
    battery = entry.get("battery", False)
    if type(battery) is not bool:
        raise ValueError(f"{where}: battery is {shown(battery)}; accepted: true or false")
    places = _places(where, entry["place"])
    return Part(
        name, shape, size, positive(f"{where}: mass", entry["mass"]), places,
        _turn(numbers(f"{where}: angles", entry.get("angles", [0.0, 0.0, 0.0]), 3, " of radians")),
        off.get("mass", 0.0), off.get("size", 0.0), off.get("place", 0.0),
        read_purchase(where, entry, len(places)), battery, unit,
    )  # fmt: skip


def _size(where: str, shape: str, given: Any) -> np.ndarray:
    what = SHAPES[shape][0]
    count = what.count(",") + 1
    size = numbers(
        f"{where}: size", [given] if count == 1 and not isinstance(given, list) else given, count, f": {what}, m"
    )
    if np.any(size < 0) or size[0] == 0 or (shape == "tube" and size[1] >= size[0]):
        raise ValueError(f"{where}: size is {shown(given)}; accepted: {what}, m, positive, and no tube without a wall")
    return size


def _places(where: str, given: Any) -> np.ndarray:
    several = isinstance(given, list) and bool(given) and isinstance(given[0], list)
    listed = given if several else [given]
    return np.stack([numbers(f"{where}: place", place, 3, " of metres") for place in listed])


def _at_least(where: str, given: Any, low: float) -> float:
    value = number(where, given)
    if value < low:
        raise ValueError(f"{where} is {shown(given)}; accepted: {low:g} or more")
    return value


def positive(where: str, given: Any) -> float:
    """A number above zero.

    Raises:
        ValueError: naming the place, the value and what is accepted.
    """
    value = number(where, given)
    if value <= 0:
        raise ValueError(f"{where} is {shown(given)}; accepted: a number above 0")
    return value


def _turn(angles: np.ndarray) -> np.ndarray:
    """The rotation matrix for roll, pitch and yaw, rad."""
    axes = Vec3(*np.eye(3))
    return Quat.of_euler(*angles).rotate(axes).stack().T


def _mesh(where: str, path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Centre of mass, m, and inertia divided by mass, m^2, of a closed mesh of uniform density."""
    if not path.is_file():
        raise ValueError(f"{where}: file {str(path)!r} does not exist; accepted: a mesh that trimesh reads")
    try:
        import trimesh
    except ImportError as error:
        raise ValueError(f"{where}: trimesh is missing ({error}); accepted: pip install 'e2efly[mesh]'") from None
    try:
        mesh: Any = trimesh.load(path, force="mesh")
    except Exception as error:  # readers of many formats raise many types
        raise ValueError(f"{where}: {path} is no mesh that trimesh reads ({error})") from None
    if not mesh.is_watertight or mesh.volume <= 0:
        raise ValueError(f"{where}: {path} is not closed; accepted: a watertight mesh, since open ones have no volume")
    return np.asarray(mesh.center_mass), np.asarray(mesh.moment_inertia) / float(mesh.mass)
