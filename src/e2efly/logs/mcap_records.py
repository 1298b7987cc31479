"""Reads MCAP files record by record, with bounded memory and time, whoever wrote them.

Source of the layout: the specification of MCAP, mcap.dev/spec. All numbers are little endian.
"""

import struct
import zlib
from collections.abc import Iterator
from mmap import mmap
from typing import NamedTuple

from e2efly.logs.expand import Expander

MAGIC = b"\x89MCAP0\r\n"
"""First bytes of a file."""
MESSAGES = 2_000_000
"""Largest number of messages that are read from a file: more than half an hour of everything that the bridge logs."""
_HEADER, _FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK = range(1, 7)
_KNOWN = range(1, 16)
_NEVER = 1 << 63  # ns: the times of a log are signed 64-bit numbers
_FOREIGN = 0x80  # records of other programs' own have opcodes from here on
_RECORD, _MESSAGE_HEAD, _CHUNK_HEAD = struct.Struct("<BQ"), struct.Struct("<HIQQ"), struct.Struct("<QQQI")
_SHORT, _LONG = struct.Struct("<I"), struct.Struct("<Q")  # numbers of bytes


class McapChannel(NamedTuple):
    """What the messages of a channel are."""

    topic: str
    encoding: str
    """Of the messages: json, cdr, ros1, ..."""
    kind: str
    """Name of the schema. Empty if the channel has none."""
    schema_encoding: str
    schema: bytes


class Message(NamedTuple):
    """One message."""

    channel: McapChannel
    number: int
    """Its sequence number."""
    stamp: int
    """Its log time, ns."""
    data: bytes


class McapRecords:
    """The messages of an MCAP file, up to its end or up to where it is damaged."""

    def __init__(self, data: bytes | mmap) -> None:
        """Begin a file, given all of its bytes."""
        self.profile: str | None = None
        """The profile in the file's header. None until the header has been read."""
        self.cut_off = ""
        """Why reading ended early. Empty at the proper end."""
        self._data, self._expand = data, Expander(len(data))
        self._schemas: dict[int, tuple[str, str, bytes]] = {}
        self._channels: dict[int, McapChannel] = {}

    def __iter__(self) -> Iterator[Message]:
        """Read the messages in the order of the file."""
        count = 0
        try:
            if self._data[: len(MAGIC)] != MAGIC:
                raise ValueError("no MCAP file")
            for message in self._walk(self._data, len(MAGIC)):
                if count == MESSAGES:
                    self.cut_off = f"the first {MESSAGES} messages are read, and no more"
                    return
                count += 1
                yield message
        except EOFError:
            self.cut_off = "the end of the file is missing: it was not closed"
        except (ValueError, struct.error, KeyError) as error:
            self.cut_off = f"the file is damaged from here on ({error})"

    def _walk(self, data: bytes | mmap, at: int, inside: bool = False) -> Iterator[Message]:
        """The messages among the records from a place on, `inside` a chunk or in the file."""
        end = len(data)
        while at < end or not inside:
            if at + _RECORD.size > end:
                raise EOFError
            opcode, size = _RECORD.unpack_from(data, at)
            at += _RECORD.size
            if opcode not in _KNOWN and opcode < _FOREIGN:
                raise ValueError(f"record of kind {opcode}")
            if size > end - at:
                raise EOFError
            content, at = data[at : at + size], at + size
            if opcode == _MESSAGE:
                channel, number, stamp, _ = _MESSAGE_HEAD.unpack_from(content)
                if stamp >= _NEVER:
                    raise ValueError(f"a message of the time {stamp} ns")
                yield Message(self._channels[channel], number, stamp, content[_MESSAGE_HEAD.size :])
            elif opcode == _SCHEMA:
                (number,) = struct.unpack_from("<H", content)
                name, then = _text(content, 2)
                encoding, then = _text(content, then)
                self._schemas[number] = name, encoding, _prefixed(content, then, _SHORT)[0]
            elif opcode == _CHANNEL:
                number, schema = struct.unpack_from("<HH", content)
                topic, then = _text(content, 4)
                encoding, _ = _text(content, then)
                known = self._schemas[schema] if schema else ("", "", b"")
                self._channels[number] = McapChannel(topic, encoding, *known)
            elif inside:
                raise ValueError(f"record of kind {opcode} in a chunk")
            elif opcode == _HEADER:
                self.profile, _ = _text(content, 0)
            elif opcode == _CHUNK:
                yield from self._walk(self._chunk(content), 0, inside=True)
            elif opcode == _FOOTER:
                return

    def _chunk(self, content: bytes) -> bytes:
        """The records of a chunk."""
        _, _, size, crc = _CHUNK_HEAD.unpack_from(content)
        compression, then = _text(content, _CHUNK_HEAD.size)
        out = self._expand(compression, _prefixed(content, then, _LONG)[0])
        if len(out) != size or (crc and zlib.crc32(out) != crc):
            raise ValueError("a chunk does not have the size and the checksum that it says")
        return out


def _prefixed(data: bytes, at: int, form: struct.Struct) -> tuple[bytes, int]:
    """The bytes behind their number, and the place behind them."""
    (size,) = form.unpack_from(data, at)
    at += form.size
    if size > len(data) - at:
        raise ValueError("a record is shorter than its content")
    return data[at : at + size], at + size


def _text(data: bytes, at: int) -> tuple[str, int]:
    text, then = _prefixed(data, at, _SHORT)
    return str(text, "utf-8"), then
