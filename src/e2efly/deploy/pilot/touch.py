"""Detects the ground without poses: on the ground, something other than the rotors carries the vehicle.

In the air, the force that the accelerometer measures follows the throttle, whatever the scale of either. On the ground
it stays constant. After a shock, or when the ground is overdue, the thrust is lowered for a moment and the force is
observed.
"""

import math
from dataclasses import dataclass, replace

from e2efly.vehicles.vehicle import GRAVITY

SHOCK = 3.0
"""Force beyond the thrust that shows a touch of the ground, m/s^2."""
DIP, DIP_S = 0.15, 0.32
"""The dip: by this share the thrust is lowered, for this time, s, to test whether the ground carries the vehicle."""
DELAY_S = 0.12
"""Time from the arrival of a command until the force shows it, s."""
ENOUGH = 5
"""The number of measurements in the dip, and of measurements after it, that are needed to judge. Those of several dips
are added up until there are so many, because a bad link delivers only few."""
LASTS_S = DIP_S + DELAY_S + 0.16
"""Duration of a dip and of the time after it that is used to judge it, s."""
FOLLOWS = 0.5
"""If the force changes by more than this share of the thrust's change, the vehicle is in the air. On the ground the
force does not change."""
WEIGHT = (0.75, 1.3)
"""Range of the force of a vehicle that stands, in units of gravity, for a badly calibrated accelerometer."""
AGAIN_S = 1.0
"""The shortest time between two dips, s."""
USUAL_S, UNUSUAL = 0.5, 1.5
"""Time over which the difference of force and thrust is smoothed, s. A measurement that differs from the smoothed value
by more than the second value, m/s^2, belongs to a shock and is not used for it."""
FROZEN_S, IGNORED, LONGEST_SAME_S = 0.15, 0.4, 0.4
"""An accelerometer is frozen if its numbers repeat bit for bit for the first value, s, while the thrust changes by the
second, m/s^2. It is also frozen if they repeat for the third value, s, whatever the thrust is, because the vibration of
the rotors always changes them."""
ALIVE_S, BELIEVED = 0.2, 3.0
"""An accelerometer whose numbers repeat for the first value, s, is frozen. One that usually differs from the thrust by
more than the second, m/s^2, is broken. Neither can detect the ground."""
SUPPORT, SUPPORT_S = 1.2, 0.3
"""If the force is larger than the thrust by the first value, m/s^2, for the second, s, something carries the vehicle.
This holds for an accelerometer that works."""


@dataclass(frozen=True)
class Touch:
    """What was measured so far. `Touch()` at the beginning of a landing."""

    usual: float | None = None
    """The usual force minus thrust, smoothed, m/s^2. None: not known yet."""
    raw: tuple[float, ...] = ()
    """The accelerometer's newest numbers ..."""
    changed: float = -math.inf
    """... and when they last changed, s."""
    same_s: float = 0.0
    """How long these numbers had repeated at the newest measurement, s."""
    then: float | None = None
    """Thrust when the numbers last changed, m/s^2. None: not known."""
    ignored: float = 0.0
    """The largest change of the thrust since then, which the numbers did not show, m/s^2."""
    dip: float = -math.inf
    """When the newest dip began, s."""
    low: tuple[float, float, int] = (0.0, 0.0, 0)
    """Sums of force and of thrust, m/s^2, and the number of measurements, in the dip ..."""
    high: tuple[float, float, int] = (0.0, 0.0, 0)
    """... and after it."""
    carried: bool = False
    """The ground was detected in a dip."""
    supported: float = 0.0
    """How long the force has been larger than the thrust by `SUPPORT`, s."""

    def factor(self, now: float) -> float:
        """The factor by which the thrust is multiplied at `now`, s."""
        return 1 - DIP if now - self.dip < DIP_S else 1.0

    def afresh(self) -> "Touch":
        """A new detection of the ground. It keeps how long the numbers have repeated."""
        return Touch(raw=self.raw, changed=self.changed, same_s=self.same_s, then=self.then, ignored=self.ignored)

    @property
    def frozen(self) -> bool:
        """Whether the accelerometer of a flying vehicle repeats its numbers bit for bit."""
        return self.same_s > LONGEST_SAME_S or (self.same_s > FROZEN_S and self.ignored > IGNORED)

    def able(self, now: float) -> bool:
        """Whether this accelerometer can detect the ground at all."""
        return now - self.changed < ALIVE_S and self.usual is not None and abs(self.usual) < BELIEVED

    @property
    def rests(self) -> bool:
        """Whether something has carried the vehicle for a while, if the accelerometer works."""
        return self.supported >= SUPPORT_S


