"""The mapping from a source's clock to this machine's monotonic clock. Pure.

A message that was true at `stamp` on the source's clock arrives at `received` on this machine's clock. `received -
stamp` is the difference of the clocks plus the delay of this message. Its running minimum is the difference plus the
smallest delay. Mapping with the minimum therefore removes the jitter of the delay from the times. The minimum may rise
slowly, because two crystals drift apart.
"""

from dataclasses import dataclass

DRIFT = 2e-4
"""How fast the running minimum may rise, s/s. This is twice the drift between two ordinary crystals (50 ppm each)."""


@dataclass(frozen=True)
class ClockMap:
    """Maps the stamps of one source."""

    offset: float
    """Running minimum of received - stamp, s."""
    stamp: float
    """The last stamp, s on the source's clock."""


def start_clock(received: float, stamp: float) -> ClockMap:
    """The map after the first message."""
    return ClockMap(received - stamp, stamp)


def follow_clock(clock: ClockMap, received: float, stamp: float) -> tuple[ClockMap, float]:
    """Process one message. `received` is the time of its arrival, s on the local monotonic clock. `stamp` is the time
    at which it was true, s on the source's clock. It must be later than the last one.

    Returns:
        The map, and the time of the message, s on the local monotonic clock. This time is at most `received`. It is
            early by at most the drift of the clocks since the message with the shortest delay.
    """
    offset = min(clock.offset + DRIFT * (stamp - clock.stamp), received - stamp)
    return ClockMap(offset, stamp), stamp + offset
