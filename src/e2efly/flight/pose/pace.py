"""How often a pose source delivers, and how old the newest pose becomes before the next one. Pure.

A source that is slow, or that has a gap twice a second, looks good for a moment between two gaps. A take-off in such a
moment would be aborted at the next gap. Therefore the last seconds before a take-off are judged.
"""

import math
from dataclasses import dataclass, replace

WINDOW_S = 3.0
"""Length of the window that is judged, s: at most this many seconds, and at least half of them."""
SHARE = 0.75
"""The share of `odometry_timeout` that the age of the newest pose may reach. A few seconds of observation give no upper
bound, so some margin is kept."""


@dataclass(frozen=True)
class Half:
    """One half of the window."""

    began: float = math.inf
    """When it began, s."""
    count: int = 0
    """Good poses in it."""
    oldest: float = 0.0
    """The largest age that the newest pose reached in it, s."""
    holes: tuple[float, float] = (0.0, 0.0)
    """The longest and the second longest time between two new poses in it, s."""


@dataclass(frozen=True)
class Pace:
    """What has been observed of a source so far."""

    time: float | None = None
    """When the newest good pose was true, s. None before the first pose."""
    received: float = 0.0
    """When it arrived, s."""
    new: float | None = None
    """When the newest pose that repeats none was true, s."""
    before: Half = Half()
    """The half window before the present one."""
    present: Half = Half()

    @property
    def rate(self) -> float:
        """Good poses per second within the window, Hz."""
        span = self.received - min(self.before.began, self.present.began)
        return (self.before.count + self.present.count) / span if span > 0 else 0.0

    @property
    def oldest(self) -> float:
        """The largest age that the newest pose reached within the window, s."""
        return max(self.before.oldest, self.present.oldest)

    @property
    def hole(self) -> float | None:
        """The longest time without a new pose that was reached twice within the window, s. None: watched too shortly.

        A single one, such as a lost message, is no property of a source.
        """
        if self.received - min(self.before.began, self.present.began) < WINDOW_S / 4:
            return None
        return sorted((*self.before.holes, *self.present.holes))[-2]


def paced(pace: Pace, time: float, received: float, *, new: bool = True) -> Pace:
    """The pace after one more good pose. `time` is when the pose was true, and `received` when it arrived, s on the
    local monotonic clock. A pose that repeats the one before bit for bit is not `new`.
    """
    if pace.time is None or pace.new is None:  # the first starts the observation and does not count for the rate
        return Pace(time, received, time, present=Half(began=received))
    before, present = pace.before, pace.present
    if received - present.began > WINDOW_S / 2:
        before, present = present, Half(began=pace.received)
    first, second = present.holes
    hole = time - pace.new if new else 0.0
    holes = (max(first, hole), max(second, min(first, hole)))
    present = replace(present, count=present.count + 1, oldest=max(present.oldest, received - pace.time), holes=holes)
    return Pace(time, received, time if new else pace.new, before, present)


def pace_problem(pace: Pace, timeout: float) -> str | None:
    """The reason, in words, why nobody should take off with this source. None: it delivers often enough. The age of the
    newest pose at this moment is not included. `timeout` is the `odometry_timeout` of the flight, s.
    """
    accepted = SHARE * timeout
    if pace.time is None or pace.oldest <= accepted:
        return None
    return (
        f"poses come at {pace.rate:.3g} Hz, and the newest was up to {pace.oldest:.3g} s old within the last "
        f"{WINDOW_S:g} s; accepted: {accepted:.3g} s, {SHARE:g} of odometry_timeout"
    )
