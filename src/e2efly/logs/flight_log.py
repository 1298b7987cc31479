"""Reads flight logs, complete or cut off by a crash, a power loss or a full disk."""

import json
import mmap
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.logs.channels import CHANNELS
from e2efly.logs.mcap_file import PROFILE
from e2efly.logs.mcap_records import McapRecords


@dataclass(frozen=True)
class Series:
    """The messages of one channel, in time order."""

    channel: str
    """Name of the channel."""
    stamp: np.ndarray
    """(n,) int64, ns since 1970: the wall clock at the start plus the monotonic time since then."""
    time: np.ndarray
    """(n,) s since the first message of the log."""
    values: tuple[dict[str, Any], ...]
    """The n messages as they were recorded."""

    def __len__(self) -> int:
        """Number of messages."""
        return len(self.time)

    def numbers(self, field: str, size: int | None = None) -> np.ndarray:
        """A field as float64. NaN where it is null, missing or of another length.

        Args:
            field: a field of numbers or flags.
            size: number of entries in a message. None: a single number, not a list.

        Returns:
            Shape (n,) or (n, size).

        Raises:
            ValueError: naming the channel and the field, if a message has no numbers there.
        """
        out = np.full((len(self),) if size is None else (len(self), size), np.nan)
        for i, message in enumerate(self.values):
            value = message.get(field)
            if value is None or (size is not None and isinstance(value, list) and len(value) != size):
                continue
            try:
                out[i] = np.array(value, np.float64) if size is None else [np.nan if v is None else v for v in value]
            except (TypeError, ValueError, OverflowError):
                kind = "a number" if size is None else f"{size} numbers"
                raise ValueError(f"flight log: {self.channel}.{field} is {value!r:.60}; accepted: {kind}") from None
        return out

    def width(self, field: str) -> int:
        """Number of entries in the longest list of a field. 0 if there is no list."""
        return max((len(v) for m in self.values if isinstance(v := m.get(field), list)), default=0)

    def texts(self, field: str) -> list[str]:
        """A field as texts. Empty where the field is missing."""
        return ["" if m.get(field) is None else str(m[field]) for m in self.values]


@dataclass(frozen=True)
class FlightLog:
    """A flight log in memory."""

    path: Path
    """The file."""
    series: dict[str, Series]
    """The channels that have messages, by name."""
    meta: dict[str, str]
    """What flew: the fields of the channel `meta`. Later fields replace earlier ones."""
    cut_off: str
    """Why the file ends early. Empty if it was closed properly."""

    def __getitem__(self, channel: str) -> Series:
        """The messages of a channel. Empty if nothing was recorded.

        Raises:
            KeyError: for a channel that flight logs do not have.
        """
        if channel in self.series:
            return self.series[channel]
        CHANNELS[channel]
        return Series(channel, np.zeros(0, np.int64), np.zeros(0), ())

    @property
    def start(self) -> int:
        """Stamp of the first message, ns. 0 if there is none."""
        return min((int(s.stamp[0]) for s in self.series.values()), default=0)

    @property
    def duration(self) -> float:
        """Time from the first to the last message, s."""
        return max((float(s.time[-1]) for s in self.series.values()), default=0.0)


def read_log(path: str | Path) -> FlightLog:
    """Read everything that is intact in a flight log.

    Raises:
        ValueError: if there is no such file, if it is not a flight log, or if a message is not JSON.
    """
    path = Path(path)
    if not path.is_file():
        raise ValueError(f"flight log {str(path)!r} does not exist")
    found: dict[str, list[tuple[int, int, dict[str, Any]]]] = {}
    meta: dict[str, str] = {}
    with mapped(path) as data:
        records = McapRecords(data)
        for name, stamp, number, text in ((r.channel.topic, r.stamp, r.number, r.data) for r in records):
            if records.profile != PROFILE:
                break
            try:
                message = json.loads(text)
            except (ValueError, RecursionError) as error:
                raise ValueError(f"{path}: a message of channel {name!r} is not JSON: {error}") from None
            if not isinstance(message, dict):
                raise ValueError(f"{path}: a message of channel {name!r} is {message!r:.60}; accepted: an object")
            found.setdefault(name, []).append((stamp, number, message))
            if name == "meta":
                meta |= {k: v if isinstance(v, str) else json.dumps(v) for k, v in message.items() if v is not None}
    if records.profile != PROFILE:
        accepted = f"an MCAP file of profile {PROFILE!r}, as e2efly fly writes it"
        raise ValueError(f"{path}: no flight log; accepted: {accepted}")
    start = min((stamp for messages in found.values() for stamp, _, _ in messages), default=0)
    series = {name: _series(name, found[name], start) for name in found}
    return FlightLog(path, series, meta, records.cut_off)


@contextmanager
def mapped(path: Path) -> Iterator[bytes | mmap.mmap]:
    """The bytes of a file, without reading all of them into memory. They are valid inside the `with` block only."""
    with path.open("rb") as file:
        if not path.stat().st_size:
            yield b""
            return
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            yield data


def _series(channel: str, messages: list[tuple[int, int, dict[str, Any]]], start: int) -> Series:
    messages.sort(key=lambda m: m[:2])
    stamp = np.array([m[0] for m in messages], np.int64)
    return Series(channel, stamp, (stamp - start) * 1e-9, tuple(m[2] for m in messages))
