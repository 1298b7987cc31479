"""Cameras in the environment: how old an image is, how often it is new, whose world it shows."""

import dataclasses
import math
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from e2efly.config import CameraConfig, EnvConfig, ImageNoiseConfig, RewardConfig
from e2efly.environment import Env, EnvState, random_key
from e2efly.tasks.hover import HoverConfig
from e2efly.tasks.land_visual import LandVisualConfig

N = 3
DOWN = CameraConfig("depth", 8, 8, fov=(0.2, 0.2), pitch=math.pi / 2, reach=(0.0, 50.0))
HIGH = HoverConfig(target=(0.0, 0.0, 10.0), position=0.5, velocity=0.0, tilt=0.0, body_rate=0.0, fence=100.0)


def env_with(*cameras: CameraConfig, task: Any = HIGH, **config: Any) -> Env:
    return Env.of(task, RewardConfig({"prog2": 1.0}), EnvConfig(cameras=cameras, **config))


def fly(env: Env, steps: int, thrust: float = 1.0) -> list[EnvState]:
    """States of a climb: every motor command at its most."""
    step = jax.jit(lambda env, state: env.step(state, jnp.tile(jnp.array([thrust, 0.0, 0.0, 0.0]), (N, 1)))[0])
    states = [jax.jit(Env.reset, static_argnums=2)(env, random_key(0), N)[0]]
    for _ in range(steps):
        states.append(step(env, states[-1]))
    return states


def heights(states: list[EnvState]) -> np.ndarray:
    return np.stack([np.asarray(s.vehicle.position[:, 2]) for s in states])


def seen(states: list[EnvState]) -> np.ndarray:
    """What a camera straight down says of the height."""
    return np.stack([np.asarray(s.images[0]).mean(axis=(1, 2)) for s in states])


def test_an_image_shows_the_state_that_is_reached() -> None:
    states = fly(env_with(DOWN), 6)
    np.testing.assert_allclose(seen(states), heights(states), rtol=2e-3)


def test_a_late_image_shows_the_state_of_a_while_ago() -> None:
    late = dataclasses.replace(DOWN, latency=(1.5 / 30, 1.5 / 30))
    states = fly(env_with(late), 10)
    z = heights(states)
    np.testing.assert_allclose(seen(states)[2:], (z[1:-1] + z[:-2])[:] / 2, rtol=2e-3)
    np.testing.assert_allclose(seen(states)[0], z[0], rtol=2e-3)  # before the start it stood there


def test_a_slow_camera_holds_its_image() -> None:
    states = fly(env_with(dataclasses.replace(DOWN, rate=10.0)), 7)
    shown, z = seen(states), heights(states)
    for tick in range(8):
        np.testing.assert_allclose(shown[tick], z[tick - tick % 3], rtol=2e-3)


def test_a_new_episode_begins_with_an_image_of_its_own() -> None:
    env = env_with(dataclasses.replace(DOWN, rate=10.0), task=dataclasses.replace(HIGH, episode_s=4 / 30, hold_s=0.0))
    states = fly(env, 4)  # the episodes end at tick 4, between two images
    np.testing.assert_allclose(seen(states)[4], heights(states)[4], rtol=2e-3)
    assert np.all(np.abs(seen(states)[4] - seen(states)[3]) > 1e-3)


def test_cameras_sit_differently_in_every_episode_where_they_are_told_to() -> None:
    env = env_with(dataclasses.replace(DOWN, angle_spread=0.3, fov_spread=0.1, position_spread=0.05))
    mount = fly(env, 0)[0].eyes[0].mount
    assert np.ptp(np.asarray(mount.matrix), axis=0).max() > 0.01 and np.ptp(np.asarray(mount.offset), axis=0).max() > 0
    same = fly(env_with(DOWN), 0)[0].eyes[0].mount
    assert np.ptp(np.asarray(same.matrix), axis=0).max() == 0


