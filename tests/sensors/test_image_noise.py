"""Noise of images: mean and deviation against each formula."""

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.env import random_key
from e2efly.sensors.image_noise import (
    d435i,
    gaussian,
    inverse_depth,
    poisson,
    redwood,
    salt_and_pepper,
    speckle,
    synthetic_distortion,
)

KEY = random_key(3)
GREY = jnp.full((20, 100, 100), 0.5)
FOV = math.radians(87)


def flat(depth: float, height: int = 120, width: int = 160) -> jax.Array:
    return jnp.full((4, height, width), depth)


def test_gaussian_and_speckle() -> None:
    added, scaled = gaussian(KEY, GREY, 0.05, 0.02), speckle(KEY, GREY, 0.1, 0.04)
    assert float(added.mean()) == pytest.approx(0.52, abs=1e-3) and float(added.std()) == pytest.approx(0.05, rel=0.02)
    assert float(scaled.mean()) == pytest.approx(0.52, abs=1e-3) and float(scaled.std()) == pytest.approx(
        0.05, rel=0.02
    )
    assert np.all(speckle(KEY, jnp.zeros((1, 9, 9)), 0.5) == 0)
    for image in (gaussian(KEY, GREY, 3.0), speckle(KEY, GREY, 3.0)):
        assert image.min() == 0 and image.max() == 1


def test_salt_and_pepper() -> None:
    noisy = salt_and_pepper(KEY, GREY, 0.06, 0.25)
    assert float(jnp.mean(noisy == 1)) == pytest.approx(0.015, rel=0.05)
    assert float(jnp.mean(noisy == 0)) == pytest.approx(0.045, rel=0.05)
    assert float(jnp.mean(noisy == 0.5)) == pytest.approx(0.94, rel=0.005)


def test_poisson_has_the_variance_of_counts() -> None:
    noisy = poisson(KEY, GREY, 200.0)
    assert float(noisy.mean()) == pytest.approx(0.5, abs=1e-3)
    assert float(noisy.var()) == pytest.approx(0.5 / 256, rel=0.03)
    np.testing.assert_allclose(noisy * 256, np.rint(noisy * 256), atol=1e-3)


def test_inverse_depth_is_noise_of_the_disparity_and_keeps_holes() -> None:
    noisy = inverse_depth(KEY, flat(4.0), 0.01)
    assert float(jnp.std(1 / noisy)) == pytest.approx(0.01, rel=0.03)
    assert float(jnp.mean(1 / noisy)) == pytest.approx(0.25, abs=2e-4)
    assert np.all(inverse_depth(KEY, flat(0.0), 0.01) == 0)


@pytest.mark.parametrize("depth", [1.0, 3.0])
def test_d435i_is_noisier_with_the_square_of_the_depth(depth: float) -> None:
    noisy = d435i(KEY, flat(depth), FOV)
    focal = 848 / 2 / math.tan(FOV / 2)
    assert float(noisy.std()) == pytest.approx(depth**2 * 0.08 / (focal * 0.05), rel=0.03)
    assert float(noisy.mean()) == pytest.approx(depth, rel=1e-3)


def test_d435i_has_a_range_and_shadows_beside_what_is_near() -> None:
    for depth in (0.0, 0.2, 12.0):
        assert np.all(d435i(KEY, flat(depth), FOV) == 0)
    scene = flat(4.0).at[:, :, 80:].set(0.5)  # an edge: to its left a strip is hidden from the other imager
    hidden = np.asarray(d435i(KEY, scene, FOV) == 0)
    width = 160 / 2 / math.tan(FOV / 2) * 0.05 * (1 / 0.5 - 1 / 4.0)
    strip = hidden[:, :, 60:80].sum(axis=2)
    np.testing.assert_allclose(strip, round(width), atol=1)
    assert not hidden[:, :, :60].any() and not hidden[:, :, 80:].any()


def test_redwood_rounds_the_disparity_and_drops_what_is_far() -> None:
    plain = np.ones((80, 80, 5), np.float32)
    noisy = np.asarray(redwood(KEY, flat(2.0, 480, 640), plain))
    eighths = 35.130 / noisy * 8
    np.testing.assert_allclose(eighths, np.rint(eighths), atol=1e-3)
    assert np.mean(35.130 / noisy) == pytest.approx(35.130 / 2.0, abs=5e-3)  # it is rounded
    above = 0.5 * math.erfc((140.5 - 8 * 35.130 / 2.0) / (8 * 0.027778) / math.sqrt(2))  # 141 eighths, else 140
    assert np.std(eighths) == pytest.approx(math.sqrt(above * (1 - above)), rel=0.03)
    assert np.all(np.asarray(redwood(KEY, flat(10.5), plain)) == 0) and np.all(
        np.asarray(redwood(KEY, flat(0.0), plain)) == 0
    )


def test_redwood_divides_by_the_distortion_at_the_pixel_and_the_depth() -> None:
    table = np.ones((80, 80, 5), np.float32)
    table[:40, :, 1] = 0.9  # the left half of the image, 3 m
    noisy = np.asarray(redwood(KEY, flat(3.0, 480, 640), table))
    assert noisy[:, :, :300].mean() == pytest.approx(3.0 / 0.9, rel=2e-3)
    assert noisy[:, :, 340:].mean() == pytest.approx(3.0, rel=2e-3)
    halfway = np.asarray(redwood(KEY, flat(2.0, 480, 640), table))[:, :, :300].mean()
    assert halfway == pytest.approx(2.0 / 0.95, rel=2e-3)


def test_redwood_jitters_pixels_more_the_farther_they_are() -> None:
    step = jnp.where(jnp.arange(640) < 320, 8.0, 7.0) * jnp.ones((2, 480, 1))
    noisy = np.asarray(redwood(KEY, step, np.ones((80, 80, 5), np.float32)))
    mixed = (noisy[:, :, 310:330] > 7.5).mean(axis=(0, 1))
    assert mixed[0] > 0.95 and mixed[-1] < 0.05 and np.sum((mixed > 0.05) & (mixed < 0.95)) >= 4


def test_the_synthetic_distortion_has_the_range_of_the_measured_one() -> None:
    table = synthetic_distortion()
    assert table.shape == (80, 80, 5) and table.mean() == pytest.approx(1.0009, abs=2e-3)
    assert 0.81 <= table.min() < 0.95 and 1.03 < table.max() <= 1.11
    assert np.abs(np.diff(table, axis=0)).max() < 0.02


def test_seeds_and_single_programs() -> None:
    for noise in (
        lambda k: gaussian(k, GREY, 0.1),
        lambda k: d435i(k, flat(2.0), FOV),
        lambda k: poisson(k, GREY, 256.0),
    ):
        f = jax.jit(noise)
        np.testing.assert_array_equal(f(KEY), f(KEY))
        assert not np.array_equal(f(KEY), f(random_key(4)))
