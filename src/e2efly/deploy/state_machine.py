"""The flight's modes: a pure function from what is known to who flies, and why.

    INIT -> TAKEOFF -> HOVER <-> POLICY
              |          |          |
              +--------> +-> LAND <-+ -> DONE -> INIT

The pilot's switches and sticks always win: from any mode in the air, the override switch leads to PILOT, and back to
HOVER (to LAND without odometry, to INIT on the ground); disarming leads to DONE. Each refusal and each change of mode
carries its reasons.
"""

import dataclasses
import math

import numpy as np

from e2efly.deploy.fence import fence_problem, here, moved, stopping, tilt_of
from e2efly.deploy.flight_state import AIRBORNE, Flight, Inputs, Mission, Mode, Pilot, Reason, Target
from e2efly.deploy.hover import blind_time
from e2efly.deploy.odometry import Odometry
from e2efly.deploy.settings import FlightSettings

LONGEST_STEP = 0.1
"""A step counts for no longer than this, s, whatever the clock does."""
SLOWING = 0.5
"""Deceleration with which a take-off's target nears its height, m/s^2."""
CLIMB_S = 5.0
"""A take-off may last so much longer than its target's climb, s."""
LEVEL = 0.35
"""Largest tilt before take-off, rad."""
ON_GROUND = 0.25
"""Largest height of the centre of mass over the ground before take-off, m."""
STANDING = 0.1
"""A still vehicle this near to the height at which it stood before stands there again, m."""
SLOW = 0.5
"""Horizontal speed below which a landing sinks, m/s ..."""
SLOWED_S = 3.0
"""... or after so long: in a gust it may never be that slow, s."""
MISLED = "the vehicle does not go where it is sent (wrong heading?)"
"""Said of odometry that is not the vehicle's own ..."""
TURNED = "its heading is wrong"
"""... and of odometry whose heading is not."""
FALLEN, FALLEN_SPEED, FALLEN_S = math.radians(60), 0.3, 0.5
"""Nothing flies so far from level, so slowly, m/s, for so long, s: gravity alone would have made it faster."""
LEAD = 0.6
"""How far the target of a landing may be under the vehicle, m: farther shows no more than that there is ground."""
PRESSED = 0.5
"""A still vehicle with its target so far under it stands on something, m."""
PRESSING = 0.5
"""One that is still in the air, by its height, is pressed down ever harder until it is felt that it stands, m/s."""
FOUND_S = 0.5
"""Odometry that was lost in a landing must be good for so long, s, to be flown by again: one that comes and goes must
not begin the landing anew each time."""
STAYS_S, AWAY_S = 1.0, 3.0
"""A landing that stays at one place for so long has ended at home, s, and, sent down blindly, elsewhere, s."""
RECENT_S = 0.5
"""An odometry as old as this still tells that the vehicle stands, s."""
NEAR_GROUND = 0.3
"""In a landing below this height the shock of the ground is not taken for a contradiction of poses and sensors, m."""


def step(settings: FlightSettings, flight: Flight, inputs: Inputs, now: float) -> Flight:
    """The machine's next state.

    Args:
        settings: what the flight may do.
        flight: the state before.
        inputs: what is known now.
        now: s, never falling; a jump counts as one long step.
    """
    passed = now - flight.now if flight.now else 0.0
    dt = min(max(passed, 0.0), LONGEST_STEP)
    jump = passed - dt
    policy = inputs.pilot is not None and inputs.pilot.mission is Mission.POLICY
    flight = dataclasses.replace(
        flight,
        now=now,
        since=flight.since + jump,
        still_since=_moved(flight.still_since, jump),
        fallen_since=_moved(flight.fallen_since, jump),
        found_since=_moved(flight.found_since, jump),
        standing_since=_moved(flight.standing_since, jump),
        lost=None if flight.lost is None else (flight.lost[0] + jump, *flight.lost[1:]),
        rearm=flight.rearm and not _mission_low(inputs),
        lock=flight.lock and policy,
    )
    flight = _watched(settings, flight, inputs)
    if flight.misled:
        turned = flight.turned
        problem = flight.misled if turned is None else f"{TURNED} by {math.degrees(turned):.0f} deg"
        inputs = dataclasses.replace(inputs, odometry_problem=problem)
    following = _common(flight, inputs) or _STEPS[flight.mode](settings, flight, inputs, dt)
    if (following.mode, following.blind) == (flight.mode, flight.blind):
        return following
    return dataclasses.replace(following, since=now, still_since=None, fallen_since=None, nearest=math.inf)


