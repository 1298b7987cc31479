"""What the flights of a campaign are held to, measured in the world."""

import math
from dataclasses import dataclass

import numpy as np

from e2efly.vehicles.gravity import GRAVITY
from tests.faults.injection import Excuse, Rule
from tests.faults.stage import Trace

HIGHEST_OFF, HIGHEST_CLIMB, FASTEST_TOUCH, FALL, LONGEST_ARMED = 0.5, 2.0, 1.5, 3.0, 3.0
"""The rules: motors off at most so high, m; a climb of at most so much, m; a touch at most so fast, m/s, from under so
high, m; armed with open throttle on the ground for at most so long, s."""
OFF, IDLE = 0.2, 0.1
"""Mean motor output below which the vehicle falls, and above which the motors do more than idle, at 0.055; with closed
throttle they may, too: the firmware then still holds the attitude."""
ON_GROUND = 1e-3
"""Height of the feet at which it stands, m."""
RECOVERY_S = 0.3
"""So long after the end of what nobody on board can help a touch is still owed to it, s."""


@dataclass(frozen=True)
class Span:
    """A time in which nothing on the companion computer can help."""

    begin: float
    """s."""
    end: float
    """s."""
    excuse: Excuse
    """What cannot be helped."""

    def covers(self, rule: Rule, time: float) -> bool:
        """Whether it excuses that a rule was broken at a time, s."""
        late = RECOVERY_S if rule is Rule.TOUCH else 0.0
        return rule in self.excuse.rules and self.begin <= time <= self.end + late


@dataclass(frozen=True)
class Violation:
    rule: Rule
    value: float
    """What was measured."""
    after: float
    """When, after the first fault, s."""
    beyond: str = ""
    """Why nothing on the companion computer could help; empty: the bridge is to blame."""


def judge(
    trace: Trace, feet: float, planned: float, began: float, beyond: list[Span], ended: bool
) -> tuple[dict[str, float], tuple[Violation, ...]]:
    """Measure a flight and hold it against the rules.

    Args:
        trace: from the first fault on.
        feet: height of the centre of mass of what stands, m.
        planned: height that it was to climb to, m; 0 where it was there.
        began: when the first fault did, s.
        beyond: when nothing on the companion computer could help.
        ended: it stands with closed throttle.

    Returns:
        The figures of `Flown` that the world alone decides, and the broken rules.
    """
    time, motor = np.array(trace.time), np.array(trace.motor)
    followed = np.ones(len(time), bool)  # the motors follow the bridge
    for span in beyond:
        if Rule.OFF in span.excuse.rules:
            followed &= (time < span.begin) | (time > span.end)
    closed = followed & (np.array(trace.throttle) <= 0)
    position, velocity = np.array(trace.position), np.array(trace.velocity)
    height = position[:, 2] - feet
    stands = height <= ON_GROUND
    start = max(float(height[0]), planned)
    broken: list[Violation] = []

    def breaks(rule: Rule, value: float, index: int, why: str = "") -> None:
        t = float(time[index])
        why = why or next((span.excuse.why for span in beyond if span.covers(rule, t)), "")
        broken.append(Violation(rule, value, t - began, why))

    climb, risen, owned = height - start, np.full(len(time), start), np.ones(len(time), bool)
    carried = [span for span in beyond if Rule.CLIMB in span.excuse.rules]
    for span in carried:
        owned &= (time < span.begin) | (time > span.end)
        if (back := int(np.searchsorted(time, span.end))) < len(time):  # what it was left with is not the bridge's
            coasts = max(float(velocity[back, 2]), 0.0) ** 2 / (2 * GRAVITY)
            risen[back:] = np.maximum(risen[back:], height[back] + coasts)
    own = np.where(owned, height - risen, 0.0)
    for above, why in ((own, ""), (climb, carried[-1].excuse.why if carried else "")):
        if above.max() > HIGHEST_CLIMB:
            breaks(Rule.CLIMB, float(above.max()), int(np.argmax(above > HIGHEST_CLIMB)), why)
            break
    off_height, touch = 0.0, (math.nan, math.nan, math.nan)
    for first, end in _runs(~stands):
        running = np.flatnonzero((motor > OFF)[first:end] & ~closed[first:end])
        cut = first + (int(running[-1]) + 1 if len(running) else 0)
        if cut < end:
            off_height = max(off_height, float(height[cut]))
            if height[cut] > HIGHEST_OFF:
                breaks(Rule.OFF, float(height[cut]), cut)
        if end < len(time):
            speed, top = float(np.linalg.norm(velocity[end - 1])), float(height[:end].max())
            if not speed <= touch[0]:
                touch = (speed, trace.tilt[end - 1], top)
            if speed > FASTEST_TOUCH and top < FALL:
                breaks(Rule.TOUCH, speed, end)
    armed_s = 0.0
    open_on_ground = stands & (motor > IDLE) & ~closed
    for first, end in (*_runs(open_on_ground & followed), *_runs(open_on_ground & ~followed)):
        lasted = float(time[end - 1] - time[first])
        armed_s = max(armed_s, lasted)
        if lasted > LONGEST_ARMED:
            breaks(Rule.ARMED, lasted, int(np.searchsorted(time, time[first] + LONGEST_ARMED)))
    if not ended and armed_s <= LONGEST_ARMED:
        breaks(Rule.ENDLESS, float(time[-1] - began), -1)
    figures = {
        "off_height": off_height, "climb": max(float(climb.max()), 0.0), "touch_speed": touch[0],
        "touch_tilt": touch[1], "fell_from": touch[2], "armed_s": armed_s,
        "drift": float(np.linalg.norm(position[-1, :2] - position[0, :2])),
    }  # fmt: skip
    return figures, tuple(broken)


def _runs(true: np.ndarray) -> list[tuple[int, int]]:
    edges = np.diff(np.concatenate([[0], true.astype(int), [0]]))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))
