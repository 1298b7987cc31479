"""An attitude as the flight controller estimates it; apart from odometry because the watchdog starts without NumPy."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Attitude:
    """An attitude as the flight controller estimates it by itself: R = Rz(yaw) Ry(pitch) Rx(roll), body FLU."""

    roll: float
    """Right side down is positive, rad."""
    pitch: float
    """Nose down is positive, rad."""
    yaw: float
    """Left is positive, rad in (-pi, pi], from wherever the controller's heading is 0."""
