"""Read flight logs of many formats into records. The first bytes of a file show its format, whatever its name is."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from e2efly.config.names import unknown
from e2efly.logs import bag_storage, blackbox, crazyflie, ulog
from e2efly.logs.csv_file import HEAD, Column, delimiter, encoding, read_csv
from e2efly.logs.mcap_file import PROFILE
from e2efly.logs.mcap_records import MAGIC, McapRecords
from e2efly.logs.recording import KINDS, MOTORS, UNUSED, Record, Stream, Streams, listed, plain
from e2efly.logs.ros_bag import read_bag
from e2efly.vehicles.gravity import GRAVITY

if TYPE_CHECKING:
    from e2efly.logs.flight_log import Series

LONGEST = 3 * 3600.0
"""Longest log, s. One wrong time stamp would make a longer one."""
_PART = re.compile(r"(?P<name>.+):(?P<begin>\d+(\.\d+)?)-(?P<end>\d+(\.\d+)?)")


@dataclass(frozen=True)
class LogReading:
    """How logs are read."""

    columns: Mapping[str, Column] = field(default_factory=dict)
    """For columns of a record, the names of the columns in a CSV file and factors. In a log of another kind, those of
    other columns of the same stream."""
    topics: tuple[str, ...] = ()
    """Topics of ROS bags that are taken before all others."""
    without: tuple[str, ...] = ()
    """Streams that are left out."""
    sessions: tuple[int, ...] = ()
    """Numbers of the sessions of a blackbox that are read, from 1. All unless given."""

    def __post_init__(self) -> None:
        """Check the names of the streams.

        Raises:
            ValueError: naming the stream that is none.
        """
        for name in self.without:
            if name not in KINDS:
                raise ValueError(f"--without: {unknown('stream', name, KINDS)}")


class Format(NamedTuple):
    """One format of a log."""

    name: str
    begins: Callable[[bytes], bool]
    """Whether a file with this beginning has the format."""
    read: Callable[[Path, LogReading], list[Record]]


def read_flights(path: Path, reading: LogReading | None = None) -> list[Record]:
    """The flights of a log. A blackbox can contain several. `path` is the file, or the folder of a ROS 2 bag.

    Raises:
        ValueError: naming the file, what is wrong with it and what is accepted. No other error comes from the content
            of a file.
    """
    reading = reading or LogReading()
    form = format_of(path)
    try:
        with np.errstate(all="ignore"):  # of damaged numbers; what is not finite is left out
            found = form.read(path, reading)
            return [_finished(replace(record, kind=form.name), reading) for record in found]
    except MemoryError:
        raise ValueError(f"{path}: {form.name} that needs more memory than there is; accepted: a part of it") from None
    except Exception as error:  # whatever strange content leads to becomes the one error of a reader
        if isinstance(error, ValueError) and str(path) in str(error):
            raise
        why = plain(f"{type(error).__name__}: {error}")
        raise ValueError(f"{path}: {form.name} that cannot be read ({why:.300}); accepted: {ACCEPTED}") from error


def format_of(path: Path) -> Format:
    """The format of a log, by its first bytes.

    Raises:
        ValueError: when there is no such file, or when it has none of `FORMATS`.
    """
    if not path.exists():
        raise ValueError(f"log {str(path)!r} does not exist; accepted: {ACCEPTED}")
    if path.is_dir():
        return _BAG
    if not (head := _head(path)):
        raise ValueError(f"{path}: is empty; accepted: {ACCEPTED}")
    found = next((form for form in FORMATS if form.begins(head)), None)
    if found is None:
        raise ValueError(f"{path}: of no kind that is known here; accepted: {ACCEPTED}")
    return found


def is_log(path: Path) -> bool:
    """Whether a path leads to a log: a file that begins as one, or the folder of a ROS 2 bag."""
    if path.is_dir():
        return (path / "metadata.yaml").is_file()
    return path.is_file() and any(form.begins(_head(path)) for form in FORMATS)


def _head(path: Path) -> bytes:
    with path.open("rb") as file:
        return file.read(HEAD)


def _is_ours(head: bytes) -> bool:
    records = McapRecords(head)
    next(iter(records), None)
    return head.startswith(MAGIC) and records.profile == PROFILE


def _is_table(head: bytes) -> bool:
    code = encoding(head)
    first = head.decode(code, "replace").partition("\n")[0] if code else ""
    return delimiter(first) in first and not first.lstrip().startswith(("{", "["))  # nor JSON


_BAG = Format("a ROS bag", lambda head: head.startswith(bag_storage.BEGINNINGS), lambda p, r: [read_bag(p, r.topics)])
BLACKBOX, OURS = "a blackbox", "a flight log of e2efly"
FORMATS = (
    Format(OURS, _is_ours, lambda path, _: [read_mcap(path)]),
    _BAG,
    Format(
        BLACKBOX, lambda head: blackbox.START in head, lambda path, reading: read_betaflight(path, reading.sessions)
    ),
    Format("a PX4 log", lambda head: head.startswith(ulog.MAGIC), lambda path, _: [ulog.read_ulog(path)]),
    Format(
        "a log of a Crazyflie's micro-SD deck",
        lambda head: head.startswith(crazyflie.MAGIC),
        lambda path, _: [crazyflie.read_crazyflie(path)],
    ),
    Format("a CSV file", _is_table, lambda path, reading: [read_csv(path, reading.columns)]),
)
"""All formats. The first that fits counts."""
ACCEPTED = (
    "our .mcap, a CSV file, a ROS 1 .bag, a ROS 2 bag (its folder, or a .db3 or .mcap), Betaflight's blackbox, PX4's "
    ".ulg, or the log of a Crazyflie's micro-SD deck"
)


def _finished(record: Record, reading: LogReading) -> Record:
    """A record as the options ask for it."""
    if record.duration > LONGEST:
        raise ValueError(
            f"{record.path}: lasts {record.duration:.6g} s from its first time to its last; accepted: up to "
            f"{LONGEST:g} s (one wrong time stamp may be the reason)"
        )
    streams, notes = dict(record.streams), list(record.notes)
    if reading.sessions and record.kind != BLACKBOX:
        notes.append(f"--sessions does not concern it: {record.kind} has one flight")
    for name in reading.without:
        if streams.pop(name, None) is not None:
            notes.append(f"{name} is left out, as asked")
    if record.kind != "a CSV file":
        streams |= _mapped(streams, reading.columns, notes)
    if "setpoint" in streams and "command" not in streams and "command" not in reading.without:
        setpoint = streams["setpoint"]
        thrust = np.full((len(setpoint.time), 1), GRAVITY)  # never changes, which says that it is not known
        streams["command"] = Stream(setpoint.time, np.concatenate([thrust, setpoint.values], 1))
    return replace(record, streams=streams, notes=tuple(map(plain, notes)))


def _mapped(streams: Mapping[str, Stream], columns: Mapping[str, Column], notes: list[str]) -> dict[str, Stream]:
    """The streams that `--columns` changes: a factor, or columns of the same stream in another order."""
    changed = {}
    for name, stream in streams.items():
        own = KINDS[name].names(stream.values.shape[1])
        asked = {ours: columns[ours] for ours in own if ours in columns and columns[ours].theirs in own}
        if asked:
            each = [asked.get(ours, Column(ours, 1.0)) for ours in own]
            values = np.stack([stream.values[:, own.index(c.theirs)] * c.factor for c in each], -1)
            changed[name] = Stream(stream.time, values)
            notes.append(f"{listed(asked)} of {name} are changed, as --columns asks")
    return changed


def read_part(path: Path, reading: LogReading | None = None) -> list[Record]:
    """The flights of a log. For LOG:BEGIN-END, only the part between these two times, s after the start of the log.

    Raises:
        ValueError: as for `read_flights`; when there is nothing between the two times.
    """
    asked = None if path.exists() else _PART.fullmatch(path.name)
    if asked is None:
        return read_flights(path, reading)
    begin, end = float(asked["begin"]), float(asked["end"])
    found = []
    for record in read_flights(path.with_name(asked["name"]), reading):
        first, length = record.span[0], record.duration
        if not begin < min(end, length):
            raise ValueError(
                f"{path}: is from {begin:g} to {end:g} s, of a log of {length:.1f} s; accepted: LOG:BEGIN-END in s "
                "after the log begins, BEGIN below END"
            )
        part = record.during(first + begin, first + end)
        kept = {name: stream for name, stream in part.streams.items() if len(stream.time)}
        found.append(replace(part, streams=kept, notes=(*record.notes, f"used from {begin:g} to {end:g} s, as asked")))
    return found


def read_mcap(path: Path) -> Record:
    """A flight log of e2efly (docs/telemetry.md).

    Raises:
        ValueError: as for `read_log`; when it has none of the channels that are used here.
    """
    from e2efly.logs.flight_log import read_log

    log = read_log(path)
    streams = Streams()
    if log.cut_off:
        streams.notes.append(f"cut off: {log.cut_off}")

    def take(name: str, channel: str, field: str, size: int | None, delay: str = "") -> None:
        series = log[channel]
        if not len(series):
            return
        values = series.numbers(field, size)
        values = values[:, None] if size is None else values
        time = series.time - (np.nan_to_num(series.numbers(delay)) if delay else 0.0)
        streams.put(name, time, values)

    for name, size in (("position", 3), ("velocity", 3), ("quaternion", 4)):
        take(name, "odometry", name, size, "age")
    take("body_rate", "imu", "gyro", 3)
    take("specific_force", "imu", "specific_force", 3)
    take("motor", "motors", "values", 4)
    take("voltage", "battery", "voltage", None)
    commands = log["command"]
    if len(commands):
        values = np.column_stack([commands.numbers("collective_thrust"), commands.numbers("body_rate", 3)])
        streams.put("command", commands.time, values)
    channels = log["rc"]
    if "command" in streams.found and len(channels):
        streams.put("setpoint", channels.time, _asked(streams.found["command"], channels))
    if "motor" in streams.found and streams.found["motor"].rate < MOTORS:
        streams.notes.append(
            f"motor outputs at {streams.found['motor'].rate:.0f} Hz: too few to show inertia and motor lag, and by "
            "commands alone they are as wrong as Betaflight's rate loop is unlike the simulation's; fly: e2efly fly "
            "excitation, or give the blackbox of the flight, too"
        )
    ages = log["odometry"].numbers("age") if len(log["odometry"]) else np.array([np.nan])
    age = float(np.nanmean(ages)) if np.isfinite(ages).any() else None
    return streams.record(path, age)


def _asked(command: Stream, channels: "Series") -> np.ndarray:
    """The body rates that the channels of the remote control request, (n, 3) rad/s. NaN before the first command.

    The relation between pulses and rates is found from the log: smooth curves are fitted from the pulses to the
    commanded rates, at the delay at which they fit best.
    """
    time, pulses = channels.time, channels.numbers("channels", channels.width("channels"))[:, :3]
    x = (pulses - 1500) / 500
    best, least = np.full(x.shape, np.nan), np.inf
    for late in np.arange(0.0, 0.1, 0.002):
        at = np.searchsorted(command.time, time - late, side="right") - 1
        good = (at >= 0) & np.isfinite(x).all(1)
        if good.sum() < 20:
            continue
        curves = [  # with full=True without a warning: of a stick that rests, any curve will do
            np.polynomial.Polynomial.fit(x[good, i], command.values[at[good], 1 + i], 3, full=True)[0] for i in range(3)
        ]
        rates = np.stack([curve(x[:, i]) for i, curve in enumerate(curves)], -1)
        left = float(np.mean((rates[good] - command.values[at[good], 1:]) ** 2))
        if left < least:
            best, least = np.where((time >= command.time[0])[:, None], rates, np.nan), left
    return best


def read_betaflight(path: Path, sessions: Sequence[int] = ()) -> list[Record]:
    """The sessions of a blackbox, or those with these numbers.

    Raises:
        ValueError: as for `read_blackbox`. Also for a vehicle that is no quadrotor.
    """
    records = []
    for session in blackbox.read_blackbox(path, numbers=sessions):
        if session.motors not in (0, 4):
            raise ValueError(
                f"{path}: session {session.session} has outputs of {session.motors} motors; accepted: a quadrotor's 4"
            )
        streams = Streams()
        streams.notes += [f"session {session.session}, {session.firmware:.60}", *session.notes]
        offered = {
            "body_rate": session.gyro, "motor": session.output, "setpoint": session.setpoint,
            "specific_force": session.force, "rotor_speed": session.rotor_speed, "voltage": session.voltage,
        }  # fmt: skip
        for name, values in offered.items():
            if values is not None and not np.isnan(values).all():
                streams.put(name, session.time, values)
        if absent := [name for name in offered if name not in streams.found]:
            streams.notes.append(f"the log has no {listed(absent)}")
        if session.unused:
            streams.notes.append(f"fields that are not used: {listed(session.unused, UNUSED)}")
        records.append(streams.record(path))
    return records
