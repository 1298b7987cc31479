"""The commands for take-off, hover and landing, with odometry and without it. Pure.

Each function adds a trim to the thrust. The trim compensates for an error of the throttle map.
"""

import math
from dataclasses import replace
from typing import Any

from e2efly.control import Ctbr, Vec3
from e2efly.control.place import Place
from e2efly.flight.attitude import Attitude
from e2efly.flight.pilot import reckoning
from e2efly.flight.pilot.flight_state import Flight, Mode, Target
from e2efly.flight.pilot.hover import LIFTED, blind, rates_of
from e2efly.flight.pilot.hovering import HoverController, Seen, UnderWay
from e2efly.flight.pilot.inertial import Inertial
from e2efly.flight.pilot.touch import LOW, UNDER, wave
from e2efly.vehicles.gravity import GRAVITY

TRIM = (-3.0, 5.0)
"""Bounds of the thrust that a take-off adds while the throttle map is still wrong, m/s^2."""
LIFT = 1.08
"""A take-off commands at most this share of the weight, without the trim: the controller may hold the command of a link
that falls silent now."""
TRIM_GAIN = 3.0
"""Rate of change of the trim divided by the error of the climb speed, 1/s."""
TRIM_FADE = 1.0
"""Time constant with which the trim fades as the map learns, s."""
STEADY = 0.03
"""Body rates of a hover that are below this are sent as zero, rad/s. If the link falls silent now, they are held for a
long time."""
OVERDUE = 0.3
"""A blind descent whose estimated height is this far under the ground, m, ..."""
WEIGHT, LIGHTER, LIGHTEST = (0.985, 0.97), (0.015, 0.04), 0.6
"""... commands at most this share of its weight (first value), less for each further metre (second value), but at least
the last value. The second of each pair holds where the accelerometer cannot tell flight from standing: the descent then
ends after a time, and must be down by then."""


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
    """Fly to a target with odometry. `memory` is that of the controller, from its `begin` or the last step. The trim is
    in m/s^2. `dt` is the time since the last control step, s. While `silent`, the flight controller is not heard, and
    may not receive what is sent.

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
    thrust = min(float(wanted.thrust), LIFT * GRAVITY) if taking_off else wanted.thrust
    return Ctbr(thrust + trim, Vec3(*rates)), memory, trim


def descend(
    flight: Flight, told: Inertial, attitude: Attitude | None, trim: float, now: float, dt: float
) -> tuple[Ctbr, float, Inertial]:
    """Descend without odometry, and feel for the ground; see `touch`. The controller's attitude may be unknown (None).
    The trim is in m/s^2. `now` is in s, and so is `dt`, the time since the last control step.

    Returns:
        The command; the trim, m/s^2; the state of the inertial sensors, for which a weighing may have begun.
    """
    reckoned = told.reckoned
    under = -math.inf if reckoned is None else flight.home - reckoned.height
    felt = told.touch.weigh(now, low=under > UNDER)
    if reckoned is None:
        command = blind(attitude, now - flight.since, 0.0 if flight.lost is None else flight.lost[2])
        thrust = float(command.thrust)
    else:
        trim = reckoning.trimmed(trim, reckoned, flight.home, dt)
        command = reckoning.settle(attitude, reckoned, flight.home, trim)
        deaf = not felt.able(now)
        weight = GRAVITY * max(WEIGHT[deaf] - LIGHTER[deaf] * under, LIGHTEST)
        thrust = min(float(command.thrust), weight) if under > OVERDUE else float(command.thrust)
    thrust = min(thrust, LOW * GRAVITY) if felt.weighs(now) else thrust * wave(now)
    return Ctbr(thrust / told.share, command.rate), trim, replace(told, touch=felt)
