"""The modes of a flight: a pure function from what is known to who flies, and why.

    INIT -> TAKEOFF -> HOVER <-> POLICY
              |          |          |
              +--------> +-> LAND <-+ -> DONE -> INIT

The pilot's switches and sticks always have priority. From any mode in the air, the override switch leads to PILOT. From
there it leads back to HOVER, or to LAND without odometry, or to INIT on the ground. Disarming leads to DONE. Each
refusal and each change of mode carries its reasons.
"""

import dataclasses
import math

import numpy as np

from e2efly.flight.pilot.fence import here, moved, stopping
from e2efly.flight.pilot.flight_state import AIRBORNE, DRIFTED, Flight, Inputs, Mission, Mode, Reason, Target, to
from e2efly.flight.pilot.landing import SLOW, has_stood, land, landing, looked, stands
from e2efly.flight.pilot.refusals import ON_GROUND, battery_refusals, policy_refusals, take_off_refusals
from e2efly.flight.settings import FlightSettings
from e2efly.policy.odometry import Odometry, tilt_of
from e2efly.vehicles.gravity import GRAVITY

LONGEST_STEP = 0.1
"""The longest time that one step may count, s, even if the clock jumps."""
SLOWING = 0.5
"""Deceleration with which a take-off's target nears its height, m/s^2."""
AHEAD = 0.15
"""How far the target of a take-off may be over the vehicle, m. A vehicle that lags behind must not catch up fast: the
controller may hold the command of a link that falls silent now."""
CLIMB_S = 5.0
"""How much longer a take-off may last than the climb of its target, s."""
LIFTS_S = 2.5
"""A take-off that has stood for this time without being felt to fly ends, s."""
MISLED = "the vehicle does not go where it is sent (wrong heading?)"
"""Reported for odometry that is not that of the vehicle ..."""
TURNED = "its heading is wrong"
"""... and for odometry whose heading is not that of the vehicle."""
THROTTLE_LOW = -0.9
"""Without a place, a vehicle that is handed over with its throttle stick below this stands on the ground."""
BRAKES_S, BRAKED = 3.0, 1.0
"""Without a place, a vehicle that is to land brakes first: for the time of the first value, s, at most, while it is
faster than the second, m/s."""
ADRIFT_S = 5.0
"""How long a vehicle hovers by poses that drift, s: long enough to hand over to the policy, and to brake after it."""
LYING, LYING_UP, LYING_RATE = 0.3, 0.6, 0.5
"""The force on a vehicle that lies still differs from its weight by less than this share, its part along the z axis is
below the second value, in units of gravity, and it turns slower than the third, rad/s."""
FALLEN, FALLEN_SPEED, FALLEN_S = math.radians(60), 0.3, 0.5
"""A vehicle has fallen if it is tilted by more than the first value, rad, and slower than the second, m/s, for the time
of the third, s. In the air, gravity alone would have made it faster."""
NEAR_GROUND = 0.3
"""In a landing, a policy's too, below this height, m, poses and sensors may differ: the shock of the ground can cause
this."""


def step(settings: FlightSettings, flight: Flight, inputs: Inputs, now: float) -> Flight:
    """The machine's next state. `now`, s, never decreases. After a jump, the step counts as `LONGEST_STEP`."""
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
        adrift=inputs.placeless,
    )
    flight = _watched(settings, flight, inputs)
    if flight.misled:
        turned = flight.turned
        problem = flight.misled if turned is None else f"{TURNED} by {math.degrees(turned):.0f} deg"
        inputs = dataclasses.replace(inputs, odometry_problem=problem)
    following = _common(flight, inputs) or _STEPS[flight.mode](settings, flight, inputs, dt)
    if (following.mode, following.blind) == (flight.mode, flight.blind):
        return following
    if following.mode is not flight.mode:  # a hover that stays at its place has not landed there
        following = dataclasses.replace(following, standing_since=None, stood_at=None)
    return dataclasses.replace(following, since=now, still_since=None, fallen_since=None, nearest=math.inf)


def _moved(moment: float | None, jump: float) -> float | None:
    return None if moment is None else moment + jump


