"""One flight of a campaign: faults that strike together or one after another, measured in the world, judged by rules.

A scenario is plain data, and its flight is the same whenever it is flown: firmware, world and chance all begin anew.
"""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.deploy.flight_state import Mode
from e2efly.deploy.goal_options import GoalOptions, goal_for
from e2efly.deploy.policy import Policy
from e2efly.validate.firmware import Firmware
from e2efly.validate.injections import KINDS, Faults, Strike
from e2efly.validate.rig import Rig
from e2efly.validate.stage import LATENCY_S, SETTINGS, TARGET, Stage, Trace
from e2efly.vehicles.vehicle import Vehicle

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
STRUCK_IN = (Mode.INIT, Mode.TAKEOFF, Mode.HOVER, Mode.POLICY, Mode.LAND)
WATCH_S = 4.0
"""After the last change among the faults the pilot watches for so long, s, then asks for a landing."""
TRIES, TRY_S = 5, 0.83
"""How often the pilot asks for a take-off that is refused, and how long he waits each time, s."""
LONGEST_S = 30.0
"""A flight is watched for so long after the landing was asked for, s."""
STOOD_S = 1.0
"""It is over when it has stood still with motors off for so long, s."""


@dataclass(frozen=True)
class Scenario:
    """One flight: plain data."""

    name: str
    mode: str
    """In which the faults strike: one of `STRUCK_IN`; init: on the ground, before the flight."""
    strikes: tuple[Strike, ...]
    """In the order in which they begin."""
    height: float = 1.0
    """Of the hover, m."""
    seed: int = 0
    """Of all noise."""
    rescue: float | None = None
    """So long after the first fault the pilot takes over and lands, s; None: he watches."""

    def __post_init__(self) -> None:
        if self.mode not in STRUCK_IN:
            raise ValueError(f"mode is {self.mode!r}; accepted: {', '.join(STRUCK_IN)}")
        if not 0 < self.height < math.inf:
            raise ValueError(f"height is {self.height!r}; accepted: a positive number of metres")

    @staticmethod
    def of(data: dict[str, Any]) -> "Scenario":
        """From what `dataclasses.asdict` makes of one.

        Raises:
            ValueError: for an unknown mode or kind.
        """
        return Scenario(**{**data, "strikes": tuple(Strike(**strike) for strike in data["strikes"])})


@dataclass(frozen=True)
class Span:
    """A time in which nothing on the companion computer can help."""

    begin: float
    """s."""
    end: float
    """s."""
    why: str


NEVER = Span(math.inf, math.inf, "")


@dataclass(frozen=True)
class Violation:
    """A rule that was broken."""

    rule: str
    value: float
    """What was measured."""
    after: float
    """When, after the first fault, s."""
    beyond: str = ""
    """Why nothing on the companion computer could help; empty: the bridge is to blame."""


@dataclass(frozen=True)
class Flown:
    """What came of a scenario."""

    off_height: float
    """Highest over the ground at which the motors went off before a touch, m."""
    climb: float
    """Highest above where the first fault found it, or above the hover where it had not come to that, m."""
    touch_speed: float
    """Fastest touch of the ground, m/s; NaN without one."""
    touch_tilt: float
    """At that touch, rad; NaN."""
    fell_from: float
    """Highest over the ground before that touch, m; NaN."""
    armed_s: float
    """Longest time that it stood with open throttle, s."""
    drift: float
    """Horizontally from where the first fault found it, at the end, m."""
    ended: bool
    """It stands with closed throttle."""
    duration: float
    """From the first fault to the end, s."""
    mode: str
    """The bridge's at the end."""
    changes: tuple[tuple[float, str, tuple[str, ...]], ...]
    """The changes of mode after the first fault: s after it, mode, reasons."""
    violations: tuple[Violation, ...]


