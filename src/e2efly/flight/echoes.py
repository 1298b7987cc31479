"""Time stamps that an autopilot sends back: how long the link takes, and what has arrived.

For autopilots that stream: a command that was sent together with a stamp that came back has arrived, too.
"""

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any

from e2efly.flight.autopilot import HOLE, arrived

ECHO_S = 0.02
"""Interval of the stamps, s."""
LATEST_S = 1.0
"""Older stamps are not those of this connection, s."""


@dataclass
class Echoes:
    """The stamps of one link."""

    quickest: float = math.inf
    """How long the quickest on this connection took, s."""
    _sent: int = 0
    _came: int = 0
    _echoed: deque[float] = field(default_factory=lambda: deque(maxlen=512))
    _trips: deque[float] = field(default_factory=lambda: deque(maxlen=5))
    _asked: float = -math.inf

    def due(self, now: float) -> bool:
        """Whether a stamp is to be sent at `now`, s. It then counts as sent."""
        if now - self._asked < ECHO_S:
            return False
        self._asked = now
        self._sent += 1
        return True

    def hear(self, sent: float, now: float) -> None:
        """A stamp of the time `sent` has come back at `now`, s."""
        if 0 <= now - sent < LATEST_S:
            self._came += 1
            self._trips.append(now - sent)
            self.quickest = min(self.quickest, now - sent)
            self._echoed.append(sent)

    def forget(self) -> None:
        """Begin with a new connection."""
        self.quickest = math.inf
        self._echoed.clear()
        self._trips.clear()

    @property
    def round_trip(self) -> float:
        """How long the quickest of the newest took, s. One that is read late, because this program was held up, says
        nothing of the link.
        """
        return min(self._trips, default=0.0)

    @property
    def late(self) -> float:
        """From sending a command to the arrival of a measurement that shows it, s."""
        return 0.0 if math.isinf(self.quickest) else self.quickest

    def delivered(self, start: float, end: float, hole: float = HOLE) -> bool:
        """Whether what was sent from `start` to `end`, s, has arrived: stamps of then have come back, `hole` s at most
        apart.
        """
        return arrived(self._echoed, start, end, hole)

    def record(self, errors: int, connections: int) -> dict[str, Any]:
        """The quality of the link, for the channel `link` of the log."""
        return {
            "requests": self._sent,
            "replies": self._came,
            "timeouts": self._sent - self._came,
            "errors": errors,
            "reconnects": max(connections - 1, 0),
            "round_trip": self.round_trip or None,
        }
