"""The smallest distance of a path to a world of triangles: exact, without a grid, for a few points at a time."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from e2efly.simulation.scenes.meshes.distance import to_triangles
from e2efly.simulation.scenes.meshes.engines import engine
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene
from e2efly.simulation.scenes.scene import GROUND, PAD

LEVEL = math.cos(math.radians(30))
"""Smallest vertical part of the normal of a level triangle: it is tilted by less than 30 degrees."""
_TOGETHER = 8
"""Number of points of a path that are processed together."""
_FIRST = 0.5
"""First distance within which triangles are searched, m. It is then doubled again and again."""


@dataclass(frozen=True, eq=False)
class Near:
    """The triangles of a world, prepared for distance queries.

    A vehicle may stand on the ground and on pads: coming near to them is no collision, but going through them is one.
    If no triangle of a world is of class ground, as in a scan of one piece, level triangles below the vehicle count as
    ground.
    """

    scene: MeshScene
    low: Float[np.ndarray, "3 f"]
    """Lowest corner of the box about each triangle, m."""
    high: Float[np.ndarray, "3 f"]
    """Highest corner of this box, m."""
    bears: Bool[np.ndarray, " f"]
    """Whether a vehicle may stand on the triangle."""
    level: Bool[np.ndarray, " f"]
    """Whether a vehicle that is above the triangle may stand on it."""

    @staticmethod
    def of(scene: MeshScene) -> "Near":
        """Prepare the triangles of a world."""
        bears = np.isin(scene.label, (GROUND, PAD))
        level = np.abs(scene.normal[:, 2]) >= LEVEL
        if np.any(scene.label == GROUND):
            level = np.zeros_like(level)
        low, high = (np.ascontiguousarray(corner(axis=1).T) for corner in (scene.triangles.min, scene.triangles.max))
        return Near(scene, low, high, bears, level)

    def distance(self, path: Float[np.ndarray, "n 3"], within: float = math.inf) -> float:
        """The smallest distance of consecutive points (world) to triangles that must not be touched, m.

        It is 0 if the path goes through any triangle between two points, and infinite if there are no such triangles.
        Triangles beyond `within`, m, may count as infinitely far.
        """
        points = np.asarray(path, np.float32)
        if self._crossed(points):
            return 0.0
        blocks = [points[i : i + _TOGETHER] for i in range(0, len(points), _TOGETHER)]
        return min((self._to(block, within) for block in blocks), default=math.inf)

    def _crossed(self, points: np.ndarray) -> bool:
        way = np.diff(points, axis=0)
        moved = np.any(way != 0, axis=1)
        if not moved.any():
            return False
        matrix = np.zeros((int(moved.sum()), 3, 3), np.float32)
        matrix[:, :, 2] = way[moved]
        ahead = np.array([[0.0], [0.0], [1.0]], np.float32)
        start = np.ascontiguousarray(points[:-1][moved])
        return bool(np.any(engine(self.scene).depth(start, matrix, ahead) <= 1))

    def _to(self, points: np.ndarray, within: float) -> float:
        """The smallest distance for points that lie close together, m."""
        first, last, reach = points.min(axis=0), points.max(axis=0), min(_FIRST, within)
        while True:
            near = np.ones(len(self.bears), bool)
            for axis in range(3):
                near &= (self.low[axis] <= last[axis] + reach) & (self.high[axis] >= first[axis] - reach)
            (around,) = np.nonzero(near)
            above = self.high[2, around] > points[:, 2:]
            which, column = np.nonzero(~self.bears[around] & (above | ~self.level[around]))
            found = math.inf
            if len(which):
                found = float(to_triangles(points[which], self.scene.triangles[around[column]]).min())
            if found <= reach or len(around) == len(near):
                return found
            if reach >= within:
                return math.inf
            reach = min(2 * reach, within)