def test_colours_differ_between_episodes_where_they_are_told_to() -> None:
    pad = LandVisualConfig(sideways=0.0, height=(0.8, 0.8), velocity=0.0)
    camera = CameraConfig("rgb", 8, 8, fov=(0.2, 0.2), pitch=math.pi / 2)
    same, mixed = (fly(env_with(c, task=pad), 0)[0].images[0] for c in (
        camera, dataclasses.replace(camera, colour_spread=0.4)
    ))  # fmt: skip
    assert np.ptp(np.asarray(same[:, 4, 4]), axis=0).max() < 1e-3
    assert np.ptp(np.asarray(mixed[:, 4, 4]), axis=0).min() > 0.05


@pytest.mark.whole
def test_images_have_no_gradient_and_let_others_through() -> None:
    env = env_with(DOWN)
    state, _ = jax.jit(Env.reset, static_argnums=2)(env, random_key(0), N)

    def loss(action: jax.Array) -> tuple[jax.Array, jax.Array]:
        after, out = env.step(env.step(state, action)[0], action)
        return jnp.sum(after.images[0]), jnp.sum(out.reward)

    by_image, by_reward = jax.jit(jax.jacrev(loss))(jnp.zeros((N, 4)))
    assert np.all(np.asarray(by_image) == 0) and np.abs(np.asarray(by_reward)).max() > 0


@pytest.mark.whole
def test_noise_comes_on_in_a_share_of_the_episodes_and_stays() -> None:
    n = 400
    noisy = dataclasses.replace(DOWN, noise=ImageNoiseConfig(salt_and_pepper=0.5), noise_share=0.3)
    env, clean = env_with(noisy), env_with(DOWN)
    state, plain = (jax.jit(e.reset, static_argnums=1)(random_key(0), n)[0] for e in (env, clean))
    first = np.any(np.asarray(state.images[0] != plain.images[0]), axis=(1, 2))
    assert 0.2 < first.mean() < 0.4
    step = jax.jit(lambda env, state: env.step(state, jnp.zeros((n, 4)))[0])
    later = np.any(np.asarray(step(env, state).images[0] != step(clean, plain).images[0]), axis=(1, 2))
    np.testing.assert_array_equal(first, later)


def test_a_mask_shows_the_pad_and_noise_its_salt() -> None:
    camera = CameraConfig("mask", 16, 16, fov=(math.pi / 2, math.pi / 2), pitch=math.pi / 2)
    task = LandVisualConfig(sideways=0.0, velocity=0.0, height=(1.0, 1.0), pad_size=(0.5, 0.5))
    state = fly(env_with(camera, task=task), 0)[0]
    image = np.asarray(state.images[0])
    assert set(np.unique(image)) == {0.0, 1.0}
    middle = image[:, 7:9, 7:9]
    assert middle.min() == 1.0 and image[:, :4].max() == 0.0
    noisy = dataclasses.replace(camera, noise=ImageNoiseConfig(salt_and_pepper=0.2))
    salted = np.asarray(fly(env_with(noisy, task=task), 0)[0].images[0])
    assert 0.03 < np.mean(salted != image) < 0.2
    again = np.asarray(fly(env_with(noisy, task=task), 0)[0].images[0])
    np.testing.assert_array_equal(salted, again)


@pytest.mark.parametrize(
    ("camera", "message"),
    [
        (dataclasses.replace(DOWN, rate=7.0), r"camera.rate is 7.0; accepted: the control rate, 30 Hz"),
        (dataclasses.replace(DOWN, of="gait", sees="mask"), r"camera.of: unknown class 'gait'.*gate"),
        (dataclasses.replace(DOWN, reach=(2.0, 1.0)), r"camera.reach is \(2.0, 1.0\)"),
        (dataclasses.replace(DOWN, noise=ImageNoiseConfig(gaussian=-1.0)), r"camera.noise.gaussian is -1.0"),
    ],
)
def test_a_bad_camera_is_refused_by_name(camera: CameraConfig, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        env_with(camera)
