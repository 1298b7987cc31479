"""The stream of images over TCP between `e2efly hil` and a bridge on another computer; docs/hil.md describes it.

It needs nothing but Python 3.8.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Any

MAGIC = b"E2EHIL01"
"""What a stream begins with."""
MESSAGE = struct.Struct("<2IQd")
"""Kind, bytes of the content, number, time on the server's monotonic clock, s."""
IMAGE, ANSWER = 1, 2
"""Kinds of messages."""
PING = struct.Struct("<8sQ")
"""What a reader sends to learn the server's time: `PING_MAGIC` and a number."""
PING_MAGIC = b"E2EPING1"
KEPT_S = 20.0
"""Answers older than this, s, say nothing of the clocks any more: they drift."""


def header(layout: Any) -> bytes:
    """The beginning of a stream: that of the shared memory, with a magic of its own."""
    return MAGIC + layout.packed()[len(MAGIC) :]


def image(number: int, moment: float, values: bytes) -> bytes:
    """A message with an image."""
    content = zlib.compress(values, 1)
    return MESSAGE.pack(IMAGE, len(content), number, moment) + content


def unpacked(content: bytes, size: int) -> bytes:
    """The values of an image.

    Raises:
        ValueError: when they are not so many bytes.
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
    """What a ping has told."""

    came: float
    """s on the own clock."""
    ahead: float
    """Of the other clock, s."""
    doubt: float
    """By which that may be wrong, s: half of the round trip."""


class Clocks:
    """By how much another computer's clock is ahead: of the last answers that with the least round trip counts."""

    def __init__(self) -> None:
        self._sent: dict[int, float] = {}
        self._answers: list[Answer] = []
        self._number = 0

    @property
    def best(self) -> Answer | None:
        """The answer that counts; None: there was none yet."""
        return min(self._answers, key=lambda answer: answer.doubt, default=None)

    def ping(self, now: float) -> bytes:
        """What to send."""
        self._number += 1
        self._sent = {number: at for number, at in self._sent.items() if now - at < KEPT_S}
        self._sent[self._number] = now
        return PING.pack(PING_MAGIC, self._number)

    def answered(self, number: int, theirs: float, now: float) -> None:
        """Take an answer; one that was not asked for is passed over.

        Args:
            number: of the ping.
            theirs: the other clock when it answered, s.
            now: the own clock, s.
        """
        sent = self._sent.pop(number, None)
        if sent is not None:
            new = Answer(now, theirs - (sent + now) / 2, (now - sent) / 2)
            self._answers = [old for old in self._answers if now - old.came < KEPT_S] + [new]
