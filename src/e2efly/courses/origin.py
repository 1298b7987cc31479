"""Where a course stands in the room that it is flown in."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from e2efly.courses.references import Spline
from e2efly.courses.tracks import RaceTrack


@dataclass(frozen=True)
class Origin:
    """A course's own origin, seen from the room's (the world of the pose source): turned about up, then moved."""

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """World, m."""
    yaw: float = 0.0
    """About world z, rad."""

    def vectors(self, vector: np.ndarray) -> np.ndarray:
        """Vectors (..., 3) of the course, in the room."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        R_room_course = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        return np.asarray(vector, np.float64) @ R_room_course.T

    def points(self, point: np.ndarray | tuple[float, float, float]) -> np.ndarray:
        """Points (..., 3) of the course, m, in the room."""
        return self.vectors(np.asarray(point, np.float64)) + np.asarray(self.position, np.float64)

    def seen_vectors(self, vector: np.ndarray) -> np.ndarray:
        """Vectors (..., 3) of the room, in the course's axes."""
        return Origin(yaw=-self.yaw).vectors(vector)

    def seen(self, point: np.ndarray) -> np.ndarray:
        """Points (..., 3) of the room, m, in the course's axes."""
        return self.seen_vectors(np.asarray(point, np.float64) - np.asarray(self.position, np.float64))

    def at(self, inner: "Origin") -> "Origin":
        """The origin, in the room, of a course whose own origin `inner` is told in this one's axes."""
        x, y, z = (float(value) for value in self.points(inner.position))
        return Origin((x, y, z), self.yaw + inner.yaw)

    def spline(self, spline: Spline) -> Spline:
        """A spline of NumPy arrays, in the room."""
        knots = self.vectors(spline.knots)
        knots[:, :, 0] += self.position
        return dataclasses.replace(spline, knots=knots)

    def track(self, track: RaceTrack) -> RaceTrack:
        """A race track, in the room."""
        return dataclasses.replace(
            track,
            start=self.points(track.start),
            start_yaw=track.start_yaw + self.yaw,
            position=self.points(track.position),
            yaw=track.yaw + self.yaw,
        )
