"""Vehicles from TOML files. Every value has a unit and a source; errors name file, key, value and what is accepted."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np

from e2efly.config.names import nearest, unknown
from e2efly.config.tables import read_table, shown
from e2efly.vehicles.payload import FixedPayload, with_payload
from e2efly.vehicles.vehicle import ROTOR_COUNTS, MixerRule, Vehicle, has_shape, quantities, terms
from e2efly.vehicles.vehicle_rules import check

_LARGEST = 1e6
"""Largest absolute value of a number, in its unit."""


_HERE = Path(__file__).parent


FAMILIES = _HERE / "families"
"""Folder of the files of the families that the package ships."""


OF_FAMILIES = "thrust_to_weight"
"""A key that only files of families have."""


CORRELATION = "correlation"
"""The table of a vehicle file that describes no single value. It holds the correlations between the errors of the
values (`e2efly.vehicles.posterior`)."""


MIXER = "mixer"
"""The key of a vehicle file that is no quantity: the rule of the flight controller's mixer, a text."""


PAYLOAD = "payload"
"""The table of a vehicle file that describes what is fixed to the vehicle. The other values are those without it."""


def vehicle_names() -> list[str]:
    """Names of the vehicles that the package ships."""
    return sorted(path.stem for path in _HERE.glob("*.toml"))


def vehicle_file(name_or_path: str | Path) -> Path:
    """The TOML file of a shipped vehicle or family, by its name, or of any other vehicle or family, by its path.

    Raises:
        ValueError: when there is none.
    """
    text = str(name_or_path)
    if text.endswith(".toml"):
        if not Path(text).is_file():
            raise ValueError(f"vehicle file {text!r} does not exist")
        return Path(text)
    name = f"{text.lower().replace('-', '_')}.toml"
    found = next((path for path in (_HERE / name, FAMILIES / name) if path.is_file()), None)
    if found is None:
        raise ValueError(unknown("vehicle", text, vehicle_names()) + ", or the path of a .toml file")
    return found


def load_vehicle(name_or_path: str | Path) -> Vehicle:
    """Load a shipped vehicle by name, or any vehicle by the path of its TOML file.

    Raises:
        ValueError: naming the file, the key, the value and what is accepted.
    """
    path = vehicle_file(name_or_path)
    table, where = read_table(path), str(path)
    if OF_FAMILIES in table:
        raise ValueError(
            f"vehicle {path.stem!r} is a family, the ranges of many vehicles; accepted here: one vehicle: "
            f"{', '.join(vehicle_names())}, or the path of a .toml file"
        )
    table.pop(CORRELATION, None)
    payload = table.pop(PAYLOAD, None)
    mixer = _read_mixer(where, table.pop(MIXER, ""))
    vehicle = Vehicle(name=path.stem, mixer=mixer, **read_values(table, (*quantities(), *terms()), where))
    if payload is not None:
        if not isinstance(payload, dict):
            raise ValueError(f"{where}: {PAYLOAD} is {shown(payload)}; accepted: the tables mass and position")
        fixed = read_values(payload, dataclasses.fields(FixedPayload), f"{where}: {PAYLOAD}")
        try:
            vehicle = with_payload(vehicle, **fixed)
        except ValueError as error:
            raise ValueError(f"{where}: {error}") from None
    check(vehicle, where)
    return vehicle


def read_values(table: dict[str, Any], fields: Sequence[dataclasses.Field], where: str) -> dict[str, Any]:
    """The values of a file that has an entry for each of these fields, and no others.

    The fields are made like those of `Vehicle`. A field that has a default may be left out.

    Raises:
        ValueError: naming the file, the key, the value and what is accepted.
    """
    known = {f.name: f for f in fields}
    for key in table:
        if key not in known:
            guess = nearest(key, known)
            hint = f"; did you mean {guess!r}?" if guess else f" (accepted: {', '.join(known)})"
            raise ValueError(f"{where}: unknown key {key!r}{hint}")
    if missing := [key for key, f in known.items() if key not in table and f.default is dataclasses.MISSING]:
        raise ValueError(f"{where}: missing key {', '.join(map(repr, missing))}")
    return {key: _read(where, f, table[key]) for key, f in known.items() if key in table}


