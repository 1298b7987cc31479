"""Rays through triangles by Embree, on CPUs. Other threads can run meanwhile."""

from collections.abc import Iterator

import numpy as np
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene
from jaxtyping import Bool, Float, Int

from e2efly.simulation.device import cores
from e2efly.simulation.scenes.meshes.engine import MeshHits
from e2efly.simulation.scenes.shapes import FAR

_AT_ONCE = 4096
"""Number of rays that fit into the caches. Images smaller than this are computed together."""


class Embree:
    """Triangles in the tree of Embree."""

    def __init__(self, triangles: Float[np.ndarray, "f 3 3"], watertight: bool = False) -> None:
        """Build the tree. With `watertight` no ray passes between triangles, and it is a fifth slower."""
        self.threads = cores()
        self._scene = EmbreeScene(robust=watertight)
        self._mesh = TriangleMesh(self._scene, np.ascontiguousarray(triangles, np.float32))
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def depth(
        self, origin: Float[np.ndarray, "c 3"], matrix: Float[np.ndarray, "c 3 3"], rays: Float[np.ndarray, "3 r"]
    ) -> Float[np.ndarray, "c r"]:
        """See `Engine`. Embree writes into the rows of the result."""
        depth = np.full((len(origin), rays.shape[1]), FAR, np.float32)
        for some, start, way in _rays(origin, matrix, rays):
            self._scene.run(start, way, dists=depth[some].reshape(-1), query="DISTANCE")
        return depth

    def hits(
        self, origin: Float[np.ndarray, "c 3"], matrix: Float[np.ndarray, "c 3 3"], rays: Float[np.ndarray, "3 r"]
    ) -> MeshHits:
        """See `Engine`."""
        shape = (len(origin), rays.shape[1])
        kinds = {"depth": np.float32, "face": np.int32, "u": np.float32, "v": np.float32}
        found = MeshHits(**{name: np.empty(shape, kind) for name, kind in kinds.items()})
        for some, start, way in _rays(origin, matrix, rays):
            met = self._scene.run(start, way, dists=FAR, output=1)
            for name, theirs in (("depth", "tfar"), ("face", "primID"), ("u", "u"), ("v", "v")):
                getattr(found, name)[some] = met[theirs].reshape(-1, shape[1])
        return found

    def first(
        self, origin: Float[np.ndarray, "m 3"], direction: Float[np.ndarray, "m 3"]
    ) -> tuple[Float[np.ndarray, " m"], Int[np.ndarray, " m"]]:
        """Depth and triangle (-1: none) of the first hit of single rays."""
        met = self._scene.run(origin, direction, dists=FAR, output=1)
        return met["tfar"], met["primID"]

    def blocked(self, origin: Float[np.ndarray, "m 3"], direction: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
        """See `Engine`."""
        return self._scene.run(origin, direction, query="OCCLUDED") >= 0


def _rays(
    origin: np.ndarray, matrix: np.ndarray, rays: np.ndarray
) -> Iterator[tuple[slice, Float[np.ndarray, "r 3"], Float[np.ndarray, "r 3"]]]:
    """Origins and directions of some cameras at a time. For a single camera they are not copied."""
    r = rays.shape[1]
    size = max(1, _AT_ONCE // r)
    for i in range(0, len(origin), size):
        some = slice(i, i + size)
        way = np.matmul(matrix[some], rays).transpose(0, 2, 1)
        yield some, np.broadcast_to(origin[some, None], way.shape).reshape(-1, 3), way.reshape(-1, 3)
