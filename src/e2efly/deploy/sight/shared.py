"""Images in shared memory: the newest one of a camera, from the process that takes them to the one that flies.

A camera's driver may block, start threads or crash, so it lives in a process of its own. That process publishes; the
bridge reads the newest image and never waits. The layout is in docs/image-sources.md, for publishers in any language.
"""

import mmap
import os
import struct
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from e2efly.deploy.policy.images import Image
from e2efly.deploy.sight.fit import fitted
from e2efly.deploy.sight.source import Frame

MAGIC = b"E2EIMG01"
TYPES = (np.dtype("<f4"), np.dtype("u1"), np.dtype("<u2"))
"""By number: the value itself; 255 for 1; millimetres."""
_HEADER, _SEQUENCE, _SLOT = struct.Struct("<8s4I2d"), struct.Struct("<Q"), struct.Struct("<Qd")
AT_SEQUENCE, AT_SLOTS = 40, 48
"""Where the number of the newest image is, and the first of the two places for images."""
_TRIES = 3
"""How often a reader begins anew where the publisher has overtaken it."""


@dataclass(frozen=True)
class Layout:
    """What all images of a camera are like."""

    height: int
    width: int
    channels: int
    """1 or 3."""
    kind: int
    """Of `TYPES`."""
    fov: tuple[float, float]
    """Horizontal and vertical field of view, rad; zeros: that of the policy's camera."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Of an image."""
        return (self.height, self.width) if self.channels == 1 else (self.height, self.width, self.channels)

    @property
    def slot(self) -> int:
        """Bytes of one of the two places for images, a multiple of 8."""
        return _SLOT.size + -(-self.height * self.width * self.channels * TYPES[self.kind].itemsize // 8) * 8

    @property
    def size(self) -> int:
        """Bytes of all."""
        return AT_SLOTS + 2 * self.slot

    def packed(self) -> bytes:
        """The header."""
        return _HEADER.pack(MAGIC, self.height, self.width, self.channels, self.kind, *self.fov)

    @staticmethod
    def of(header: bytes, where: str) -> "Layout":
        """Read a header.

        Raises:
            ValueError: naming the file and what is wrong with it.
        """
        if len(header) < _HEADER.size:
            raise ValueError(f"{where} has {len(header)} bytes; accepted: a header of {_HEADER.size}")
        magic, height, width, channels, kind, across, down = _HEADER.unpack(header[: _HEADER.size])
        if magic != MAGIC:
            raise ValueError(f"{where} begins with {magic!r}; accepted: {MAGIC!r}")
        if not (1 <= height <= 8192 and 1 <= width <= 8192 and channels in (1, 3) and kind < len(TYPES)):
            said = f"{height} rows, {width} columns, {channels} channels and type {kind}"
            raise ValueError(f"{where} has {said}; accepted: 1 to 8192, 1 to 8192, 1 or 3, and 0 to {len(TYPES) - 1}")
        if not (0 <= across < np.pi and 0 <= down < np.pi and (across > 0) == (down > 0)):
            raise ValueError(f"{where} has the field of view {across} {down}; accepted: two angles below pi, or zeros")
        return Layout(height, width, channels, kind, (across, down))


def place(name: str) -> Path:
    """The file of a camera's shared memory.

    Raises:
        ValueError: for a name that is no word.
    """
    if not name.replace("-", "_").isidentifier():
        raise ValueError(f"name of shared images is {name!r}; accepted: letters, digits, _ and -")
    memory = Path("/dev/shm")  # where Linux keeps files in memory
    return (memory if memory.is_dir() else Path(tempfile.gettempdir())) / f"e2efly_{name}"


class SharedImages:
    """The publisher's end."""

    def __init__(
        self, name: str, shape: tuple[int, ...], dtype: str = "float32", fov: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Make room, or take the room of an earlier publisher of the same images.

        Args:
            name: by which `--image NAME=shm:name` finds them.
            shape: (h, w) or (h, w, 3).
            dtype: float32 (the value), uint8 (255 for 1) or uint16 (millimetres).
            fov: horizontal and vertical field of view, rad; left out: that of the policy's camera.

        Raises:
            ValueError: naming what is wrong with shape, type or name.
            OSError: where the file cannot be written.
        """
        known = [t.name for t in TYPES]
        if dtype not in known:
            raise ValueError(f"dtype is {dtype!r}; accepted: {', '.join(known)}")
        channels = shape[2] if len(shape) == 3 else 1
        if len(shape) not in (2, 3):
            raise ValueError(f"shape is {shape}; accepted: (h, w) or (h, w, 3)")
        wanted = Layout(shape[0], shape[1], channels, known.index(dtype), fov)
        self.layout = Layout.of(wanted.packed(), "shape")
        self.path = place(name)
        self._memory = self._taken() or self._made()
        (self._count,) = _SEQUENCE.unpack_from(self._memory, AT_SEQUENCE)

    def _taken(self) -> mmap.mmap | None:
        """The room of an earlier publisher, where its images are the same: who reads them goes on."""
        with suppress(OSError), self.path.open("r+b") as file:
            if os.fstat(file.fileno()).st_size == self.layout.size and file.read(_HEADER.size) == self.layout.packed():
                return mmap.mmap(file.fileno(), self.layout.size)
        return None

    def _made(self) -> mmap.mmap:
        """Room of its own: another file, as a reader of the old one would die were that made shorter."""
        draft = self.path.with_name(f"{self.path.name}.{os.getpid()}")
        with os.fdopen(os.open(draft, os.O_RDWR | os.O_CREAT | os.O_TRUNC, 0o600), "r+b") as file:
            file.truncate(self.layout.size)
            file.write(self.layout.packed())
            file.flush()
            memory = mmap.mmap(file.fileno(), self.layout.size)
        draft.replace(self.path)
        return memory

    def publish(self, time: float, image: np.ndarray) -> None:
        """Make an image the newest.

        Args:
            time: when it was exposed, s on this machine's monotonic clock (`time.monotonic()`), not when it arrived.
            image: of the shape and the type that were announced.

        Raises:
            ValueError: for another shape or type.
        """
        dtype = TYPES[self.layout.kind]
        if image.shape != self.layout.shape or image.dtype != dtype:
            raise ValueError(
                f"image has shape {image.shape} and type {image.dtype}; accepted: {self.layout.shape} and {dtype.name}"
            )
        self._count += 1
        at = AT_SLOTS + (self._count % 2) * self.layout.slot
        _SLOT.pack_into(self._memory, at, self._count, time)  # first: who reads the old image sees that it goes
        content = np.ascontiguousarray(image).tobytes()
        self._memory[at + _SLOT.size : at + _SLOT.size + len(content)] = content
        _SEQUENCE.pack_into(self._memory, AT_SEQUENCE, self._count)

    def close(self) -> None:
        """Let go; what was published stays until the machine restarts, and grows too old to be flown by."""
        self._memory.close()


class SharedCamera:
    """The bridge's end: an image source."""

    def __init__(self, name: str, camera: Image) -> None:
        """Open what somebody publishes.

        Args:
            name: of the images.
            camera: of the policy's contract, to which they are cut and resampled.

        Raises:
            ValueError: when nobody publishes under this name, or what is published is not what the policy sees.
        """
        self.problem: str | None = None
        self._name, self._camera, self._last = name, camera, 0
        path = place(name)
        where = f"shm:{name} ({path})"
        try:
            with path.open("rb") as file:
                self._layout = Layout.of(file.read(_HEADER.size), where)
                self._memory = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)
        except OSError as error:
            raise ValueError(f"{where}: {error.strerror}; accepted: images that a running program publishes") from None
        if len(self._memory) != self._layout.size:
            raise ValueError(
                f"{where} has {len(self._memory)} bytes; accepted: {self._layout.size}, as its header says"
            )
        fitted(np.zeros(self._layout.shape, np.float32), self._layout.fov, camera, where)  # refused here, not in flight

    def read(self, now: float) -> list[Frame]:
        """The newest image, where it is new."""
        del now
        for _ in range(_TRIES):
            (count,) = _SEQUENCE.unpack_from(self._memory, AT_SEQUENCE)
            if count == self._last:
                return []
            layout = self._layout
            at = AT_SLOTS + (count % 2) * layout.slot
            begun, time = _SLOT.unpack_from(self._memory, at)
            size = layout.height * layout.width * layout.channels
            raw = np.frombuffer(self._memory, TYPES[layout.kind], size, at + _SLOT.size).copy()
            if begun == count == _SLOT.unpack_from(self._memory, at)[0]:
                self._last = count
                return [Frame(time, self._fitted(raw.reshape(layout.shape)))]
        self.problem = f"shm:{self._name}: the publisher was faster than the reader"
        return []

    def close(self) -> None:
        """Let go."""
        self._memory.close()

    def describe(self) -> str:
        """Where from, and how large."""
        return f"shm:{self._name}, {self._layout.height} rows, {self._layout.width} columns"

    def _fitted(self, raw: np.ndarray) -> np.ndarray:
        value = raw.astype(np.float32) * (1.0, 1 / 255, 1e-3)[self._layout.kind]
        return fitted(value, self._layout.fov, self._camera, f"shm:{self._name}")