def _watched(settings: FlightSettings, flight: Flight, inputs: Inputs) -> Flight:
    """Check whether the odometry is that of the vehicle, and whether the vehicle has fallen over.

    With a wrong heading, the controller pushes to the wrong side, and the vehicle spirals outwards, faster and faster.
    Nothing on the ground shows a wrong heading, because the flight controller's own heading has another origin than the
    odometry's. In flight, the comparison of headings shows it, or else the growing distance from the target.
    """
    if flight.mode in (Mode.INIT, Mode.DONE):
        return dataclasses.replace(flight, misled=None, turned=None, fallen_since=None)
    if inputs.motion_problem and not flight.misled and not _nearly_landed(flight, inputs):
        flight = dataclasses.replace(flight, misled=f"{Reason.MOTION}: {inputs.motion_problem}")
    odometry, target = inputs.seen, flight.target
    if odometry is None:
        return dataclasses.replace(flight, fallen_since=None)
    fallen = tilt_of(odometry.quaternion) > FALLEN and _lies(inputs, odometry)
    fallen_since = (flight.now if flight.fallen_since is None else flight.fallen_since) if fallen else None
    flight = dataclasses.replace(flight, fallen_since=fallen_since)
    error = inputs.heading_error
    if flight.misled and flight.turned is not None and error is not None:
        flight = dataclasses.replace(flight, turned=error)
    if flight.mode is Mode.PILOT:
        stood = not flight.adrift and stands(settings, flight, odometry)
        misled = None if stood else flight.misled
        return dataclasses.replace(flight, misled=misled, turned=flight.turned if misled else None)
    if target is None:
        return flight
    if error is not None and abs(error) > settings.heading_agreement:
        return dataclasses.replace(flight, misled=TURNED, turned=error)
    if inputs.silent:  # commands may not arrive, so the motion shows nothing about the odometry
        return dataclasses.replace(flight, nearest=math.inf)
    off = math.hypot(*np.subtract(target.position[:2], odometry.position[:2]).tolist())
    rests = math.isfinite(flight.nearest) or float(np.linalg.norm(odometry.velocity)) < SLOW
    nearest = min(flight.nearest, off) if rests else math.inf
    misled = flight.misled or (MISLED if off > nearest + settings.follow_distance else None)
    return dataclasses.replace(flight, nearest=nearest, misled=misled)


def _lies(inputs: Inputs, odometry: Odometry) -> bool:
    """Whether a tilted vehicle rests. If its velocity drifts, by the sensors: what carries it in flight are its rotors,
    along its z axis.
    """
    if not inputs.placeless:
        return float(np.linalg.norm(odometry.velocity)) < FALLEN_SPEED
    if inputs.force is None or float(np.linalg.norm(odometry.body_rate)) > LYING_RATE:
        return False
    weight = float(np.linalg.norm(inputs.force)) / GRAVITY
    return abs(weight - 1) < LYING and float(inputs.force[2]) < LYING_UP * GRAVITY


def _nearly_landed(flight: Flight, inputs: Inputs) -> bool:
    odometry = inputs.odometry
    lands = flight.mode is Mode.LAND or (flight.mode is Mode.POLICY and inputs.policy_lands)
    if not lands or flight.blind or odometry is None:
        return False
    return abs(float(odometry.position[2]) - flight.home) < NEAR_GROUND


def _mission_low(inputs: Inputs) -> bool:
    return inputs.pilot is not None and inputs.pilot.mission is Mission.LAND


def _common(flight: Flight, inputs: Inputs) -> Flight | None:
    """The rules of all modes: disarming ends a flight, and the override switch gives the vehicle to the pilot."""
    if inputs.link_problem:
        return None  # nothing is known about the controller; each mode decides
    if not inputs.armed:
        return None if flight.mode in (Mode.INIT, Mode.DONE) else to(flight, Mode.DONE, Reason.DISARMED)
    if not inputs.override and (flight.mode in AIRBORNE or _left_the_ground(flight, inputs.seen)):
        return to(flight, Mode.PILOT, Reason.OVERRIDE_OFF, target=_here(inputs))
    if flight.mode in AIRBORNE and flight.fallen_since is not None and flight.now - flight.fallen_since >= FALLEN_S:
        return to(flight, Mode.DONE, Reason.CRASHED)
    return None


