"""The time that the bridge uses: the machine's time, or a simulation's."""

import time
from typing import Protocol


class Clock(Protocol):
    """A clock that never goes backwards."""

    def now(self) -> float:
        """The time, s."""
        ...

    def sleep(self, seconds: float) -> None:
        """Let time pass."""
        ...


class MonotonicClock:
    """The machine's monotonic clock. Changes of the wall clock do not affect it."""

    def now(self) -> float:
        """The time, s."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Sleep."""
        time.sleep(max(seconds, 0.0))


MONOTONIC = MonotonicClock()
"""The clock of real flights."""
