"""The path of the backup manoeuvre.

The path is computed in the plane in which the thrust turns. There, the rate loop, the mixer and the rotors' lag give
one angle and one thrust over time, both with the vehicle's own numbers. The effect of the thrust on the velocity
follows by summation. After `turn.STEPS` the thrust points in the braking direction, and the rest of the path is in
closed form.
"""

import math
from typing import Any, NamedTuple

from e2efly.flight.filter.arithmetic import SCALARS, Number
from e2efly.flight.filter.backup import (
    DIAGONAL,
    REST_S,
    THRUST_SHARE,
    TILT_GAIN,
    UNSEEN,
    WAY_GAINS,
    Backup,
    Brake,
    brake,
)
from e2efly.flight.filter.forecast import NOTHING, ForecastMotion, Residual
from e2efly.vehicles.gravity import GRAVITY


class Way(NamedTuple):
    """The path of the manoeuvre."""

    px: tuple[Number, ...]
    """Positions during the turn, at the moments of `SEEN`, world, m."""
    py: tuple[Number, ...]
    pz: tuple[Number, ...]
    lz: tuple[Number, ...]
    """Heights, m, if the battery becomes flat now ..."""
    wz: Number
    """... and the vertical velocity after the turn, m/s, at most 0: the speed of falling."""
    speed2: Number
    """Square of the largest speed on the path, (m/s)^2."""
    vx: Number
    """Velocity after the turn, m/s. Zero in an axis where braking would have reversed it."""
    vy: Number
    vz: Number


