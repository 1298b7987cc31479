"""A policy's images and memory, as whoever flies it hands them over: what does not fit is refused by name."""

import dataclasses
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from e2efly.commands.fly import Fly
from e2efly.commands.fly import run as fly_command
from e2efly.config import CameraConfig, EnvConfig, NetworkConfig
from e2efly.environment import Env
from e2efly.learning.networks import Actor
from e2efly.learning.onnx_export import contract_of, export_policy
from e2efly.policy.contract import Contract
from e2efly.policy.images import Image
from e2efly.policy.loader import Policy, load_policy
from e2efly.policy.odometry import Odometry
from e2efly.policy.runtime import Runtime, act, begin
from e2efly.runs import presets
from e2efly.tasks.route import course_for
from e2efly.vehicles.loading import load_vehicle
from tests.policy.test_contract import EXAMPLE

VEHICLE = load_vehicle("vis_r")
LEVEL = np.array([0.0, 0, 0, 1, *[0] * 17], np.float32)


def make(path: Path, cameras: tuple[CameraConfig, ...], recurrent: int) -> Path:
    network = NetworkConfig((8,), pool=(2, 2), encoder=(4,), recurrent=recurrent)
    config = dataclasses.replace(presets.preset("hover", "ppo"), env=EnvConfig(cameras=cameras), network=network)
    env = Env.of(config.task, config.reward, config.env)
    actor = Actor.of(env.fields, cameras, network)
    export_policy(path, actor.init(np.random.default_rng(0), np.asarray(env.hover)), actor, contract_of(env, config))
    return path


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A policy that sees depth and colours, and remembers."""
    cameras = CameraConfig("depth", width=4, height=2, reach=(0.2, 5.0)), CameraConfig("rgb", width=2, height=2)
    return make(tmp_path_factory.mktemp("seeing") / "policy.onnx", cameras, recurrent=3)


@pytest.fixture(scope="module")
def policy(path: Path) -> Policy:
    return load_policy(path)


@pytest.mark.parametrize(
    ("pitch", "said"),
    [
        (-0.35, "tilted 20 degrees up"),
        (0.2, "tilted 11 degrees down"),
        (-0.001, "looks straight ahead"),
        (np.pi / 2, "looks straight down"),
        (-np.pi / 2, "looks straight up"),
        (2.0, "tilted 115 degrees down"),
    ],
)
def test_a_mount_is_told_in_words(policy: Policy, pitch: float, said: str) -> None:
    image = policy.contract.images[0]
    told = dataclasses.replace(image, pitch_rad=pitch, latency_range_s=(0.0, 0.05)).mount
    assert told == (
        f"{said}; in the centre of mass; 87 x 58 degrees (pinhole), 4 x 2 pixels of depth; 30 Hz, 0 to 50 ms old"
    )
    elsewhere = dataclasses.replace(image, position_m=(0.1, -0.02, 0.03)).mount
    assert "; +10.0 cm ahead, -2.0 cm left and +3.0 cm above; " in elsewhere


def images(n: int | None = None) -> list[np.ndarray]:
    lead = () if n is None else (n,)
    return [np.full((*lead, 2, 4), 2.0), np.full((*lead, 2, 2, 3), 0.5)]


def test_one_and_many_act_alike(policy: Policy) -> None:
    action, memory = policy.act(LEVEL, images())
    assert (action.shape, memory.shape, memory.dtype) == ((4,), (3,), np.float32)
    actions, memories = policy.act(np.stack([LEVEL] * 2), images(2), np.stack([memory, np.zeros(3)]))
    np.testing.assert_allclose(actions[1], action, atol=1e-6)
    np.testing.assert_allclose(memories[0], policy.act(LEVEL, images(), memory)[1], atol=1e-6)
    assert np.abs(memories[0] - memories[1]).max() > 1e-3
    assert [x.shape for x in policy.act(np.zeros((0, 21)), images(0))] == [(0, 4), (0, 3)]


@pytest.mark.parametrize(
    ("which", "wrong", "message"),
    [
        (0, np.zeros((4, 2)), r"image 'image_0' has shape \(4, 2\) .*accepted: float32 of shape \(2, 4\): depth along"),
        (0, np.zeros((1, 2, 4)), r"image 'image_0' has shape \(1, 2, 4\)"),
        (0, np.full((2, 4), "a"), r"image 'image_0' has shape \(2, 4\) and type <U1"),
        (
            0,
            np.full((2, 4), np.nan),
            r"image 'image_0' has the value nan \(8 such values\); accepted: .*\[0, 5\]: depth",
        ),
        (0, np.full((2, 4), -0.1), r"image 'image_0' has the value -0.1"),
        (0, np.full((2, 4), 5.1), r"image 'image_0' has the value 5.1 .*; 5: that far or farther"),
        (1, np.zeros((2, 2)), r"image 'image_1' has shape \(2, 2\) .*accepted: float32 of shape \(2, 2, 3\)"),
        (1, np.full((2, 2, 3), 255, np.uint8), r"image 'image_1' has the value 255 .*\[0, 1\]: red, green, blue"),
        (1, np.full((2, 2, 3), np.inf), r"image 'image_1' has the value inf"),
    ],
)
def test_a_bad_image_is_refused_by_name(policy: Policy, which: int, wrong: np.ndarray, message: str) -> None:
    some = images()
    some[which] = wrong
    with pytest.raises(ValueError, match=message):
        policy.act(LEVEL, some)


def test_missing_images_and_bad_memories_are_refused(policy: Policy) -> None:
    with pytest.raises(ValueError, match=r"^0 images; accepted: 2: 'image_0' \(2, 4\), 'image_1' \(2, 2, 3\)"):
        policy.act(LEVEL)
    with pytest.raises(ValueError, match=r"^memory has shape \(2,\) .*accepted: float32 of shape \(3,\)"):
        policy.act(LEVEL, images(), np.zeros(2))
    for bad in (np.nan, 1.5):
        with pytest.raises(ValueError, match=r"^memory is .*accepted: numbers in \[-1, 1\]"):
            policy.act(LEVEL, images(), np.full(3, bad))


def test_what_the_image_can_show_is_taken(policy: Policy) -> None:
    policy.act(LEVEL, [np.full((2, 4), 5.0, np.float32), np.ones((2, 2, 3), np.uint8)])
    policy.act(LEVEL, [np.zeros((2, 4), np.int64), np.zeros((2, 2, 3), bool)])


IMAGE: dict[str, Any] = json.loads(json.dumps(EXAMPLE))["images"][0]


@pytest.mark.parametrize(
    ("key", "value", "accepted"),
    [
        ("sees", "label", "'depth' or 'range' or 'mask'"),
        ("of", "none", "'none' but where sees is 'mask'"),
        ("encoding", "inverse", "'none'"),
        ("pool", [5, 16], "divisors of the 48 rows and 64 columns"),
        ("pool", [0, 16], "a whole number, 1 or more"),
        ("width", 64.5, "a whole number"),
        ("fov_rad", [3.2, 1.0], "two angles in (0, 3.142)"),
        ("reach_m", [2.0, 1.0], "two rising numbers of metres"),
        ("rate_hz", 0.0, "0.01 Hz or more"),
        ("latency_range_s", [0.2, 0.1], "two rising numbers of seconds"),
        ("projection", "fisheye", "'pinhole' or 'spherical'"),
    ],
)
def test_an_image_out_of_range_is_refused(key: str, value: Any, accepted: str) -> None:
    with pytest.raises(ValueError, match=rf"^contract: image\.{key}.* is .*{re.escape(accepted)}"):
        Image.of_json(IMAGE | {key: value}, "image")
    assert Image.of_json(IMAGE, "image").shape == (48, 64)


def test_images_of_a_contract_agree_with_each_other_and_with_the_rate() -> None:
    for index, change, message in (
        (1, {"name": "image_0"}, r"images is \['image_0', 'image_0'\]; accepted: images of different names"),
        (0, {"rate_hz": 31.0}, r"images\[0\].rate_hz is 31.0; accepted: at most control_rate_hz, 30"),
    ):
        content = json.loads(json.dumps(EXAMPLE))
        content["images"][index] |= change
        with pytest.raises(ValueError, match=message):
            Contract.from_json(json.dumps(content))


def test_no_camera_no_flight(path: Path, policy: Policy) -> None:
    """Refused before anything is opened."""
    message = r"image 'image_0': there is no camera.*looks straight ahead.*4 x 2 pixels of depth.*; accepted: "
    goal = course_for(policy.contract, VEHICLE)
    with pytest.raises(ValueError, match=message):
        Runtime.of(policy, goal, VEHICLE)
    with pytest.raises(ValueError, match=message):
        fly_command(Fly(link="nowhere:1", pose="nowhere:1", policy=path))


def test_the_runtime_hands_the_memory_on(tmp_path: Path) -> None:
    policy = load_policy(make(tmp_path / "policy.onnx", (), recurrent=3))
    runtime = Runtime.of(policy, course_for(policy.contract, VEHICLE), VEHICLE)
    zero = np.zeros(3)
    still = Odometry(0.0, np.array([0.0, 0.0, 2.0]), zero, np.array([1.0, 0, 0, 0]), zero)
    state, memory = begin(runtime, still, 0.0), None
    for k in range(3):
        state, decision = act(runtime, state, still, k * runtime.period)
        action, memory = policy.act(decision.observation, memory=memory)
        np.testing.assert_array_equal(decision.action, action)
        np.testing.assert_array_equal(state.recurrent, memory)
    assert np.abs(memory).max() > 0
