"""An MCAP file that grows by whole blocks. It can give up some blocks to say at its end what is missing."""

import json
import os
from collections import deque
from collections.abc import Mapping
from typing import Any

import numpy as np

from e2efly.config.storage import finite
from e2efly.logs.channels import CHANNELS, json_schema

PROFILE = "e2efly"
"""Profile in the header of the file."""
_BLOCKS_KEPT = 64  # so many of the last blocks may be replaced by the event that says what is missing


class McapFile:
    """An MCAP file that grows by whole chunks only. Raises `OSError` if the disk does not take a chunk."""

    def __init__(self, file: int) -> None:
        self._file, self._size, self._block = file, 0, _Block()
        self.pending: list[float] = []
        """Times of the messages that are not yet in any block of the file, s."""
        self._blocks: deque[tuple[int, list[float]]] = deque(maxlen=_BLOCKS_KEPT)
        """Where the last blocks of the file begin, and the times of their messages."""
        self._room = 0
        """Bytes of the blocks that were given up. The file still has this space on the disk."""
        self._writer = mcap_writer()(self._block, chunk_size=1 << 30)
        self._channels: dict[str, int] = {}
        self._writer.start(profile=PROFILE, library="e2efly")
        self._commit()

    def add(self, channel: str, when: int, number: int, values: Mapping[str, Any]) -> None:
        """Take a message, to be written with the next block. `when` is its log time, ns.

        Raises:
            ValueError: if it cannot be written.
        """
        data = encode(values)
        if not 0 <= when < 1 << 63:
            raise ValueError(f"log time {when} ns; accepted: 0 or more, below 2^63")
        if channel not in self._channels:
            self._channels[channel] = _register(self._writer, channel)
        self._writer.add_message(self._channels[channel], when, data, when, number & 0xFFFFFFFF)
        if channel == "meta":
            self._writer.add_metadata("meta", {_text(key): _text(value) for key, value in values.items()})

    def flush(self) -> None:
        """Write the waiting messages as one block."""
        self._writer.flush()
        self._commit()

    def finish(self) -> None:
        """Write the waiting messages, the index and the end of the file."""
        self._writer.finish()
        self._commit()

    def end_with(self, when: int, number: int, event: Mapping[str, Any]) -> bool:
        """Write one last event over the part of the file that was given up. False if there is not enough room for it
        yet.

        Raises:
            OSError: if there is no block left to give up.
        """
        block = _Block()
        writer = mcap_writer()(block, chunk_size=1 << 30)
        writer.start(profile=PROFILE, library="e2efly")
        writer.flush()
        block.take()  # the file already begins with it
        known = dict.fromkeys((*self._channels, "event"))  # in the same order, so that each keeps its number
        numbers = {channel: _register(writer, channel) for channel in known}
        writer.add_message(numbers["event"], when, encode(event), when, number & 0xFFFFFFFF)
        writer.flush()
        data = block.take()
        try:
            written = 0
            while written < len(data):  # overwriting existing data needs no new room on the disk
                written += os.pwrite(self._file, data[written:], self._size + written)
        except OSError:
            os.ftruncate(self._file, self._size + self._room)
            if not self._blocks:
                raise
            return False
        os.ftruncate(self._file, self._size + len(data))
        return True

    def give_up_block(self) -> list[float]:
        """Give up the last block, so that `end_with` can use its space. Returns the times of its messages."""
        begin, moments = self._blocks.pop()
        self._room += self._size - begin
        self._size = begin
        return moments

    def _commit(self) -> None:
        """Hand the whole block to the operating system, or cut the file back to where it was."""
        data = memoryview(self._block.take())
        try:
            written = 0
            while written < len(data):
                written += os.write(self._file, data[written:])
        except OSError:
            os.ftruncate(self._file, self._size)
            raise
        if self.pending:
            self._blocks.append((self._size, self.pending))
        self.pending = []
        self._size += len(data)


def _register(writer: Any, channel: str) -> int:
    schema = json.dumps(json_schema(CHANNELS[channel])).encode()
    return writer.register_channel(channel, "json", writer.register_schema(f"e2efly.{channel}", "jsonschema", schema))


class _Block:
    """The stream that the MCAP writer sees. It collects what is to be written next."""

    def __init__(self) -> None:
        self._data, self._offset = bytearray(), 0

    def write(self, data: bytes) -> int:
        self._data += data
        return len(data)

    def tell(self) -> int:
        return self._offset + len(self._data)

    def flush(self) -> None:
        pass

    def take(self) -> bytes:
        data, self._data = bytes(self._data), bytearray()
        self._offset += len(data)
        return data


def mcap_writer() -> Any:
    """The writer's class. It is imported late, because flying needs a log but looking at a policy does not."""
    try:
        from mcap.writer import Writer
    except ImportError as error:
        raise ValueError(f"a flight log needs the package mcap ({error}); accepted: pip install mcap") from None
    return Writer


def _text(value: Any) -> str:
    """A text that can be encoded in UTF-8."""
    text = value if isinstance(value, str) else json.dumps(value, default=_plain)
    return text.encode("utf-8", "backslashreplace").decode()


def encode(values: Mapping[str, Any] | list[Any]) -> bytes:
    """A record as JSON, with null for a number that is not finite.

    Raises:
        TypeError: for a type that JSON does not have.
    """
    try:
        return json.dumps(values, allow_nan=False, default=_plain, separators=(",", ":")).encode()
    except ValueError:  # a number that is not finite. This is rare, so the fast way is tried first
        return json.dumps(finite(values), allow_nan=False, default=_plain, separators=(",", ":")).encode()


def _plain(value: Any) -> Any:
    """NumPy's arrays and numbers as Python's."""
    if isinstance(value, np.ndarray | np.generic):
        return finite(value.tolist())
    raise TypeError(f"{type(value).__name__} is no JSON")
