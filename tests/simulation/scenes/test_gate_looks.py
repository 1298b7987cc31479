"""Gates with random looks: what is painted, and where."""

import dataclasses
from itertools import combinations

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.config import CameraConfig
from e2efly.courses.gates import Gates
from e2efly.courses.tracks import load_track
from e2efly.simulation.scenes.camera import look, mount
from e2efly.simulation.scenes.course import frames
from e2efly.simulation.scenes.gate_looks import KEPT_APART, SEEN, TRIED, coloured, drawn, photographed
from e2efly.simulation.scenes.scene import GATE, Scene
from e2efly.simulation.scenes.textures import texture


def test_a_look_paints_its_gates_where_the_mask_has_them() -> None:
    camera = CameraConfig("mask", 64, 48, of="gate", fov=(1.5, 1.2))
    gates = Gates.of(load_track("s_shaped"))
    scene, still = Scene.of({"gate": frames(gates, 1)}, 1), jnp.array([[1.0, 0, 0, 0]])
    where = scene, mount(camera, 1), jnp.asarray(gates.position[:1]) - jnp.array([2.0, 0.1, 0.0]), still
    one = drawn(jax.random.key(0), 1, KEPT_APART)
    other = dataclasses.replace(one, colour=one.colour.at[:, 3].set((one.colour[:, 3] + 0.5) % 1))
    mask = np.asarray(look(camera, *where)) > 0
    colours, labels = coloured(camera, *where, one)
    repainted, _ = coloured(camera, *where, other)
    assert 0.02 < mask.mean() < 0.9
    np.testing.assert_array_equal(np.asarray(labels) == GATE, mask)
    np.testing.assert_array_equal(np.abs(np.asarray(colours - repainted)).max(-1) > 0, mask)


def test_gates_of_known_paint_have_its_colours_in_every_world() -> None:
    paint = ((0.9, 0.1, 0.1), (1.0, 1.0, 0.9))
    own = drawn(jax.random.key(2), 5, dataclasses.replace(SEEN, paint=paint))
    np.testing.assert_allclose(own.colour[:, 3, :2], np.tile(paint, (5, 1, 1)), atol=1e-6)
    assert np.ptp(np.asarray(own.colour[:, 0, 0]), axis=0).min() > 0.05


def test_each_texture_is_another_one() -> None:
    x, y = np.meshgrid(np.linspace(0, 3, 40), np.linspace(0, 3, 40))
    kinds = {kind for family in (SEEN, TRIED, KEPT_APART) for kind in (*family.gate, *family.around)}
    number = jnp.array([0.3, 0.2, 0.5, 0.7])
    shares = {k: np.asarray(texture(jnp.int32(k), jnp.asarray(x), jnp.asarray(y), number)) for k in sorted(kinds)}
    assert all(share.min() >= 0 and share.max() <= 1 for share in shares.values())
    assert all(np.abs(shares[a] - shares[b]).mean() > 0.03 for a, b in combinations(shares, 2))


def test_what_is_kept_apart_is_learned_from_nowhere() -> None:
    for one, other in combinations((SEEN, TRIED, KEPT_APART), 2):
        assert not set(one.gate) & set(other.gate)
        assert not set(one.around) & set(other.around)
    assert SEEN.sun[0] >= KEPT_APART.sun[1]
    assert SEEN.strength[1] <= KEPT_APART.strength[0]
    assert SEEN.tint[1] <= KEPT_APART.tint[0]


def test_blur_and_smear_leave_an_edge_where_it_is() -> None:
    drawn_look = drawn(jax.random.key(1), 1, SEEN)
    soft = dataclasses.replace(
        drawn_look, noise=0 * drawn_look.noise, motion=0 * drawn_look.motion + 9.0, blur=0 * drawn_look.blur + 2.0
    )
    edge = np.zeros((20, 40, 3), np.float32)
    edge[:, 20:] = 1.0
    for seed in range(5):
        image = photographed(edge, soft, 1.0, np.random.default_rng(seed))
        row = image[10, :, 0].astype(float)
        assert abs(np.interp(127.5, row[10:30], np.arange(10, 30)) - 19.5) < 0.05
        assert (row == row[0]).sum() < 20
