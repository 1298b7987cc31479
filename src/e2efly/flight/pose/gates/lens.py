"""A pinhole camera on the vehicle, and the corners of gates as it sees them. Pure NumPy.

Camera frame: x right, y down, z ahead. Body frame FLU. Pixels are counted from the upper left corner of the image.
"""

import math
from dataclasses import dataclass

import numpy as np

from e2efly.courses.tracks import RaceTrack

NEAREST = 0.3
"""Corners nearer than this along the optical axis are not used, m."""
_AHEAD = np.array([[0.0, -1.0, 0.0], [0.0, 0.0, -1.0], [1.0, 0.0, 0.0]])
"""Rotation from the body frame to the frame of a camera that looks straight ahead."""


@dataclass(frozen=True)
class Corners:
    """The k corners of openings in an image."""

    pixel: np.ndarray
    """(k, 2) column and row of each, pixels from the upper left corner of the image, whose own centre is 0.5, 0.5."""
    inward: np.ndarray
    """(k, 2) unit vectors in the image, from the corner into the opening."""


NO_CORNERS = Corners(np.zeros((0, 2)), np.zeros((0, 2)))


@dataclass(frozen=True)
class Lens:
    """A pinhole camera as it should be mounted."""

    width: int
    """Columns."""
    height: int
    """Rows."""
    fov: tuple[float, float]
    """Horizontal and vertical field of view, rad."""
    pitch: float
    """Downward pitch from straight ahead, rad."""
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """In the body frame, m."""
    readout: float = 0.0
    """Time from the exposure of the first row to that of the last, s (rolling shutter). The stamp of an image is the
    time of its middle row."""

    @property
    def focal(self) -> np.ndarray:
        """(2,) focal lengths, pixels."""
        return np.array([self.width / 2 / math.tan(self.fov[0] / 2), self.height / 2 / math.tan(self.fov[1] / 2)])

    @property
    def matrix(self) -> np.ndarray:
        """(3, 3) rotation from the body frame to the camera frame."""
        c, s = math.cos(self.pitch), math.sin(self.pitch)
        return _AHEAD @ np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])

    def pixels(self, points: np.ndarray) -> np.ndarray:
        """(..., 2) pixels of points (..., 3) in the camera frame that lie ahead of it."""
        middle = np.array([self.width, self.height]) / 2
        return middle + self.focal * points[..., :2] / points[..., 2:]

    def slope(self, points: np.ndarray) -> np.ndarray:
        """(k, 2, 3) derivative of `pixels` with respect to points (k, 3)."""
        x, y, z = points.T
        (fx, fy), zero = self.focal, np.zeros_like(z)
        rows = np.stack([fx / z, zero, -fx * x / z**2, zero, fy / z, -fy * y / z**2], axis=-1)
        return rows.reshape(-1, 2, 3)

    def inside(self, pixel: np.ndarray, margin: float) -> np.ndarray:
        """(k,) whether pixels (k, 2) lie in the image, farther than a margin from its border, pixels."""
        return np.all((pixel > margin) & (pixel < np.array([self.width, self.height]) - margin), axis=-1)


@dataclass(frozen=True)
class Openings:
    """The openings of a track's gates. They are as deep as their bars, so what is seen through one has the edges of its
    front and of its back, whichever hides more.
    """

    corners: np.ndarray
    """(g, 4, 3) corners in the middle of the depth, in turn about each opening, world, m."""
    forward: np.ndarray
    """(g, 3) from the middle of each opening to its back, world, m."""

    @staticmethod
    def of(track: RaceTrack, half_depth: float) -> "Openings":
        """The openings of a track whose bars have a half depth, m."""
        along = np.stack([np.cos(track.yaw), np.sin(track.yaw), np.zeros(len(track.yaw))], axis=-1)
        return Openings(track.corners, half_depth * along)

    def seen(self, eye: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where each corner appears from a position (3,) in the world.

        The two edges that meet there may be of different depths, and then they do not meet in space. The corner is
        where they meet in the image: on the ray that both planes through the eye have in common.

        Returns:
            (g, 4, 3) points in the world, m, and (g, 4, 3) the directions from each corner into the opening.
        """
        to = self.corners - eye
        middle = self.corners.mean(axis=1)
        nearness = np.einsum("gi,gi->g", eye - middle, self.forward)
        near = np.where(nearness > 0, 1.0, -1.0)[:, None, None] * self.forward[:, None]  # towards the eye
        # edge i runs from corner i to corner i + 1; outward is away from the opening
        outward = self.corners + np.roll(self.corners, -1, axis=1) - 2 * middle[:, None]
        beyond = np.einsum("gki,gki->gk", -to, outward) > 0  # the eye is outside of this edge: its near face hides
        edge = np.where(beyond[..., None], near, -near)
        starts, ends = to + edge, np.roll(to, -1, axis=1) + edge
        plane = np.cross(starts, ends)  # of the eye and edge i
        ray = np.cross(np.roll(plane, 1, axis=1), plane)
        scale = np.einsum("gki,gki->gk", ray, to) / np.maximum(np.einsum("gki,gki->gk", ray, ray), 1e-12)
        return eye + ray * scale[..., None], middle[:, None] - self.corners
