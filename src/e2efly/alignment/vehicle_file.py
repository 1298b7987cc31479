"""The resulting vehicle file: the values of the base, with the identified values and their sigmas in their place."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.alignment.estimates import Estimate
from e2efly.config.storage import write_atomically
from e2efly.config.tables import read_table
from e2efly.vehicles.loading import CORRELATION, MIXER, vehicle_file
from e2efly.vehicles.posterior import Entry, read_correlation
from e2efly.vehicles.vehicle import Vehicle, quantities
from e2efly.vehicles.vehicle_rules import check


def merged(base: Vehicle, found: Mapping[str, Estimate]) -> Vehicle:
    """The base vehicle with the identified values in place of its own. Moments of inertia that were not found are
    scaled like the others.

    Raises:
        ValueError: when the combined values are not a valid vehicle, naming the values.
    """
    values = {}
    for name, estimate in found.items():
        own = np.asarray(getattr(base, name), float)
        known = np.isfinite(estimate.value)
        new = np.where(known, estimate.value, own)
        if name == "inertia" and known.any():  # otherwise no rigid body might have these three
            new = np.where(known, new, own * np.mean(estimate.value[known] / own[known]))
        values[name] = new if new.shape else float(new)
    kept = {f.name: getattr(base, f.name) for f in quantities(base)} | {"name": base.name, "mixer": base.mixer}
    vehicle = Vehicle(**(kept | values))
    check(vehicle, "identified vehicle")
    return vehicle


def write_vehicle(
    path: Path,
    base_name: str,
    base: Vehicle,
    found: Mapping[str, Estimate],
    correlation: tuple[list[str], np.ndarray] = ([], np.zeros((0, 0))),
) -> Vehicle:
    """Write the new vehicle file. Values of the base keep their sources.

    `found` are the estimates by field. `correlation` is as `e2efly.vehicles.posterior` reads it.

    Raises:
        ValueError: as for `merged`.
    """
    vehicle, table = merged(base, found), read_table(vehicle_file(base_name))
    lines = [
        f"# {path.stem}: identified by e2efly, from {base.name}. Every entry: value, unit and source; sigma is the",
        f"# standard deviation, nan where it is not known. Rotors in {_order(base)} order. Body frame FLU.",
    ]
    lines += [f"{MIXER} = {_text(vehicle.mixer)}"] if vehicle.mixer else []
    for f in quantities(vehicle):
        entry: dict[str, Any] = table.get(f.name, {"unit": f.metadata["unit"]})  # a term that the base does not have
        lines += ["", f"[{f.name}]", f"value = {_toml(getattr(vehicle, f.name))}", f"unit = {_text(entry['unit'])}"]
        if f.name in found:
            lines += [f"sigma = {_toml(found[f.name].sigma, digits=3)}", f"source = {_text(found[f.name].source)}"]
        else:
            lines += [f"sigma = {_toml(np.asarray(entry['sigma']))}"] if "sigma" in entry else []
            lines += [f"source = {_text(entry['source'])}"]
    names, matrix = _with_older(correlation, read_correlation(table, str(path)), found)
    if names:
        lines += ["", f"[{CORRELATION}]", f"of = [{', '.join(map(_text, names))}]", "value = ["]
        lines += [*(f"    {_toml(row, digits=4)}," for row in matrix), "]"]
    write_atomically(path, ("\n".join(lines) + "\n").encode())
    return vehicle


def _order(base: Vehicle) -> str:
    return "Betaflight's" if base.rotor_count == 4 else f"{base.name}'s"


def _with_older(
    new: tuple[list[str], np.ndarray], old: tuple[list[str], np.ndarray], found: Mapping[str, Estimate]
) -> tuple[list[str], np.ndarray]:
    """The new correlations, and those of the base between entries for which nothing new was found."""
    kept = [i for i, name in enumerate(old[0]) if Entry.of(name).field not in found]
    size = len(new[0])
    matrix = np.eye(size + len(kept))
    matrix[:size, :size], matrix[size:, size:] = new[1], old[1][np.ix_(kept, kept)]
    return [*new[0], *(old[0][i] for i in kept)], matrix


def _toml(value: Any, digits: int = 6) -> str:
    if np.ndim(value):
        return f"[{', '.join(_toml(x, digits) for x in value)}]"
    return _number(float(value), digits)


def _number(x: float, digits: int) -> str:
    said = f"{x:.{digits}g}"
    return said if any(c in said for c in ".ne") else f"{said}.0"


def _text(words: str) -> str:
    escaped = words.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else " " for c in escaped) + '"'
