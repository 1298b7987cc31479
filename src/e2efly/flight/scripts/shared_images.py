"""Publishes images in shared memory. It needs only Python 3.8, so every script that has images can use it.

docs/image-sources.md describes the layout, for publishers in any language.
"""

from __future__ import annotations

import math
import mmap
import os
import struct
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

MAGIC = b"E2EIMG01"
TYPES = {"float32": 4, "uint8": 1, "uint16": 2}
"""Bytes per value of each type, in the order of the types' numbers. float32 holds the value itself, in uint8 255 stands
for 1, and uint16 holds millimetres."""
HEADER, SEQUENCE, SLOT = struct.Struct("<8s4I2d"), struct.Struct("<Q"), struct.Struct("<Qd")
AT_SEQUENCE, AT_SLOTS = 40, 48


@dataclass(frozen=True)
class Layout:
    """The layout of all images of a camera."""

    height: int
    width: int
    channels: int
    """1 or 3."""
    kind: int
    """The type of the values: its number in `TYPES`."""
    fov: tuple[float, float]
    """Horizontal and vertical field of view, rad. Zeros: that of the policy's camera."""

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of an image: (h, w), or (h, w, 3)."""
        return (self.height, self.width) if self.channels == 1 else (self.height, self.width, self.channels)

    @property
    def type(self) -> str:
        """The type of the values: its name in `TYPES`."""
        return list(TYPES)[self.kind]

    @property
    def bytes(self) -> int:
        """Size of an image's values, bytes."""
        return self.height * self.width * self.channels * TYPES[self.type]

    @property
    def slot(self) -> int:
        """Size of one of the two slots for images, bytes, a multiple of 8."""
        return SLOT.size + -(-self.bytes // 8) * 8

    @property
    def size(self) -> int:
        """Size of the shared memory, bytes."""
        return AT_SLOTS + 2 * self.slot

    def packed(self) -> bytes:
        """The header of the shared memory."""
        return HEADER.pack(MAGIC, self.height, self.width, self.channels, self.kind, *self.fov)

    @staticmethod
    def of(header: bytes, where: str) -> Layout:
        """Read a header.

        Raises:
            ValueError: the header is not valid. The message names the file and what is wrong with it.
        """
        if len(header) < HEADER.size:
            raise ValueError(f"{where} has {len(header)} bytes; accepted: a header of {HEADER.size}")
        magic, height, width, channels, kind, across, down = HEADER.unpack(header[: HEADER.size])
        if magic != MAGIC:
            raise ValueError(f"{where} begins with {magic!r}; accepted: {MAGIC!r}")
        if not (1 <= height <= 8192 and 1 <= width <= 8192 and channels in (1, 3) and kind < len(TYPES)):
            said = f"{height} rows, {width} columns, {channels} channels and type {kind}"
            raise ValueError(f"{where} has {said}; accepted: 1 to 8192, 1 to 8192, 1 or 3, and 0 to {len(TYPES) - 1}")
        if not (0 <= across < math.pi and 0 <= down < math.pi and (across > 0) == (down > 0)):
            raise ValueError(f"{where} has the field of view {across} {down}; accepted: two angles below pi, or zeros")
        return Layout(height, width, channels, kind, (across, down))

    @staticmethod
    def wanted(shape: tuple[int, ...], type_: str, fov: tuple[float, float]) -> Layout:
        """The layout of images with a shape, (h, w) or (h, w, 3), a type of `TYPES` and a field of view, rad.

        Raises:
            ValueError: the shape, the type or the field of view is not valid. The message says what is wrong.
        """
        if type_ not in TYPES:
            raise ValueError(f"dtype is {type_!r}; accepted: {', '.join(TYPES)}")
        if len(shape) not in (2, 3):
            raise ValueError(f"shape is {shape}; accepted: (h, w) or (h, w, 3)")
        channels = shape[2] if len(shape) == 3 else 1
        return Layout.of(Layout(shape[0], shape[1], channels, list(TYPES).index(type_), fov).packed(), "shape")


def place(name: str) -> Path:
    """The file of a camera's shared memory.

    Raises:
        ValueError: the name has other characters than letters, digits, _ and -.
    """
    if not name.replace("-", "_").isidentifier():
        raise ValueError(f"name of shared images is {name!r}; accepted: letters, digits, _ and -")
    memory = Path("/dev/shm")  # where Linux keeps files in memory
    return (memory if memory.is_dir() else Path(tempfile.gettempdir())) / f"e2efly_{name}"


class Publisher:
    """Publishes images that are given as bytes."""

    def __init__(self, name: str, layout: Layout) -> None:
        """Create the shared memory, or use that of an earlier publisher of the same images.

        Raises:
            ValueError: the name has other characters than letters, digits, _ and -.
            OSError: the file cannot be written.
        """
        self.layout = layout
        self.path = place(name)
        self._memory = self._taken() or self._made()
        (self._count,) = SEQUENCE.unpack_from(self._memory, AT_SEQUENCE)

    def _taken(self) -> mmap.mmap | None:
        """The memory of an earlier publisher, if its images have the same layout, so that its readers can continue.

        None: there is no such memory.
        """
        with suppress(OSError), self.path.open("r+b") as file:
            if os.fstat(file.fileno()).st_size == self.layout.size and file.read(HEADER.size) == self.layout.packed():
                return mmap.mmap(file.fileno(), self.layout.size)
        return None

    def _made(self) -> mmap.mmap:
        """New memory in a new file. If the old file were made shorter, its readers would crash."""
        draft = self.path.with_name(f"{self.path.name}.{os.getpid()}")
        with os.fdopen(os.open(str(draft), os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o600), "r+b") as file:
            file.truncate(self.layout.size)
            file.write(self.layout.packed())
            file.flush()
            memory = mmap.mmap(file.fileno(), self.layout.size)
        draft.replace(self.path)
        return memory

    def put(self, time: float, values: bytes | bytearray | memoryview) -> None:
        """Publish an image as the newest one: `Layout.bytes` bytes, little-endian, row by row from the top. `time` is
        when it was exposed, s on this machine's monotonic clock (`time.monotonic()`), not when it arrived.
        """
        assert len(values) == self.layout.bytes
        self._count += 1
        at = AT_SLOTS + (self._count % 2) * self.layout.slot
        SLOT.pack_into(self._memory, at, self._count, time)  # before the values: readers of the old image notice it
        self._memory[at + SLOT.size : at + SLOT.size + len(values)] = values
        SEQUENCE.pack_into(self._memory, AT_SEQUENCE, self._count)

    def close(self) -> None:
        """Close the memory. The published image stays until the machine restarts, but soon it is too old to fly by."""
        self._memory.close()
