"""One flight of a campaign: faults that strike together or one after another, measured in the world, judged by rules.

A scenario is plain data, and its flight is the same whenever it is flown: firmware, world and chance all begin anew.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from e2efly.flight.pilot.flight_state import Mode
from e2efly.policy.loader import Policy
from e2efly.validation.firmware_program import Firmware
from e2efly.validation.rig import Rig
from e2efly.vehicles.vehicle import Vehicle
from tests.faults.campaign_rules import IDLE, LONGEST_ARMED, ON_GROUND, Span, Violation, judge
from tests.faults.fliers import body_of, flier_of, outfit
from tests.faults.injection import Flier
from tests.faults.injections import KINDS, Faults, Strike
from tests.faults.stage import LATENCY_S, Stage, Trace

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
        flier_of(self.strikes)

    @staticmethod
    def of(data: dict[str, Any]) -> "Scenario":
        """From what `dataclasses.asdict` makes of one."""
        return Scenario(**{**data, "strikes": tuple(Strike(**strike) for strike in data["strikes"])})


@dataclass(frozen=True)
class Flown:
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
    reasons: tuple[str, ...]
    """What it says of it."""
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
    """Fly a scenario with a firmware of its own; `look` is called with the stage before each control step."""
    folder.mkdir(parents=True, exist_ok=True)
    body = body_of(scenario.strikes, vehicle)
    with Rig(firmware, folder, body, latency=LATENCY_S, seed=scenario.seed) as rig:
        with_ = outfit(scenario.strikes, scenario.height, scenario.seed, rig, policy, vehicle, folder)
        stage = Stage(rig, with_.policy, with_.course, scenario.seed, with_.settings, with_.gear)
        try:
            return _flown(scenario, stage, look)
        finally:
            stage.end()


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
        try:
            stage.open()
        except (ValueError, OSError) as error:
            return _refused(str(error))
        stage.trace = Trace()
    known = len(stage.session.flown.changes)
    stage.each = each
    if scenario.mode == Mode.HOVER and flier_of(scenario.strikes) is not Flier.POLICY:
        rig.set(mission="policy")  # it takes over, or is not let, with the fault there
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
    quiet = began + max(ends)
    stage.fly(quiet + WATCH_S - rig.now(), lambda: not waiting and _over(stage, quiet))
    rig.set(mission="land")
    stage.fly(LONGEST_S, lambda: not waiting and _over(stage, quiet))
    changes = [(t - began, mode, why) for t, mode, why in stage.session.flown.changes[known:]]
    ended = stage.standing and _closed(stage)
    feet, spans = rig.world.vehicle.feet_height, beyond(scenario, began)
    measured, violations = judge(stage.trace, feet, planned, began, spans, ended)
    return Flown(
        **measured,
        ended=ended,
        duration=rig.now() - began,
        mode=str(stage.mode),
        reasons=tuple(map(str, stage.session.bridge.flight.reasons)),
        changes=tuple(changes),
        violations=violations,
    )


def _refused(problem: str) -> Flown:
    """The bridge does not start with this controller."""
    nothing, never = 0.0, math.nan
    return Flown(
        nothing, nothing, never, never, never, nothing, nothing, True, nothing, "refused",
        (problem,), (), (),
    )  # fmt: skip


def beyond(scenario: Scenario, began: float) -> list[Span]:
    """When nothing on the companion computer can help, of a scenario whose first fault could begin at `began`, s."""
    spans = []
    for strike in scenario.strikes:
        if (excuse := KINDS[strike.kind].excuse) is not None:
            if excuse.unless_grounded and scenario.mode == Mode.INIT:
                continue
            lasts = math.inf if strike.lasts is None or excuse.for_good else strike.lasts
            spans.append(Span(began + strike.at + excuse.after, began + strike.at + lasts, excuse))
    return spans


def _ask(stage: Stage) -> None:
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


def _over(stage: Stage, quiet: float) -> bool:
    """Whether it has stood with closed throttle, or since the last change among the faults, s, with an open one."""
    trace, period = stage.trace, stage.session.period
    count, longest = 1 + round(STOOD_S / period), 1 + round((LONGEST_ARMED + STOOD_S) / period)
    standing = [p[2] <= stage.rig.world.vehicle.feet_height + ON_GROUND for p in trace.position[-longest:]]
    running = [m > IDLE for m in trace.motor[-longest:]]
    watched = stage.rig.now() - quiet > LONGEST_ARMED + STOOD_S
    stuck = watched and len(standing) >= longest and all(standing) and all(running) and not _closed(stage)
    return stuck or (len(standing) >= count and all(standing[-count:]) and _closed(stage, count))


def _closed(stage: Stage, count: int = 1) -> bool:
    """Whether the throttle is closed, and the firmware knows or the motors are still."""
    trace = stage.trace
    known = not stage.link.silent or max(trace.motor[-count:]) < IDLE
    ended = stage.taken_over or stage.mode in (Mode.DONE, Mode.INIT)
    return ended and max(trace.throttle[-count:]) <= 0 and known
