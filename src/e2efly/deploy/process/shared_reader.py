"""Reads the newest image of shared memory. It needs nothing but Python 3.8."""

from __future__ import annotations

import importlib
import mmap


class Reader:
    """The images of one name."""

    def __init__(self, name: str) -> None:
        """Open what is published; it is there before this script starts.

        Raises:
            ValueError: when it is not what a publisher writes.
            OSError: when it is not there.
        """
        self._shared = shared = importlib.import_module("shared_images")
        with shared.place(name).open("rb") as file:
            self.layout = shared.Layout.of(file.read(shared.HEADER.size), name)
            self._memory = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        # what is there is of an earlier run
        (self._last,) = shared.SEQUENCE.unpack_from(self._memory, shared.AT_SEQUENCE)

    def take(self) -> tuple[int, float, bytes] | None:
        """Number, time of exposure and values of the newest image; None: there is no new one."""
        shared, layout = self._shared, self.layout
        (number,) = shared.SEQUENCE.unpack_from(self._memory, shared.AT_SEQUENCE)
        if number == self._last:
            return None
        at = shared.AT_SLOTS + (number % 2) * layout.slot
        begun, moment = shared.SLOT.unpack_from(self._memory, at)
        begin = at + shared.SLOT.size
        values = self._memory[begin : begin + layout.bytes]
        if not begun == number == shared.SLOT.unpack_from(self._memory, at)[0]:
            return None  # it was overtaken; the next look finds the newer one
        self._last = number
        return number, moment, values
