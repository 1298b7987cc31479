"""Without odometry: the velocity seen last, carried on by the flight controller's accelerometer and attitude.

It serves to end the motion under way and to sink, not to know where the vehicle is: an accelerometer that is wrong by
1 % of gravity is off by 0.1 m/s after a second, by half a metre a second after five.
"""

import math
from dataclasses import dataclass

from e2efly.control import Ctbr, Vec3
from e2efly.deploy.fence import heading
from e2efly.deploy.hover import LEVEL_GAIN, LEVEL_RATE, SINK_ACCELERATION, SINK_SPEED
from e2efly.deploy.msp.messages import Attitude
from e2efly.deploy.odometry import Odometry
from e2efly.vehicles.vehicle import GRAVITY

LONGEST_STEP = 0.1
"""Between two measurements; after a longer pause the velocity is not known any more, s."""
BRAKE_GAIN, BRAKE_ACCELERATION = 1.5, 3.0
"""Deceleration over horizontal speed, 1/s, and the largest, m/s^2."""
BRAKE_S = 2.0
"""Horizontal motion is braked for so long, s: then its reckoning is too old, and the vehicle is held level."""
SINK_GAIN = 3.0
"""Acceleration over the error of the vertical speed, 1/s."""
SINK_FASTER = 0.1
"""By which the speed of sinking grows, m/s^2: more than what an accelerometer is wrong by, so that it always sinks."""
TRIM_GAIN, TRIM_ERROR, LARGEST_TRIM = 3.0, 0.6, 4.0
"""Growth of the trim over the error of the vertical speed, 1/s^2; the largest error that counts, m/s, as a motion that
is being ended is none of the map's; and its bound, m/s^2: a map that is wrong by 30 %."""


@dataclass(frozen=True)
class Reckoning:
    """The velocity without odometry."""

    velocity: tuple[float, float, float]
    """Forward, left and up along the heading, m/s."""
    time: float
    """Up to when it is reckoned, s."""
    height: float
    """Reckoned from the odometry's last, world, m."""
    top: float
    """The highest since then, m."""


def seen(odometry: Odometry, now: float, error: float = 0.0) -> Reckoning:
    """Begin from an odometry at `now`, s, whose heading is wrong by `error`, rad."""
    x, y, z = (float(v) for v in odometry.velocity)
    yaw = heading(odometry.quaternion) - error
    c, s = math.cos(yaw), math.sin(yaw)
    height = float(odometry.position[2])
    return Reckoning((c * x + s * y, c * y - s * x, z), now, height, height)


def reckon(
    before: Reckoning | None, attitude: Attitude | None, force: tuple[float, ...], now: float
) -> Reckoning | None:
    """Carry the velocity on by one measurement; the heading is taken to stay.

    Args:
        before: what was reckoned so far.
        attitude: the flight controller's.
        force: specific force by its accelerometer, body FLU, m/s^2.
        now: s.

    Returns:
        The velocity now; None where it cannot be known: no attitude, or too long a pause.
    """
    if before is None or attitude is None or not 0 <= now - before.time <= LONGEST_STEP:
        return None
    dt, (fx, fy, fz) = now - before.time, force
    cr, sr = math.cos(attitude.roll), math.sin(attitude.roll)
    cp, sp = math.cos(attitude.pitch), math.sin(attitude.pitch)
    lifted = sr * fy + cr * fz
    forward, left, up = before.velocity
    height = before.height + up * dt
    return Reckoning(
        (forward + (cp * fx + sp * lifted) * dt, left + (cr * fy - sr * fz) * dt,
         up + (cp * lifted - sp * fx - GRAVITY) * dt),
        now, height, max(height, before.top),
    )  # fmt: skip


def trimmed(trim: float, elapsed: float, up: float, dt: float) -> float:
    """The trim that makes up for a wrong throttle map, m/s^2, carried on by `dt` s.

    Args:
        trim: so far, m/s^2.
        elapsed: since the odometry was lost, s.
        up: vertical speed, m/s.
        dt: s.
    """
    behind = max(-TRIM_ERROR, min(TRIM_ERROR, _climb(elapsed) - up))
    return max(-LARGEST_TRIM, min(LARGEST_TRIM, trim + TRIM_GAIN * behind * dt))


def settle(attitude: Attitude, elapsed: float, velocity: tuple[float, float, float], trim: float = 0.0) -> Ctbr:
    """End the motion, level, and sink.

    Args:
        attitude: the flight controller's.
        elapsed: since the odometry was lost, s.
        velocity: forward, left and up along the heading, m/s.
        trim: added to the thrust, m/s^2; see `trimmed`.
    """
    forward, left, up = velocity
    wanted = SINK_GAIN * (_climb(elapsed) - up)
    thrust = GRAVITY + trim + max(-SINK_ACCELERATION, min(SINK_ACCELERATION, wanted))
    speed = math.hypot(forward, left)
    share = min(BRAKE_GAIN, BRAKE_ACCELERATION / speed) if speed > 0 and elapsed < BRAKE_S else 0.0
    roll, pitch = math.atan(share * left / GRAVITY), -math.atan(share * forward / GRAVITY)
    tilt = max(math.cos(attitude.roll) * math.cos(attitude.pitch), 0.5)
    return Ctbr(thrust / tilt, Vec3(_turn(roll - attitude.roll), _turn(pitch - attitude.pitch), 0.0))


def _climb(elapsed: float) -> float:
    return -SINK_SPEED - SINK_FASTER * elapsed


def _turn(angle: float) -> float:
    return max(-LEVEL_RATE, min(LEVEL_RATE, LEVEL_GAIN * angle))
