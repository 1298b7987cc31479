"""An attitude as the flight controller estimates it. Apart from odometry, because the watchdog starts without NumPy."""

import math
from collections.abc import Iterable
from dataclasses import dataclass


@dataclass(frozen=True)
class Attitude:
    """An attitude as the flight controller itself estimates it: R = Rz(yaw) Ry(pitch) Rx(roll), body FLU."""

    roll: float
    """Roll, rad. Positive: right side down."""
    pitch: float
    """Pitch, rad. Positive: nose down."""
    yaw: float
    """Yaw, rad in (-pi, pi]. Positive: to the left. It is counted from the direction in which the controller's heading
    is 0."""


def attitude_of(w: float, x: float, y: float, z: float) -> Attitude:
    """The attitude of a unit quaternion, from body FLU to a frame whose z axis points up."""
    return Attitude(
        math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
        math.asin(max(-1.0, min(1.0, 2 * (w * y - z * x)))),
        math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
    )


def level(attitude: Attitude, vector: Iterable[float]) -> tuple[float, float, float]:
    """A vector of the body, FLU, in level axes that point along the heading."""
    x, y, z = map(float, vector)
    cr, sr = math.cos(attitude.roll), math.sin(attitude.roll)
    cp, sp = math.cos(attitude.pitch), math.sin(attitude.pitch)
    lifted = sr * y + cr * z
    return cp * x + sp * lifted, cr * y - sr * z, cp * lifted - sp * x


def turned(attitude: Attitude, rate: tuple[float, float, float], dt: float) -> Attitude:
    """The attitude after `dt` s of a body rate, FLU, rad/s: by the kinematics of Euler angles."""
    p, q, r = rate
    s, c = math.sin(attitude.roll), math.cos(attitude.roll)
    lean = math.copysign(max(abs(math.cos(attitude.pitch)), 0.1), math.cos(attitude.pitch))
    about = (q * s + r * c) / lean
    return Attitude(
        attitude.roll + (p + about * math.sin(attitude.pitch)) * dt,
        attitude.pitch + (q * c - r * s) * dt,
        attitude.yaw + about * dt,
    )
