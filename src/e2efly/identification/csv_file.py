"""Flights as CSV files: any subset of the columns of `KINDS`, in any order. Entries are empty where nothing was
measured.
"""

import csv
import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from e2efly.identification.record import KINDS, Record, Stream
from e2efly.vehicles.names import unknown

TIME = "t"
"""Name of the time column, s."""
DIGITS = 9
"""Decimal places of the times that are written: nanoseconds."""
LINES = 1_000_000
"""Largest number of lines that are read from a file: half an hour at 500 Hz, which needs a third of a gigabyte."""
COLUMNS = (TIME, *(name for kind in KINDS.values() for name in kind.columns))
"""All known columns."""


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

    Args:
        path: a file with a header.
        columns: the columns of the file by their name in `COLUMNS`. Other columns are looked up by their name in
            `COLUMNS`.

    Raises:
        ValueError: naming the file, the line or the column, its value and what is accepted.
    """
    columns, notes = columns or {}, []
    try:
        with path.open(newline="", encoding="utf-8") as file:
            lines = csv.reader(file)
            header = [name.strip() for name in next(lines, [])]
            places = _places(path, header, columns)
            table = np.fromiter(_numbers(path, lines, len(header), places, notes), (np.float64, len(places)))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: {error}; accepted: a CSV file with a header") from None
    if len(table) < 2:
        raise ValueError(f"{path}: has {len(table)} lines of numbers; accepted: two or more")
    factor = np.array([columns[name].factor if name in columns else 1.0 for name in places])
    numbers = dict(zip(places, (table * factor).T, strict=True))
    time = numbers[TIME]
    if not np.all(np.diff(time) > 0):
        at = int(np.argmin(np.diff(time) > 0)) + 3
        raise ValueError(f"{path}: line {at}: t does not rise; accepted: rising times, s")
    streams = {}
    for name, kind in KINDS.items():
        if kind.columns[0] not in numbers:
            continue
        values = np.stack([numbers[column] for column in kind.columns], -1)
        there = np.isfinite(values).all(-1)
        if there.any():
            streams[name] = Stream(time[there], values[there])
    return Record(path, streams, tuple(notes))


def write_csv(record: Record, path: Path) -> None:
    """Write a flight with the columns of `COLUMNS`: one line for each time at which any stream has a sample."""
    times = np.unique(np.concatenate([stream.time for stream in record.streams.values()]).round(DIGITS))
    names, columns = [TIME], [times]
    for name, kind in KINDS.items():
        if name in record.streams:
            stream = record.streams[name]
            values = np.full((len(times), len(kind.columns)), np.nan)
            values[np.searchsorted(times, stream.time.round(DIGITS))] = stream.values
            names += kind.columns
            columns += list(values.T)
    with path.open("w", newline="", encoding="utf-8") as file:
        lines = csv.writer(file)
        lines.writerow(names)
        for row in zip(*columns, strict=True):
            lines.writerow([f"{row[0]:.{DIGITS}f}", *("" if math.isnan(x) else f"{x:.8g}" for x in row[1:])])


def _places(path: Path, header: list[str], columns: Mapping[str, Column]) -> dict[str, int]:
    """The index of each column of `COLUMNS` in a line."""
    if len(set(header)) < len(header):
        twice = next(name for name in header if header.count(name) > 1)
        raise ValueError(f"{path}: has two columns {twice!r}; accepted: each name once")
    found = {}
    for ours in COLUMNS:
        theirs = columns[ours].theirs if ours in columns else ours
        if theirs in header:
            found[ours] = header.index(theirs)
        elif ours in columns:
            raise ValueError(f"{path}: --columns says that {ours} is {unknown('column', theirs, header)}")
    if TIME not in found:
        raise ValueError(f"{path}: has no column 't'; accepted: times in s in a column t, or --columns t=THEIRS")
    for kind in KINDS.values():
        there = [name for name in kind.columns if name in found]
        if there and len(there) < len(kind.columns):
            missing = next(name for name in kind.columns if name not in found)
            raise ValueError(
                f"{path}: has the column {there[0]} but not {missing}; accepted: {', '.join(kind.columns)}"
            )
    if len(found) == 1:
        raise ValueError(f"{path}: knows none of the columns {', '.join(header)}; accepted: {', '.join(COLUMNS)}")
    return found


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
                    f"{path}: line {number}: {name} is {entry!r}; accepted: a number, or nothing"
                ) from None
            if math.isinf(value) or (name == TIME and math.isnan(value)):
                raise ValueError(f"{path}: line {number}: {name} is {entry!r}; accepted: a finite number")
            row.append(value)
        yield row
