"""Gates with random looks: what is painted, and where."""

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np

from e2efly.config import CameraConfig
from e2efly.courses.gates import Gates
from e2efly.courses.tracks import load_track
from e2efly.simulation.scenes.camera import look, mount
from e2efly.simulation.scenes.course import frames
from e2efly.simulation.scenes.gate_looks import KEPT_APART, SEEN, coloured, drawn, photographed
from e2efly.simulation.scenes.scene import GATE, Scene


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


def test_what_is_kept_apart_is_learned_from_nowhere() -> None:
    assert not set(SEEN.gate) & set(KEPT_APART.gate)
    assert not set(SEEN.around) & set(KEPT_APART.around)
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