def fly(
    scenario: Scenario,
    policy: Policy,
    vehicle: Vehicle,
    firmware: Firmware,
    folder: Path,
    look: Callable[[Stage], None] = lambda stage: None,
) -> Flown:
    """Fly a scenario with a firmware of its own.

    Args:
        scenario: what to do.
        policy: one that hovers.
        vehicle: whose.
        firmware: built.
        folder: for the firmware's settings; made.
        look: called with the stage before each control step, to watch a flight closely.
    """
    settings = dataclasses.replace(SETTINGS, takeoff_height=scenario.height)
    x, y, _ = TARGET
    goal = goal_for(policy.contract, GoalOptions(target=(x, y, scenario.height)), vehicle)
    folder.mkdir(parents=True, exist_ok=True)
    with Rig(firmware, folder, vehicle, latency=LATENCY_S, seed=scenario.seed) as rig:
        stage = Stage(rig, policy, goal, scenario.seed, settings)
        try:
            return _flown(scenario, stage, look)
        finally:
            stage.close()


def _flown(scenario: Scenario, stage: Stage, look: Callable[[Stage], None]) -> Flown:
    rig, faults, waiting = stage.rig, Faults(stage), list(scenario.strikes)
    ground = scenario.mode == Mode.INIT
    if ground:  # the bridge knows nothing but what is wrong
        stage.close()
        stage.renew()
    else:
        stage.fly(0.3)
        _come_to(stage, Mode(scenario.mode))
    stage.trace = Trace()
    began = rig.now()
    faults.attach()

    def each() -> None:
        while waiting and rig.now() >= began + waiting[0].at - 1e-9:
            faults.begin(waiting.pop(0))
        faults.each()
        look(stage)
        if scenario.rescue is not None and rig.now() > began + scenario.rescue:
            stage.pilot = stage.pilot_lands

    each()
    if ground:
        stage.open()
        stage.trace = Trace()
    known = len(stage.session.flown.changes)
    stage.each = each
    planned = scenario.height if scenario.mode in (Mode.INIT, Mode.TAKEOFF) else 0.0
    if ground:
        stage.fly(0.5)
        _ask(stage)
        for _ in range(TRIES):
            if stage.fly(TRY_S, lambda: stage.mode is not Mode.INIT):
                break
            rig.set(mission="land")
            stage.fly(TRY_S / 2)
            rig.set(mission="hover")
    ends = [strike.at + (strike.lasts or 0.0) for strike in scenario.strikes]
    stage.fly(began + max(ends) + WATCH_S - rig.now(), lambda: not waiting and _over(stage))
    rig.set(mission="land")
    stage.fly(LONGEST_S, lambda: not waiting and _over(stage))
    changes = [(t - began, mode, why) for t, mode, why in stage.session.flown.changes[known:]]
    spans = [
        Span(began + s.at, math.inf if s.lasts is None else began + s.at + s.lasts, KINDS[s.kind].beyond)
        for s in scenario.strikes
        if KINDS[s.kind].beyond
    ]
    feet = rig.world.vehicle.feet_height
    measured, violations = judge(stage.trace, feet, planned, began, spans)
    return Flown(
        **measured,
        ended=stage.standing and _closed(stage),
        duration=rig.now() - began,
        mode=str(stage.mode),
        changes=tuple(changes),
        violations=violations,
    )


def _ask(stage: Stage) -> None:
    """The pilot arms and asks for a hover."""
    stage.rig.set(override=True)
    stage.fly(0.3)
    stage.rig.set(armed=True)
    stage.fly(0.3)
    stage.rig.set(mission="hover")


def _come_to(stage: Stage, mode: Mode) -> None:
    """Bring the flight to the mode in which the faults strike."""
    if mode is Mode.TAKEOFF:
        _ask(stage)
        if not stage.fly(3.0, lambda: stage.mode is Mode.TAKEOFF):
            raise RuntimeError(f"no take-off: {'; '.join(stage.session.bridge.flight.reasons)}")
        return
    stage.ready(Mode.POLICY if mode is Mode.POLICY else Mode.HOVER)
    if mode is Mode.LAND:
        stage.rig.set(mission="land")
        stage.fly(1.0, lambda: stage.mode is Mode.LAND)


