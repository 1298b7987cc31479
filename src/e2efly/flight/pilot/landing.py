"""The landing: with odometry, without it, and while the controller is not heard. Pure.

It ends where the vehicle stands. With odometry, this is at the height of its take-off, or higher only if something is
felt to carry it. Without odometry, it ends when the ground is felt, or after a time. It never ends while the link is
silent.
"""

import dataclasses
import math

import numpy as np

from e2efly.flight.pilot.fence import stopping
from e2efly.flight.pilot.flight_state import DRIFTED, Flight, Inputs, Mode, Reason, Target, to
from e2efly.flight.pilot.hover import blind_time
from e2efly.flight.settings import FlightSettings
from e2efly.policy.odometry import Odometry

STANDING = 0.1
"""A still vehicle within this distance of the height at which it stood before stands there again, m."""
SLOW = 0.5
"""Horizontal speed below which a landing sinks, m/s ..."""
FAST, FASTER, HIGH = 3.0, 0.5, 2.0
"""A landing from far above the ground sinks faster: by the second value, 1/s, times the height over the third, m, up to
the first value, m/s."""
SLOWED_S = 3.0
"""... or after this time, because in a gust the vehicle may never be that slow, s."""
UNHEARD_SINK = 0.35
"""Sink speed while the link is silent, m/s. It is small because the newest command may be held for a long time."""
LEAD = 0.6
"""How far the target of a landing may be under the vehicle, m. A larger distance only shows that the ground is
there."""
PRESSED = 0.5
"""A still vehicle whose target is this far under it stands on something, m."""
PRESSING = 0.5
"""A vehicle that is still although its height is not that of the ground is pressed down more and more, until it is felt
that it stands, m/s."""
FOUND_S = 0.5
"""Odometry that was lost in a landing must be good for this time before it is used again, s. Odometry that comes and
goes must not restart the landing each time."""
STAYS_S, AWAY_S = 1.0, 3.0
"""A landing has ended when the vehicle has stayed at one place for `STAYS_S` at home, or for `AWAY_S` elsewhere if it
descends blindly, s."""
BEYOND_S = 3.0
"""How much longer than twice its expected time a blind descent waits for an accelerometer that is not sure, s."""
RECENT_S = 0.5
"""Odometry up to this age still shows that the vehicle stands, s."""


def land(settings: FlightSettings, flight: Flight, inputs: Inputs, *reasons: str) -> Flight:
    """Begin a landing for these reasons: with odometry if there is some that does not drift, otherwise without it."""
    if flight.adrift:  # from here on its odometry counts as lost, whatever else there is to say of it
        flight = dataclasses.replace(flight, misled=DRIFTED, turned=None)
    if inputs.seen is None or flight.adrift:
        return _blindly(settings, flight, inputs, *reasons)
    return to(flight, Mode.LAND, *reasons, target=_down_from(settings, inputs.seen))


def _blindly(settings: FlightSettings, flight: Flight, inputs: Inputs, *reasons: str) -> Flight:
    lost = _last_seen(settings, flight, inputs)
    begun = dataclasses.replace(flight, lost=lost, found_since=None)
    return to(begun, Mode.LAND, *reasons, blind=True)


def _down_from(settings: FlightSettings, odometry: Odometry) -> Target:
    """Where the vehicle can stop, but no higher than it is. A vehicle that has nearly landed must not rise to the
    fence's floor.
    """
    target = stopping(settings.fence, odometry, settings.ground_height)
    x, y, z = target.position
    return dataclasses.replace(target, position=(x, y, min(z, float(odometry.position[2]))))


