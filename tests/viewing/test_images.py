"""Pictures of sensors: their numbers against geometry, their colours, and that they can be drawn."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from docs.noise_plots import plot_depth_noise, plot_image_noise, plot_imu

from e2efly.config import CameraConfig, ImuConfig
from e2efly.environment import random_key
from e2efly.simulation.scenes.scene import COLOURS, GROUND, Scene
from e2efly.viewing.cloud import cloud
from e2efly.viewing.image_plots import DISTANCE, ImageSight, exposure, in_colours, look_around
from tests.viewing.test_plots import check_png

CAMERA = CameraConfig(width=32, height=16, fov=(1.4, 0.8), pitch=0.5, reach=(0.3, 6.0))


@pytest.fixture(scope="module")
def sight() -> ImageSight:
    """Of the bare ground from 2 m, nose down by 0.5 rad."""
    return look_around(CAMERA, Scene.of({}, 1), 0.0, np.array([1.0, 0.0, 2.0]), np.array([1.0, 0.0, 0.0, 0.0]))


def test_range_runs_along_the_rays_and_depth_along_the_axis(sight: ImageSight) -> None:
    np.testing.assert_allclose(np.linalg.norm(sight.directions, axis=-1), 1.0, rtol=1e-5)
    down = np.where(sight.directions[..., 2] < -0.05, -2.0 / sight.directions[..., 2], np.inf)
    np.testing.assert_allclose(sight.images["range"], np.minimum(down, 6.0), rtol=1e-4)
    ahead = sight.directions @ [np.cos(0.5), 0.0, -np.sin(0.5)]
    np.testing.assert_allclose(sight.images["depth"], np.minimum(down * ahead, 6.0), rtol=1e-4)
    np.testing.assert_allclose(cloud(sight)[:, 2], 0.0, atol=1e-4)


def test_colours_of_each_sensor() -> None:
    depth = in_colours("depth", np.array([[0.0, 3.0, 6.0]]), 6.0)[0]
    np.testing.assert_allclose(depth[0], [0.741] * 3, atol=1e-3)  # a hole is grey
    np.testing.assert_allclose(depth[1:], np.array(DISTANCE([0.5, 1.0]))[:, :3], atol=0.02)
    np.testing.assert_array_equal(in_colours("label", np.array([[GROUND]]), 6.0)[0, 0], COLOURS[GROUND])
    np.testing.assert_allclose(
        in_colours("normal", np.array([[[0, 0, 1.0], [0, 0, 0]]]), 6.0)[0], [[0.5, 0.5, 1], [1] * 3]
    )
    assert len(np.unique(in_colours("instance", np.arange(12)[None], 6.0)[0], axis=0)) == 12


@pytest.mark.whole
def test_pictures_of_noise(tmp_path: Path, sight: ImageSight) -> None:
    plot_depth_noise(sight, random_key(0), tmp_path / "depth.png")
    plot_image_noise(sight, np.ones((16, 32), np.float32), random_key(0), tmp_path / "image.png")
    plot_imu(dataclasses.replace(ImuConfig(), gyro_bias=1e-3), random_key(0), tmp_path / "imu.png", 30.0)
    for name in ("depth", "image", "imu"):
        assert (tmp_path / f"{name}.png").stat().st_size > 10_000
    check_png(tmp_path / "imu.png", (400, 600))


def test_a_dark_world_is_exposed_for_longer_and_a_bright_one_is_not() -> None:
    dark, bright = np.full((4, 4, 3), 0.2), np.full((4, 4, 3), 0.8)
    assert exposure([dark]) == pytest.approx(2.0)
    assert exposure([dark, bright]) == 1.0
    assert exposure([0 * dark]) == 3.0
    place, level = np.array([1.0, 0.0, 2.0]), np.array([1.0, 0.0, 0.0, 0.0])
    usual, longer = (
        look_around(CAMERA, Scene.of({}, 1), 0.0, place, level, ("rgb",), exposed).images["rgb"]
        for exposed in (1.0, 2.0)
    )
    np.testing.assert_allclose(longer, np.minimum(2 * usual, 1.0), atol=1e-6)
