"""Flights as CSV files: any subset of the columns of `KINDS`, in any order. Entries are empty where nothing was
measured.
"""

import codecs
import csv
import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import NamedTuple, TextIO

import numpy as np

from e2efly.config.names import unknown
from e2efly.logs.recording import HUGE, KINDS, UNUSED, Record, Stream, listed
from e2efly.vehicles.gravity import GRAVITY

TIME = "t"
"""Name of the time column, s."""
DIGITS = 9
"""Decimal places of the times that are written: nanoseconds."""
LINES = 1_000_000
"""Largest number of lines that are read from a file: half an hour at 500 Hz, which needs a third of a gigabyte."""
LONGEST_LINE = 100_000
"""Longest line that is read, characters."""
WIDEST = 2000
"""Largest number of columns."""
HEAD = 1 << 16
"""Bytes at the beginning of a file that show what it is."""
COLUMNS = (TIME, *(name for kind in KINDS.values() for name in kind.known))
"""All known columns."""
_USUAL = (TIME, *(name for kind in KINDS.values() for name in kind.columns))
"""Those of a quadrotor."""
UNIT = {TIME: "s"} | {
    column: unit
    for kind in KINDS.values()
    for column, unit in zip(
        kind.known,
        ["m/s^2", *["rad/s"] * 3] if len(kind.unit.split(",")) > 1 else [kind.unit] * len(kind.known),
        strict=True,
    )
}
"""The unit of each column."""
_TURN = {"deg/s": math.pi / 180, "°/s": math.pi / 180, "dps": math.pi / 180, "rpm": math.pi / 30}
UNITS: dict[str, dict[str, float]] = {
    "s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9},
    "m": {"m": 1.0, "cm": 1e-2, "mm": 1e-3},
    "m/s": {"m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "km/h": 1 / 3.6},
    "m/s^2": {"m/s^2": 1.0, "m/s2": 1.0, "m/s²": 1.0, "m/s/s": 1.0, "mm/s^2": 1e-3, "g": GRAVITY, "mg": 1e-3 * GRAVITY},
    "rad/s": {"rad/s": 1.0, "mrad/s": 1e-3, **_TURN},
    "V": {"v": 1.0, "mv": 1e-3},
    "1": {"1": 1.0, "-": 1.0, "%": 1e-2},
}
"""The units that a header may name, in lower case, and what makes ours of them."""


class Column(NamedTuple):
    """The column of a file with other names that holds one of the columns of `KINDS`."""

    theirs: str
    factor: float


def column_map(given: Iterable[str], known: Collection[str] = COLUMNS) -> dict[str, Column]:
    """The columns by their name in `known`, from entries `ours=theirs` or `ours=theirs*factor`.

    Raises:
        ValueError: for an entry of another form, and for a name `ours` that is not in `known`.
    """
    found: dict[str, Column] = {}
    for entry in given:
        ours, equals, rest = entry.partition("=")
        theirs, _, factor = rest.rpartition("*") if "*" in rest else (rest, "", "1")
        try:
            scale = float(factor)
        except ValueError:
            scale = math.nan
        if not equals or not theirs or not math.isfinite(scale) or scale == 0:
            raise ValueError(f"--columns is {entry!r}; accepted: OURS=THEIRS or OURS=THEIRS*FACTOR, as az=acc_z*9.81")
        if ours not in known:
            raise ValueError(f"--columns is {entry!r}: {unknown('column', ours, known)}")
        if ours in found:
            raise ValueError(f"--columns names {ours!r} twice; accepted: once")
        found[ours] = Column(theirs, scale)
    return found


def read_csv(path: Path, columns: Mapping[str, Column] | None = None) -> Record:
    """Read a flight line by line. Of a long file, only the first `LINES` lines are read.

    Commas, semicolons or tabs may part the entries. The header may have units behind the names, as in `ax (g)`; the
    numbers are then converted.

    Args:
        path: a file with a header.
        columns: the columns of the file by their name in `COLUMNS`. Other columns are looked up by their name in
            `COLUMNS`. A factor takes the place of the unit in the header.

    Raises:
        ValueError: naming the file, the line or the column, its value and what is accepted.
    """
    notes: list[str] = []
    try:
        with path.open("rb") as opened:
            code = encoding(opened.read(HEAD)) or "utf-8"
        with path.open(newline="", encoding=code) as file:
            texts = _texts(path, file)
            first = next(texts, "")
            mark = delimiter(first)
            header = [name.strip() for name in next(csv.reader([first], delimiter=mark), [])]
            places, factors = _places(path, header, columns or {}, notes)
            lines = csv.reader(texts, delimiter=mark)
            table = np.fromiter(_numbers(path, lines, len(header), places, notes), (np.float64, len(places)))
    except (OSError, UnicodeError, csv.Error) as error:
        raise ValueError(f"{path}: {error}; accepted: a CSV file with a header") from None
    if len(table) < 2:
        raise ValueError(f"{path}: has {len(table)} lines of numbers; accepted: two or more")
    with np.errstate(over="ignore"):
        numbers = dict(zip(places, (table * factors).T, strict=True))
    if large := [name for name, values in numbers.items() if np.any(np.abs(values) >= HUGE)]:
        raise ValueError(f"{path}: {large[0]} has numbers of {HUGE:g} and more; accepted: smaller ones")
    time = numbers[TIME]
    if not np.all(np.diff(time) > 0):
        at = int(np.argmin(np.diff(time) > 0)) + 3
        raise ValueError(f"{path}: line {at}: t does not rise; accepted: rising times, s")
    streams = {}
    for name, kind in KINDS.items():
        if kind.columns[0] not in numbers:
            continue
        columns_of = [column for column in kind.known if column in numbers]
        values = np.stack([numbers[column] for column in columns_of], -1)
        there = np.isfinite(values).all(-1)
        if there.any():
            streams[name] = Stream(time[there], values[there])
        else:
            notes.append(f"{name} is left out: no line has all of {', '.join(columns_of)}")
    return Record(path, streams, tuple(notes))


def encoding(head: bytes) -> str:
    """How a text is encoded, by its beginning: byte-order marks, UTF-8, else Windows' Western. Empty: it is no text."""
    marks = {codecs.BOM_UTF8: "utf-8-sig", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
    for mark, code in marks.items():
        if head.startswith(mark):
            return code
    if re.search(rb"[\x00-\x08\x0e-\x1f]", head):
        return ""
    try:
        codecs.getincrementaldecoder("utf-8")().decode(head)
    except UnicodeDecodeError:
        return "cp1252"
    return "utf-8"


def delimiter(line: str) -> str:
    """What parts the entries of a line."""
    return max(",;\t", key=line.count)


def _texts(path: Path, file: TextIO) -> Iterator[str]:
    """The lines of a file."""
    for number in count(1):
        line = file.readline(LONGEST_LINE + 1)
        if len(line) > LONGEST_LINE:
            raise ValueError(f"{path}: line {number} is longer than {LONGEST_LINE} characters; accepted: shorter ones")
        if not line:
            return
        yield line


def write_csv(record: Record, path: Path) -> None:
    """Write a flight with the columns of `COLUMNS`: one line for each time at which any stream has a sample."""
    times = np.unique(np.concatenate([stream.time for stream in record.streams.values()]).round(DIGITS))
    names, columns = [TIME], [times]
    for name, kind in KINDS.items():
        if name in record.streams:
            stream = record.streams[name]
            values = np.full((len(times), stream.values.shape[1]), np.nan)
            values[np.searchsorted(times, stream.time.round(DIGITS))] = stream.values
            names += kind.names(stream.values.shape[1])
            columns += list(values.T)
    with path.open("w", newline="", encoding="utf-8") as file:
        lines = csv.writer(file)
        lines.writerow(names)
        for row in zip(*columns, strict=True):
            lines.writerow([f"{row[0]:.{DIGITS}f}", *("" if math.isnan(x) else f"{x:.8g}" for x in row[1:])])


def _places(
    path: Path, header: list[str], columns: Mapping[str, Column], notes: list[str]
) -> tuple[dict[str, int], np.ndarray]:
    """The index of each column of `COLUMNS` in a line, and the factors to its unit."""
    if len(header) > WIDEST:
        raise ValueError(f"{path}: has {len(header)} columns; accepted: up to {WIDEST}")
    if len(set(header)) < len(header):
        twice = next(name for name in header if header.count(name) > 1)
        raise ValueError(f"{path}: has two columns {twice!r}; accepted: each name once")
    bare = {text: _with_unit(text) for text in header}
    found, factors = {}, []
    for ours in COLUMNS:
        theirs, factor = columns.get(ours, Column(ours, 1.0))
        named = [text for text in header if text == theirs] or [text for text in header if bare[text][0] == theirs]
        if len(named) > 1:
            raise ValueError(f"{path}: has the columns {' and '.join(named)}; accepted: one of the name {theirs}")
        if not named and ours in columns:
            raise ValueError(f"{path}: --columns says that {ours} is {unknown('column', theirs, header)}")
        if named:
            found[ours] = header.index(named[0])
            unit = "" if factor != 1 else bare[named[0]][1]
            factors.append(factor * _factor(path, ours, named[0], unit))
            if factors[-1] != factor:
                notes.append(f"{named[0]} is multiplied by {factors[-1]:.6g}, for {ours} in {UNIT[ours]}")
    if TIME not in found:
        raise ValueError(f"{path}: has no column 't'; accepted: times in s in a column t, or --columns t=THEIRS")
    for kind in KINDS.values():
        there = [i for i, name in enumerate(kind.known) if name in found]
        needed = kind.names(max(there[-1] + 1, len(kind.columns))) if there else ()
        if missing := [name for name in needed if name not in found]:
            raise ValueError(
                f"{path}: has the column {kind.known[there[0]]} but not {missing[0]}; accepted: {', '.join(needed)}"
            )
    if len(found) == 1:
        raise ValueError(f"{path}: knows none of the columns {listed(header)}; accepted: {', '.join(_USUAL)}")
    if unused := [text for i, text in enumerate(header) if i not in found.values()]:
        notes.append(f"columns that are not used: {listed(unused, UNUSED)}")
    return found, np.array(factors)


def _with_unit(text: str) -> tuple[str, str]:
    """A name of the header without its unit, and the unit, in lower case. Empty if it has none."""
    parts = re.fullmatch(r"(.*\S)\s*[(\[]([^()\[\]]*)[)\]]", text)
    if parts is None or parts[2].isdecimal():  # an entry of an array, as gyro[0]
        return text, ""
    return parts[1], parts[2].strip().lower()


def _factor(path: Path, ours: str, theirs: str, unit: str) -> float:
    """What makes our unit of the unit of a header."""
    known = UNITS[UNIT[ours]]
    if unit in known or not unit:
        return known.get(unit, 1.0)
    raise ValueError(
        f"{path}: {ours} is in the unit of the column {theirs}, which is not known; accepted: {', '.join(known)}, "
        f"or --columns {ours}={theirs}*FACTOR"
    )


def _numbers(
    path: Path, lines: Iterator[list[str]], width: int, places: Mapping[str, int], notes: list[str]
) -> Iterator[list[float]]:
    for number, line in enumerate(lines, 2):
        if number > LINES + 1:
            notes.append(f"the first {LINES} lines are read, and no more: cut the file where another part matters")
            return
        if len(line) != width:
            if number > 2 and len(line) < width and next(lines, None) is None:
                notes.append(f"line {number}, the last, breaks off and is left out")
                return
            raise ValueError(f"{path}: line {number} has {len(line)} entries; accepted: {width}, as the header")
        row = []
        for name, place in places.items():
            entry = line[place].strip()
            try:
                value = float(entry) if entry else math.nan
            except ValueError:
                raise ValueError(
                    f"{path}: line {number}: {name} is {entry!r:.60}; accepted: a number, or nothing"
                ) from None
            if math.isinf(value) or (name == TIME and math.isnan(value)):
                raise ValueError(f"{path}: line {number}: {name} is {entry!r:.60}; accepted: a finite number")
            row.append(value)
        yield row
