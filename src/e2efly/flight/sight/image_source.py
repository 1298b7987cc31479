"""Where images come from: one small interface, like that for poses."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True)
class Frame:
    """An image as a camera took it."""

    time: float
    """Time of exposure, s on this machine's monotonic clock."""
    image: np.ndarray
    """(h, w) or (h, w, 3). `e2efly.policy.images.Image` defines its values."""


class ImageSource(Protocol):
    """One camera. Nothing here blocks or raises once the source is open."""

    @property
    def problem(self) -> str | None:
        """The last problem. None: no problem so far."""
        ...

    def read(self, now: float) -> list[Frame]:
        """The images that came since the last call, oldest first. `now` is on this machine's monotonic clock, s."""
        ...

    def close(self) -> None:
        """Release all resources. May be called twice."""
        ...

    def describe(self) -> str:
        """A description of the source, for people and logs."""
        ...