def way(xp: Any, b: Backup, m: ForecastMotion, k: Brake, air: Residual) -> Way:
    """The path of the manoeuvre from a state.

    The manoeuvre turns in the plane of c and t of `Brake`, about an axis u. There the angle to t obeys the rate loop,
    starting from the present rate about u; d(angle) is the direction. Rotation across that plane comes to rest by
    itself. Of the distance `off` of the thrust from the plane, a share e still remains. The thrust therefore points
    along d(angle) + e * off, with d(angle) = sin(angle) / sin(whole) c + sin(whole - angle) / sin(whole) t.
    The form of d is that of K. Shoemake, "Animating rotation with quaternion curves", 1985, for directions.
    """
    low, high = b.response.thrust
    # the slower of both axes turns; `most` is the thrust to command so that the actual one is `k.thrust`
    gain, motor_time, top, most = min(b.response.gain[:2]), b.response.motor_time, b.rate, k.thrust / k.share
    # thrust that a rate error takes from either end of the range, per rad/s, and the largest that it can take
    spread, half = DIAGONAL * max(b.response.spread[:2]) * gain, (high - low) / 2
    cx, cy, cz, tx, ty, tz = k.cx, k.cy, k.cz, k.tx, k.ty, k.tz
    # u = c x t, with the length `sine`; `whole` is the angle from c to t, kept away from 0 and pi, where there is no u
    ux, uy, uz = cy * tz - cz * ty, cz * tx - cx * tz, cx * ty - cy * tx
    sine = xp.sqrt(ux * ux + uy * uy + uz * uz + 1e-12)
    whole = xp.arctan2(sine, cx * tx + cy * ty + cz * tz)
    whole = xp.minimum(xp.maximum(whole, 1e-3), math.pi - 0.02)
    # the present rate about u and its change, towards t positive
    rate = (k.wx * ux + k.wy * uy + k.wz * uz) / sine
    angular = (k.ax * ux + k.ay * uy + k.az * uz) / sine
    bx, by, bz = k.bx, k.by, k.bz
    # the angle about u from the present direction b to t: its sine is u . (b x t), its cosine b . t
    up = (ux * (by * tz - bz * ty) + uy * (bz * tx - bx * tz) + uz * (bx * ty - by * tx)) / sine
    left = xp.arctan2(up, bx * tx + by * ty + bz * tz)
    # b = a c + d t + off, with a c + d t = d(left) in the plane
    scale = 1.0 / xp.sin(whole)
    a, d = xp.sin(left) * scale, xp.sin(whole - left) * scale
    offx, offy, offz = bx - a * cx - d * tx, by - a * cy - d * ty, bz - a * cz - d * tz
    root = xp.sqrt(m.f)  # the rotors' speed is in proportion to the root of the thrust
    # velocity and distance that the thrust has given along off, c and t; o is the constant rest, by air and gravity
    vb = vc = vt = pb = pc = pt = 0.0 * left
    ox, oy, oz = air.x, air.y, air.z - GRAVITY
    px, py, pz, lz, fastest = [], [], [], [], m.vx * m.vx + m.vy * m.vy + m.vz * m.vz
    vx, vy, vz = m.vx, m.vy, m.vz
    # the share of the thrust that a flat battery leaves before it is noticed; z: velocity up that the thrust has given
    flat, z = xp.minimum(xp.maximum(THRUST_SHARE / k.share, UNSEEN), 1.0), 0.0
    for h, t, (a11, a12, a21, a22), kept, mean, square, still, seen in b.steps:
        # the rate loop asks for TILT_GAIN * left. It gets what the rotors can give: an error that takes at most `half`
        error = rate - xp.minimum(xp.maximum(TILT_GAIN * left, -top), top)
        taken = spread * abs(error) + 1e-9
        error = error * xp.minimum(half / taken, 1.0)
        wanted = rate - error
        # the exact step of the rate loop, see `turning`: the error and the angular acceleration after h
        after, then = a11 * error + a12 * angular, a21 * error + a22 * angular
        # the angle turned is the integral of wanted + error. With angular = d(error)/dt, the loop obeys
        # motor_time * d(angular)/dt = -gain * error - angular, so the error's integral follows from their changes
        turned = wanted * h - (motor_time * (then - angular) + (after - error)) / gain
        taken = xp.minimum(taken, half)
        # the commanded thrust is the part of `most` that points to t, as in `command`, within what the turn leaves of
        # the range, because the mixer gives attitude priority
        goal = xp.sqrt(xp.minimum(xp.maximum(most * xp.cos(left), low + taken), high - taken))
        rate, angular = wanted + after, then
        middle, left = left - 0.5 * turned, left - turned
        # the mean thrust over the step: of (goal + lack * e(t))^2, where e is the share of the lack that the lag leaves
        lack = root - goal
        push = k.share * (goal * goal + lack * (2.0 * goal * mean + lack * square))
        root = goal + kept * lack
        # its acceleration along c, t and off, taken as constant over the step
        a, d, e = push * scale * xp.sin(middle), push * scale * xp.sin(whole - middle), push * still
        k2 = 0.5 * h * h
        pb, pc, pt = pb + h * vb + k2 * e, pc + h * vc + k2 * a, pt + h * vt + k2 * d
        vb, vc, vt = vb + h * e, vc + h * a, vt + h * d
        if seen:
            # the position: free motion, and the distance by the thrust in the world
            fall = 0.5 * t * t
            x, y, z = pb * offx + pc * cx + pt * tx, pb * offy + pc * cy + pt * ty, pb * offz + pc * cz + pt * tz
            free = m.pz + t * m.vz + fall * oz
            px.append(m.px + t * m.vx + fall * ox + x)
            py.append(m.py + t * m.vy + fall * oy + y)
            pz.append(free + z)
            lz.append(free + flat * z)
            # the same for the velocity
            x, y, z = vb * offx + vc * cx + vt * tx, vb * offy + vc * cy + vt * ty, vb * offz + vc * cz + vt * tz
            vx = m.vx + t * ox + x
            vy = m.vy + t * oy + y
            vz = m.vz + t * oz + z
            fastest = xp.maximum(fastest, vx * vx + vy * vy + vz * vz)
    # the turn ends with a step that is seen, so v and z are those after it
    wz = xp.minimum(vz - (1.0 - flat) * z, 0.0)
    vx = xp.where(vx * k.vx > 0.0, vx, 0.0)
    vy = xp.where(vy * k.vy > 0.0, vy, 0.0)
    vz = xp.where(vz * k.vz > 0.0, vz, 0.0)
    return Way(tuple(px), tuple(py), tuple(pz), tuple(lz), wz, fastest, vx, vy, vz)


def stopping(b: Backup, speed: float) -> float:
    """The distance in which level flight at a speed, m/s, comes to rest with the manoeuvre, from its first command on,
    m.
    """
    m = ForecastMotion(0.0, 0.0, 0.0, speed, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, GRAVITY)
    w = way(SCALARS, b, m, brake(SCALARS, b, m, NOTHING, gains=WAY_GAINS), NOTHING)
    return max(*w.px, w.px[-1] + run_out(SCALARS, w.vx, b.braking[0]))


def run_out(xp: Any, speed: Number, braking: Number) -> Number:
    """The distance in which a speed, m/s, comes to rest, m: first with the deceleration `braking`, m/s^2, then with the
    time constant `REST_S`.
    """
    slow = braking * REST_S  # the speed at which both decelerations are equal
    # above it: (speed^2 - slow^2) / (2 braking) + slow * REST_S, with slow^2 / (2 braking) = slow * REST_S / 2
    return xp.where(speed < slow, speed * REST_S, 0.5 * speed * speed / braking + 0.5 * slow * REST_S)
