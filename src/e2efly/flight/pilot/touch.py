"""Tells flight from standing without poses: only in the air, the measured force follows the throttle.

A regression of the force on the thrust of the throttle over the last measurements gives a slope. It is near 1 in the
air, whatever the scale of either, and 0 for a vehicle that something carries. A blind descent waves its thrust a little
all the time, so that there is something to follow. The force may follow later than it should, so the thrusts of several
moments are compared with it. Where every slope is that of the ground, the vehicle is weighed: the thrust is lowered far
for a moment. Only a force that stays as large as the weight then shows the ground.
"""

import math
from dataclasses import dataclass, replace

from e2efly.vehicles.gravity import GRAVITY

WAVE, WAVE_HZ = 0.08, 2.0
"""The wave on the thrust of a blind descent: its amplitude as a share, and its frequency, Hz. It moves the vehicle by
some millimetres."""
LAGS = (0.0, 0.07, 0.14, 0.21)
"""How much later than usual the force may follow, s: a busy controller takes its commands late."""
STILL = 0.5
"""A vehicle that turns faster than this, rad/s, does not stand. Its rotors then give a force that the throttle did not
ask for."""
MEMORY, FEWEST = 30, 8
"""The weight of a measurement falls to 1/e within so many later ones. So many must add up before anything is told."""
FOLLOWS, SURE = 0.5, 2.0
"""The slope between standing and flight, and by how many of its standard deviations it must differ from that."""
FLOOR = 0.15
"""The smallest standard deviation of a measured force, m/s^2."""
WEIGHT = (0.75, 1.3)
"""Range of the force of a vehicle that stands, in units of gravity, for a badly calibrated accelerometer."""
STRUCK_S = 0.1
"""How soon after a shock a weighing begins, s."""
LOW, LONGEST_S, AGAIN_S = 0.45, 0.5, 1.0
"""A weighing lowers the thrust to the first value, in units of gravity, for the second at most, s. The next one begins
after the third, s."""
UNDER = 0.1
"""A blind descent whose estimated height is this far under the ground, m, weighs the vehicle, unless it is felt to fly.
"""
LIGHT, ENOUGH_S, MOST_S = 0.6, 0.07, 0.05
"""A vehicle is carried if it measures its weight for the second value, s, while its thrust is below the first, in units
of gravity. A measurement counts for the time since the one before, but at most for the third value, s."""
SHOCK, BLOW = 3.0, 1.4
"""Change of force minus thrust between two measurements that shows a shock, m/s^2. What was measured before it is
forgotten. With a force above the second value, in units of gravity, it may be the ground's."""
TOLD_S = 0.5
"""How long the comparison holds after its newest measurement, s. After a longer pause it begins anew."""
UNTOLD_S = 1.0
"""Without a comparison for this time, s, an accelerometer does not tell anything."""
FROZEN_S, IGNORED, LONGEST_SAME_S = 0.15, 0.4, 0.4
"""An accelerometer is frozen if its numbers repeat bit for bit for the first value, s, while the thrust changes by the
second, m/s^2. It is also frozen if they repeat for the third value, s, whatever the thrust is, because the vibration of
the rotors always changes them."""
ALIVE_S, LEAST, USUAL_S = 0.5, 0.3, 0.3
"""An accelerometer whose numbers repeat for the first value, s, is frozen. One whose force is below the second, in
units of gravity, smoothed over the third, s, is broken. Neither can tell flight from standing."""


