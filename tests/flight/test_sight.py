"""Which images a policy may act on: age, order, size, content, and where the camera points."""

import dataclasses
import math

import numpy as np
import pytest

import e2efly
from e2efly.flight.sight.image_source import Frame
from e2efly.flight.sight.quality import FIELD, FROZEN, LEVEL, MOUNTED, TURNING, WRONG, SeenImages, see
from e2efly.policy.odometry import Odometry

CAMERA = e2efly.load_policy("avoid").contract.images[0]
RNG = np.random.default_rng(0)


def image(scale: float = 1.0) -> np.ndarray:
    return (scale * RNG.uniform(1.0, 5.0, CAMERA.shape)).astype(np.float32)


def level(height: float, pitch: float = 0.0) -> Odometry:
    quaternion = np.array([math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0])
    return Odometry(0.0, np.array([0.0, 0.0, height]), np.zeros(3), quaternion, np.zeros(3))


def ground(height: float, pitch: float = 0.0, field: float = 1.0) -> np.ndarray:
    """A depth image of level ground, by the angles of its rows; what is farther than the reach is the reach."""
    down = field * math.tan(CAMERA.fov_rad[1] / 2) * (1 - 2 * (np.arange(CAMERA.height) + 0.5) / CAMERA.height)
    tilt = CAMERA.pitch_rad + pitch
    fall = math.sin(tilt) - down * math.cos(tilt)  # metres of height per metre of depth
    depth = np.where(fall > 1e-3, height / np.maximum(fall, 1e-3), np.inf)
    return np.tile(np.minimum(depth, CAMERA.reach_m[1])[:, None], (1, CAMERA.width)).astype(np.float32)


def test_fresh_changing_images_are_flown_by_until_they_are_old() -> None:
    seen = SeenImages(CAMERA)
    assert seen.problem(0.0) == "image 'image_0': none came yet"
    for k in range(5):
        seen = see(seen, [Frame(0.03 * k, image())], 0.03 * k + 0.01)
        assert seen.problem(0.03 * k + 0.01) is None
    assert seen.problem(0.12 + seen.oldest) is None
    late = seen.problem(0.12 + seen.oldest + 0.01)
    assert f"accepted: at most {1e3 * seen.oldest:.0f} ms" in late
    assert seen.oldest == pytest.approx(CAMERA.latency_range_s[1] + 1 / CAMERA.rate_hz + 0.05)


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        (Frame(0.1, image()[:-1]), "has shape (11, 32) and type float32; accepted"),
        (Frame(0.1, image().astype(str)), "and type <U32; accepted"),
        (Frame(0.1, 100 * image()), "accepted: numbers in [0, 10]"),
        (Frame(0.1, image() * np.nan), "has the value nan"),
        (Frame(0.2, image()), "was exposed 100 ms from now; accepted: times by this machine's clock"),
        (Frame(-0.5, image()), "was exposed 500 ms before the one before; accepted: rising times"),
        (Frame(0.0, image()), "was exposed 0 ms before the one before"),
        (Frame(0.1, 0 * image()), "shows nothing: holes everywhere"),
    ],
)
def test_an_image_that_cannot_be_believed_is_named_at_once_and_forgiven_later(frame: Frame, said: str) -> None:
    seen = see(SeenImages(CAMERA), [Frame(0.0, image())], 0.0)
    bad = see(seen, [frame], 0.1)
    problem = bad.problem(0.1)
    assert problem.startswith("image 'image_0': ")
    assert said in problem
    assert see(bad, [Frame(0.11, image())], 0.11).problem(0.11) is None


def test_frozen_images_are_found_but_not_an_empty_sky() -> None:
    still, sky = image(), np.full(CAMERA.shape, 10.0, np.float32)
    seen, open_sky = SeenImages(CAMERA), SeenImages(CAMERA)
    for k in range(FROZEN):
        assert k == 0 or seen.problem(0.03 * k) is None
        seen = see(seen, [Frame(0.03 * k, still)], 0.03 * k)
        open_sky = see(open_sky, [Frame(0.03 * k, sky)], 0.03 * k)
    now = 0.03 * (FROZEN - 1)
    assert seen.problem(now) == f"image 'image_0': frozen: {FROZEN} equal images in a row"
    assert open_sky.problem(now) is None
    mask = dataclasses.replace(CAMERA, sees="mask", of="pad", encoding="none")
    away = SeenImages(mask)
    for k in range(10):  # a mask without its object is always the same
        away = see(away, [Frame(0.03 * k, np.zeros(mask.shape, np.float32))], 0.03 * k)
    assert away.problem(0.27) is None


@pytest.mark.parametrize(("height", "pitch"), [(0.3, 0.0), (0.4, 0.0), (0.8, 0.2), (1.5, 0.2)])
def test_a_camera_that_hangs_upside_down_sees_farther_than_the_ground(height: float, pitch: float) -> None:
    right, wrong, near = SeenImages(CAMERA), SeenImages(CAMERA), SeenImages(CAMERA)
    for k in range(WRONG):
        noise = (1 + 0.01 * RNG.standard_normal(CAMERA.shape)).astype(np.float32)
        picture = np.clip(ground(height, pitch) * noise, 0, 10)
        now, pose = 0.03 * k, level(height, pitch)
        right = see(right, [Frame(now, picture)], now, pose)
        wrong = see(wrong, [Frame(now, picture[::-1].copy())], now, pose)
        near = see(near, [Frame(now, np.minimum(picture[::-1], 1.0))], now, pose)  # a wall before it
    assert right.problem(now) is None
    assert near.problem(now) is None
    problem = wrong.problem(now)
    assert "sees farther than the ground (upside down?)" in problem
    # nothing is said by a vehicle that turns, that is on the ground, or whose pose is not known
    spinning = dataclasses.replace(level(height), body_rate=np.array([3.0, 0, 0]))
    for pose in (None, spinning, level(0.05)):
        quiet = SeenImages(CAMERA)
        for k in range(WRONG):
            quiet = see(quiet, [Frame(0.03 * k, (1 - 0.001 * k) * ground(height)[::-1])], 0.03 * k, pose)
        assert quiet.problem(0.03 * (WRONG - 1)) is None


@pytest.mark.parametrize("height", [0.8, 1.2, 1.6])
def test_a_camera_as_in_the_training_never_sees_farther_than_the_ground(height: float) -> None:
    """Off its mount, with a smaller field of view, and with images older than the pose of a vehicle that turns: at each
    attitude, as high as in a room.
    """
    for pitch in np.linspace(-LEVEL, LEVEL, 41):
        for rate in (-TURNING, -0.4, 0.0, 0.4, TURNING):
            pose = dataclasses.replace(level(height, pitch), body_rate=np.array([0.0, rate, 0.0]))
            for age in (0.0, 0.034, CAMERA.latency_range_s[1]):
                picture = ground(height, pitch - rate * age - MOUNTED, 1 - FIELD)
                assert see(SeenImages(CAMERA), [Frame(0.0, picture)], age, pose).wrong == 0
