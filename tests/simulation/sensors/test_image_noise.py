"""Noise of images: mean and deviation against each formula."""

import dataclasses
import math
import zlib
from pathlib import Path
from statistics import NormalDist

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import CameraConfig, ImageNoiseConfig
from e2efly.environment import random_key
from e2efly.simulation.sensors.image_noise import (
    OF_DEPTH,
    OF_VALUES,
    OWN,
    add_image_noise,
    check,
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


def test_noise_is_normal_and_independent_between_pixels_images_and_keys() -> None:
    grey = jnp.full((50, 64, 64), 0.5)
    drawn = np.concatenate([(gaussian(random_key(seed), grey, 0.05) - 0.5) / 0.05 for seed in (0, 1)])
    ranked = np.sort(drawn.ravel())
    expected = np.vectorize(NormalDist().cdf)(ranked[::100])
    assert np.abs(np.linspace(0, 1, ranked.size)[::100] - expected).max() < 1.63 / math.sqrt(ranked.size)  # 1 %
    assert (np.abs(drawn) > 4).mean() == pytest.approx(2 * NormalDist().cdf(-4), rel=0.5)
    others = (np.roll(drawn, 1, axis) for axis in (0, 1, 2))
    apart = (drawn[50:], np.roll(drawn, 50, 0)[50:])
    for a, b in (*((drawn, other) for other in others), apart, (np.abs(apart[0]), np.abs(apart[1]))):
        assert abs(np.corrcoef(a.ravel(), b.ravel())[0, 1]) < 4 / math.sqrt(a.size)


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


@pytest.mark.parametrize("shape", [(2, 1, 1), (2, 4, 4)])
def test_a_telephoto_s_shadows_may_be_wider_than_its_image(shape: tuple[int, ...]) -> None:
    seen = np.asarray(d435i(KEY, jnp.full(shape, 2.0), 0.01))
    assert seen.shape == shape
    np.testing.assert_allclose(seen, 2.0, atol=0.05)


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


DEPTH = CameraConfig(fov=(FOV, 1.0), reach=(0.3, 8.0))
LABEL = CameraConfig("label")
ALL = ImageNoiseConfig(0.005, True, "synthetic", 0.02, 256.0, 0.01, 0.02)


def test_a_configuration_applies_its_noises_in_order_each_with_its_own_draws() -> None:
    image = flat(4.0).at[:, :20].set(0.0)
    one = {name: add_image_noise(dataclasses.replace(ImageNoiseConfig(), **{name: value}), KEY, image, DEPTH)
           for name, value in vars(ALL).items() if name not in ("speckle", "poisson", "own")}  # fmt: skip
    keys = {name: jax.random.fold_in(KEY, zlib.crc32(name.encode())) for name in vars(ALL)}
    np.testing.assert_allclose(one["d435i"], d435i(keys["d435i"], image, FOV), rtol=1e-6)
    np.testing.assert_allclose(one["redwood"], redwood(keys["redwood"], image, synthetic_distortion()), rtol=1e-6)
    chain = inverse_depth(keys["inverse_depth"], image, 0.02)
    chain = jnp.where(image > 0, gaussian(keys["gaussian"], jnp.minimum(chain / 8.0, 1.0), 0.01), 0.0)
    chain = salt_and_pepper(keys["salt_and_pepper"], chain, 0.03) * 8.0
    config = ImageNoiseConfig(inverse_depth=0.02, gaussian=0.01, salt_and_pepper=0.03)
    np.testing.assert_allclose(add_image_noise(config, KEY, image, DEPTH), jnp.where(chain < 0.3, 0.0, chain))
    assert float(jnp.std(1 / one["inverse_depth"][:, 20:])) == pytest.approx(0.005, rel=0.05)
    assert float(one["gaussian"][:, 20:].std()) == pytest.approx(0.01 * 8.0, rel=0.05)
    assert np.all(one["gaussian"][:, :20] == 0) and np.all(one["inverse_depth"][:, :20] == 0)
    assert float(jnp.mean(one["salt_and_pepper"][:, :20] == 8.0)) == pytest.approx(0.01, rel=0.3)


def test_a_noise_draws_the_same_whatever_other_noises_there_are() -> None:
    image = flat(4.0)
    alone = np.asarray(add_image_noise(ImageNoiseConfig(gaussian=0.01), KEY, image, DEPTH))
    both = np.asarray(add_image_noise(ImageNoiseConfig(gaussian=0.01, salt_and_pepper=0.1), KEY, image, DEPTH))
    changed = alone != both
    assert changed.mean() == pytest.approx(0.1, rel=0.05)
    assert set(np.unique(both[changed])) == {0.0, 8.0}
    salt = np.asarray(add_image_noise(ImageNoiseConfig(salt_and_pepper=0.1), KEY, image, DEPTH))
    np.testing.assert_array_equal(salt != image, changed)


def test_every_option_is_a_noise_in_the_order_of_the_options() -> None:
    assert list(OF_DEPTH | OF_VALUES | OWN) == list(vars(ImageNoiseConfig()))


def test_the_reach_of_the_camera_holds_after_the_noise() -> None:
    noisy = add_image_noise(ImageNoiseConfig(inverse_depth=0.3, gaussian=0.2), KEY, flat(1.0), DEPTH)
    assert np.all((noisy == 0) | ((noisy >= 0.3) & (noisy <= 8.0))) and float(noisy.max()) == 8.0
    assert np.all(add_image_noise(ImageNoiseConfig(d435i=True), KEY, flat(8.0), DEPTH) == 0)
    np.testing.assert_array_equal(add_image_noise(ImageNoiseConfig(), KEY, flat(8.0), DEPTH), flat(8.0))


def test_masks_and_colours_are_noised_as_values() -> None:
    mask, colours = jnp.zeros((2, 100, 100)), jnp.full((2, 60, 60, 3), 0.5)
    noisy = add_image_noise(ImageNoiseConfig(salt_and_pepper=0.1), KEY, mask, LABEL)
    assert float(noisy.mean()) == pytest.approx(0.05, rel=0.1) and set(np.unique(noisy)) == {0.0, 1.0}
    noisy = add_image_noise(ImageNoiseConfig(gaussian=0.05), KEY, colours, CameraConfig("rgb"))
    assert noisy.shape == colours.shape and float(noisy.std()) == pytest.approx(0.05, rel=0.03)
    assert abs(np.corrcoef(noisy[..., 0].ravel(), noisy[..., 1].ravel())[0, 1]) < 0.05


def test_strengths_are_leaves_of_one_program_and_which_noises_are_in_is_not() -> None:
    traced = []

    @jax.jit
    def noisy(config: ImageNoiseConfig, key: jax.Array, image: jax.Array) -> jax.Array:
        traced.append(config)
        return add_image_noise(config, key, image, DEPTH)

    image = flat(4.0, 24, 32)
    a, b, other = noisy(ALL, KEY, image), noisy(ALL, KEY, image), noisy(ALL, random_key(4), image)
    np.testing.assert_array_equal(a, b)
    assert not np.array_equal(a, other)
    changed = noisy(dataclasses.replace(ALL, inverse_depth=0.02), KEY, image)
    assert len(traced) == 1 and not np.array_equal(a, changed)
    assert jax.tree.structure(ALL) != jax.tree.structure(dataclasses.replace(ALL, speckle=None))
    eager = np.asarray(add_image_noise(ALL, KEY, image, DEPTH))
    assert np.mean(np.isclose(a, eager, rtol=1e-5)) > 0.99  # rounded disparities may fall to the other side


@pytest.mark.parametrize(
    ("config", "camera", "said"),
    [
        ({"inverse_depth": 0.1}, LABEL, "camera.noise.inverse_depth is 0.1; accepted: None where"),
        ({"d435i": True}, CameraConfig("range"), "camera.noise.d435i is on; accepted with camera.sees depth"),
        ({"redwood": "synthetic"}, CameraConfig(projection="spherical"), "camera.noise.redwood is on; accepted with"),
        ({"redwood": "nowhere.npy"}, DEPTH, "camera.noise.redwood is 'nowhere.npy': .*accepted: synthetic, or a .npy"),
        ({"gaussian": 0.1}, CameraConfig("normal"), "camera.noise.gaussian is on; accepted where camera.sees is"),
    ],
)
def test_bad_noise_is_named(config: dict, camera: CameraConfig, said: str) -> None:
    check(ALL, DEPTH)
    with pytest.raises(ValueError, match=said):
        check(ImageNoiseConfig(**config), camera)


def test_a_table_of_one_s_own(tmp_path: Path) -> None:
    good, small, zero = (str(tmp_path / f"{name}.npy") for name in ("good", "small", "zero"))
    np.save(good, np.full((80, 80, 5), 0.8))
    np.save(small, np.ones((80, 80)))
    np.save(zero, np.zeros((80, 80, 5)))
    noisy = add_image_noise(ImageNoiseConfig(redwood=good), KEY, flat(2.0), DEPTH)
    assert float(noisy.mean()) == pytest.approx(2.5, rel=0.01)
    for path, said in ((small, r"of \(80, 80\); accepted"), (zero, "not positive; accepted")):
        with pytest.raises(ValueError, match=said):
            check(ImageNoiseConfig(redwood=path), DEPTH)


def test_a_noise_of_ones_own_comes_last(tmp_path: Path) -> None:
    file = tmp_path / "mine.py"
    file.write_text(
        "import jax, jax.numpy as jnp\n"
        "def lines(key, image, camera):\n"
        "    lost = jax.random.bernoulli(key, 0.5, (image.shape[0], image.shape[1], 1))\n"
        "    return jnp.where(lost, 0.0, image)\n"
        "def smaller(key, image, camera):\n    return image[:, 1:]\n"
        "def broken(key, image, camera):\n    return image + camera.focus\n"
    )
    config = ImageNoiseConfig(own=f"{file}:lines")
    check(config, DEPTH)
    noisy = np.asarray(add_image_noise(config, KEY, flat(4.0), DEPTH))
    whole = (noisy == 0).all(-1)
    assert 0.3 < whole.mean() < 0.7
    np.testing.assert_allclose(noisy[~whole], 4.0, rtol=1e-6)
    for name, message in (
        ("smaller", r"mine.py:smaller, which returns .*; accepted: an image of \(2, 64, 64\)"),
        ("broken", "mine.py:broken, which fails: AttributeError"),
        ("absent", "unknown name in .*mine.py 'absent'"),
    ):
        with pytest.raises(ValueError, match=message):
            check(ImageNoiseConfig(own=f"{file}:{name}"), DEPTH)