@dataclass(frozen=True)
class Touch:
    """What was measured so far. `Touch()` at the beginning of a flight's phase."""

    sums: tuple[tuple[float, ...], ...] = ()
    """For each lag fading sums of weight, thrust, force, thrust squared, thrust times force and force squared, less
    gravity."""
    time: float = -math.inf
    """When the newest of these measurements was asked for, s."""
    beyond: float = 0.0
    """Force minus thrust at the newest measurement, m/s^2."""
    usual: float = GRAVITY
    """The force, smoothed, m/s^2."""
    struck: float = -math.inf
    """When the newest shock came, s."""
    weighed: float = -math.inf
    """When the newest weighing began, s."""
    carried: float = 0.0
    """For how long the measurements have shown the weight while the thrust is far below it, s."""
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

    def afresh(self) -> "Touch":
        """A new comparison. It keeps how long the numbers have repeated."""
        return Touch(raw=self.raw, changed=self.changed, same_s=self.same_s, then=self.then, ignored=self.ignored)

    @property
    def frozen(self) -> bool:
        """Whether the accelerometer of a flying vehicle repeats its numbers bit for bit."""
        return self.same_s > LONGEST_SAME_S or (self.same_s > FROZEN_S and self.ignored > IGNORED)

    def able(self, now: float) -> bool:
        """Whether this accelerometer can tell flight from standing at all."""
        return now - self.changed < ALIVE_S and self.usual > LEAST * GRAVITY

    def tells(self, now: float) -> bool:
        """Whether it can, and its force was compared with the thrust lately."""
        return self.able(now) and now - self.time < UNTOLD_S

    def stands(self, now: float) -> bool | None:
        """Whether something carries the vehicle: True; False: it flies; None: not known."""
        if now - self.time > TOLD_S or not self.able(now):
            return None
        if self.carried >= ENOUGH_S:
            return True
        return False if any(map(_follows, self.sums)) else None

    def weighs(self, now: float) -> bool:
        """Whether the thrust of a blind descent is lowered at `now`, s, to weigh the vehicle."""
        return now - self.weighed < LONGEST_S

    def weigh(self, now: float, *, low: bool = False) -> "Touch":
        """Begin to weigh at `now`, s, but not too often: after a shock, where the slope is that of the ground, or where
        the height is (`low`) and the slope is not that of flight.
        """
        ground = bool(self.sums) and all(_follows(sums) is False for sums in self.sums)
        ground = ground or (low and self.stands(now) is None)
        due = (ground or self.time - self.struck < STRUCK_S) and now - self.time < TOLD_S and self.able(now)
        return replace(self, weighed=now, carried=0.0) if due and now - self.weighed > AGAIN_S else self


def _follows(sums: tuple[float, ...]) -> bool | None:
    """Whether the force follows the thrust, by their sums. None: not known."""
    weight, thrust, force, thrusts, products, forces = sums
    spread = thrusts - thrust * thrust / weight if weight >= FEWEST else 0.0
    if spread <= 0:
        return None
    shared = products - thrust * force / weight
    slope = shared / spread
    rest = max(forces - force * force / weight - slope * shared, 0.0) / (weight - 2)
    error = SURE * math.sqrt((rest + FLOOR**2) / spread)
    return None if abs(slope - FOLLOWS) < error else slope > FOLLOWS


def wave(now: float) -> float:
    """The factor by which the thrust of a blind descent is multiplied at `now`, s."""
    return 1 + WAVE * math.sin(math.tau * WAVE_HZ * now)


def seen(before: Touch, raw: tuple[float, ...], thrust: float | None, now: float) -> Touch:
    """Process the accelerometer's numbers that came at `now`, s, with the thrust of the throttle, m/s^2, if known."""
    if raw != before.raw:
        return replace(before, raw=raw, changed=now, same_s=0.0, then=thrust, ignored=0.0)
    change = 0.0 if thrust is None or before.then is None else abs(thrust - before.then)
    return replace(before, same_s=now - before.changed, ignored=max(before.ignored, change))


def feel(before: Touch, force: float, thrusts: tuple[float, ...], turn: float, now: float, dt: float) -> Touch:
    """Process a measurement.

    Args:
        before: the state so far.
        force: specific force along the body's z axis, m/s^2.
        thrusts: the thrusts that the map gives for the throttles sent a moment, and each of `LAGS`, before, m/s^2.
        turn: the body rate, rad/s.
        now: everything sent before this time had arrived when the measurement was taken, s.
        dt: time since the previous measurement, s.
    """
    beyond = force - thrusts[0]
    usual = before.usual + (force - before.usual) * -math.expm1(-dt / USUAL_S)
    heavy = WEIGHT[0] * GRAVITY < force < WEIGHT[1] * GRAVITY and max(thrusts) < LIGHT * GRAVITY
    carried = before.carried + min(dt, MOST_S) * (turn < STILL) if heavy else 0.0
    after = replace(before, time=now, beyond=beyond, usual=usual, carried=carried)
    if now - before.time > TOLD_S or abs(beyond - before.beyond) > SHOCK:
        blow = force > BLOW * GRAVITY and beyond - before.beyond > SHOCK
        return replace(after, sums=(), struck=now if blow else before.struck)
    if force < LIGHT * GRAVITY and before.weighs(now):  # it flies
        after = replace(after, weighed=now - LONGEST_S)
    if turn > STILL:
        return after
    y, kept, sums = force - GRAVITY, math.exp(-1 / MEMORY), []
    for thrust, old in zip(thrusts, before.sums or ((0.0,) * 6,) * len(thrusts), strict=True):
        x = thrust - GRAVITY
        new = (1.0, x, y, x * x, x * y, y * y)
        sums.append(tuple(kept * a + b for a, b in zip(old, new, strict=True)))
    return replace(after, sums=tuple(sums))
