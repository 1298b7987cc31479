"""Why a take-off is refused, and why the policy may not fly: every condition that is not met, in words. Pure."""

import math

import numpy as np

from e2efly.flight.pilot.fence import fence_problem
from e2efly.flight.pilot.flight_state import Flight, Inputs, Mission, Pilot, Reason
from e2efly.flight.settings import FlightSettings
from e2efly.policy.odometry import Odometry, tilt_of

LEVEL = 0.35
"""Largest tilt before take-off, rad."""
ON_GROUND = 0.25
"""Largest height of the centre of mass over the ground before take-off, m."""


def take_off_refusals(settings: FlightSettings, flight: Flight, inputs: Inputs) -> tuple[str, ...]:
    """Every condition for take-off that is not met, in words."""
    reasons = [] if inputs.seen is None else _standing_refusals(settings, inputs.seen)
    if inputs.seen is None:
        reasons.append(inputs.blindness)
    if inputs.link_problem:
        reasons.append(f"{Reason.LINK}: {inputs.link_problem}")
    error, level = inputs.attitude_error, inputs.seen is None or tilt_of(inputs.seen.quaternion) <= LEVEL
    if error is None and inputs.odometry is not None:
        reasons.append(f"{Reason.ATTITUDE}: the controller's is not known")
    elif error is not None and not error <= settings.attitude_agreement:
        reasons.append(f"{Reason.ATTITUDE}: by {math.degrees(error):.0f} deg")
    if inputs.accelerometer_problem and level:  # gravity is where it should be only if the vehicle is level
        reasons.append(f"{Reason.ACCELEROMETER}: {inputs.accelerometer_problem}")
    if inputs.motion_problem:
        reasons.append(f"{Reason.MOTION}: {inputs.motion_problem}")
    reasons += _sensing(inputs)
    reasons += battery_refusals(settings, inputs)
    reasons += _sticks(settings, inputs.pilot, Reason.STICKS)
    if inputs.pilot is None:
        reasons.append(Reason.NO_PILOT)
    elif flight.rearm and inputs.pilot.mission is not Mission.LAND:
        reasons.append(Reason.MISSION_NOT_LOW)
    reasons += [f"{Reason.SETTINGS}: {problem}" for problem in inputs.settings_problems]
    if not inputs.armed:
        reasons.append(Reason.NOT_ARMED)
    if not inputs.override:
        reasons.append(Reason.NO_OVERRIDE)
    return tuple(reasons)


def _standing_refusals(settings: FlightSettings, odometry: Odometry) -> list[str]:
    """Why a vehicle with this odometry is not ready for take-off."""
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


def battery_refusals(settings: FlightSettings, inputs: Inputs) -> list[str]:
    """Why the battery does not allow a flight. Empty: it allows one."""
    if inputs.voltage is None:
        return [] if settings.battery_unknown else [Reason.BATTERY_UNKNOWN]
    if not inputs.voltage >= settings.battery_low:
        return [f"{Reason.BATTERY_LOW}: {inputs.voltage:.2f} V per cell; accepted: {settings.battery_low:g}"]
    return []


def _sensing(inputs: Inputs) -> list[str]:
    return [f"{Reason.SENSING}: {inputs.sensing_problem}"] if inputs.sensing_problem else []


def _sticks(settings: FlightSettings, pilot: Pilot | None, reason: Reason) -> list[str]:
    if pilot is None or pilot.deflection <= settings.stick_deadband:
        return []
    return [f"{reason}: by {pilot.deflection:.2f}"]


def policy_refusals(settings: FlightSettings, flight: Flight, inputs: Inputs, odometry: Odometry) -> tuple[str, ...]:
    """Why the policy may not fly now. Empty: it may."""
    reasons: list[str] = [Reason.LOCKED] if flight.lock else []
    if inputs.policy_problem:
        reasons.append(f"{Reason.POLICY}: {inputs.policy_problem}")
    reasons += _sensing(inputs)
    reasons += _sticks(settings, inputs.pilot, Reason.STICK_INPUT)
    age = max(flight.now - odometry.time, 0.0)
    if not inputs.placeless and (
        problem := fence_problem(
            settings.fence, odometry, not inputs.policy_lands, guard=not inputs.filtered, age=age, force=inputs.force
        )
    ):
        reasons.append(problem)
    if inputs.missed_deadlines >= settings.missed_deadlines:
        reasons.append(f"{Reason.DEADLINES}: {inputs.missed_deadlines} in a second")
    if inputs.accelerometer_problem:
        reasons.append(f"{Reason.ACCELEROMETER}: {inputs.accelerometer_problem}")
    return (*reasons, *battery_refusals(settings, inputs))
