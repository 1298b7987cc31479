"""From a source's clock to this machine's monotonic clock. Pure.

A message that was true at `stamp` on the source's clock arrives at `received` on ours. `received - stamp` is the
difference of the clocks plus the delay of this message; its running minimum is the difference plus the smallest delay,
so mapping by the minimum takes the jitter of the way out of the times. The minimum may rise slowly, as two crystals
drift apart.
"""

from dataclasses import dataclass

DRIFT = 2e-4
"""How fast the running minimum may rise, s/s: twice what two ordinary crystals (50 ppm each) drift apart."""


@dataclass(frozen=True)
class ClockMap:
    """Maps stamps of one source."""

    offset: float
    """Running minimum of received - stamp, s."""
    stamp: float
    """The last stamp, s on the source's clock."""


def start_clock(received: float, stamp: float) -> ClockMap:
    """The map after the first message."""
    return ClockMap(received - stamp, stamp)


def follow_clock(clock: ClockMap, received: float, stamp: float) -> tuple[ClockMap, float]:
    """Take one message in.

    Args:
        clock: the map so far.
        received: when it arrived, s on the local monotonic clock.
        stamp: when it was true, s on the source's clock; later than the last one.

    Returns:
        The map, and the time of the message, s on the local monotonic clock: at most `received`, and early by no more
        than the drift of the clocks since the message that took the shortest way.
    """
    offset = min(clock.offset + DRIFT * (stamp - clock.stamp), received - stamp)
    return ClockMap(offset, stamp), stamp + offset
