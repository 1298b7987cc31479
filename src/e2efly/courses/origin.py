"""The place of a course in the room in which it is flown."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from e2efly.courses.tracks import RaceTrack

RESIDUAL = 0.02
"""Largest accepted root mean square error of measured points after a fit, m."""
FLAT = 0.05
"""Ratio of the extent of points across their longest line to the extent along it. Below this, they count as points on a
line."""


@dataclass(frozen=True)
class Origin:
    """The origin of a course relative to the room's (the world of the pose source): rotated about up, then moved."""

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Position in the room, m."""
    yaw: float = 0.0
    """Rotation about world z, rad."""

    def vectors(self, vector: np.ndarray) -> np.ndarray:
        """Convert vectors (..., 3) from the course to the room."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        R_room_course = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        return np.asarray(vector, np.float64) @ R_room_course.T

    def points(self, point: np.ndarray | tuple[float, float, float]) -> np.ndarray:
        """Convert points (..., 3), m, from the course to the room."""
        return self.vectors(np.asarray(point, np.float64)) + np.asarray(self.position, np.float64)

    def seen_vectors(self, vector: np.ndarray) -> np.ndarray:
        """Convert vectors (..., 3) from the room to the course."""
        return Origin(yaw=-self.yaw).vectors(vector)

    def seen(self, point: np.ndarray) -> np.ndarray:
        """Convert points (..., 3), m, from the room to the course."""
        return self.seen_vectors(np.asarray(point, np.float64) - np.asarray(self.position, np.float64))

    @staticmethod
    def fitted(room: np.ndarray, course: np.ndarray) -> "Origin":
        """The origin that best maps points of the course to their measured positions in the room, by least squares.

        Both have z up, so only a rotation about z and a shift are fitted: B. K. P. Horn, "Closed-form solution of
        absolute orientation using unit quaternions", 1987, for a rotation in the plane. Both are (n, 3), m: `room` as
        measured in the room, and `course` the same points in the course's world.

        Raises:
            ValueError: for fewer than three points, for points on a line, and for a residual above `RESIDUAL`.
        """
        room, course = np.asarray(room, np.float64), np.asarray(course, np.float64)
        if room.shape != course.shape or room.ndim != 2 or room.shape[1] != 3 or len(room) < 3:
            raise ValueError(
                f"points have shapes {room.shape} and {course.shape}; accepted: three or more pairs, (n, 3)"
            )
        if not (np.isfinite(room).all() and np.isfinite(course).all()):
            raise ValueError("points are not finite; accepted: metres")
        a, b = course - course.mean(0), room - room.mean(0)
        spread = np.linalg.svd(a[:, :2], compute_uv=False)
        if spread[1] < FLAT * max(spread[0], 1e-9):
            raise ValueError(f"points lie on a line seen from above, to {100 * FLAT:g} %; accepted: three corners")
        yaw = math.atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a[:, :2] * b[:, :2]).sum()))
        turned = Origin(yaw=yaw)
        x, y, z = (float(value) for value in room.mean(0) - turned.vectors(course.mean(0)))
        found = Origin((x, y, z), yaw)
        off = float(np.sqrt(((found.points(course) - room) ** 2).sum(-1).mean()))
        if off > RESIDUAL:
            raise ValueError(
                f"points are {100 * off:.1f} cm off after the fit; accepted: at most {100 * RESIDUAL:g} cm"
            )
        return found

    def at(self, inner: "Origin") -> "Origin":
        """The origin, in the room, of a course whose own origin `inner` is given in the axes of this one."""
        x, y, z = (float(value) for value in self.points(inner.position))
        return Origin((x, y, z), self.yaw + inner.yaw)

    def track(self, track: RaceTrack) -> RaceTrack:
        """A race track, in the room."""
        return dataclasses.replace(
            track,
            start=self.points(track.start),
            start_yaw=track.start_yaw + self.yaw,
            position=self.points(track.position),
            yaw=track.yaw + self.yaw,
        )