def _moved(moment: float | None, jump: float) -> float | None:
    return None if moment is None else moment + jump


def _watched(settings: FlightSettings, flight: Flight, inputs: Inputs) -> Flight:
    """Whether the odometry is the vehicle's own, and whether the vehicle has fallen over.

    With a wrong heading the controller pushes to the wrong side, and the vehicle spirals outwards, ever faster. Nothing
    on the ground shows it: the flight controller's own heading is not the odometry's. The flight shows it, and where it
    does not, the distance from the target.
    """
    if flight.mode in (Mode.INIT, Mode.DONE):
        return dataclasses.replace(flight, misled=None, turned=None, fallen_since=None)
    odometry, target = inputs.seen, flight.target
    if odometry is None:
        return dataclasses.replace(flight, fallen_since=None)
    fallen = tilt_of(odometry.quaternion) > FALLEN and float(np.linalg.norm(odometry.velocity)) < FALLEN_SPEED
    fallen_since = (flight.now if flight.fallen_since is None else flight.fallen_since) if fallen else None
    flight = dataclasses.replace(flight, fallen_since=fallen_since)
    error = inputs.heading_error
    if flight.misled and flight.turned is not None and error is not None:
        flight = dataclasses.replace(flight, turned=error)
    if inputs.motion_problem and not flight.misled and not _nearly_landed(flight, odometry):
        return dataclasses.replace(flight, misled=f"{Reason.MOTION}: {inputs.motion_problem}")
    if target is None or flight.mode is Mode.PILOT:
        misled = None if _stands(settings, flight, odometry) else flight.misled
        return dataclasses.replace(flight, misled=misled, turned=flight.turned if misled else None)
    if error is not None and abs(error) > settings.heading_agreement:
        return dataclasses.replace(flight, misled=TURNED, turned=error)
    off = math.hypot(*np.subtract(target.position[:2], odometry.position[:2]).tolist())
    rests = math.isfinite(flight.nearest) or float(np.linalg.norm(odometry.velocity)) < SLOW
    nearest = min(flight.nearest, off) if rests else math.inf
    misled = flight.misled or (MISLED if off > nearest + settings.follow_distance else None)
    return dataclasses.replace(flight, nearest=nearest, misled=misled)


def _nearly_landed(flight: Flight, odometry: Odometry) -> bool:
    return flight.mode is Mode.LAND and abs(float(odometry.position[2]) - flight.home) < NEAR_GROUND


def _mission_low(inputs: Inputs) -> bool:
    return inputs.pilot is not None and inputs.pilot.mission is Mission.LAND


def _to(
    flight: Flight, mode: Mode, *reasons: str, target: Target | None = None, blind: bool = False, **changes: bool
) -> Flight:
    return dataclasses.replace(flight, mode=mode, reasons=reasons, target=target, blind=blind, **changes)


def _common(flight: Flight, inputs: Inputs) -> Flight | None:
    """What holds in every mode: disarming ends a flight, and the override switch is the pilot's."""
    if inputs.link_problem:
        return None  # nothing is known of the controller; each mode decides
    if not inputs.armed:
        return None if flight.mode in (Mode.INIT, Mode.DONE) else _to(flight, Mode.DONE, Reason.DISARMED)
    if not inputs.override and (flight.mode in AIRBORNE or _left_the_ground(flight, inputs.seen)):
        return _to(flight, Mode.PILOT, Reason.OVERRIDE_OFF, target=_here(inputs))
    if flight.mode in AIRBORNE and flight.fallen_since is not None and flight.now - flight.fallen_since >= FALLEN_S:
        return _to(flight, Mode.DONE, Reason.CRASHED)
    return None


