"""Images in shared memory: the newest one of a camera, from the process that takes them to the one that flies.

A camera's driver may block, start threads or crash, so it lives in a process of its own. That process publishes; the
bridge reads the newest image and never waits. The layout is in docs/image-sources.md, for publishers in any language.
"""

import mmap

import numpy as np

from e2efly.deploy.policy.images import Image
from e2efly.deploy.process.shared_images import (
    AT_SEQUENCE,
    AT_SLOTS,
    HEADER,
    SEQUENCE,
    SLOT,
    TYPES,
    Layout,
    Publisher,
    place,
)
from e2efly.deploy.sight.fit import fitted
from e2efly.deploy.sight.source import Frame

__all__ = ["SharedCamera", "SharedImages", "place"]
_TYPES = tuple(np.dtype(name).newbyteorder("<") for name in TYPES)
_TRIES = 3
"""How often a reader begins anew where the publisher has overtaken it."""


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
        self._publisher = Publisher(name, Layout.wanted(shape, dtype, fov))
        self.layout, self.path = self._publisher.layout, self._publisher.path

    def publish(self, time: float, image: np.ndarray) -> None:
        """Make an image the newest.

        Args:
            time: when it was exposed, s on this machine's monotonic clock (`time.monotonic()`), not when it arrived.
            image: of the shape and the type that were announced.

        Raises:
            ValueError: for another shape or type.
        """
        dtype = _TYPES[self.layout.kind]
        if image.shape != self.layout.shape or image.dtype != dtype:
            raise ValueError(
                f"image has shape {image.shape} and type {image.dtype}; accepted: {self.layout.shape} and {dtype.name}"
            )
        self._publisher.put(time, np.ascontiguousarray(image).tobytes())

    def close(self) -> None:
        """Let go; what was published stays until the machine restarts, and grows too old to be flown by."""
        self._publisher.close()


class SharedCamera:
    """The bridge's end: an image source."""

    def __init__(self, name: str, camera: Image, called: str | None = None) -> None:
        """Open what somebody publishes.

        Args:
            name: of the images.
            camera: of the policy's contract, to which they are cut and resampled.
            called: the name of the source for people; left out: that of the images.

        Raises:
            ValueError: when nobody publishes under this name, or what is published is not what the policy sees.
        """
        self.problem: str | None = None
        self._name, self._camera, self._last = called or f"shm:{name}", camera, 0
        path = place(name)
        where = called or f"shm:{name} ({path})"
        try:
            with path.open("rb") as file:
                self._layout = Layout.of(file.read(HEADER.size), where)
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
            (count,) = SEQUENCE.unpack_from(self._memory, AT_SEQUENCE)
            if count == self._last:
                return []
            layout = self._layout
            at = AT_SLOTS + (count % 2) * layout.slot
            begun, time = SLOT.unpack_from(self._memory, at)
            size = layout.height * layout.width * layout.channels
            raw = np.frombuffer(self._memory, _TYPES[layout.kind], size, at + SLOT.size).copy()
            if begun == count == SLOT.unpack_from(self._memory, at)[0]:
                self._last = count
                return [Frame(time, self._fitted(raw.reshape(layout.shape)))]
        self.problem = f"{self._name}: the publisher was faster than the reader"
        return []

    def close(self) -> None:
        """Let go."""
        self._memory.close()

    def describe(self) -> str:
        """Where from, and how large."""
        return f"{self._name}, {self._layout.height} rows, {self._layout.width} columns"

    def _fitted(self, raw: np.ndarray) -> np.ndarray:
        value = raw.astype(np.float32) * (1.0, 1 / 255, 1e-3)[self._layout.kind]
        if raw.dtype == _TYPES[0] and self._camera.sees in ("depth", "range"):  # what ROS says of holes and of the sky
            far = self._camera.reach_m[1]
            value = np.nan_to_num(value, copy=False, nan=0.0, posinf=far, neginf=0.0)
        return fitted(value, self._layout.fov, self._camera, self._name)