def _left_the_ground(flight: Flight, odometry: Odometry | None) -> bool:
    """Whether the pilot has taken off manually. When the pilot hands over such a vehicle, it must not fall."""
    grounded = flight.mode in (Mode.INIT, Mode.DONE)
    return grounded and odometry is not None and abs(float(odometry.position[2]) - flight.home) > ON_GROUND


def _init(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    del dt
    odometry = inputs.seen
    if odometry is not None and not inputs.armed:
        flight = dataclasses.replace(flight, home=float(odometry.position[2]))
    if refusals := take_off_refusals(settings, flight, inputs):
        # a refusal may disappear by itself, but only a move of the mission switch may start a flight
        return dataclasses.replace(flight, reasons=refusals, rearm=not _mission_low(inputs))
    assert inputs.pilot is not None
    assert odometry is not None
    if inputs.pilot.mission is Mission.LAND:
        return dataclasses.replace(flight, reasons=(Reason.WAITING,))
    target = here(odometry)
    flight = dataclasses.replace(flight, home=target.position[2], lock=inputs.pilot.mission is Mission.POLICY)
    return to(flight, Mode.TAKEOFF, Reason.MISSION, target=target)


def _lost(inputs: Inputs) -> tuple[str, ...]:
    """What is missing for a flight by anyone but the pilot. Empty: nothing."""
    if inputs.seen is None:
        return (inputs.blindness,)
    if inputs.link_problem:
        return (f"{Reason.LINK}: {inputs.link_problem}",)
    return (Reason.NO_PILOT,) if inputs.pilot is None else ()


def _must_land(settings: FlightSettings, inputs: Inputs) -> tuple[str, ...]:
    """Why the hover controller must land now. Empty: it need not."""
    if reasons := _lost(inputs):
        return reasons
    if _mission_low(inputs):
        return (Reason.MISSION,)
    if inputs.accelerometer_problem:
        return (f"{Reason.ACCELEROMETER}: {inputs.accelerometer_problem}",)
    return tuple(battery_refusals(settings, inputs)) if inputs.voltage is not None else ()


def _here(inputs: Inputs) -> Target | None:
    return None if inputs.seen is None else here(inputs.seen)


def _take_off(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    if reasons := _must_land(settings, inputs):
        return land(settings, flight, inputs, *reasons)
    assert inputs.odometry is not None
    height = float(inputs.odometry.position[2]) - flight.home
    elapsed = flight.now - flight.since
    flight = looked(flight, inputs)
    assert flight.target is not None
    if inputs.stands is not False and has_stood(settings, flight, inputs.odometry, LIFTS_S):
        return to(flight, Mode.DONE, f"{Reason.NOT_CLIMBING}: {height:.2f} m after {elapsed:.0f} s")
    if elapsed > settings.takeoff_height / settings.takeoff_speed + CLIMB_S:
        return land(settings, flight, inputs, f"{Reason.NOT_CLIMBING}: {height:.2f} m after {elapsed:.0f} s")
    x, y, z = flight.target.position
    goal = flight.home + settings.takeoff_height
    climb = min(settings.takeoff_speed, math.sqrt(2 * SLOWING * max(goal - z, 0.0)) + 0.02)
    up = min(z + climb * dt, goal, max(z, height + flight.home + AHEAD))
    target = Target((x, y, up), flight.target.yaw, climb if up < goal else 0.0)
    if settings.takeoff_height - height < 0.1 and up == goal:
        return to(flight, Mode.HOVER, Reason.REACHED, target=target)
    return dataclasses.replace(flight, target=target)


def _hover(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    reasons = _must_land(settings, inputs)
    if reasons and _brakes(flight, inputs):
        return dataclasses.replace(flight, reasons=reasons)
    if reasons:
        return land(settings, flight, inputs, *reasons)
    assert flight.target is not None
    assert inputs.odometry is not None
    assert inputs.pilot is not None
    flight = looked(flight, inputs)
    if not flight.adrift and has_stood(settings, flight, inputs.odometry) and inputs.stands is not False:
        return land(settings, flight, inputs, f"{Reason.NOT_CLIMBING}: it stands where it took off")
    if flight.adrift and flight.now - flight.since > ADRIFT_S:
        return land(settings, flight, inputs, f"{Reason.NO_ODOMETRY}: {DRIFTED}")
    if inputs.pilot.mission is Mission.POLICY:
        refusals = policy_refusals(settings, flight, inputs, inputs.odometry)
        if not refusals:
            return to(flight, Mode.POLICY, Reason.MISSION)
        flight = dataclasses.replace(flight, reasons=refusals)
    assert flight.target is not None
    target = moved(settings, flight.target, inputs.pilot, dt)
    nearest = flight.nearest if target.position[:2] == flight.target.position[:2] else math.inf
    return dataclasses.replace(flight, target=target, nearest=nearest)


def _brakes(flight: Flight, inputs: Inputs) -> bool:
    """Whether a hover without a place goes on although it should land: the landing would sink at this speed."""
    if not flight.adrift or inputs.seen is None or inputs.link_problem or inputs.accelerometer_problem:
        return False
    return flight.now - flight.since < BRAKES_S and float(np.linalg.norm(inputs.seen.velocity)) > BRAKED


def _policy(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    del dt
    reasons = _lost(inputs)
    if reasons and (not flight.adrift or inputs.seen is None or inputs.link_problem):
        return land(settings, flight, inputs, *reasons)
    assert inputs.odometry is not None
    if inputs.pilot is None:
        pass  # without a place it brakes first
    elif inputs.pilot.mission is not Mission.POLICY:
        reasons = (Reason.MISSION,)
    elif inputs.policy_done:
        reasons = (Reason.POLICY_DONE,)
        if not flight.adrift and float(inputs.odometry.position[2]) - settings.ground_height < ON_GROUND:
            return land(settings, flight, inputs, *reasons)
    else:
        reasons = policy_refusals(settings, flight, inputs, inputs.odometry)
    if reasons and flight.adrift:  # it brakes, and dives no deeper; where the fence is, nobody knows
        target = stopping(settings.fence.opened, inputs.odometry)
        x, y, z = target.position
        level = dataclasses.replace(target, position=(x, y, max(z, float(inputs.odometry.position[2]))))
        return to(flight, Mode.HOVER, *reasons, target=level, lock=True)
    if reasons:
        return to(
            flight,
            Mode.HOVER,
            *reasons,
            target=stopping(settings.fence, inputs.odometry, settings.ground_height),
            lock=True,
        )
    return flight


def _with_pilot(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    """While the pilot flies, the target of the hover controller follows the vehicle."""
    del dt
    odometry = inputs.seen
    if not inputs.override or inputs.link_problem:
        return dataclasses.replace(flight, target=_here(inputs))
    if flight.adrift:  # only the pilot knows whether it flies
        if inputs.pilot is not None and inputs.pilot.throttle < THROTTLE_LOW:
            return to(flight, Mode.INIT, Reason.OVERRIDE_ON, rearm=True)
        return land(settings, flight, inputs, Reason.OVERRIDE_ON, DRIFTED)
    if odometry is None:
        return land(settings, flight, inputs, Reason.OVERRIDE_ON, inputs.blindness)
    if stands(settings, flight, odometry):
        return to(flight, Mode.INIT, Reason.OVERRIDE_ON, rearm=True)
    return to(flight, Mode.HOVER, Reason.OVERRIDE_ON, target=here(odometry), lock=True)


def _done(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    del settings, dt
    if inputs.armed or inputs.link_problem:
        return flight
    return to(flight, Mode.INIT, Reason.DISARMED, rearm=True)


_STEPS = {
    Mode.INIT: _init,
    Mode.TAKEOFF: _take_off,
    Mode.HOVER: _hover,
    Mode.POLICY: _policy,
    Mode.LAND: landing,
    Mode.PILOT: _with_pilot,
    Mode.DONE: _done,
}
