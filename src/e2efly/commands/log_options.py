"""Options of the commands that read flight logs."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from rich.console import Console

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence
    from pathlib import Path

    from e2efly.logs.readers import LogReading
    from e2efly.logs.recording import Record
    from e2efly.vehicles.vehicle import Vehicle


@dataclass(frozen=True)
class LogOptions:
    """How logs are read."""

    columns: tuple[str, ...] = ()
    """Maps the column names of a CSV log, or of the record of a thrust stand, to ours: OURS=THEIRS or
    OURS=THEIRS*FACTOR, as in az=acc_z*9.81. In a log of any other kind, THEIRS is one of our names of the same stream,
    as in az=az*9.81 or m1=m4."""
    topics: tuple[str, ...] = ()
    """Topics of ROS bags that are taken before all others. The notes on a log say which topics were taken."""
    without: tuple[str, ...] = ()
    """Streams that are left out, such as rotor_speed."""
    sessions: tuple[int, ...] = ()
    """Numbers of the sessions of a blackbox that are read, as its notes give them, from 1. Each is a flight. All unless
    given."""

    def reading(self, known: "Collection[str] | None" = None) -> "LogReading":
        """The options, checked. `known`: our names of columns; those of flights unless given.

        Raises:
            ValueError: naming the option that is wrong, and what is accepted.
        """
        from e2efly.logs.csv_file import COLUMNS, column_map
        from e2efly.logs.readers import LogReading

        columns = column_map(self.columns, COLUMNS if known is None else known)
        return LogReading(columns, self.topics, self.without, self.sessions)


def show_notes(records: "Sequence[Record]", console: Console, known: "Sequence[Record]" = ()) -> None:
    """Print what was left out or changed in each record, except for what was noted on the records that are known."""
    told = {note for record in known for note in record.notes}
    for record in records:
        for note in record.notes:
            if note not in told:
                console.print(f"{record.path.name}: {note}", style="dim", markup=False)


def read_checked(
    files: "Sequence[Path]", reading: "LogReading", vehicle: "Vehicle", console: Console, hovers: bool = False
) -> "list[Record]":
    """The flights of these logs, checked against the vehicle; what was left out, changed and found is printed.

    With `hovers`, all of a log without rotor speeds and motor outputs counts as flown.


    Raises:
        ValueError: naming the log, what is wrong with it, and what is accepted.
    """
    from e2efly.alignment.checks import checked
    from e2efly.logs.blackbox_merge import with_blackboxes
    from e2efly.logs.readers import read_part

    read = with_blackboxes([record for path in files for record in read_part(path, reading)])
    show_notes(read, console)
    records = checked(read, vehicle, hovers)
    show_notes(records, console, read)
    for record in records:
        rates = ", ".join(f"{name} {stream.rate:.0f} Hz" for name, stream in record.streams.items())
        console.print(f"{record.path.name}: {record.duration:.1f} s; {rates}", markup=False)
    return records
