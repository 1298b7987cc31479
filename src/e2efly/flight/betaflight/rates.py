"""Betaflight's rate profiles: the curves from stick to body rate, and their exact inverse.

The five published curves are two families. With s(x, n) = (1 - expo) x + expo x^n and a stick x from 0 to 1:

- with a pole (BETAFLIGHT, KISS, QUICK): rate = a s(x, n) / max(1 - b s(x, m), 0.01)
- with a square (ACTUAL, RACEFLIGHT): rate = a s(x, n) + b x s(x, m)

Each curve is an odd function of x, and its result is then limited. The curves are documented at betaflight.com
("Rates"). The tests compare them with what real firmware reports.
"""

from bisect import bisect_left
from dataclasses import dataclass
from functools import cached_property
from math import isfinite, radians, sqrt

AXES = ("roll", "pitch", "yaw")
"""The axes, in the order of every tuple of three here."""
RATES_TYPES = ("BETAFLIGHT", "RACEFLIGHT", "KISS", "ACTUAL", "QUICK")
"""Types of curve, in the firmware's numbering."""
HIGHEST_RATE = 1998
"""The highest rate that any curve commands, deg/s."""
_PIECES = 64
_SLOWEST = 0.01
"""The smallest value of the denominator of a curve with a pole."""
_POLE = {"BETAFLIGHT": (4, 1), "KISS": (3, 1), "QUICK": (1, 3)}
_SQUARE = {"ACTUAL": (1, 5), "RACEFLIGHT": (3, 3)}


@dataclass(frozen=True)
class RateProfile:
    """A controller's rate profile: three curves, with the numbers as in its command line."""

    rates_type: str
    """One of `RATES_TYPES`."""
    rc_rate: tuple[int, int, int]
    """`roll_rc_rate` and so on, 0 to 255. The meaning depends on the type."""
    rate: tuple[int, int, int]
    """`roll_srate` and so on, 0 to 255."""
    expo: tuple[int, int, int]
    """`roll_expo` and so on, 0 to 100 percent."""
    rate_limit: tuple[int, int, int] = (HIGHEST_RATE, HIGHEST_RATE, HIGHEST_RATE)
    """`roll_rate_limit` and so on, deg/s."""
    quick_rc_expo: bool = False
    """`quickrates_rc_expo`: with QUICK rates, expo acts on the stick instead of the gain. MSP does not report it."""

    def __post_init__(self) -> None:
        if self.rates_type not in RATES_TYPES:
            raise ValueError(f"rate profile: rates_type is {self.rates_type!r}; accepted: {', '.join(RATES_TYPES)}")
        least = 1 if self.rates_type == "QUICK" else 0  # the firmware divides by it
        for name, low, high in (("rc_rate", least, 255), ("rate", 0, 255), ("expo", 0, 100), ("rate_limit", 0, 65535)):
            values = getattr(self, name)
            if len(values) != 3 or not all(low <= value <= high for value in values):
                accepted = f"three numbers from {low} to {high} with {self.rates_type} rates"
                raise ValueError(f"rate profile: {name} is {values!r}; accepted: {accepted}")

    @cached_property
    def curves(self) -> tuple["Curve", "Curve", "Curve"]:
        """The curves of roll, pitch and yaw."""
        return _curve(self, 0), _curve(self, 1), _curve(self, 2)

    @cached_property
    def max_rate(self) -> tuple[float, float, float]:
        """The largest rates that sticks reach, rad/s."""
        roll, pitch, yaw = (radians(curve.highest) for curve in self.curves)
        return roll, pitch, yaw


