"""An attitude as the flight controller estimates it. Apart from odometry, because the watchdog starts without NumPy."""

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
