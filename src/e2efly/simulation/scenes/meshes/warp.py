"""Rays through triangles by Warp, on CUDA: one thread per ray. Tests run the same kernels on its CPU device."""

# kernels are a language of their own, whose types look like calls
# pyright: reportInvalidTypeForm=false, reportAttributeAccessIssue=false
# pyright: reportAssignmentType=false, reportGeneralTypeIssues=false
import numpy as np
import warp as wp
from jaxtyping import Bool, Float

from e2efly.simulation.scenes.meshes.engine import MeshHits
from e2efly.simulation.scenes.shapes import FAR

wp.config.log_level = wp.LOG_WARNING
wp.set_module_options({"enable_backward": False})
_FAR = wp.constant(wp.float32(FAR))


@wp.kernel
def _first(
    mesh: wp.uint64,
    origin: wp.array(dtype=wp.vec3),
    matrix: wp.array(dtype=wp.mat33),
    rays: wp.array(dtype=wp.vec3),
    depth: wp.array2d(dtype=wp.float32),
    face: wp.array2d(dtype=wp.int32),
    u: wp.array2d(dtype=wp.float32),
    v: wp.array2d(dtype=wp.float32),
) -> None:
    camera, ray = wp.tid()
    met = wp.mesh_query_ray(mesh, origin[camera], matrix[camera] * rays[ray], _FAR)
    depth[camera, ray] = _FAR
    face[camera, ray] = -1
    if met.result:
        depth[camera, ray] = met.t
        face[camera, ray] = met.face
        u[camera, ray] = met.v
        v[camera, ray] = 1.0 - met.u - met.v


@wp.kernel
def _any(
    mesh: wp.uint64,
    origin: wp.array(dtype=wp.vec3),
    direction: wp.array(dtype=wp.vec3),
    blocked: wp.array(dtype=wp.int32),
) -> None:
    i = wp.tid()
    blocked[i] = int(wp.mesh_query_ray_anyhit(mesh, origin[i], direction[i], _FAR))


class Warp:
    """Triangles in the tree of Warp."""

    threads = 1

    def __init__(self, triangles: Float[np.ndarray, "f 3 3"], device: str = "cuda") -> None:
        """Build the tree on a device of Warp."""
        self._device = device
        points = self._given(triangles.reshape(-1, 3), wp.vec3)
        self._mesh = wp.Mesh(points, self._given(np.arange(len(points), dtype=np.int32), wp.int32))

    def _given(self, values: np.ndarray, kind: type) -> wp.array:
        return wp.array(np.ascontiguousarray(values), dtype=kind, device=self._device)

    def depth(
        self, origin: Float[np.ndarray, "c 3"], matrix: Float[np.ndarray, "c 3 3"], rays: Float[np.ndarray, "3 r"]
    ) -> Float[np.ndarray, "c r"]:
        """See `Engine`."""
        return self._traced(origin, matrix, rays)[0].numpy()

    def hits(
        self, origin: Float[np.ndarray, "c 3"], matrix: Float[np.ndarray, "c 3 3"], rays: Float[np.ndarray, "3 r"]
    ) -> MeshHits:
        """See `Engine`."""
        return MeshHits(*(array.numpy() for array in self._traced(origin, matrix, rays)))

    def _traced(self, origin: np.ndarray, matrix: np.ndarray, rays: np.ndarray) -> list[wp.array]:
        shape = (len(origin), rays.shape[1])
        kinds = (wp.float32, wp.int32, wp.float32, wp.float32)
        found = [wp.zeros(shape, dtype=kind, device=self._device) for kind in kinds]
        given = [self._given(origin, wp.vec3), self._given(matrix, wp.mat33), self._given(rays.T, wp.vec3)]
        wp.launch(_first, shape, [self._mesh.id, *given], found, device=self._device)
        return found

    def blocked(self, origin: Float[np.ndarray, "m 3"], direction: Float[np.ndarray, "m 3"]) -> Bool[np.ndarray, " m"]:
        """See `Engine`."""
        found = wp.zeros(len(origin), dtype=wp.int32, device=self._device)
        given = [self._mesh.id, self._given(origin, wp.vec3), self._given(direction, wp.vec3)]
        wp.launch(_any, len(origin), given, [found], device=self._device)
        return found.numpy() > 0
