"""Images in shared memory: the newest image of a camera, from the process that takes it to the process that flies.

A camera's driver may block, start threads or crash, so it runs in its own process. That process publishes. The bridge
reads the newest image and never waits. The layout is in docs/image-sources.md, for publishers in any language.
"""

import mmap
from time import monotonic

import numpy as np

from e2efly.flight.scripts.shared_images import (
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
from e2efly.flight.sight.fit import fitted
from e2efly.flight.sight.image_source import Frame
from e2efly.policy.images import Image

__all__ = ["SharedCamera", "SharedImages", "place"]
_TYPES = tuple(np.dtype(name).newbyteorder("<") for name in TYPES)
_HELD_UP_S = 1.0
"""The longest time for which the reading loop may have been delayed since its `now`, s. New images may have come in
this time."""
_TRIES = 3
"""How many times a reader tries again if the publisher has overtaken it."""


class SharedImages:
    """The publisher's side."""

    def __init__(
        self, name: str, shape: tuple[int, ...], dtype: str = "float32", fov: tuple[float, float] = (0.0, 0.0)
    ) -> None:
        """Create the shared memory, or take over that of an earlier publisher of the same images.

        Args:
            name: the name for `--image NAME=shm:name`.
            shape: (h, w) or (h, w, 3).
            dtype: float32 (the value), uint8 (255 for 1) or uint16 (millimetres).
            fov: horizontal and vertical field of view, rad. If omitted, the field of view of the policy's camera.

        Raises:
            ValueError: naming what is wrong with the shape, the type or the name.
            OSError: if the file cannot be written.
        """
        self._publisher = Publisher(name, Layout.wanted(shape, dtype, fov))
        self.layout, self.path = self._publisher.layout, self._publisher.path

    def publish(self, time: float, image: np.ndarray) -> None:
        """Publish an image as the newest.

        Args:
            time: time of exposure, s on this machine's monotonic clock (`time.monotonic()`), not the time of arrival.
            image: an image of the shape and the type that were announced.

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
        """Release the memory. What was published stays until the machine restarts, and becomes too old for flight."""
        self._publisher.close()


class SharedCamera:
    """The bridge's side: an image source."""

    def __init__(self, name: str, camera: Image, called: str | None = None) -> None:
        """Open images that another program publishes. They are cropped and resampled to `camera`. `called` is the name
        of the source for people. If omitted, it is that of the images.

        Raises:
            ValueError: if no program publishes under this name, or if the published images are not what the policy
                sees.
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
        """The newest image, if it is new. An image that was exposed after `now` is left for the next call."""
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
                if now < time <= monotonic() < now + _HELD_UP_S:  # no clock has jumped
                    return []
                self._last = count
                return [Frame(time, self._fitted(raw.reshape(layout.shape)))]
        self.problem = f"{self._name}: the publisher was faster than the reader"
        return []

    def close(self) -> None:
        """Release the memory."""
        self._memory.close()

    def describe(self) -> str:
        """The source, and the size of its images."""
        return f"{self._name}, {self._layout.height} rows, {self._layout.width} columns"

    def _fitted(self, raw: np.ndarray) -> np.ndarray:
        value = raw.astype(np.float32) * (1.0, 1 / 255, 1e-3)[self._layout.kind]
        if raw.dtype == _TYPES[0] and self._camera.sees in ("depth", "range"):  # ROS's holes and sky
            far = self._camera.reach_m[1]
            value = np.nan_to_num(value, copy=False, nan=0.0, posinf=far, neginf=0.0)
        return fitted(value, self._layout.fov, self._camera, self._name)
