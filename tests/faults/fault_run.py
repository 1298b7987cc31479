"""Inject one fault into a flight, and judge what came of it."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from e2efly.flight.pilot.flight_state import Mode, Reason
from e2efly.logs.flight_log import read_log
from e2efly.logs.telemetry import Telemetry
from e2efly.validation.firmware_rig import STEP_S
from tests.faults.faults import End, Fault
from tests.faults.stage import FENCE, Stage, Trace

DOWN = (End.LANDED, End.OFF, End.FAILSAFE, End.FALLS)
"""Ends on the ground, motors stopped, the bridge in DONE or already in INIT."""
TOUCH_SPEED = 2.5
"""Fastest touch of the ground that legs and propellers survive, m/s."""
TOUCH_TILT = 0.35
"""Largest tilt at the touch, rad."""
TAKEOVER_S = 1.0
"""How long the pilot takes to notice, s."""
ROUNDING = 1e-6


@dataclass(frozen=True)
class Outcome:
    fault: str
    end: End
    """What had to come."""
    reaction: float
    """From the fault to the change of mode, s; NaN where none was to come."""
    allowed: float
    """The longest time that this may take: one control period and the stated time-out, s; NaN."""
    changes: tuple[tuple[float, str, tuple[str, ...]], ...]
    """The changes of mode after the fault: s after it, mode, reasons."""
    touch_speed: float
    """Of the touch of the ground, m/s; NaN without."""
    touch_tilt: float
    """rad; NaN."""
    largest_tilt: float
    """In the whole flight after the fault, rad."""
    problems: tuple[str, ...]
    """What was unlike the documented; empty: as it is to be."""


def strike(stage: Stage, fault: Fault, log: Path) -> Outcome:
    """Bring the flight to the fault, inject it, watch, and end it."""
    if fault.during is Mode.INIT:
        return _refused(stage, fault, log)
    stage.ready(fault.during)
    bridge, session = stage.session.bridge, stage.session
    period = math.ceil(session.period / STEP_S - ROUNDING) * STEP_S  # the rig's time goes on in whole steps
    stage.trace = Trace()
    with Telemetry(log) as telemetry:
        bridge.log = telemetry
        known, at = len(session.flown.changes), stage.rig.now()
        begun = math.nan
        stage.each = lambda: fault.each(stage)
        fault.inject(stage)
        end, settled = at + 20.0, math.inf
        while stage.rig.now() < min(end, settled):
            if math.isnan(begun) and fault.begins(stage):
                begun = stage.rig.now()
            if fault.end is End.PILOT and fault.reason is Reason.LINK and stage.rig.now() > at + TAKEOVER_S:
                stage.pilot = stage.pilot_lands
            if fault.end is End.OFF and stage.rig.now() > at + TAKEOVER_S:
                stage.rig.power(True)
            stage.step()
            if math.isinf(settled) and _arrived(stage, fault):
                settled = stage.rig.now() + fault.watch
        changes = tuple((t - at, mode, why) for t, mode, why in session.flown.changes[known:])
        reaction = at + changes[0][0] - begun if changes else math.nan
        if changes and math.isnan(begun):
            reaction = 0.0  # before it had to
        trace, mode = stage.trace, stage.mode
        bridge.log = None
    stage.heal()
    goes_on = fault.end is End.GOES_ON
    allowed = math.nan if goes_on else fault.within + period + (stage.policy_period if fault.asked else 0.0)
    problems = _change_problems(fault, changes, mode, reaction, allowed)
    speed, tilt = _touch(trace, stage.rig.world.vehicle.feet_height)
    problems += _world_problems(fault, trace, speed, tilt)
    problems += _log_problems(log, changes)
    return Outcome(
        fault.name, fault.end, reaction, allowed, changes, speed, tilt, max(trace.tilt), tuple(problems)
    )  # fmt: skip


def _arrived(stage: Stage, fault: Fault) -> bool:
    """Whether the flight is where it is to stay."""
    if fault.end is End.GOES_ON:
        return True
    if fault.end is End.STANDS:
        return stage.standing and stage.session.bridge.sent.throttle == 0
    if fault.end in DOWN:
        return stage.mode in (Mode.DONE, Mode.INIT)
    if fault.end is End.PILOT and fault.reason is Reason.LINK:
        return stage.standing
    return stage.mode is {End.HOVER: Mode.HOVER, End.PILOT: Mode.PILOT}[fault.end]


_FIRST = {End.HOVER: Mode.HOVER, End.STANDS: Mode.LAND} | dict.fromkeys(DOWN, Mode.LAND)
_LAST = (
    {End.HOVER: (Mode.HOVER,), End.STANDS: (Mode.LAND,)}
    | dict.fromkeys(DOWN, (Mode.DONE, Mode.INIT))
    | {End.LANDED: (Mode.DONE,)}
)


def _change_problems(
    fault: Fault, changes: tuple[tuple[float, str, tuple[str, ...]], ...], mode: Mode, reaction: float, allowed: float
) -> list[str]:
    said = [f"{m} ({'; '.join(why)})" for _, m, why in changes]
    if fault.end is End.GOES_ON:
        return [f"the mode changed: {said}"] if changes else []
    if not changes:
        return ["no change of mode"]
    problems = []
    first = _FIRST.get(fault.end, Mode.LAND if fault.reason is Reason.LINK else Mode.PILOT)
    if changes[0][1] != first or not (fault.reason is None or changes[0][2][0].startswith(fault.reason)):
        problems.append(f"changed to {said[0]} rather than to {first} ({fault.reason})")
    last = _LAST.get(fault.end)
    if last and mode not in last:
        problems.append(f"ended in {mode}: {said}")
    if not reaction <= allowed + ROUNDING:
        problems.append(f"reacted after {reaction:.3f} s; allowed: {allowed:.3f}")
    return problems


def _world_problems(fault: Fault, trace: Trace, speed: float, tilt: float) -> list[str]:
    problems = []
    if max(trace.tilt) > math.pi / 2 and fault.end is not End.FALLS:
        problems.append(f"tilted by {max(trace.tilt):.2f} rad")
    if fault.end in (End.LANDED, End.STANDS, End.FAILSAFE) or (fault.end is End.PILOT and fault.reason is Reason.LINK):
        if not speed <= TOUCH_SPEED:
            problems.append(f"touched the ground at {speed:.2f} m/s; accepted: {TOUCH_SPEED}")
        if not tilt <= TOUCH_TILT:
            problems.append(f"touched the ground tilted by {tilt:.2f} rad; accepted: {TOUCH_TILT}")
        x, y, _ = trace.position[-1]
        if not (FENCE.low[0] < x < FENCE.high[0] and FENCE.low[1] < y < FENCE.high[1]):
            problems.append(f"landed outside the fence, at {x:.2f}, {y:.2f} m")
    if fault.end in DOWN and trace.throttle[-1] > 0:
        problems.append(f"the throttle is {trace.throttle[-1]:.2f} at the end")
    if fault.end is End.OFF and trace.armed[-1]:
        problems.append("armed again")
    return problems


def _touch(trace: Trace, feet: float) -> tuple[float, float]:
    """Speed and tilt just before the ground was reached; NaN where it was not."""
    for i in range(1, len(trace.position)):
        if trace.position[i][2] <= feet + 1e-3 < trace.position[i - 1][2]:
            return float((trace.velocity[i - 1] ** 2).sum() ** 0.5), trace.tilt[i - 1]
    return math.nan, math.nan


def _log_problems(log: Path, changes: tuple[tuple[float, str, tuple[str, ...]], ...]) -> list[str]:
    read = read_log(log)
    logged = [(m["mode"], tuple(m["reasons"])) for m in read["mode"].values]
    flown = [(mode, why) for _, mode, why in changes]
    problems = [f"log: {read.cut_off}"] if read.cut_off else []
    if logged != flown:
        problems.append(f"the log has the changes {logged}; flown: {flown}")
    if not len(read["command"]):
        problems.append("the log has no commands")
    return problems


def _refused(stage: Stage, fault: Fault, log: Path) -> Outcome:
    """The pilot tries to take off with a controller that is not what it should be."""
    stage.ready(Mode.INIT)
    stage.close()
    stage.renew()
    fault.inject(stage)
    problems: list[str] = []
    changes: list[Any] = []
    try:
        stage.open()
    except ValueError as error:
        changes.append((0.0, "refused", (str(error),)))
        if fault.reason is not None:
            problems.append(f"refused outright: {error}")
    else:
        with Telemetry(log) as telemetry:
            stage.session.bridge.log = telemetry
            stage.trace = Trace()
            stage.rig.set(override=True)
            stage.fly(0.3)
            stage.rig.set(armed=True)
            stage.fly(1.0)
            stage.rig.set(mission="hover")
            stage.fly(1.5)
            reasons = tuple(stage.session.bridge.flight.reasons)
            changes.append((0.0, str(stage.mode), reasons))
            if stage.mode is not Mode.INIT or not any(r.startswith(str(fault.reason)) for r in reasons):
                problems.append(f"in {stage.mode}, for {reasons}")
            if not stage.standing or max(stage.trace.throttle) > 0:
                problems.append("it took off")
            stage.rig.set(armed=False, mission="land")
            stage.fly(0.3)
            stage.session.bridge.log = None
        problems += [f"log: {read_log(log).cut_off}"] if read_log(log).cut_off else []
    stage.close()
    stage.reopen()
    stage.fly(0.3)
    return Outcome(
        fault.name, fault.end, math.nan, math.nan, tuple(changes), math.nan, math.nan, math.nan, tuple(problems)
    )  # fmt: skip
