"""A recorded flight: streams of numbers, each with its own times. SI units, world ENU, body FLU."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from e2efly.vehicles.vehicle import ROTOR_COUNTS


@dataclass(frozen=True)
class StreamKind:
    """One stream that a record may have."""

    columns: tuple[str, ...]
    """Names of its columns in a CSV file; of a value for each rotor, those of a quadrotor."""
    unit: str
    """Unit of the numbers."""
    what: str
    """Description, with the frame."""
    per_rotor: bool = False
    """Whether it has as many columns as the vehicle has rotors."""

    def names(self, size: int) -> tuple[str, ...]:
        """The names of its columns, of a stream with this number of them."""
        return tuple(f"{self.columns[0][0]}{i + 1}" for i in range(size)) if self.per_rotor else self.columns

    @property
    def known(self) -> tuple[str, ...]:
        """The names of all columns that it may have."""
        return self.names(ROTOR_COUNTS[-1])


KINDS: dict[str, StreamKind] = {
    "position": StreamKind(("px", "py", "pz"), "m", "centre of mass, world"),
    "velocity": StreamKind(("vx", "vy", "vz"), "m/s", "world"),
    "quaternion": StreamKind(("qw", "qx", "qy", "qz"), "1", "attitude, wxyz, body to world"),
    "body_rate": StreamKind(("wx", "wy", "wz"), "rad/s", "about body x, y, z"),
    "specific_force": StreamKind(("ax", "ay", "az"), "m/s^2", "accelerometer, body: (0, 0, 9.81) at rest"),
    "rotor_speed": StreamKind(
        ("n1", "n2", "n3", "n4"), "rad/s", "in the order of the vehicle's file, and so on with more rotors", True
    ),
    "motor": StreamKind(
        ("m1", "m2", "m3", "m4"), "1",
        "output to each motor, 0 to 1, in the order of the vehicle's file, and so on with more rotors", True,
    ),
    "command": StreamKind(
        ("cmd_thrust", "cmd_wx", "cmd_wy", "cmd_wz"), "m/s^2, rad/s",
        "thrust over mass and body rates (command mode ctbr) that were sent, each held until the next",
    ),
    "setpoint": StreamKind(
        ("set_wx", "set_wy", "set_wz"), "rad/s", "body rates that the flight controller's rate loop was asked for",
    ),
    "voltage": StreamKind(("volts",), "V", "of the whole battery"),
}  # fmt: skip
"""All streams, by name."""


HUGE = 1e15
"""Numbers of this size and above are damage, in any unit."""
UNUSED = 300
"""Most names in a note on what a log has besides, and is not used."""
MOTORS = 40.0
"""Lowest logging rate at which motor outputs can drive a simulation, Hz."""


@dataclass(frozen=True)
class Stream:
    """Numbers over time."""

    time: np.ndarray
    """(n,) times, s of the record's clock, increasing."""
    values: np.ndarray
    """(n, k) finite values."""

    @property
    def rate(self) -> float:
        """Sampling rate, Hz: one divided by the median time between samples. 0 for fewer than two samples."""
        return float(1 / np.median(np.diff(self.time))) if len(self.time) > 1 else 0.0

    def during(self, start: float, end: float) -> "Stream":
        """The part between two times, s."""
        inside = (self.time >= start) & (self.time <= end)
        return Stream(self.time[inside], self.values[inside])


@dataclass(frozen=True)
class Record:
    """One flight."""

    path: Path
    """The file or folder from which it was read."""
    streams: Mapping[str, Stream]
    """Streams by the names of `KINDS`. Streams that were not recorded are missing."""
    notes: tuple[str, ...] = field(default=())
    """What was left out or changed during reading, in words."""
    pose_age: float | None = None
    """Age of the poses when commands were computed from them, by the gyroscope's clock, s. None: not known."""
    kind: str = ""
    """Of which kind the file is, as `readers.FORMATS` names it."""

    @property
    def span(self) -> tuple[float, float]:
        """First and last time of all streams, s."""
        times = [stream.time for stream in self.streams.values() if len(stream.time)]
        return (min(float(t[0]) for t in times), max(float(t[-1]) for t in times)) if times else (0.0, 0.0)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample of all streams, s."""
        start, end = self.span
        return end - start

    def during(self, start: float, end: float) -> "Record":
        """The part between two times, s."""
        return replace(self, streams={name: stream.during(start, end) for name, stream in self.streams.items()})

    def has(self, *names: str) -> bool:
        """Whether all of these streams were recorded, with at least two samples each."""
        return all(name in self.streams and len(self.streams[name].time) > 1 for name in names)


class Streams:
    """The streams of a log as a reader collects them. It notes what is left out."""

    def __init__(self) -> None:
        self.found: dict[str, Stream] = {}
        self.notes: list[str] = []

    def put(self, name: str, time: np.ndarray, values: np.ndarray, source: str = "") -> bool:
        """Keep the samples that are numbers and whose times rise. The first source of a stream is kept. The times are
        (n,) s, the values (n, k). `source` is where they are from, for the notes. Returns whether any sample was kept.
        """
        if name in self.found:
            return False
        of, total = f"{name}{source and f' of {source}'}", len(time)
        good = (np.abs(time) < HUGE) & (np.abs(values) < HUGE).all(1)
        time, values = time[good], values[good]
        latest = np.concatenate([[-np.inf], np.maximum.accumulate(time)[:-1]]) if len(time) else time
        rising = time > latest
        lost = {"are no numbers": total - len(time), "have times that do not rise": int((~rising).sum())}
        for why, count in lost.items():
            if count:
                self.notes.append(f"{count} of {total} samples of {of} are left out: they {why}")
        time, values = time[rising], values[rising]
        if name in ("rotor_speed", "quaternion", "specific_force") and len(time) and not values.any():
            self.notes.append(f"{of} is left out: it is always 0, so it was not measured")
        elif len(time):
            self.found[name] = Stream(time, values)
        return name in self.found

    def record(self, path: Path, pose_age: float | None = None) -> Record:
        """What was collected.

        Raises:
            ValueError: when that is nothing.
        """
        if not self.found:
            told = "".join(f"; {note}" for note in self.notes)
            accepted = "body rates, forces, poses, motors or commands"
            raise ValueError(f"{path}: has nothing that is used here{told}; accepted: {accepted}")
        return Record(path, self.found, tuple(self.notes), pose_age)


def listed(names: Iterable[str], most: int = 12) -> str:
    """Names for people, the first few of them, as one plain line."""
    names = [plain(name) for name in names]
    more = f" and {len(names) - most} more" if len(names) > most else ""
    return ", ".join(names[:most]) + more


def plain(text: str) -> str:
    """A text of somebody else, without the control characters that would move a terminal's cursor."""
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def percent(share: float) -> str:
    """A share for people, with two digits and no exponent."""
    return f"{100 * share:.0f} %" if share >= 0.095 else f"{100 * share:.2g} %"
