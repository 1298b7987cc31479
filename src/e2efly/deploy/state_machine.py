"""The flight's modes: a pure function from what is known to who flies, and why.

    INIT -> TAKEOFF -> HOVER <-> POLICY
                         |          |
                         +-> LAND <-+ -> DONE            any -> PILOT on the override switch

The pilot's switches and sticks always win. Each refusal and each change of mode carries its reasons.
"""

import dataclasses
import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from e2efly.deploy.odometry import Odometry
from e2efly.deploy.settings import FlightSettings


class Mode(StrEnum):
    """Who flies."""

    INIT = "init"
    """On the ground; the throttle is closed."""
    TAKEOFF = "takeoff"
    """The hover controller, its target rising."""
    HOVER = "hover"
    """The hover controller; the pilot's sticks move its target."""
    POLICY = "policy"
    """The policy."""
    LAND = "land"
    """The hover controller, its target sinking; without odometry: level and a gentle descent."""
    PILOT = "pilot"
    """The pilot, by the override switch."""
    DONE = "done"
    """Landed, throttle closed, until disarmed."""


class Mission(StrEnum):
    """The pilot's three-position switch."""

    LAND = "land"
    """Stay on the ground, or land."""
    HOVER = "hover"
    """Take off and hover."""
    POLICY = "policy"
    """Let the policy fly."""


@dataclass(frozen=True)
class Pilot:
    """What the pilot's receiver says."""

    mission: Mission
    roll: float = 0.0
    """Stick, -1 to 1, right positive."""
    pitch: float = 0.0
    """Forward positive."""
    throttle: float = 0.0
    """Up positive."""
    yaw: float = 0.0
    """Right positive."""

    @property
    def deflection(self) -> float:
        """The stick that is farthest from its centre."""
        return max(abs(self.roll), abs(self.pitch), abs(self.throttle), abs(self.yaw))


@dataclass(frozen=True)
class Inputs:
    """What is known at a control step."""

    odometry: Odometry | None = None
    """The newest that passed the checks."""
    odometry_problem: str | None = None
    """Why there is none that is fresh and good."""
    link_problem: str | None = None
    """Why the flight controller is not heard."""
    armed: bool = False
    override: bool = False
    """The controller takes its sticks from here."""
    pilot: Pilot | None = None
    """None: the receiver is not heard."""
    voltage: float | None = None
    """Of a cell, V."""
    settings_problems: tuple[str, ...] = ()
    """How the controller's settings are unlike what the policy needs."""
    attitude_error: float | None = None
    """Between the controller's roll and pitch and the odometry's, rad."""
    policy_problem: str | None = None
    """Why the policy must not fly, or must stop: failed, late, non-finite, outside its envelope."""
    policy_done: bool = False
    """Its task is over."""
    policy_lands: bool = False
    """Its task is to land: the floor of the fence is open to it."""
    missed_deadlines: int = 0
    """Late control steps within the last second."""


@dataclass(frozen=True)
class Target:
    """Where the hover controller is to hold."""

    position: tuple[float, float, float]
    """World, m."""
    yaw: float
    """rad."""


@dataclass(frozen=True)
class Flight:
    """The state of the machine."""

    mode: Mode = Mode.INIT
    since: float = 0.0
    """When the mode began, s."""
    now: float = 0.0
    """Of the last step, s."""
    reasons: tuple[str, ...] = ()
    """Why this mode; in INIT: why no take-off yet."""
    target: Target | None = None
    """The hover controller's; None where it does not fly."""
    home: float = 0.0
    """Height at which it stood before take-off, m."""
    blind: bool = False
    """Landing without odometry."""
    rearm: bool = True
    """The mission switch must go to its low position before a take-off."""
    lock: bool = False
    """The mission switch must leave its policy position before the policy flies again."""
    still_since: float | None = None
    """Since when it has been still while landing, s."""


