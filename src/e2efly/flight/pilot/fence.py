"""Where the vehicle may be: the fence, the guard that acts before it is reached, and targets that stay inside."""

import math
from dataclasses import replace

import numpy as np

from e2efly.control import Quat, Vec3
from e2efly.flight.pilot.flight_state import Pilot, Reason, Target
from e2efly.flight.settings import Fence, FlightSettings
from e2efly.policy.goal import Course
from e2efly.policy.odometry import Odometry, tilt_of, yaw_of
from e2efly.vehicles.gravity import GRAVITY

MARGIN = 0.1
"""How far inside the fence a policy's flight comes to rest, m."""
RIGHTING = 8.0
"""How fast a tilted vehicle becomes upright before it can brake, rad/s."""


def fence_problem(
    fence: Fence,
    odometry: Odometry,
    floor: bool = True,
    *,
    guard: bool = True,
    age: float = 0.0,
    force: np.ndarray | None = None,
) -> str | None:
    """Why the vehicle is outside the fence, or can no longer stop inside it. None: neither. `floor` tells whether the
    lowest height counts, and `guard` whether it counts if the vehicle cannot stop inside. `age` is that of the
    odometry, s. `force` is (3,) specific force, body FLU, m/s^2. Until the braking takes effect, it may last, and turns
    with the body. None: not known.
    """
    v = odometry.velocity
    speed, tilt = float(np.linalg.norm(v)), tilt_of(odometry.quaternion)
    if speed > fence.speed:
        return f"{Reason.OUTSIDE_FENCE}: {speed:.1f} m/s; accepted: {fence.speed:g}"
    if tilt > fence.tilt:
        return f"{Reason.OUTSIDE_FENCE}: tilt {math.degrees(tilt):.0f} deg; accepted: {math.degrees(fence.tilt):.0f}"
    stops = _stop(fence, odometry, age, force)
    for axis, at, stop, low, high in zip("xyz", odometry.position, stops, fence.low, fence.high, strict=True):
        low = low if floor or axis != "z" else -math.inf
        if not low <= at <= high:
            return f"{Reason.OUTSIDE_FENCE}: {axis} is {at:.2f} m; accepted: {low:g} to {high:g}"
        if guard and not low <= stop <= high:
            return f"{Reason.GUARD}: {axis} would reach {stop:.2f} m; accepted: {low:g} to {high:g}"
    return None


def check_course(fence: Fence, course: Course) -> None:
    """Refuse a course that a fence does not hold. A course that ends on the ground may lead below it.

    Raises:
        ValueError: naming the fence, what the course needs, and what is accepted.
    """
    low, high = course.box
    under = (low < fence.low) & ~np.array([False, False, course.goal.lands])
    if (under | (high > fence.high)).any():
        raise ValueError(
            f"the fence is {fence.low} to {fence.high} m; the course needs {course.needs}; accepted: a fence that "
            "holds it (--flight.fence.low, --flight.fence.high), or a course that is smaller or elsewhere"
        )


def here(odometry: Odometry) -> Target:
    """The position and heading of the vehicle."""
    x, y, z = (float(value) for value in odometry.position)
    return Target((x, y, z), yaw_of(odometry.quaternion))


def stopping(fence: Fence, odometry: Odometry, ground: float = -math.inf) -> Target:
    """Where the vehicle can come to rest. Along an axis on which this is outside the fence, it is sent back by as much
    as it needs to stop, so that it brakes as hard as it can. The target is always inside the fence, and over `ground`,
    m, where the fence reaches below it.
    """
    fence = replace(fence, low=(*fence.low[:2], max(fence.low[2], ground)))
    stops = _stop(fence, odometry)
    leaves = (stops < fence.low) | (stops > fence.high)
    place = np.where(leaves, 2 * odometry.position - stops, stops)
    x, y, z = np.clip(place, np.add(fence.low, MARGIN), np.subtract(fence.high, MARGIN)).tolist()
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


def _stop(fence: Fence, odometry: Odometry, age: float = 0.0, force: np.ndarray | None = None) -> np.ndarray:
    """(3,) m: where the vehicle comes to rest, computed for each axis separately: at its present speed until it is
    upright and the braking takes effect, then braking. What the present force changes until then counts where it leads
    farther or faster. The force turns with the body.
    """
    v, wait = odometry.velocity, age + fence.reaction + tilt_of(odometry.quaternion) / RIGHTING
    way = gain = np.zeros(3)
    if force is not None:
        gain, way = (np.where(change * v >= 0, change, 0.0) for change in _pushed(odometry, force, wait))
    then = v + gain
    return odometry.position + v * wait + way + then * np.abs(then) / (2 * fence.braking)


def _pushed(odometry: Odometry, force: np.ndarray, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """(3,) each, m/s and m: what gravity and a force that turns with the body change of velocity and position.

    With the body rate w, the angle a = |w| t and the unit axis n, the force is f(t) = n (n.f) + (f - n (n.f)) cos a +
    (n x f) sin a (Rodrigues), here integrated once and twice.
    """
    attitude = Quat(*odometry.quaternion.tolist())
    turned = (attitude.rotate(Vec3(*vector.tolist())) for vector in (force, odometry.body_rate))
    f, w = (np.array([vector.x, vector.y, vector.z]) for vector in turned)
    rate = max(float(np.linalg.norm(w)), 1e-4)
    angle, n = rate * seconds, w / rate
    along = n * float(n @ f)
    across, side = f - along, np.cross(n, f)
    steady = along - (0.0, 0.0, GRAVITY)
    bent = 2 * math.sin(angle / 2) ** 2  # 1 - cos
    gain = steady * seconds + (across * math.sin(angle) + side * bent) / rate
    return gain, steady * seconds**2 / 2 + (across * bent + side * (angle - math.sin(angle))) / rate**2