def landing(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    """A landing after another control step of `dt` s."""
    flight = looked(flight, inputs)
    if inputs.link_problem and inputs.silent:  # its motion is not known: nothing counts as landed
        return _unheard(settings, flight, inputs, dt)
    if has_stood(settings, flight, inputs.odometry) and inputs.stands is not False:
        assert inputs.odometry is not None
        return dataclasses.replace(to(flight, Mode.DONE, Reason.LANDED), home=float(inputs.odometry.position[2]))
    odometry = inputs.seen
    if flight.blind and flight.lost is not None and inputs.failsafe:  # nothing of this descent happens
        flight = dataclasses.replace(flight, lost=(flight.lost[0] + dt, *flight.lost[1:]))
    if odometry is None:
        return _sinking(settings, flight, inputs)
    if flight.blind:
        found = flight.now if flight.found_since is None else flight.found_since
        flight = dataclasses.replace(flight, found_since=found, lost=_last_seen(settings, flight, inputs))
        return _sinking(settings, flight, inputs) if flight.now - found < FOUND_S else _see(settings, flight, odometry)
    flight = _lowered(settings, flight, odometry, dt, stands=bool(inputs.stands))
    height = float(odometry.position[2])
    low = height < flight.home + STANDING
    still = flight.still_since is not None and flight.now - flight.still_since >= settings.land_settle
    if still and (inputs.stands or (low and inputs.stands is None)):
        return dataclasses.replace(to(flight, Mode.DONE, Reason.LANDED), home=height)
    return flight


def _lowered(settings: FlightSettings, flight: Flight, odometry: Odometry, dt: float, *, stands: bool) -> Flight:
    """Lower the target by one control step, but never far under the vehicle. Also note since when the vehicle has been
    still. If it is felt to stand, the poses may be noisy.
    """
    assert flight.target is not None
    x, y, z = flight.target.position
    height = float(odometry.position[2])
    stopped = float(np.linalg.norm(odometry.velocity[:2])) < SLOW or flight.now - flight.since > SLOWED_S
    far = min(FAST, FASTER * (height - flight.home - HIGH))
    sink = max(settings.land_speed, far) if stopped else 0.0
    still_for = 0.0 if flight.still_since is None else flight.now - flight.still_since
    down = max(z - sink * dt, height - LEAD - PRESSING * max(still_for - settings.land_settle, 0.0))
    speed = float(np.linalg.norm(odometry.velocity))
    still = (speed < settings.still_speed and height - down > PRESSED) or (stands and speed < SLOW)
    since = (flight.now if flight.still_since is None else flight.still_since) if still else None
    return dataclasses.replace(flight, target=Target((x, y, down), flight.target.yaw, -sink), still_since=since)


def _see(settings: FlightSettings, flight: Flight, odometry: Odometry) -> Flight:
    """Land with odometry from the present position."""
    return dataclasses.replace(
        flight, blind=False, found_since=None, lost=None, target=_down_from(settings, odometry), still_since=None,
        nearest=math.inf,
    )  # fmt: skip


def _unheard(settings: FlightSettings, flight: Flight, inputs: Inputs, dt: float) -> Flight:
    """While the link is down: the landing goes on, because its commands may arrive, but no timer of the landing runs.

    The vehicle may drift far meanwhile, so its target moves with it. Once it is heard again, it stops there and does
    not fly back.
    """
    if inputs.seen is None:
        flight = dataclasses.replace(flight, still_since=None)
        if not flight.blind or flight.lost is None:
            return _blindly(settings, flight, inputs, *flight.reasons)
        return dataclasses.replace(flight, lost=(flight.lost[0] + dt, *flight.lost[1:]))
    flight = _see(settings, flight, inputs.seen)
    assert flight.target is not None
    x, y, _ = flight.target.position
    target = Target((x, y, float(inputs.seen.position[2])), flight.target.yaw, -UNHEARD_SINK)
    return dataclasses.replace(flight, target=target, since=flight.since + dt)


def looked(flight: Flight, inputs: Inputs) -> Flight:
    """In a hover or a landing: note since when the newest odometry, good or just lost, has stayed at one place."""
    odometry = inputs.odometry
    if odometry is None or flight.misled or flight.now - odometry.time > RECENT_S:
        return dataclasses.replace(flight, standing_since=None, stood_at=None)
    x, y, z = (float(p) for p in odometry.position)
    if not math.isfinite(x + y + z):
        return flight
    if flight.stood_at is None or math.dist(flight.stood_at, (x, y, z)) > STANDING:
        return dataclasses.replace(flight, standing_since=flight.now, stood_at=(x, y, z))
    return flight


def has_stood(settings: FlightSettings, flight: Flight, odometry: Odometry | None, at_least: float = STAYS_S) -> bool:
    """Whether a flight has stayed at one place long enough to have ended there, according to the newest odometry.
    `at_least`: at home, s.
    """
    if odometry is None or flight.standing_since is None:
        return False
    stayed = flight.now - flight.standing_since
    if abs(float(odometry.position[2]) - flight.home) < STANDING:
        return stayed >= max(settings.land_settle, at_least)
    return flight.blind and stayed >= AWAY_S


def _last_seen(settings: FlightSettings, flight: Flight, inputs: Inputs) -> tuple[float, float, float]:
    """Now, and the height over home, m, and the climb, m/s, from the newest odometry. Absolute values are used because
    it may be mirrored. Without odometry, and if it drifts, the height is the largest that the fence allows.
    """
    o = None if flight.adrift else inputs.odometry
    height, climb = (math.nan, math.nan) if o is None else (float(o.position[2]) - flight.home, float(o.velocity[2]))
    if not math.isfinite(height):
        height = settings.fence.high[2] - flight.home
    return flight.now, abs(height), abs(climb) if math.isfinite(climb) else 0.0


def _sinking(settings: FlightSettings, flight: Flight, inputs: Inputs) -> Flight:
    """A landing without odometry ends when the ground is felt, or after a time where the accelerometer cannot tell. A
    vehicle that has landed must not start up again.
    """
    if not flight.blind:
        return _blindly(settings, flight, inputs, inputs.blindness)
    if inputs.stands:
        return to(flight, Mode.DONE, Reason.TOUCHED)
    if inputs.seen is None:
        flight = dataclasses.replace(flight, found_since=None)
    if inputs.failsafe:
        return flight
    at, height, climb = flight.lost or _last_seen(settings, flight, inputs)
    sinking, expected = flight.now - at, blind_time(height, climb)
    overdue = inputs.stands is None and sinking > 2 * expected + BEYOND_S
    if (inputs.deaf and (sinking > expected or inputs.buried)) or overdue:
        return to(flight, Mode.DONE, f"{Reason.LANDED}: without odometry, after {flight.now - at:.0f} s")
    return flight


def stands(settings: FlightSettings, flight: Flight, odometry: Odometry) -> bool:
    """Whether the vehicle is still, at the height of its take-off."""
    still = float(np.linalg.norm(odometry.velocity)) < settings.still_speed
    return still and abs(float(odometry.position[2]) - flight.home) < STANDING
