"""The engine of a scene: Embree on a CPU, Warp on CUDA."""

from weakref import WeakKeyDictionary

import jax

from e2efly.simulation.scenes.meshes.engine import Engine, needed
from e2efly.simulation.scenes.meshes.mesh_scene import MeshScene

_READY: WeakKeyDictionary[MeshScene, Engine] = WeakKeyDictionary()


def engine(scene: MeshScene) -> Engine:
    """The engine for the device on which JAX computes. It is made once per scene.

    Raises:
        ValueError: naming the package that is missing, and how to install it.
    """
    if scene not in _READY:
        cuda = jax.default_backend() == "gpu"
        with needed("mesh-cuda" if cuda else "mesh"):
            if cuda:
                from e2efly.simulation.scenes.meshes.warp import Warp as Kind
            else:
                from e2efly.simulation.scenes.meshes.embree import Embree as Kind
        _READY[scene] = Kind(scene.triangles)
    return _READY[scene]
