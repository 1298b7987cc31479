"""The place at which a controller is to hold a vehicle, and the motion of this place."""

from dataclasses import dataclass

from e2efly.control.vectors import Array, Vec3

ZERO = Vec3(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Place:
    """A place to be at. Components are numbers, or arrays of the batch's shape. World ENU, SI units."""

    position: Vec3
    """Position, m."""
    velocity: Vec3 = ZERO
    """Velocity, m/s."""
    acceleration: Vec3 = ZERO
    """Acceleration, m/s^2."""
    jerk: Vec3 = ZERO
    """Jerk, m/s^3."""
    yaw: Array | None = None
    """Yaw, rad. None: any yaw; the vehicle keeps its own."""

    def after(self, seconds: float) -> "Place":
        """The place after some seconds of constant jerk."""
        t = seconds
        return Place(
            self.position + self.velocity * t + self.acceleration * (t**2 / 2) + self.jerk * (t**3 / 6),
            self.velocity + self.acceleration * t + self.jerk * (t**2 / 2),
            self.acceleration + self.jerk * t,
            self.jerk,
            self.yaw,
        )
