"""Reads the newest image of a shared memory. It needs only Python 3.8."""

from __future__ import annotations

import importlib
import mmap


class Reader:
    """Reads the images that are published under one name."""

    def __init__(self, name: str) -> None:
        """Open the shared memory, which must exist before this script starts.

        Raises:
            ValueError: its header is not that of a publisher.
            OSError: it does not exist.
        """
        self._shared = shared = importlib.import_module("shared_images")
        with shared.place(name).open("rb") as file:
            self.layout = shared.Layout.of(file.read(shared.HEADER.size), name)
            self._memory = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        # the image that is there now may be from an earlier run
        (self._last,) = shared.SEQUENCE.unpack_from(self._memory, shared.AT_SEQUENCE)

    def take(self) -> tuple[int, float, bytes] | None:
        """The number, the time of exposure, s, and the values of the newest image. None: there is no new one."""
        shared, layout = self._shared, self.layout
        (number,) = shared.SEQUENCE.unpack_from(self._memory, shared.AT_SEQUENCE)
        if number == self._last:
            return None
        at = shared.AT_SLOTS + (number % 2) * layout.slot
        begun, moment = shared.SLOT.unpack_from(self._memory, at)
        begin = at + shared.SLOT.size
        values = self._memory[begin : begin + layout.bytes]
        if not begun == number == shared.SLOT.unpack_from(self._memory, at)[0]:
            return None  # it was overwritten meanwhile; the next call finds the newer one
        self._last = number
        return number, moment, values
