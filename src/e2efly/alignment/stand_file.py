"""Read the record of a thrust stand: CSV, with columns named by us, by the maker of the stand, or by `--columns`."""

import csv
import math
import re
import unicodedata
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from e2efly.config.names import unknown
from e2efly.logs.csv_file import Column

COLUMNS = {
    "t": "s, needed for the lag",
    "throttle": "0 to 1",
    "voltage": "V",
    "rotor_speed": "rad/s",
    "rpm": "1/min, in place of rotor_speed",
    "thrust": "N",
    "torque": "N*m",
}
"""Our names of columns, with their units."""
_TURN = 2 * math.pi
_RPM = _TURN / 60
_KG, _POUND = 9.80665, 4.4482216152605  # kilogram-force and pound-force, N
_FORCES = {
    "n": 1.0, "mn": 1e-3, "g": 1e-3 * _KG, "gf": 1e-3 * _KG, "kg": _KG, "kgf": _KG,
    "lb": _POUND, "lbf": _POUND, "lbs": _POUND, "oz": _POUND / 16, "ozf": _POUND / 16,
}  # fmt: skip
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
_TORQUES = {f"{f}{m}": _FORCES[f] * _LENGTHS[m] for f in _FORCES for m in _LENGTHS}
UNITS: dict[str, dict[str, float]] = {
    "t": {"s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0},
    "throttle": {"%": 1e-2, "us": 1e-3},
    "voltage": {"v": 1.0, "mv": 1e-3},
    "rotor_speed": {
        "rad/s": 1.0, "rpm": _RPM, "1/min": _RPM, "rev/min": _RPM, "hz": _TURN, "1/s": _TURN, "rps": _TURN,
        "rev/s": _TURN,
    },
    "thrust": _FORCES,
    "torque": _TORQUES | {f"{m}{f}": _FORCES[f] * _LENGTHS[m] for f in ("lb", "lbf", "oz", "ozf") for m in _LENGTHS},
}  # fmt: skip
"""The units of each quantity that are known, as `_plain` writes them, and their size in our unit."""
WORDS = {
    "t": "time timestamp",
    "throttle": "throttle esc pwm",
    "voltage": "voltage",
    "rotor_speed": "rpm speed",
    "thrust": "thrust",
    "torque": "torque",
}
"""Words of a header that name a quantity."""
BESIDES = (
    "1 2 a and average avg battery command dc electrical elapsed input mean measured motor of optical output prop "
    "propeller pulse rotation rotational rotor signal supply test the width"
)
"""Other words that such a header may have. A header with any other word is of another quantity, as an efficiency."""
IDLE_PULSE = 1000.0
"""Pulse of an ESC without throttle, us. Full throttle is 1000 us longer."""


class FilePlace(NamedTuple):
    """A column of the file that holds a quantity: factor * entry - offset, in our unit."""

    column: int
    quantity: str
    factor: float
    offset: float = 0.0


def read_stand(
    path: Path, columns: Mapping[str, Column] | None = None, told: Callable[[str], None] = lambda _: None
) -> dict[str, np.ndarray]:
    """The quantities of a stand's record in our units, by their name in `UNITS`.

    A header is one of our names, in the unit of `COLUMNS`, or a name with another unit, as `Thrust (gf)`, `torque_Nm`.

    Args:
        path: a CSV file with a header, separated by commas, semicolons or tabs.
        columns: the columns of the file by their name in `COLUMNS`, from `--columns`. A factor other than 1 leads to
            our unit, whatever unit the header names.
        told: told what is left out.

    Raises:
        ValueError: naming the file, the column or the line, the value and what is accepted.
    """
    header, lines = _lines(path)
    found: dict[str, np.ndarray] = {}
    used: dict[str, str] = {}
    for place in _places(path, header, columns or {}):
        name, quantity = header[place.column], place.quantity
        values = place.factor * np.array([_number(path, line, name, row[place.column]) for line, row in lines])
        if not np.nan_to_num(values).any():
            continue  # nothing, or zeros, of a sensor that is not there
        if quantity in found:
            raise ValueError(
                f"{path}: {used[quantity]!r} and {name!r} are both a {quantity}; accepted: one of them, by --columns "
                f"{quantity}='{name}'"
            )
        found[quantity], used[quantity] = values - place.offset, name
    for quantity in ("rotor_speed", "thrust"):
        if quantity not in found:
            accepted = ", ".join(f"{name} ({what})" for name, what in COLUMNS.items())
            raise ValueError(
                f"{path}: has no {quantity} in its columns {', '.join(filter(None, header))}; accepted: {accepted}; a "
                f"name with its unit, as 'Thrust (gf)'; --columns {quantity}='THEIRS*FACTOR'"
            )
    if left := [name for name in header if name and name not in used.values()]:
        told(f"{path.name}: columns that are not used: {', '.join(left)}")
    whole = np.asarray(np.isfinite(np.stack(list(found.values()))).all(axis=0))
    if not whole.all():
        told(f"{path.name}: {int((~whole).sum())} of {len(whole)} lines lack an entry and are left out")
    found = {quantity: values[whole] for quantity, values in found.items()}
    if "t" in found and np.any(np.diff(found["t"]) <= 0):
        at = lines[int(np.flatnonzero(whole)[np.argmax(np.diff(found["t"]) <= 0) + 1])][0]
        raise ValueError(f"{path}: line {at}: {used['t']} does not rise; accepted: rising times")
    if "throttle" in found and not np.all(np.abs(found["throttle"] - 0.5) <= 0.75):  # pulses may be a bit off
        low, high = found["throttle"].min(), found["throttle"].max()
        raise ValueError(f"{path}: throttle is {low:g} to {high:g}; accepted: 0 to 1, or pulses of 1000 to 2000 us")
    return found


def _lines(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """The header, and the lines that are not empty with their numbers. Decimal commas become points."""
    try:
        text = path.read_text(encoding="utf-8-sig")
        delimiter = max(",;\t", key=text.partition("\n")[0].count)
        rows = [(i, row) for i, row in enumerate(csv.reader(text.splitlines(), delimiter=delimiter), 1) if any(row)]
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: {error}; accepted: a CSV file of a thrust stand") from None
    if len(rows) < 2:
        raise ValueError(f"{path}: has {len(rows)} lines; accepted: a header and a line a measurement")
    header = [name.strip() for name in rows[0][1]]
    if twice := [name for name in header if name and header.count(name) > 1]:
        raise ValueError(f"{path}: has two columns {twice[0]!r}; accepted: each name once")
    for line, row in rows:
        if len(row) != len(header):
            raise ValueError(f"{path}: line {line} has {len(row)} entries; accepted: {len(header)}, as the header")
    point = "," if delimiter == "," else "."
    return header, [(line, [entry.strip().replace(",", point) for entry in row]) for line, row in rows[1:]]


def _number(path: Path, line: int, name: str, entry: str) -> float:
    """An entry as a number. NaN: it is empty."""
    try:
        value = float(entry) if entry else math.nan
    except ValueError:
        value = math.inf
    if math.isinf(value):
        raise ValueError(f"{path}: line {line}: {name} is {entry!r}; accepted: a finite number, or nothing")
    return value


def _places(path: Path, header: list[str], columns: Mapping[str, Column]) -> list[FilePlace]:
    """The columns that hold a quantity. What `--columns` names stands in place of what the header says."""
    places = [place for i, name in enumerate(header) if (place := _place(i, name))]
    for ours, column in columns.items():
        quantity = "rotor_speed" if ours == "rpm" else ours
        others = [place for place in places if place.quantity != quantity]
        if quantity not in UNITS or (column.theirs not in header and len(others) < len(places)):
            continue  # of the flights of the same command
        if column.theirs not in header:
            raise ValueError(f"{path}: --columns says that {ours} is {unknown('column', column.theirs, header)}")
        index, (_, unit) = header.index(column.theirs), _parts(column.theirs)
        chosen = FilePlace(index, quantity, column.factor * (_RPM if ours == "rpm" else 1.0))
        if column.factor == 1 and unit:
            if unit not in UNITS[quantity]:
                raise ValueError(
                    f"{path}: --columns says that {ours} is {column.theirs!r}; accepted: {ours}='{column.theirs}"
                    f"*FACTOR', or one of the units {', '.join(UNITS[quantity])}"
                )
            chosen = _with_unit(index, quantity, unit)
        places = [*(place for place in others if place.column != index), chosen]
    return places


def _place(index: int, header: str) -> FilePlace | None:
    """The quantity that a header names. None: none that is known, in no unit that is known."""
    if header in COLUMNS:
        return FilePlace(index, "rotor_speed", _RPM) if header == "rpm" else FilePlace(index, header, 1.0)
    name, unit = _parts(header)
    words = set(re.findall(r"[^\W_]+", name.casefold()))
    for quantity, names in WORDS.items():
        own = words & set(names.split())
        if own and words <= own | set(BESIDES.split()) and unit in UNITS[quantity]:
            return _with_unit(index, quantity, unit)
    return None


def _with_unit(index: int, quantity: str, unit: str) -> FilePlace:
    factor = UNITS[quantity][unit]
    pulse = quantity == "throttle" and unit == "us"
    return FilePlace(index, quantity, factor, IDLE_PULSE * factor if pulse else 0.0)


def _parts(header: str) -> tuple[str, str]:
    """Name and unit of a header. The unit stands in brackets, or it is the last word, if it is known. "": no unit."""
    if bracketed := re.fullmatch(r"(.+?)\s*[(\[]([^()\[\]]*)[)\]]", header):
        return bracketed[1], _plain(bracketed[2])
    *_, last = re.split(r"[\s_,]+", header)
    if any(_plain(last) in units for units in UNITS.values()):
        return header.removesuffix(last) or header, _plain(last)
    return header, ""


def _plain(unit: str) -> str:
    """A unit in lower case without signs of multiplication: N·m, N*m, N.m, N-m and Nm are all nm."""
    folded = unicodedata.normalize("NFKC", unit).casefold().replace("μ", "u")
    return re.sub(r"[\s·⋅•*.\-]", "", folded)
