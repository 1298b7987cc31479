"""Where images come from: one small interface, as poses have one."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np


@dataclass(frozen=True)
class Frame:
    """An image as a camera took it."""

    time: float
    """When it was exposed, s on this machine's monotonic clock."""
    image: np.ndarray
    """(h, w) or (h, w, 3): what `e2efly.deploy.policy.images.Image` says of its values."""


class ImageSource(Protocol):
    """One camera. Nothing here blocks or raises once it is open."""

    @property
    def problem(self) -> str | None:
        """What was wrong last; None: nothing so far."""
        ...

    def read(self, now: float) -> list[Frame]:
        """What has come since the last call, oldest first; `now`: this machine's monotonic clock, s."""
        ...

    def close(self) -> None:
        """Let go of everything; may be called twice."""
        ...

    def describe(self) -> str:
        """What this is, for people and logs."""
        ...