def seen(before: Touch, raw: tuple[float, ...], thrust: float | None, now: float) -> Touch:
    """Process the accelerometer's numbers that came at `now`, s, with the thrust of the throttle, m/s^2, if known."""
    if raw != before.raw:
        return replace(before, raw=raw, changed=now, same_s=0.0, then=thrust, ignored=0.0)
    change = 0.0 if thrust is None or before.then is None else abs(thrust - before.then)
    return replace(before, same_s=now - before.changed, ignored=max(before.ignored, change))


def feel(before: Touch, force: float, thrust: float, now: float, dt: float) -> Touch:
    """Process a measurement.

    Args:
        before: the state so far.
        force: specific force along the body's z axis, m/s^2.
        thrust: the thrust that the map gives for the throttle sent a moment before, m/s^2.
        now: everything sent before this time had arrived when the measurement was taken, s.
        dt: time since the previous measurement, s.
    """
    beyond = force - thrust
    after = replace(before, supported=before.supported + dt if beyond > SUPPORT else 0.0)
    if now - after.dip < LASTS_S:
        return _dipping(after, force, thrust, now)
    usual = beyond if after.usual is None else after.usual
    if abs(beyond - usual) < UNUSUAL:
        usual += (beyond - usual) * -math.expm1(-dt / USUAL_S)
    return replace(after, usual=usual)


def dip(before: Touch, now: float, *, overdue: bool, beyond: float) -> Touch:
    """Begin a dip to test for the ground, if there is a reason and the last dip is long enough ago.

    Args:
        before: the state so far.
        now: s.
        overdue: by its height, the vehicle should already stand.
        beyond: force minus thrust of the newest measurement, m/s^2.
    """
    shock = before.usual is not None and beyond - before.usual > SHOCK
    if not (shock or overdue) or not before.able(now) or now - before.dip < AGAIN_S:
        return before
    none = (0.0, 0.0, 0)
    return replace(before, dip=now, low=none, high=none) if _enough(before) else replace(before, dip=now)


def _dipping(before: Touch, force: float, thrust: float, now: float) -> Touch:
    """Add a measurement in a dip or after it. Once there are enough of both, judge whether the ground carries."""
    since = now - before.dip
    in_dip, after_dip = DELAY_S <= since < DIP_S, since >= DIP_S + DELAY_S
    if not (in_dip or after_dip):
        return before
    low, high = before.low, before.high
    if in_dip:
        return replace(before, low=(low[0] + force, low[1] + thrust, low[2] + 1))
    after = replace(before, high=(high[0] + force, high[1] + thrust, high[2] + 1))
    if not _enough(after):
        return after
    (force_low, thrust_low), (force_high, thrust_high) = (
        (force / count, thrust / count) for force, thrust, count in (low, after.high)
    )
    follows = force_high - force_low > FOLLOWS * (thrust_high - thrust_low)
    stands = WEIGHT[0] * GRAVITY < force_low < WEIGHT[1] * GRAVITY and thrust_high > thrust_low
    return replace(after, carried=before.carried or (stands and not follows))


def _enough(touch: Touch) -> bool:
    return min(touch.low[2], touch.high[2]) >= ENOUGH