def _left_the_ground(flight: Flight, odometry: Odometry | None) -> bool:
    """Whether the pilot has taken off by hand: handed over, the vehicle must not be let fall."""
    grounded = flight.mode in (Mode.INIT, Mode.DONE)
    return grounded and odometry is not None and abs(float(odometry.position[2]) - flight.home) > ON_GROUND


def _init(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    del dt
    odometry = inputs.seen
    if odometry is not None and not inputs.armed:
        flight = dataclasses.replace(flight, home=float(odometry.position[2]))
    if refusals := take_off_refusals(settings, flight, inputs):
        # what else was wrong may come right by itself: only the mission switch may start a flight
        return dataclasses.replace(flight, reasons=refusals, rearm=not _mission_low(inputs))
    assert inputs.pilot is not None
    assert odometry is not None
    if inputs.pilot.mission is Mission.LAND:
        return dataclasses.replace(flight, reasons=(Reason.WAITING,))
    target = here(odometry)
    flight = dataclasses.replace(flight, home=target.position[2], lock=inputs.pilot.mission is Mission.POLICY)
    return _to(flight, Mode.TAKEOFF, Reason.MISSION, target=target)


def take_off_refusals(settings: FlightSettings, flight: Flight, inputs: Inputs) -> tuple[str, ...]:
    """Every condition for take-off that is not met, in words."""
    reasons = [] if inputs.seen is None else _standing_refusals(settings, inputs.seen)
    if inputs.seen is None:
        reasons.append(inputs.blindness)
    if inputs.link_problem:
        reasons.append(f"{Reason.LINK}: {inputs.link_problem}")
    error = inputs.attitude_error
    if error is None:
        reasons.append(f"{Reason.ATTITUDE}: the controller's is not known")
    elif not error <= settings.attitude_agreement:
        reasons.append(f"{Reason.ATTITUDE}: by {math.degrees(error):.0f} deg")
    if inputs.accelerometer_problem:
        reasons.append(f"{Reason.ACCELEROMETER}: {inputs.accelerometer_problem}")
    if inputs.motion_problem:
        reasons.append(f"{Reason.MOTION}: {inputs.motion_problem}")
    reasons += _battery(settings, inputs)
    reasons += _sticks(settings, inputs.pilot, Reason.STICKS)
    if inputs.pilot is None:
        reasons.append(Reason.NO_PILOT)
    elif flight.rearm:
        reasons.append(Reason.MISSION_NOT_LOW)
    reasons += [f"{Reason.SETTINGS}: {problem}" for problem in inputs.settings_problems]
    if not inputs.armed:
        reasons.append(Reason.NOT_ARMED)
    if not inputs.override:
        reasons.append(Reason.NO_OVERRIDE)
    return tuple(reasons)


def _standing_refusals(settings: FlightSettings, odometry: Odometry) -> list[str]:
    """Why a vehicle that is so does not stand ready."""
    reasons: list[str] = []
    speed, tilt = float(np.linalg.norm(odometry.velocity)), tilt_of(odometry.quaternion)
    height, fence, (x, y, _) = float(odometry.position[2]) - settings.ground_height, settings.fence, odometry.position
    if speed > settings.still_speed:
        reasons.append(f"{Reason.MOVING}: {speed:.2f} m/s; accepted: {settings.still_speed:g}")
    if abs(height) > ON_GROUND:
        reasons.append(f"{Reason.NOT_ON_GROUND}: {height:.2f} m over ground_height; accepted: {ON_GROUND:g}")
    if tilt > LEVEL:
        reasons.append(f"{Reason.TILTED}: {math.degrees(tilt):.0f} deg; accepted: {math.degrees(LEVEL):.0f}")
    if not (fence.low[0] < x < fence.high[0] and fence.low[1] < y < fence.high[1]):
        reasons.append(f"{Reason.OUTSIDE_FENCE}: x and y are {x:.2f} and {y:.2f} m")
    return reasons


def _battery(settings: FlightSettings, inputs: Inputs) -> list[str]:
    if inputs.voltage is None:
        return [] if settings.battery_unknown else [Reason.BATTERY_UNKNOWN]
    if not inputs.voltage >= settings.battery_low:
        return [f"{Reason.BATTERY_LOW}: {inputs.voltage:.2f} V a cell; accepted: {settings.battery_low:g}"]
    return []


def _sticks(settings: FlightSettings, pilot: Pilot | None, reason: Reason) -> list[str]:
    if pilot is None or pilot.deflection <= settings.stick_deadband:
        return []
    return [f"{reason}: by {pilot.deflection:.2f}"]


def _lost(inputs: Inputs) -> tuple[str, ...]:
    """What is missing that nobody but the pilot flies without."""
    if inputs.seen is None:
        return (inputs.blindness,)
    if inputs.link_problem:
        return (f"{Reason.LINK}: {inputs.link_problem}",)
    return (Reason.NO_PILOT,) if inputs.pilot is None else ()


def _must_land(settings: FlightSettings, inputs: Inputs) -> tuple[str, ...]:
    """Why the hover controller must land now."""
    if reasons := _lost(inputs):
        return reasons
    if _mission_low(inputs):
        return (Reason.MISSION,)
    if inputs.accelerometer_problem:
        return (f"{Reason.ACCELEROMETER}: {inputs.accelerometer_problem}",)
    return tuple(_battery(settings, inputs)) if inputs.voltage is not None else ()


def _land(settings: FlightSettings, flight: Flight, inputs: Inputs, *reasons: str) -> Flight:
    if inputs.seen is None:
        return _blindly(settings, flight, inputs, *reasons)
    return _to(flight, Mode.LAND, *reasons, target=_down_from(settings, inputs.seen))


def _blindly(settings: FlightSettings, flight: Flight, inputs: Inputs, *reasons: str) -> Flight:
    lost = _last_seen(settings, flight, inputs)
    begun = dataclasses.replace(flight, lost=lost, found_since=None)
    return _to(begun, Mode.LAND, *reasons, blind=True)


def _down_from(settings: FlightSettings, odometry: Odometry) -> Target:
    """Where it can stop, but no higher than it is: what has nearly landed must not rise to the fence's floor."""
    target = stopping(settings.fence, odometry)
    x, y, z = target.position
    return dataclasses.replace(target, position=(x, y, min(z, float(odometry.position[2]))))


def _here(inputs: Inputs) -> Target | None:
    return None if inputs.seen is None else here(inputs.seen)


def _take_off(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    if reasons := _must_land(settings, inputs):
        return _land(settings, flight, inputs, *reasons)
    assert flight.target is not None
    assert inputs.odometry is not None
    height = float(inputs.odometry.position[2]) - flight.home
    elapsed = flight.now - flight.since
    if elapsed > settings.takeoff_height / settings.takeoff_speed + CLIMB_S:
        return _land(settings, flight, inputs, f"{Reason.NOT_CLIMBING}: {height:.2f} m after {elapsed:.0f} s")
    x, y, z = flight.target.position
    goal = flight.home + settings.takeoff_height
    climb = min(settings.takeoff_speed, math.sqrt(2 * SLOWING * max(goal - z, 0.0)) + 0.02)
    up = min(z + climb * dt, goal)
    target = Target((x, y, up), flight.target.yaw, climb if up < goal else 0.0)
    if settings.takeoff_height - height < 0.1 and up == goal:
        return _to(flight, Mode.HOVER, Reason.REACHED, target=target)
    return dataclasses.replace(flight, target=target)


def _hover(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    if reasons := _must_land(settings, inputs):
        return _land(settings, flight, inputs, *reasons)
    assert flight.target is not None
    assert inputs.odometry is not None
    assert inputs.pilot is not None
    if inputs.pilot.mission is Mission.POLICY:
        refusals = policy_refusals(settings, flight, inputs, inputs.odometry)
        if not refusals:
            return _to(flight, Mode.POLICY, Reason.MISSION)
        flight = dataclasses.replace(flight, reasons=refusals)
    assert flight.target is not None
    target = moved(settings, flight.target, inputs.pilot, dt)
    nearest = flight.nearest if target.position[:2] == flight.target.position[:2] else math.inf
    return dataclasses.replace(flight, target=target, nearest=nearest)


def policy_refusals(settings: FlightSettings, flight: Flight, inputs: Inputs, odometry: Odometry) -> tuple[str, ...]:
    """Why the policy may not fly now; empty: it may."""
    reasons: list[str] = [Reason.LOCKED] if flight.lock else []
    if inputs.policy_problem:
        reasons.append(f"{Reason.POLICY}: {inputs.policy_problem}")
    reasons += _sticks(settings, inputs.pilot, Reason.STICK_INPUT)
    if problem := fence_problem(settings.fence, odometry, floor=not inputs.policy_lands):
        reasons.append(problem)
    if inputs.missed_deadlines >= settings.missed_deadlines:
        reasons.append(f"{Reason.DEADLINES}: {inputs.missed_deadlines} in a second")
    if inputs.accelerometer_problem:
        reasons.append(f"{Reason.ACCELEROMETER}: {inputs.accelerometer_problem}")
    return (*reasons, *_battery(settings, inputs))


def _policy(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    del dt
    if lost := _lost(inputs):
        return _land(settings, flight, inputs, *lost)
    assert inputs.odometry is not None
    assert inputs.pilot is not None
    reasons: tuple[str, ...] = ()
    if inputs.pilot.mission is not Mission.POLICY:
        reasons = (Reason.MISSION,)
    elif inputs.policy_done:
        reasons = (Reason.POLICY_DONE,)
        if float(inputs.odometry.position[2]) - settings.ground_height < ON_GROUND:
            return _land(settings, flight, inputs, *reasons)
    else:
        reasons = policy_refusals(settings, flight, inputs, inputs.odometry)
    if reasons:
        return _to(flight, Mode.HOVER, *reasons, target=stopping(settings.fence, inputs.odometry), lock=True)
    return flight


def _landing(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    flight = _looked(flight, inputs)
    if inputs.link_problem and inputs.silent:  # what it does meanwhile is not known: nothing counts as landed
        return _unheard(settings, flight, inputs)
    if flight.standing_since is not None and flight.now - flight.standing_since >= _settled(settings, flight, inputs):
        assert inputs.odometry is not None
        return dataclasses.replace(_to(flight, Mode.DONE, Reason.LANDED), home=float(inputs.odometry.position[2]))
    odometry = inputs.seen
    if odometry is None:
        return _sinking(settings, flight, inputs)
    if flight.blind:
        found = flight.now if flight.found_since is None else flight.found_since
        flight = dataclasses.replace(flight, found_since=found, lost=_last_seen(settings, flight, inputs))
        return _sinking(settings, flight, inputs) if flight.now - found < FOUND_S else _see(settings, flight, odometry)
    assert flight.target is not None
    x, y, z = flight.target.position
    height = float(odometry.position[2])
    stopped = float(np.linalg.norm(odometry.velocity[:2])) < SLOW or flight.now - flight.since > SLOWED_S
    sink = settings.land_speed if stopped else 0.0
    still_for = 0.0 if flight.still_since is None else flight.now - flight.still_since
    down = max(z - sink * dt, height - LEAD - PRESSING * max(still_for - settings.land_settle, 0.0))
    still = float(np.linalg.norm(odometry.velocity)) < settings.still_speed and height - down > PRESSED
    since = (flight.now if flight.still_since is None else flight.still_since) if still else None
    low = height < flight.home + STANDING
    if since is not None and flight.now - since >= settings.land_settle and (low or inputs.supported):
        return dataclasses.replace(_to(flight, Mode.DONE, Reason.LANDED), home=height)
    target = Target((x, y, down), flight.target.yaw, -sink)
    return dataclasses.replace(flight, target=target, still_since=since)


def _see(settings: FlightSettings, flight: Flight, odometry: Odometry) -> Flight:
    """Land by odometry from where it is."""
    return dataclasses.replace(
        flight, blind=False, found_since=None, lost=None, target=_down_from(settings, odometry), still_since=None,
        nearest=math.inf,
    )  # fmt: skip


def _unheard(settings: FlightSettings, flight: Flight, inputs: Inputs) -> Flight:
    """While the link is down: no clock of the landing runs, and it will begin where the vehicle is."""
    flight = dataclasses.replace(flight, still_since=None)
    if inputs.seen is not None:
        return _see(settings, flight, inputs.seen)
    if not flight.blind or flight.lost is None:
        return _blindly(settings, flight, inputs, *flight.reasons)
    return dataclasses.replace(flight, lost=(flight.now, *flight.lost[1:]))


def _looked(flight: Flight, inputs: Inputs) -> Flight:
    """In a landing: since when the newest odometry, good or lost just now, has stayed at one place."""
    odometry = inputs.odometry
    if odometry is None or flight.misled or flight.now - odometry.time > RECENT_S:
        return dataclasses.replace(flight, standing_since=None, stood_at=None)
    x, y, z = (float(p) for p in odometry.position)
    if not math.isfinite(x + y + z):
        return flight
    if flight.stood_at is None or math.dist(flight.stood_at, (x, y, z)) > STANDING:
        return dataclasses.replace(flight, standing_since=flight.now, stood_at=(x, y, z))
    return flight


def _settled(settings: FlightSettings, flight: Flight, inputs: Inputs) -> float:
    """For how long it must have stayed at one place to have landed, s."""
    assert inputs.odometry is not None
    if abs(float(inputs.odometry.position[2]) - flight.home) < STANDING:
        return max(settings.land_settle, STAYS_S)
    return AWAY_S if flight.blind else math.inf


def _last_seen(settings: FlightSettings, flight: Flight, inputs: Inputs) -> tuple[float, float, float]:
    """Now, and the height over home, m, and the climb, m/s, that the newest odometry tells; mirrored, it is as high."""
    o = inputs.odometry
    height, climb = (math.nan, math.nan) if o is None else (float(o.position[2]) - flight.home, float(o.velocity[2]))
    if not math.isfinite(height):
        height = settings.fence.high[2] - flight.home
    return flight.now, abs(height), abs(climb) if math.isfinite(climb) else 0.0


def _sinking(settings: FlightSettings, flight: Flight, inputs: Inputs) -> Flight:
    """Landing without odometry ends with the ground felt, or by the clock: what has landed must not start up again."""
    if not flight.blind:
        return _blindly(settings, flight, inputs, inputs.blindness)
    if inputs.touched:
        return _to(flight, Mode.DONE, Reason.TOUCHED)
    if inputs.seen is None:
        flight = dataclasses.replace(flight, found_since=None)
    at, height, climb = flight.lost or _last_seen(settings, flight, inputs)
    if flight.now - at > blind_time(height, climb):
        return _to(flight, Mode.DONE, f"{Reason.LANDED}: without odometry, after {flight.now - at:.0f} s")
    return flight


def _with_pilot(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    """While the pilot flies, the hover controller stays ready at the place where the vehicle is."""
    del dt
    odometry = inputs.seen
    if not inputs.override or inputs.link_problem:
        return dataclasses.replace(flight, target=_here(inputs))
    if odometry is None:
        return _land(settings, flight, inputs, Reason.OVERRIDE_ON, inputs.blindness)
    if _stands(settings, flight, odometry):
        return _to(flight, Mode.INIT, Reason.OVERRIDE_ON, rearm=True)
    return _to(flight, Mode.HOVER, Reason.OVERRIDE_ON, target=here(odometry), lock=True)


def _stands(settings: FlightSettings, flight: Flight, odometry: Odometry) -> bool:
    """Whether it is still, at the height of its take-off."""
    still = float(np.linalg.norm(odometry.velocity)) < settings.still_speed
    return still and abs(float(odometry.position[2]) - flight.home) < STANDING


def _done(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    del settings, dt
    if inputs.armed or inputs.link_problem:
        return flight
    return _to(flight, Mode.INIT, Reason.DISARMED, rearm=True)


_STEPS = {
    Mode.INIT: _init,
    Mode.TAKEOFF: _take_off,
    Mode.HOVER: _hover,
    Mode.POLICY: _policy,
    Mode.LAND: _landing,
    Mode.PILOT: _with_pilot,
    Mode.DONE: _done,
}
