"""Detects the ground without poses: the ground carries a vehicle whose rotors do not.

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
"""Share of the thrust that is left out for so long, s, to feel whether the ground carries."""
DELAY_S = 0.12
"""Time from the arrival of a command until the force shows it, s."""
ENOUGH = 5
"""Measurements of each kind by which a dip is judged; those of several dips are taken together until there are so
many, as a bad link lets few through."""
LASTS_S = DIP_S + DELAY_S + 0.16
"""A dip ends, and with it the time after it by which it is judged, when the thrust is back, s."""
FOLLOWS = 0.5
"""Share of the thrust's change that the force shows in the air; on the ground it shows none."""
WEIGHT = (0.75, 1.3)
"""Force of what stands, gravities, by an accelerometer that is calibrated badly."""
AGAIN_S = 1.0
"""The shortest time between two dips, s."""
USUAL_S, UNUSUAL = 0.5, 1.5
"""Over which the difference of force and thrust is smoothed, s; beyond this difference, m/s^2, it is a shock's."""
FROZEN_S, IGNORED, LONGEST_SAME_S = 0.15, 0.4, 0.4
"""An accelerometer whose numbers repeat bit for bit for so long, s, while the thrust changes by so much, m/s^2, is
frozen; so is one that repeats them for as long as the last, s, whatever the thrust: the rotors shake it."""
ALIVE_S, BELIEVED = 0.2, 3.0
"""An accelerometer whose numbers repeat for so long, s, is frozen; one that is so unlike the thrust as a rule, m/s^2,
is broken: neither can feel the ground."""
SUPPORT, SUPPORT_S = 1.2, 0.3
"""Force beyond the thrust, m/s^2, for so long, s: something carries the vehicle, by an accelerometer that is right."""


@dataclass(frozen=True)
class Touch:
    """What was felt so far. `Touch()` at the beginning of a landing."""

    usual: float | None = None
    """Force minus thrust as a rule, m/s^2."""
    raw: tuple[float, ...] = ()
    """The accelerometer's newest numbers ..."""
    changed: float = -math.inf
    """... and when they last changed, s."""
    same_s: float = 0.0
    """For how long they have repeated at the newest measurement, s."""
    then: float | None = None
    """Thrust at the change, m/s^2; None: not known."""
    ignored: float = 0.0
    """By how much the thrust has changed since, and the numbers not, m/s^2."""
    dip: float = -math.inf
    """When the newest dip began, s."""
    low: tuple[float, float, int] = (0.0, 0.0, 0)
    """Sums of force and thrust, m/s^2, and of how many measurements, in the dip ..."""
    high: tuple[float, float, int] = (0.0, 0.0, 0)
    """... and after it."""
    carried: bool = False
    """The ground was felt in a dip."""
    supported: float = 0.0
    """For how long the force has been beyond the thrust, s."""

    def factor(self, now: float) -> float:
        """The factor by which the thrust is multiplied at `now`, s."""
        return 1 - DIP if now - self.dip < DIP_S else 1.0

    def afresh(self) -> "Touch":
        """Of the ground nothing was felt yet; how long the numbers have repeated is known."""
        return Touch(raw=self.raw, changed=self.changed, same_s=self.same_s, then=self.then, ignored=self.ignored)

    @property
    def frozen(self) -> bool:
        """Whether the accelerometer of a flying vehicle repeats itself bit for bit."""
        return self.same_s > LONGEST_SAME_S or (self.same_s > FROZEN_S and self.ignored > IGNORED)

    def able(self, now: float) -> bool:
        """Whether this accelerometer can feel the ground at all."""
        return now - self.changed < ALIVE_S and self.usual is not None and abs(self.usual) < BELIEVED

    @property
    def rests(self) -> bool:
        """Something has carried the vehicle for a while, by an accelerometer that is right."""
        return self.supported >= SUPPORT_S


def seen(before: Touch, raw: tuple[float, ...], thrust: float | None, now: float) -> Touch:
    """Take in the accelerometer's numbers as they came at `now`, s, and the thrust by the throttle, m/s^2, if known."""
    if raw != before.raw:
        return replace(before, raw=raw, changed=now, same_s=0.0, then=thrust, ignored=0.0)
    change = 0.0 if thrust is None or before.then is None else abs(thrust - before.then)
    return replace(before, same_s=now - before.changed, ignored=max(before.ignored, change))


def feel(before: Touch, force: float, thrust: float, now: float, dt: float) -> Touch:
    """Take in a measurement.

    Args:
        before: so far.
        force: specific force along the body's z axis, m/s^2.
        thrust: the one that the throttle sent a moment before gives by the map, m/s^2.
        now: up to when what was sent had arrived as it was taken, s.
        dt: since the measurement before, s.
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
    """Begin to feel for the ground, where there is a reason and the last time is long enough ago.

    Args:
        before: so far.
        now: s.
        overdue: by its height the vehicle ought to stand.
        beyond: force minus thrust of the newest measurement, m/s^2.
    """
    shock = before.usual is not None and beyond - before.usual > SHOCK
    if not (shock or overdue) or not before.able(now) or now - before.dip < AGAIN_S:
        return before
    none = (0.0, 0.0, 0)
    return replace(before, dip=now, low=none, high=none) if _enough(before) else replace(before, dip=now)


def _dipping(before: Touch, force: float, thrust: float, now: float) -> Touch:
    """The measurements of a dip and of the time after it, judged once enough of both have come."""
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