@dataclass(frozen=True)
class Curve:
    """One axis of a rate profile: a member of one of the two families."""

    pole: bool
    """Whether the curve is of the family with a pole. Otherwise it is of the family with a square."""
    a: float
    """Slope at the centre without expo, deg/s."""
    b: float
    """Strength of the pole, dimensionless, or of the square, deg/s."""
    expo: float
    """0 to 1."""
    powers: tuple[int, int]
    """The exponents n and m."""
    limit: float
    """Largest rate, deg/s."""

    def at(self, x: float) -> tuple[float, float]:
        """The rate before the limit, deg/s, and its slope, at a stick from 0 to 1."""
        (n, m), e = self.powers, self.expo
        xn, xm = x ** (n - 1), x ** (m - 1)
        s, ds = x * (1 - e + e * xn), 1 - e + n * e * xn
        t, dt = x * (1 - e + e * xm), 1 - e + m * e * xm
        if not self.pole:
            return self.a * s + self.b * x * t, self.a * ds + self.b * (t + x * dt)
        d = 1 - self.b * t
        if d <= _SLOWEST:
            return self.a * s / _SLOWEST, self.a * ds / _SLOWEST
        return self.a * s / d, self.a * (ds + self.b * s * dt / d) / d

    @cached_property
    def highest(self) -> float:
        """The largest rate that the stick reaches, deg/s."""
        return min(self.at(1.0)[0], self.limit)

    @cached_property
    def _table(self) -> list[float]:
        return [self.at(i / _PIECES)[0] for i in range(_PIECES + 1)]

    def stick_for(self, rate: float) -> float:
        """The stick, 0 to 1, that gives a rate, deg/s. It is 1 for a rate of `highest` or more."""
        if rate <= 0 or rate >= self.highest:
            return 0.0 if rate <= 0 else 1.0
        if not self.expo:
            return min(self._closed(rate), 1.0)
        return self._newton(rate)

    def _closed(self, rate: float) -> float:
        if not self.pole:
            return 2 * rate / (self.a + sqrt(self.a * self.a + 4 * self.b * rate))
        x = rate / (self.a + self.b * rate)
        return x if 1 - self.b * x >= _SLOWEST else _SLOWEST * rate / self.a

    def _newton(self, rate: float) -> float:
        """Newton's method, which starts just above the solution and so converges directly for a convex curve.

        If a step would leave the bracket, the bracket is halved instead.
        """
        i = bisect_left(self._table, rate)
        low, high = (i - 1) / _PIECES, min(i / _PIECES, 1.0)
        x = high
        for _ in range(100):
            value, slope = self.at(x)
            low, high = (x, high) if value < rate else (low, x)
            step = x - (value - rate) / slope if slope > 0 else -1.0
            if low <= step <= high and abs(step - x) < 1e-8:  # the next error is about the square of this one
                return step
            x = step if low <= step <= high else 0.5 * (low + high)
        return x


def stick_to_rate(profile: RateProfile, axis: int, stick: float) -> float:
    """The rate that a stick commands, rad/s. `axis` is 0 for roll, 1 for pitch, 2 for yaw. `stick` is the deflection
    after the deadband, -1 to 1.
    """
    curve = profile.curves[axis]
    rate = radians(min(curve.at(min(abs(stick), 1.0))[0], curve.limit))
    return rate if stick >= 0 else -rate


def rate_to_stick(profile: RateProfile, axis: int, rate: float) -> float:
    """The deflection, -1 to 1, that commands a rate: the exact inverse of `stick_to_rate`.

    A rate of `profile.max_rate[axis]` or more gives full deflection. `axis` is 0 for roll, 1 for pitch, 2 for yaw.
    `rate` is in rad/s.

    Raises:
        ValueError: the rate is not finite.
    """
    if not isfinite(rate):
        raise ValueError(f"{AXES[axis]} rate is {rate!r}; accepted: a finite number of rad/s")
    curve = profile.curves[axis]
    stick = curve.stick_for(abs(rate) * _DEGREES)
    return stick if rate >= 0 else -stick


def channel_to_stick(channel: float, centre: int = 1500, deadband: int = 0) -> float:
    """The deflection, -1 to 1, that the controller computes from a channel, µs."""
    offset = min(max(channel - centre, -500), 500)
    beyond = max(abs(offset) - deadband, 0) / (500 - deadband)
    return beyond if offset >= 0 else -beyond


def stick_to_channel(stick: float, centre: int = 1500, deadband: int = 0) -> int:
    """The channel, in whole µs, whose deflection is nearest to `stick`, -1 to 1."""
    steps = round(min(abs(stick), 1.0) * (500 - deadband))
    offset = steps + deadband if steps else 0
    return centre + offset if stick >= 0 else centre - offset


_DEGREES = 1 / radians(1)


def _curve(profile: RateProfile, axis: int) -> Curve:
    kind, expo = profile.rates_type, profile.expo[axis] / 100
    rc_rate, rate = profile.rc_rate[axis], profile.rate[axis]
    limit = float(min(profile.rate_limit[axis], HIGHEST_RATE))
    if kind == "ACTUAL":
        a, b = 10.0 * rc_rate, 10.0 * max(rate - rc_rate, 0)
    elif kind == "RACEFLIGHT":
        a, b = 10.0 * rc_rate, 0.1 * rc_rate * rate
    elif kind == "QUICK":
        a = 2.0 * rc_rate
        b = 1 - a / max(10.0 * rate, a)
    else:
        # above 2.00 a BETAFLIGHT rc_rate counts 15.54 times
        extra = 14.54 * max(rc_rate / 100 - 2, 0) if kind == "BETAFLIGHT" else 0.0
        a, b = 200 * (rc_rate / 100 + extra), rate / 100
    pole = kind in _POLE
    powers = _POLE[kind] if pole else _SQUARE[kind]
    if kind == "QUICK" and profile.quick_rc_expo:
        powers = (3, 1)
    return Curve(pole, a, b, expo, powers, limit)
