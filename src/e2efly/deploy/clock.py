"""Time as the bridge sees it: the machine's, or a simulation's."""

import time
from typing import Protocol


class Clock(Protocol):
    """A clock that never falls."""

    def now(self) -> float:
        """Seconds."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...


class MonotonicClock:
    """The machine's monotonic clock: what happens to the wall clock does not touch it."""

    def now(self) -> float:
        """Seconds."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(max(seconds, 0.0))


MONOTONIC = MonotonicClock()
"""The clock of real flights."""
