"""Where a course stands in the room that it is flown in."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from e2efly.courses.references import Spline
from e2efly.courses.tracks import RaceTrack

RESIDUAL = 0.02
"""Root mean square by which measured points may be off after a fit, m."""
FLAT = 0.05
"""Extent of points across their longest line over that along it, below which they lie on a line."""


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

    @staticmethod
    def fitted(room: np.ndarray, course: np.ndarray) -> "Origin":
        """The origin by which points of the course lie where they were measured in the room, by least squares.

        Both have z up, so that a turn about it and a shift are looked for: B. K. P. Horn, "Closed-form solution of
        absolute orientation using unit quaternions", 1987, of a rotation in the plane.

        Args:
            room: (n, 3) measured in the room, m.
            course: (n, 3) the same points in the course's world, m.

        Raises:
            ValueError: for fewer than three points, points on a line, and a residual above `RESIDUAL`.
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
