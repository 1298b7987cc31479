"""Another engine's word on triangles: the kernels that run on CUDA, on Warp's CPU device, beside Embree."""

import numpy as np
import pytest

from e2efly.simulation.scenes.meshes.embree import Embree
from e2efly.simulation.scenes.meshes.load import load_mesh_scene
from e2efly.simulation.scenes.meshes.warp import Warp


@pytest.mark.whole
def test_warp_and_embree_meet_the_same() -> None:
    triangles = load_mesh_scene("garage").triangles
    embree, warp = Embree(triangles), Warp(triangles, "cpu")
    rng = np.random.default_rng(0)
    origin = rng.uniform([-20, -12, 0.5], [20, 12, 2.5], (8, 3)).astype(np.float32)
    matrix = rng.standard_normal((8, 3, 3)).astype(np.float32)
    rays = rng.standard_normal((3, 500)).astype(np.float32)
    theirs, mine = embree.hits(origin, matrix, rays), warp.hits(origin, matrix, rays)
    same = theirs.face == mine.face
    assert np.mean(same) > 0.995 and 0.5 < np.mean(theirs.face >= 0) < 1
    np.testing.assert_allclose(theirs.depth[same], mine.depth[same], rtol=1e-4)
    met = same & (mine.face >= 0)
    np.testing.assert_allclose(theirs.u[met], mine.u[met], atol=1e-2)
    np.testing.assert_allclose(theirs.v[met], mine.v[met], atol=1e-2)
    np.testing.assert_array_equal(warp.depth(origin, matrix, rays), mine.depth)
    sun = np.tile(np.float32([0.3, 0.2, 0.9]), (8, 1))
    np.testing.assert_array_equal(embree.blocked(origin, sun), warp.blocked(origin, sun))