class Reason(StrEnum):
    """Every reason there is; some are followed by numbers."""

    NO_ODOMETRY = "no good odometry"
    MOVING = "moving"
    NOT_ON_GROUND = "not on the ground"
    TILTED = "not level"
    BATTERY_LOW = "battery low"
    BATTERY_UNKNOWN = "battery voltage unknown"
    STICKS = "sticks off centre"
    NO_PILOT = "the pilot's receiver is not heard"
    MISSION_NOT_LOW = "the mission switch was not low since the start"
    NOT_ARMED = "not armed"
    NO_OVERRIDE = "MSP override is off"
    SETTINGS = "settings"
    LINK = "no link to the flight controller"
    ATTITUDE = "the controller's attitude is unlike the odometry's"
    OUTSIDE_FENCE = "outside the fence"
    WAITING = "ready: waiting for the mission switch"
    MISSION = "mission switch"
    REACHED = "height reached"
    STICK_INPUT = "stick input"
    POLICY = "policy"
    POLICY_DONE = "the policy's task is over"
    NOT_CLIMBING = "does not climb"
    DEADLINES = "missed deadlines"
    GUARD = "would leave the fence"
    LANDED = "landed"
    DISARMED = "disarmed"
    OVERRIDE_OFF = "the pilot took over"
    OVERRIDE_ON = "the pilot handed over"
    LOCKED = "the mission switch must leave its policy position first"


AIRBORNE = (Mode.TAKEOFF, Mode.HOVER, Mode.POLICY, Mode.LAND)
CLIMB_S = 5.0
"""A take-off may last so much longer than its target's climb, s."""
LEVEL = 0.35
"""Largest tilt before take-off, rad."""
ON_GROUND = 0.25
"""Largest height of the centre of mass over the ground before take-off, m."""


def step(settings: FlightSettings, flight: Flight, inputs: Inputs, now: float) -> Flight:
    """The machine's next state.

    Args:
        settings: what the flight may do.
        flight: the state before.
        inputs: what is known now.
        now: s, never falling.
    """
    dt = min(max(now - flight.now, 0.0), 0.1) if flight.now else 0.0
    pilot = inputs.pilot
    low = pilot is not None and pilot.mission is Mission.LAND
    flight = dataclasses.replace(
        flight,
        now=now,
        rearm=flight.rearm and not low,
        lock=flight.lock and pilot is not None and pilot.mission is Mission.POLICY,
    )
    following = _common(settings, flight, inputs) or _STEPS[flight.mode](settings, flight, inputs, dt)
    return _begin(following, flight, now)


def _begin(following: Flight, flight: Flight, now: float) -> Flight:
    if following.mode is flight.mode:
        return following
    return dataclasses.replace(following, since=now, still_since=None)


def _to(flight: Flight, mode: Mode, *reasons: str, target: Target | None = None, **changes: bool) -> Flight:
    return dataclasses.replace(flight, mode=mode, reasons=reasons, target=target, **changes)


def _common(settings: FlightSettings, flight: Flight, inputs: Inputs) -> Flight | None:
    """What holds in every mode: disarming ends a flight, and the override switch is the pilot's."""
    if inputs.link_problem:
        return None  # nothing is known of the controller; each mode decides
    if not inputs.armed and flight.mode not in (Mode.INIT, Mode.DONE):
        return _to(flight, Mode.DONE, Reason.DISARMED, rearm=True)
    if not inputs.override and flight.mode in AIRBORNE:
        return _to(flight, Mode.PILOT, Reason.OVERRIDE_OFF)
    return None