def _over(stage: Stage) -> bool:
    """Whether it has stood with closed throttle, or shown that it stands with an open one, for long enough."""
    trace, period = stage.trace, stage.session.period
    count, longest = 1 + round(STOOD_S / period), 1 + round((LONGEST_ARMED + STOOD_S) / period)
    standing = [p[2] <= stage.rig.world.vehicle.feet_height + ON_GROUND for p in trace.position[-longest:]]
    running = [m > IDLE for m in trace.motor[-longest:]]
    stuck = len(standing) >= longest and all(standing) and all(running) and not _closed(stage)
    return stuck or (len(standing) >= count and all(standing[-count:]) and _closed(stage, count))


def _closed(stage: Stage, count: int = 1) -> bool:
    """Whether the throttle is closed, and the firmware knows or the motors are still."""
    trace = stage.trace
    known = not stage.link.silent or max(trace.motor[-count:]) < IDLE
    return stage.mode in (Mode.DONE, Mode.INIT) and max(trace.throttle[-count:]) <= 0 and known


def judge(
    trace: Trace, feet: float, planned: float, began: float, beyond: list[Span]
) -> tuple[dict[str, float], tuple[Violation, ...]]:
    """Measure a flight and hold it against the rules.

    Args:
        trace: from the first fault on.
        feet: height of the centre of mass of what stands, m.
        planned: height that it was to climb to, m; 0 where it was there.
        began: when the first fault did, s.
        beyond: when nothing on the companion computer could help.

    Returns:
        The figures of `Flown` that the world alone decides, and the broken rules.
    """
    time, motor = np.array(trace.time), np.array(trace.motor)
    obeyed = ~np.any([(span.begin <= time) & (time <= span.end) for span in [*beyond, NEVER]], axis=0)
    closed = obeyed & (np.array(trace.throttle) <= 0)
    position, velocity = np.array(trace.position), np.array(trace.velocity)
    height = position[:, 2] - feet
    stands = height <= ON_GROUND
    start = max(float(height[0]), planned)
    broken: list[Violation] = []

    def breaks(rule: str, value: float, index: int, late: float = 0.0) -> None:
        t = float(time[index])
        why = next((s.why for s in beyond if s.begin <= t <= s.end + late), "")
        broken.append(Violation(rule, value, t - began, why))

    climb = height - start
    if climb.max() > HIGHEST_CLIMB:
        breaks("climb", float(climb.max()), int(np.argmax(climb > HIGHEST_CLIMB)))
    off_height, touch = 0.0, (math.nan, math.nan, math.nan)
    for first, end in _runs(~stands):
        running = np.flatnonzero((motor > OFF)[first:end] & ~closed[first:end])
        cut = first + (int(running[-1]) + 1 if len(running) else 0)
        if cut < end:
            off_height = max(off_height, float(height[cut]))
            if height[cut] > HIGHEST_OFF:
                breaks("motors off", float(height[cut]), cut)
        if end < len(time):
            speed, top = float(np.linalg.norm(velocity[end - 1])), float(height[:end].max())
            if not speed <= touch[0]:
                touch = (speed, trace.tilt[end - 1], top)
            if speed > FASTEST_TOUCH and top < FALL:
                breaks("touch", speed, end, RECOVERY_S)
    armed_s = 0.0
    for first, end in _runs(stands & (motor > IDLE) & ~closed):
        lasted = float(time[end - 1] - time[first])
        armed_s = max(armed_s, lasted)
        if lasted > LONGEST_ARMED:
            breaks("armed on the ground", lasted, int(np.searchsorted(time, time[first] + LONGEST_ARMED)))
    figures = {
        "off_height": off_height, "climb": max(float(climb.max()), 0.0), "touch_speed": touch[0],
        "touch_tilt": touch[1], "fell_from": touch[2], "armed_s": armed_s,
        "drift": float(np.linalg.norm(position[-1, :2] - position[0, :2])),
    }  # fmt: skip
    return figures, tuple(broken)


def _runs(true: np.ndarray) -> list[tuple[int, int]]:
    """Begin and end of each run of True."""
    edges = np.diff(np.concatenate([[0], true.astype(int), [0]]))
    return list(zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True))
