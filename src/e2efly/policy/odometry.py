"""The position and motion of the vehicle: what pose sources deliver, and what the bridge uses to fly."""

import math
from dataclasses import dataclass

import numpy as np

from e2efly.control import Quat
from e2efly.courses.origin import Origin


@dataclass(frozen=True)
class Sample:
    """One message of a pose source, as it arrived, in the source's own clock."""

    received: float
    """Time of arrival, s on this machine's monotonic clock."""
    position: np.ndarray
    """(3,) centre of mass, world ENU, m."""
    quaternion: np.ndarray
    """(4,) attitude, wxyz, body FLU to world ENU."""
    stamp: float | None = None
    """Time at which the pose was true, s on the source's clock. None: the source does not give it."""
    velocity: np.ndarray | None = None
    """(3,) velocity, world, m/s. None: it has to be estimated."""
    body_rate: np.ndarray | None = None
    """(3,) about body x, y, z, rad/s. None: it has to be estimated."""
    frame: str = ""
    """Name of the frame that the source uses. Empty: the source does not give it."""


@dataclass(frozen=True)
class Odometry:
    """The vehicle's motion, checked."""

    time: float
    """Time at which the motion was true, s on this machine's monotonic clock."""
    position: np.ndarray
    """(3,) centre of mass, world ENU, m."""
    velocity: np.ndarray
    """(3,) world, m/s."""
    quaternion: np.ndarray
    """(4,) unit, wxyz, body FLU to world ENU. Continuous in time, so w >= 0 is not guaranteed."""
    body_rate: np.ndarray
    """(3,) about body x, y, z, rad/s."""

    @property
    def batch(self) -> "Odometry":
        """The same motion as a batch of one: each array with a leading axis."""
        p, v, q, w = self.position, self.velocity, self.quaternion, self.body_rate
        return Odometry(self.time, p[None], v[None], q[None], w[None])

    def seen_from(self, origin: Origin) -> "Odometry":
        """The motion in the axes of a world that has this origin."""
        if origin == Origin():
            return self
        half = origin.yaw / 2
        turn = Quat(math.cos(half), 0.0, 0.0, -math.sin(half))
        attitude = turn.compose(Quat.of(self.quaternion)).stack()
        position, velocity = origin.seen(self.position), origin.seen_vectors(self.velocity)
        return Odometry(self.time, position, velocity, attitude, self.body_rate)


def yaw_of(quaternion: np.ndarray) -> float:
    """The angle about world z of the body's x axis, rad; quaternion (4,) wxyz."""
    return float(Quat.of(quaternion).yaw())


def tilt_of(quaternion: np.ndarray) -> float:
    """The angle between the body's z axis and up, rad; quaternion (4,) wxyz."""
    return float(Quat.of(quaternion).tilt())
