"""The ground, felt without poses: it carries a vehicle whose rotors do not.

In the air the force that the accelerometer feels follows the throttle, whatever the scale of either; on the ground it
stays. After a shock, or where the ground is overdue, the thrust is lowered for a moment, and the force is watched.
"""

import math
from dataclasses import dataclass, replace

from e2efly.vehicles.vehicle import GRAVITY

SHOCK = 3.0
"""Force beyond what thrust explains that a touch of the ground shows, m/s^2."""
DIP, DIP_S = 0.15, 0.32
"""Share of the thrust that is left out for so long, s, to feel whether the ground carries."""
DELAY_S = 0.12
"""Until the force shows it, s."""
CARRIED = (0.5, 1.5)
"""Share of the missing thrust that the ground takes over: all of it, as the force stays."""
WEIGHT = (0.75, 1.3)
"""Force of what stands, gravities, by an accelerometer that is calibrated badly."""
AGAIN_S = 1.0
"""Between two dips, s."""
USUAL_S, UNUSUAL = 0.5, 1.5
"""Over which the difference of force and thrust is smoothed, s; beyond this difference, m/s^2, it is a shock's."""
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
    dip: float = -math.inf
    """When the newest dip began, s."""
    before: float = 0.0
    """Thrust when it began, m/s^2."""
    sums: tuple[float, float, int] = (0.0, 0.0, 0)
    """Of force minus thrust and of thrust, and of how many measurements, in the dip so far."""
    carried: bool = False
    """The ground was felt in a dip."""
    supported: float = 0.0
    """For how long the force has been beyond the thrust, s."""

    def factor(self, now: float) -> float:
        """By which the thrust is multiplied at `now`, s."""
        return 1 - DIP if now - self.dip < DIP_S else 1.0

    @property
    def rests(self) -> bool:
        """Something has carried the vehicle for a while, by an accelerometer that is right."""
        return self.supported >= SUPPORT_S


def feel(before: Touch, raw: tuple[float, ...], force: float, thrust: float, now: float, dt: float) -> Touch:
    """Take in a measurement.

    Args:
        before: so far.
        raw: the accelerometer's numbers as they came.
        force: specific force along the body's z axis, m/s^2.
        thrust: the one that the throttle sent a moment before gives by the map, m/s^2.
        now: s.
        dt: since the measurement before, s.
    """
    beyond = force - thrust
    after = replace(
        before, raw=raw, changed=before.changed if raw == before.raw else now,
        supported=before.supported + dt if beyond > SUPPORT else 0.0,
    )  # fmt: skip
    if now - after.dip < DIP_S + DELAY_S:
        return _dipping(after, beyond, thrust, now)
    usual = beyond if after.usual is None else after.usual
    if abs(beyond - usual) < UNUSUAL:
        usual += (beyond - usual) * -math.expm1(-dt / USUAL_S)
    return replace(after, usual=usual)


def dip(before: Touch, thrust: float, now: float, *, overdue: bool, beyond: float) -> Touch:
    """Begin to feel for the ground, where there is a reason and the last time is long enough ago.

    Args:
        before: so far.
        thrust: now, by the map, m/s^2.
        now: s.
        overdue: by its height the vehicle ought to stand.
        beyond: force minus thrust of the newest measurement, m/s^2.
    """
    shock = before.usual is not None and beyond - before.usual > SHOCK
    alive = now - before.changed < ALIVE_S and before.usual is not None and abs(before.usual) < BELIEVED
    if not (shock or overdue) or not alive or now - before.dip < AGAIN_S:
        return before
    return replace(before, dip=now, before=thrust, sums=(0.0, 0.0, 0))


def _dipping(before: Touch, beyond: float, thrust: float, now: float) -> Touch:
    """The measurements of a dip, from when the force must show it; judged once enough of them have come."""
    if now - before.dip < DELAY_S:
        return before
    total, thrusts, count = before.sums
    total, thrusts, count = total + beyond, thrusts + thrust, count + 1
    after = replace(before, sums=(total, thrusts, count))
    if now - before.dip < DIP_S or count < 4 or before.usual is None:
        return after
    missing = before.before - thrusts / count
    gained, force = total / count - before.usual, (total + thrusts) / count
    carried = missing > 0 and CARRIED[0] < gained / missing < CARRIED[1]
    stands = WEIGHT[0] * GRAVITY < force < WEIGHT[1] * GRAVITY
    return replace(after, carried=before.carried or (carried and stands))
