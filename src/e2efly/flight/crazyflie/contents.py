"""Tables of contents: which parameters and log variables a Crazyflie has, by name, with their numbers and types."""

import math
import struct
from dataclasses import dataclass

from e2efly.flight.crazyflie.crtp import LOGS, PARAMETERS

ITEM, INFO = 2, 3
"""Requests of a table: one entry, and how many there are."""
FORMATS = {
    PARAMETERS: {0x08: "B", 0x09: "H", 0x0A: "I", 0x0B: "Q", 0x00: "b", 0x01: "h", 0x02: "i", 0x03: "q", 0x05: "e",
                 0x06: "f", 0x07: "d"},
    LOGS: {1: "B", 2: "H", 3: "I", 4: "b", 5: "h", 6: "i", 7: "f", 8: "e"},
}  # fmt: skip
"""Formats of `struct` by the number of a type."""


@dataclass(frozen=True)
class TableEntry:
    """One parameter or log variable."""

    name: str
    """group.name"""
    id: int
    kind: int
    """The number of its type."""
    format: str
    """Its type as a format of `struct`, little endian. Empty: a type that is not known."""

    @property
    def size(self) -> int:
        """Bytes of a value."""
        return struct.calcsize("<" + self.format)

    def value(self, data: bytes) -> float:
        """The value of the first bytes. NaN for a type that is not known."""
        return float(struct.unpack_from("<" + self.format, data)[0]) if self.format else math.nan


def entry(port: int, data: bytes) -> TableEntry | None:
    """The entry in an answer of ITEM: number, type, group and name. None: it is none."""
    if len(data) < 6 or data[0] != ITEM:
        return None
    kind = data[3] & 0x0F
    group, variable, *_ = (*data[4:].split(b"\0"), b"")
    name = b".".join((group, variable)).decode("ascii", "replace")
    return TableEntry(name, int.from_bytes(data[1:3], "little"), kind, FORMATS[port].get(kind, ""))
