"""Where a controller is to hold a vehicle, and how that moves."""

from dataclasses import dataclass

from e2efly.control.vectors import Array, Vec3

ZERO = Vec3(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Place:
    """Where to be; components are numbers, or arrays of the batch's shape. World ENU, SI units."""

    position: Vec3
    """m."""
    velocity: Vec3 = ZERO
    """m/s."""
    acceleration: Vec3 = ZERO
    """m/s^2."""
    jerk: Vec3 = ZERO
    """m/s^3."""
    yaw: Array | None = None
    """rad; None: any, the vehicle keeps the one that it has."""

    def after(self, seconds: float) -> "Place":
        """Where it has moved to after some seconds, the jerk being constant."""
        t = seconds
        return Place(
            self.position + self.velocity * t + self.acceleration * (t**2 / 2) + self.jerk * (t**3 / 6),
            self.velocity + self.acceleration * t + self.jerk * (t**2 / 2),
            self.acceleration + self.jerk * t,
            self.jerk,
            self.yaw,
        )
