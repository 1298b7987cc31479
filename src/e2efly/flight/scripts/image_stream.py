"""The stream of images over TCP between `e2efly hil` and a bridge on another computer. docs/hil.md describes it.

It needs only Python 3.8.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Any

MAGIC = b"E2EHIL01"
"""The bytes at the beginning of a stream."""
MESSAGE = struct.Struct("<2IQd")
"""The header of a message: kind, size of the content in bytes, number, time on the server's monotonic clock, s."""
IMAGE, ANSWER = 1, 2
"""The kinds of messages."""
PING = struct.Struct("<8sQ")
"""The ping that a reader sends to learn the server's time: `PING_MAGIC` and a number."""
PING_MAGIC = b"E2EPING1"
KEPT_S = 20.0
"""Answers that are older than this, s, are not used any more, because the clocks drift."""


def header(layout: Any) -> bytes:
    """The header of a stream: the header of the shared memory, but with `MAGIC` at its beginning."""
    return MAGIC + layout.packed()[len(MAGIC) :]


def image(number: int, moment: float, values: bytes) -> bytes:
    """A message with an image."""
    content = zlib.compress(values, 1)
    return MESSAGE.pack(IMAGE, len(content), number, moment) + content


def unpacked(content: bytes, size: int) -> bytes:
    """The values of an image.

    Raises:
        ValueError: the content cannot be unpacked, or does not have `size` bytes.
    """
    zipped = zlib.decompressobj()
    try:
        values = zipped.decompress(content, size + 1)
    except zlib.error as error:
        raise ValueError(f"an image cannot be unpacked: {error}") from None
    if len(values) != size or not zipped.eof:
        raise ValueError(f"an image has other than {size} bytes")
    return values


@dataclass(frozen=True)
class Answer:
    """The result of a ping."""

    came: float
    """When the answer came, s on the local clock."""
    ahead: float
    """How much the other clock is ahead of the local one, s."""
    doubt: float
    """The possible error of `ahead`, s: half of the round trip."""


class Clocks:
    """Measures how much another computer's clock is ahead. Of the recent answers, the one with the shortest round trip
    is used.
    """

    def __init__(self) -> None:
        self._sent: dict[int, float] = {}
        self._answers: list[Answer] = []
        self._number = 0

    @property
    def best(self) -> Answer | None:
        """The answer that is used. None: no answer has come yet."""
        return min(self._answers, key=lambda answer: answer.doubt, default=None)

    def ping(self, now: float) -> bytes:
        """The bytes of the next ping."""
        self._number += 1
        self._sent = {number: at for number, at in self._sent.items() if now - at < KEPT_S}
        self._sent[self._number] = now
        return PING.pack(PING_MAGIC, self._number)

    def answered(self, number: int, theirs: float, now: float) -> None:
        """Process an answer. An answer to an unknown ping is ignored. `theirs` is the time on the other clock when it
        answered, and `now` the time on the local clock, s.
        """
        sent = self._sent.pop(number, None)
        if sent is not None:
            new = Answer(now, theirs - (sent + now) / 2, (now - sent) / 2)
            self._answers = [old for old in self._answers if now - old.came < KEPT_S] + [new]