def _read(where: str, f: dataclasses.Field, entry: Any) -> Any:
    """One value of the file, after a check of its unit, shape and bounds."""
    key, unit, shape = f.name, f.metadata["unit"], f.metadata["shape"]
    if not isinstance(entry, dict) or set(entry) - {"sigma"} != {"value", "unit", "source"}:
        raise ValueError(
            f"{where}: [{key}] is {shown(entry)}; accepted: a table with value, unit and source, and sigma where it is "
            "known"
        )
    if entry["unit"] != unit:
        raise ValueError(f"{where}: {key}.unit is {shown(entry['unit'])}; accepted: {unit!r}")
    source, given = entry["source"], entry["value"]
    if not isinstance(source, str) or not source.strip():
        raise ValueError(f"{where}: {key}.source is {shown(source)}; accepted: a text that says where it is from")
    try:
        value = np.asarray(given)
    except ValueError:
        value = np.asarray("ragged")
    numbers = value.dtype.kind in "fi" and not any(isinstance(x, bool) for x in np.asarray(given, object).flat)
    if not numbers or not has_shape(f, value.shape):
        raise ValueError(f"{where}: {key}.value is {shown(given)}; accepted: {_expected(f)}")
    value = value.astype(np.float64)
    _read_sigma(where, f, entry, value.shape)
    at_least, above = f.metadata["at_least"], f.metadata["above"]
    accepted = f">= {at_least:g}" if at_least is not None else f"> {above:g}" if above is not None else "finite"
    good = np.abs(value) <= _LARGEST  # false for NaN
    if at_least is not None:
        good &= value >= at_least
    if above is not None:
        good &= value > above
    if not np.all(good):
        raise ValueError(
            f"{where}: {key}.value is {shown(given)}; accepted: {accepted} {unit}, finite, at most {_LARGEST:g} in size"
        )
    return value if shape else float(value)


def _expected(f: dataclasses.Field) -> str:
    """The shapes that are accepted for a field, in words."""
    if (components := f.metadata.get("per_rotor")) is None:
        return "a number" if f.metadata["shape"] == () else f"numbers of shape {f.metadata['shape']}"
    shapes = " or ".join(f"(N, {size})" for size in components) or "(N,)"
    return f"numbers of shape {shapes}, with {ROTOR_COUNTS[0]} to {ROTOR_COUNTS[-1]} rotors N"


def _read_mixer(where: str, given: Any) -> str:
    if given and given not in get_args(MixerRule):
        accepted = ", ".join(map(repr, get_args(MixerRule)))
        raise ValueError(f"{where}: {MIXER} is {shown(given)}; accepted: {accepted}, or no such key")
    return given


def _read_sigma(where: str, f: dataclasses.Field, entry: dict[str, Any], shape: tuple[int, ...]) -> np.ndarray:
    """Standard deviations of an entry of the file, in the shape of the value. NaN where they are not known."""
    given = entry.get("sigma")
    if given is None:
        return np.full(shape, np.nan)
    try:
        sigma = np.asarray(given, np.float64)
    except (TypeError, ValueError):
        sigma = np.full((0,), np.nan)
    if sigma.shape != shape or np.any(sigma < 0) or np.any(np.isinf(sigma)):
        raise ValueError(
            f"{where}: {f.name}.sigma is {shown(given)}; accepted: a number of 0 or more for each of the value's, nan "
            "where it is not known"
        )
    return sigma


def read_sigmas(name_or_path: str | Path) -> dict[str, np.ndarray]:
    """Standard deviations of a vehicle's values, by field, in their units. NaN where the file does not give them.

    Raises:
        ValueError: as for `load_vehicle`.
    """
    path = vehicle_file(name_or_path)
    return sigmas_of(load_vehicle(path), read_table(path), str(path))


def sigmas_of(vehicle: Vehicle, table: dict[str, Any], where: str) -> dict[str, np.ndarray]:
    """The same as `read_sigmas`, for a file that was already read."""
    fields = quantities(vehicle)
    return {f.name: _read_sigma(where, f, table.get(f.name, {}), np.shape(getattr(vehicle, f.name))) for f in fields}