def _init(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    del dt
    if refusals := take_off_refusals(settings, flight, inputs):
        return dataclasses.replace(flight, reasons=refusals)
    assert inputs.pilot is not None
    assert inputs.odometry is not None
    if inputs.pilot.mission is Mission.LAND:
        return dataclasses.replace(flight, reasons=(Reason.WAITING,))
    x, y, z = (float(value) for value in inputs.odometry.position)
    target = Target((x, y, z), heading(inputs.odometry.quaternion))
    flight = dataclasses.replace(flight, home=z, blind=False, lock=inputs.pilot.mission is Mission.POLICY)
    return _to(flight, Mode.TAKEOFF, Reason.MISSION, target=target)


def take_off_refusals(settings: FlightSettings, flight: Flight, inputs: Inputs) -> tuple[str, ...]:
    """Every condition for take-off that is not met, in words."""
    reasons: list[str] = []
    if inputs.link_problem:
        reasons.append(f"{Reason.LINK}: {inputs.link_problem}")
    odometry = inputs.odometry
    if odometry is None or inputs.odometry_problem:
        reasons.append(f"{Reason.NO_ODOMETRY}: {inputs.odometry_problem or 'none came yet'}")
    else:
        speed, tilt = float(np.linalg.norm(odometry.velocity)), tilt_of(odometry.quaternion)
        height = float(odometry.position[2]) - settings.ground_height
        if speed > settings.still_speed:
            reasons.append(f"{Reason.MOVING}: {speed:.2f} m/s; accepted: {settings.still_speed:g}")
        if abs(height) > ON_GROUND:
            reasons.append(f"{Reason.NOT_ON_GROUND}: {height:.2f} m over ground_height; accepted: {ON_GROUND:g}")
        if tilt > LEVEL:
            reasons.append(f"{Reason.TILTED}: {math.degrees(tilt):.0f} deg; accepted: {math.degrees(LEVEL):.0f}")
        fence = settings.fence
        if not all(a < x < b for a, x, b in zip(fence.low[:2], odometry.position[:2], fence.high[:2], strict=True)):
            reasons.append(f"{Reason.OUTSIDE_FENCE}: {odometry.position[:2].round(2).tolist()} m")
    if inputs.attitude_error is not None and inputs.attitude_error > settings.attitude_agreement:
        reasons.append(f"{Reason.ATTITUDE}: by {math.degrees(inputs.attitude_error):.0f} deg")
    reasons += _battery(settings, inputs)
    if inputs.pilot is None:
        reasons.append(Reason.NO_PILOT)
    else:
        if inputs.pilot.deflection > settings.stick_deadband:
            reasons.append(f"{Reason.STICKS}: by {inputs.pilot.deflection:.2f}")
        if flight.rearm:
            reasons.append(Reason.MISSION_NOT_LOW)
    reasons += [f"{Reason.SETTINGS}: {problem}" for problem in inputs.settings_problems]
    if not inputs.armed:
        reasons.append(Reason.NOT_ARMED)
    if not inputs.override:
        reasons.append(Reason.NO_OVERRIDE)
    return tuple(reasons)


def _battery(settings: FlightSettings, inputs: Inputs) -> list[str]:
    if inputs.voltage is None:
        return [] if settings.battery_unknown else [Reason.BATTERY_UNKNOWN]
    if inputs.voltage < settings.battery_low:
        return [f"{Reason.BATTERY_LOW}: {inputs.voltage:.2f} V a cell; accepted: {settings.battery_low:g}"]
    return []


def _must_land(settings: FlightSettings, inputs: Inputs) -> tuple[str, ...]:
    """Why the hover controller must land now."""
    if inputs.odometry_problem or inputs.odometry is None:
        return (f"{Reason.NO_ODOMETRY}: {inputs.odometry_problem}",)
    if inputs.link_problem:
        return (f"{Reason.LINK}: {inputs.link_problem}",)
    if inputs.pilot is None:
        return (Reason.NO_PILOT,)
    if inputs.pilot.mission is Mission.LAND:
        return (Reason.MISSION,)
    if inputs.voltage is not None and inputs.voltage < settings.battery_low:
        return tuple(_battery(settings, inputs))
    return ()


def _land(flight: Flight, inputs: Inputs, reasons: tuple[str, ...]) -> Flight:
    if inputs.odometry is None or inputs.odometry_problem:
        return _to(flight, Mode.LAND, *reasons, blind=True)
    return _to(flight, Mode.LAND, *reasons, target=_here(inputs.odometry), blind=False)


def _take_off(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    if reasons := _must_land(settings, inputs):
        return _land(flight, inputs, reasons)
    assert flight.target is not None
    assert inputs.odometry is not None
    x, y, z = flight.target.position
    goal = flight.home + settings.takeoff_height
    target = Target((x, y, min(z + settings.takeoff_speed * dt, goal)), flight.target.yaw)
    if flight.now - flight.since > settings.takeoff_height / settings.takeoff_speed + CLIMB_S:
        height = float(inputs.odometry.position[2]) - flight.home
        return _land(
            flight, inputs, (f"{Reason.NOT_CLIMBING}: {height:.2f} m after {flight.now - flight.since:.0f} s",)
        )
    if goal - float(inputs.odometry.position[2]) < 0.1 and target.position[2] == goal:
        return _to(flight, Mode.HOVER, Reason.REACHED, target=target)
    return dataclasses.replace(flight, target=target)


def _hover(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    if reasons := _must_land(settings, inputs):
        return _land(flight, inputs, reasons)
    assert flight.target is not None
    assert inputs.odometry is not None
    assert inputs.pilot is not None
    target = _moved(settings, flight.target, inputs.pilot, dt)
    reasons: tuple[str, ...] = ()
    if inputs.pilot.mission is Mission.POLICY:
        reasons = policy_refusals(settings, flight, inputs)
        if not reasons:
            return _to(flight, Mode.POLICY, Reason.MISSION)
    return dataclasses.replace(flight, target=target, reasons=reasons or flight.reasons)


def policy_refusals(settings: FlightSettings, flight: Flight, inputs: Inputs) -> tuple[str, ...]:
    """Why the policy may not fly now; empty: it may."""
    assert inputs.odometry is not None
    assert inputs.pilot is not None
    reasons: list[str] = []
    if flight.lock:
        reasons.append(Reason.LOCKED)
    if inputs.policy_problem:
        reasons.append(f"{Reason.POLICY}: {inputs.policy_problem}")
    if inputs.pilot.deflection > settings.stick_deadband:
        reasons.append(f"{Reason.STICK_INPUT}: {inputs.pilot.deflection:.2f}")
    if problem := fence_problem(settings, inputs.odometry, floor=not inputs.policy_lands):
        reasons.append(problem)
    if inputs.missed_deadlines >= settings.missed_deadlines:
        reasons.append(f"{Reason.DEADLINES}: {inputs.missed_deadlines} in a second")
    return tuple(reasons)


def _policy(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    del dt
    if inputs.odometry is None or inputs.odometry_problem or inputs.link_problem or inputs.pilot is None:
        return _land(flight, inputs, _must_land(settings, inputs))
    reasons: tuple[str, ...] = ()
    if inputs.pilot.mission is not Mission.POLICY:
        reasons = (Reason.MISSION,)
    elif inputs.policy_done:
        if float(inputs.odometry.position[2]) - settings.ground_height < ON_GROUND:
            return _land(flight, inputs, (Reason.POLICY_DONE,))
        reasons = (Reason.POLICY_DONE,)
    else:
        reasons = policy_refusals(settings, flight, inputs) + tuple(_battery(settings, inputs))
    if reasons:
        return _to(flight, Mode.HOVER, *reasons, target=_stopping(settings, inputs.odometry), lock=True)
    return flight


def _landing(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    odometry = inputs.odometry
    if odometry is None or inputs.odometry_problem:
        return dataclasses.replace(flight, blind=True, target=None, still_since=None)
    if flight.target is None:
        return dataclasses.replace(flight, blind=False, target=_here(odometry))
    x, y, z = flight.target.position
    height = float(odometry.position[2])
    down = max(z - settings.land_speed * dt, height - 0.6)  # no farther ahead than it takes to know the ground
    target = Target((x, y, down), flight.target.yaw)
    still = float(np.linalg.norm(odometry.velocity)) < settings.still_speed and height - down > 0.5
    since = (flight.still_since if flight.still_since is not None else flight.now) if still else None
    if since is not None and flight.now - since >= settings.land_settle:
        return _to(flight, Mode.DONE, Reason.LANDED, rearm=True)
    return dataclasses.replace(flight, target=target, still_since=since, blind=False)


def _with_pilot(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    """While the pilot flies, the hover controller stays ready at the place where the vehicle is."""
    del settings, dt
    good = inputs.odometry is not None and not inputs.odometry_problem
    target = _here(inputs.odometry) if good and inputs.odometry is not None else None
    if inputs.override and not inputs.link_problem:
        if target is None:
            return _to(flight, Mode.LAND, Reason.OVERRIDE_ON, f"{Reason.NO_ODOMETRY}: {inputs.odometry_problem}",
                       blind=True)  # fmt: skip
        return _to(flight, Mode.HOVER, Reason.OVERRIDE_ON, target=target, lock=True)
    return dataclasses.replace(flight, target=target)


def _done(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    del settings, dt
    if not inputs.armed and not inputs.link_problem:
        return _to(flight, Mode.INIT, Reason.DISARMED, rearm=True)
    return flight


_STEPS = {
    Mode.INIT: _init,
    Mode.TAKEOFF: _take_off,
    Mode.HOVER: _hover,
    Mode.POLICY: _policy,
    Mode.LAND: _landing,
    Mode.PILOT: _with_pilot,
    Mode.DONE: _done,
}


def fence_problem(settings: FlightSettings, odometry: Odometry, floor: bool = True) -> str | None:
    """Why the vehicle is outside the fence, or cannot stop inside it any more; None: neither.

    Args:
        settings: with the fence.
        odometry: where it is and how it moves.
        floor: whether the lowest height counts.
    """
    fence, v = settings.fence, odometry.velocity
    speed, tilt = float(np.linalg.norm(v)), tilt_of(odometry.quaternion)
    if speed > fence.speed:
        return f"{Reason.OUTSIDE_FENCE}: {speed:.1f} m/s; accepted: {fence.speed:g}"
    if tilt > fence.tilt:
        return f"{Reason.OUTSIDE_FENCE}: tilt {math.degrees(tilt):.0f} deg; accepted: {math.degrees(fence.tilt):.0f}"
    for i, axis in enumerate("xyz"):
        at, low, high = float(odometry.position[i]), fence.low[i], fence.high[i]
        low = low if floor or axis != "z" else -math.inf
        if not low <= at <= high:
            return f"{Reason.OUTSIDE_FENCE}: {axis} is {at:.2f} m; accepted: {low:g} to {high:g}"
        stop = at + float(v[i]) * fence.reaction + float(v[i]) * abs(float(v[i])) / (2 * fence.braking)
        if not low <= stop <= high:
            return f"{Reason.GUARD}: {axis} would reach {stop:.2f} m; accepted: {low:g} to {high:g}"
    return None


def _here(odometry: Odometry) -> Target:
    x, y, z = (float(value) for value in odometry.position)
    return Target((x, y, z), heading(odometry.quaternion))


def _stopping(settings: FlightSettings, odometry: Odometry) -> Target:
    """Where it can come to rest, kept inside the fence."""
    fence, v = settings.fence, odometry.velocity
    stop = odometry.position + v * fence.reaction + v * np.abs(v) / (2 * fence.braking)
    x, y, z = (float(s) for s in np.clip(stop, np.add(fence.low, 0.1), np.subtract(fence.high, 0.1)))
    return Target((x, y, z), heading(odometry.quaternion))


def _moved(settings: FlightSettings, target: Target, pilot: Pilot, dt: float) -> Target:
    """The hover point moved by the sticks, in the vehicle's heading, and kept inside the fence."""

    def beyond(stick: float) -> float:
        dead = settings.stick_deadband
        return math.copysign(max(abs(stick) - dead, 0.0) / (1 - dead), stick)

    reach = settings.reposition_speed * dt
    forward, left, up = beyond(pilot.pitch) * reach, -beyond(pilot.roll) * reach, beyond(pilot.throttle) * reach
    if not (forward or left or up or beyond(pilot.yaw)):
        return target
    c, s = math.cos(target.yaw), math.sin(target.yaw)
    moved = np.add(target.position, (c * forward - s * left, s * forward + c * left, up))
    x, y, z = (float(p) for p in np.clip(moved, settings.fence.low, settings.fence.high))
    turned = target.yaw - beyond(pilot.yaw) * dt
    return Target((x, y, z), math.remainder(turned, math.tau))


def heading(quaternion: np.ndarray) -> float:
    """The angle about world z of the body's x axis, rad."""
    w, x, y, z = (float(q) for q in quaternion)
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def tilt_of(quaternion: np.ndarray) -> float:
    """The angle between the body's z axis and up, rad."""
    _, x, y, _ = (float(q) for q in quaternion)
    return math.acos(max(-1.0, min(1.0, 1 - 2 * (x * x + y * y))))
