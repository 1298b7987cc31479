"""Where the vehicle may be: the fence, the guard that acts before it is reached, and targets that stay inside."""

import math

import numpy as np

from e2efly.deploy.odometry import Odometry, tilt_of, yaw_of
from e2efly.deploy.pilot.flight_state import Pilot, Reason, Target
from e2efly.deploy.settings import Fence, FlightSettings

MARGIN = 0.1
"""How far inside the fence a policy's flight comes to rest, m."""


def fence_problem(fence: Fence, odometry: Odometry, floor: bool = True, *, guard: bool = True) -> str | None:
    """Why the vehicle is outside the fence, or can no longer stop inside it. None: neither.

    Args:
        fence: the fence.
        odometry: the position and motion of the vehicle.
        floor: whether the lowest height counts.
        guard: whether it counts if the vehicle cannot stop inside.
    """
    v = odometry.velocity
    speed, tilt = float(np.linalg.norm(v)), tilt_of(odometry.quaternion)
    if speed > fence.speed:
        return f"{Reason.OUTSIDE_FENCE}: {speed:.1f} m/s; accepted: {fence.speed:g}"
    if tilt > fence.tilt:
        return f"{Reason.OUTSIDE_FENCE}: tilt {math.degrees(tilt):.0f} deg; accepted: {math.degrees(fence.tilt):.0f}"
    stops = _stop(fence, odometry)
    for axis, at, stop, low, high in zip("xyz", odometry.position, stops, fence.low, fence.high, strict=True):
        low = low if floor or axis != "z" else -math.inf
        if not low <= at <= high:
            return f"{Reason.OUTSIDE_FENCE}: {axis} is {at:.2f} m; accepted: {low:g} to {high:g}"
        if guard and not low <= stop <= high:
            return f"{Reason.GUARD}: {axis} would reach {stop:.2f} m; accepted: {low:g} to {high:g}"
    return None


def here(odometry: Odometry) -> Target:
    """The position and heading of the vehicle."""
    x, y, z = (float(value) for value in odometry.position)
    return Target((x, y, z), yaw_of(odometry.quaternion))


def stopping(fence: Fence, odometry: Odometry) -> Target:
    """Where the vehicle can come to rest, limited to the inside of the fence."""
    inside = np.clip(_stop(fence, odometry), np.add(fence.low, MARGIN), np.subtract(fence.high, MARGIN))
    x, y, z = (float(value) for value in inside)
    return Target((x, y, z), yaw_of(odometry.quaternion))


def moved(settings: FlightSettings, target: Target, pilot: Pilot, dt: float) -> Target:
    """The target moved by the sticks for `dt` s, relative to the target's heading. It never leaves the fence. If it is
    outside, it does not move farther out.
    """

    def beyond(stick: float) -> float:
        dead = settings.stick_deadband
        return math.copysign(max(abs(stick) - dead, 0.0) / (1 - dead), stick)

    reach = settings.reposition_speed * dt
    forward, left, up = beyond(pilot.pitch) * reach, -beyond(pilot.roll) * reach, beyond(pilot.throttle) * reach
    c, s = math.cos(target.yaw), math.sin(target.yaw)
    at, fence = np.array(target.position), settings.fence
    to = np.add(at, (c * forward - s * left, s * forward + c * left, up))
    x, y, z = (float(p) for p in np.clip(to, np.minimum(fence.low, at), np.maximum(fence.high, at)))
    return Target((x, y, z), math.remainder(target.yaw - beyond(pilot.yaw) * dt, math.tau))


def _stop(fence: Fence, odometry: Odometry) -> np.ndarray:
    """(3,) m: where the vehicle comes to rest, computed for each axis separately: at its present speed for the reaction
    time, then braking.
    """
    v = odometry.velocity
    return odometry.position + v * fence.reaction + v * np.abs(v) / (2 * fence.braking)
