"""The commands for take-off, hover and landing, with odometry and without it. Pure.

Each function adds a trim to the thrust. The trim compensates for an error of the throttle map.
"""

import math
from typing import Any

from e2efly.control import Ctbr, Vec3
from e2efly.control.place import Place
from e2efly.deploy.attitude import Attitude
from e2efly.deploy.pilot import inertial, reckoning
from e2efly.deploy.pilot.flight_state import Flight, Mode, Target
from e2efly.deploy.pilot.hover import LIFTED, blind, rates_of
from e2efly.deploy.pilot.hovering import HoverController, Seen, UnderWay
from e2efly.deploy.pilot.inertial import Inertial
from e2efly.vehicles.vehicle import GRAVITY

TRIM = (-3.0, 5.0)
"""Bounds of the thrust that a take-off adds while the throttle map is still wrong, m/s^2."""
TRIM_GAIN = 3.0
"""Rate of change of the trim divided by the error of the climb speed, 1/s."""
TRIM_FADE = 1.0
"""Time constant with which the trim fades as the map learns, s."""
STEADY = 0.03
"""Body rates of a hover that are below this are sent as zero, rad/s. If the link falls silent now, they are held for a
long time."""
OVERDUE = 0.3
"""A blind descent whose estimated height is this far under the ground tries to feel the ground, m, ..."""
WEIGHT, LIGHTER, LIGHTEST = 0.97, 0.04, 0.6
"""... and commands at most this share of its weight (first value), less for each further metre (second value), but at
least the last value."""


def hover(
    controller: HoverController,
    memory: Any,
    flight: Flight,
    target: Target,
    seen: Seen,
    under_way: UnderWay,
    trim: float,
    dt: float,
    *,
    silent: bool = False,
) -> tuple[Ctbr, Any, float]:
    """Fly to a target with odometry.

    Args:
        controller: the hover controller that flies.
        memory: the memory of the controller, from its `begin` or the last step.
        flight: the state of the flight. Its mode and its home are used.
        target: where the vehicle should be.
        seen: the present motion.
        under_way: the commands that were sent but do not act yet.
        trim: the trim so far, m/s^2.
        dt: time since the last control step, s.
        silent: the flight controller is not heard, and may not receive what is sent.

    Returns:
        The command, the new memory of the controller, and the trim, m/s^2.
    """
    x, y, z = target.position
    height, climb = float(seen.position.z), float(seen.velocity.z)
    taking_off, low = flight.mode is Mode.TAKEOFF, height - flight.home < LIFTED
    if taking_off:
        change = TRIM_GAIN * (target.climb - climb) * dt if low else -trim * dt / TRIM_FADE
        trim = min(max(trim + change, TRIM[0]), TRIM[1])
    else:
        trim *= math.exp(-dt / TRIM_FADE)
    on_ground = taking_off and low
    if on_ground:  # no tilt before the feet have left the ground
        x, y = float(seen.position.x), float(seen.position.y)
    place = Place(Vec3(x, y, z), Vec3(0.0, 0.0, target.climb), yaw=target.yaw)
    memory, wanted = controller.step(memory, seen, under_way, place, dt, held=low or silent)
    rates = (0.0 if on_ground or abs(rate) < STEADY else rate for rate in rates_of(wanted))
    return Ctbr(wanted.thrust + trim, Vec3(*rates)), memory, trim


def descend(
    flight: Flight, told: Inertial, attitude: Attitude | None, trim: float, now: float, dt: float
) -> tuple[Ctbr, float, Inertial]:
    """Descend without odometry, and detect the ground.

    Args:
        flight: the state of the flight.
        told: the state of the inertial sensors.
        attitude: the controller's attitude. None: unknown.
        trim: the trim so far, m/s^2.
        now: s.
        dt: time since the last control step, s.

    Returns:
        The command; the trim, m/s^2; the state of the inertial sensors, including the detection of the ground.
    """
    reckoned, ground, overdue = told.reckoned, flight.home, True
    if reckoned is None:
        command = blind(attitude, now - flight.since, 0.0 if flight.lost is None else flight.lost[2])
        thrust = float(command.thrust)
    else:
        trim = reckoning.trimmed(trim, reckoned, ground, dt)
        command = reckoning.settle(attitude, reckoned, ground, trim)
        under = ground - reckoned.height
        overdue = under > OVERDUE
        weight = GRAVITY * max(WEIGHT - LIGHTER * under, LIGHTEST)
        thrust = min(float(command.thrust), weight) if overdue else float(command.thrust)
    told = inertial.feel_for_ground(told, thrust, now, overdue=overdue)
    return Ctbr(thrust * told.touch.factor(now), command.rate), trim, told
