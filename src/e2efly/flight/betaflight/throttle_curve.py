"""Betaflight's throttle curve in the firmware's own integer arithmetic, and its exact inverse.

The stick above `min_check` becomes 0 to 1000. The throttle is interpolated linearly in a table of twelve points, and is
then scaled or clipped. Firmware that reports a hover throttle (MSP 1.47) fills the table with two parabolas that meet
in (mid, hover). Older firmware fills it with two cubics that meet in (mid, mid). The tests compare the parabolas with
what real firmware reports.
"""

from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property
from math import isfinite

LIMIT_TYPES = ("OFF", "SCALE", "CLIP")
"""Types of throttle limit, in the firmware's numbering."""
LOWEST, HIGHEST = 1000, 2000
"""The ends of the throttle channel, µs."""
_POINTS = 12


@dataclass(frozen=True)
class ThrottleCurve:
    """The curve from the throttle channel to the throttle of the mixer, with the numbers as in the command line."""

    mid: int = 50
    """`thr_mid`, percent."""
    expo: int = 0
    """`thr_expo`, percent."""
    hover: int | None = None
    """`thr_hover`, percent. None: firmware older than MSP 1.47, which has no such setting."""
    limit_type: str = "OFF"
    """`throttle_limit_type`: one of `LIMIT_TYPES`."""
    limit: int = 100
    """`throttle_limit_percent`."""
    min_check: int = 1050
    """`min_check`, µs: the channel up to which the throttle is 0."""

    def __post_init__(self) -> None:
        if self.limit_type not in LIMIT_TYPES:
            raise ValueError(f"throttle curve: limit_type is {self.limit_type!r}; accepted: {', '.join(LIMIT_TYPES)}")
        ranges = {"mid": (0, 100), "expo": (0, 100), "limit": (1, 100), "min_check": (750, HIGHEST - 1)}
        if self.hover is not None:
            ranges["hover"] = (0, 100)
        for name, (low, high) in ranges.items():
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"throttle curve: {name} is {getattr(self, name)!r}; accepted: {low} to {high}")

    @property
    def largest(self) -> float:
        """The largest throttle that the stick reaches, 0 to 1."""
        return self._throttles[-1]

    def throttle_of(self, channel: int) -> float:
        """The throttle, 0 to 1, of a channel, µs."""
        return self._throttles[min(max(int(channel), LOWEST), HIGHEST) - LOWEST]

    def channel_for(self, throttle: float) -> int:
        """The lowest channel, µs, whose throttle is nearest to the wanted one.

        Raises:
            ValueError: the throttle is not finite.
        """
        if not isfinite(throttle):
            raise ValueError(f"throttle is {throttle!r}; accepted: a finite number, 0 to 1")
        steps = self._throttles
        i = bisect_left(steps, throttle)
        if i == len(steps):
            return LOWEST + bisect_left(steps, steps[-1])
        if i and throttle - steps[i - 1] <= steps[i] - throttle:
            i = bisect_left(steps, steps[i - 1])
        return LOWEST + i

    @cached_property
    def _throttles(self) -> list[float]:
        """The throttle at every µs from `LOWEST` to `HIGHEST`. It never decreases."""
        table = [self._cubic(i) if self.hover is None else self._parabolas(i / (_POINTS - 1)) for i in range(_POINTS)]
        factor = self.limit / 100
        throttles = []
        for channel in range(LOWEST, HIGHEST + 1):
            stick = max(channel - self.min_check, 0) * 1000 // (HIGHEST - self.min_check)
            throttle = self._between(table, stick) / 1000
            scaled = {"OFF": throttle, "SCALE": throttle * factor, "CLIP": min(throttle, factor)}
            throttles.append(scaled[self.limit_type])
        return throttles

    def _between(self, table: list[int], stick: int) -> int:
        if self.hover is None:  # a point every 100; the twelfth is only needed to interpolate at the end
            i, rest, step = stick // 100, stick % 100, 100
        else:
            i, rest, step = stick * (_POINTS - 1) // 1000, stick * (_POINTS - 1) % 1000, 1000
        if i >= _POINTS - 1:
            return table[-1]
        return table[i] + int((table[i + 1] - table[i]) * rest / step)

    def _parabolas(self, x: float) -> int:
        mid, hover, expo = self.mid / 100, (self.hover or 0) / 100, self.expo / 100
        if x <= mid:
            t = x / mid if mid else 0.0
            y = hover * t * (1 + expo * (1 - t))
        else:
            t = (x - mid) / (1 - mid)
            y = 1 - (1 - hover) * (1 - t) * (1 + expo * t)
        return round(1000 * y)

    def _cubic(self, i: int) -> int:
        beyond = 10 * i - self.mid
        span = (100 - self.mid if beyond > 0 else self.mid) or 1
        slope = 100 - self.expo + self.expo * beyond * beyond // (span * span)
        return 10 * self.mid + int(beyond * slope / 10)
