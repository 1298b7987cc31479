"""What a policy sees and remembers is the same in its file: encodings, encoders, GRU, and what the contract says."""

import dataclasses
import json
import re
from importlib import resources
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pytest

from e2efly.config import CameraConfig, EnvConfig, ImuConfig, NetworkConfig, RewardConfig, TrainConfig
from e2efly.environment import Env
from e2efly.environment.episodes import Act
from e2efly.learning.networks import Actor, View, Weights
from e2efly.learning.onnx_export import contract_of, export_policy
from e2efly.learning.programs import acting
from e2efly.policy.loader import load_policy
from e2efly.policy.random_inputs import random_images, random_observations
from e2efly.runs import presets
from e2efly.runs.rundir import RunDirectory, run_of
from e2efly.validation.candidate import check_observation, config_from_contract
from e2efly.validation.evaluation import act_of
from e2efly.vehicles.loading import load_vehicle
from tests.learning.parity import parity

DEPTH = CameraConfig("depth", width=16, height=12, reach=(0.3, 8.0), rate=15.0, latency=(0.0, 0.05))
MASK, RGB = CameraConfig("mask", width=16, height=16), CameraConfig("rgb", width=8, height=8)
POOLED = NetworkConfig((8,), pool=(4, 4), encoder=(6,))
CONVOLVED = NetworkConfig((8,), "elu", convolution=(3, 5), encoder=(6, 4))


def exported(
    folder: Path, cameras: tuple[CameraConfig, ...], network: NetworkConfig, **env_options: object
) -> tuple[Path, Weights, Actor, TrainConfig, Env]:
    """A policy with weights of the size that training ends at, biases included."""
    config = presets.preset("hover", "ppo")
    config = dataclasses.replace(config, env=EnvConfig(cameras=cameras, **env_options), network=network)  # type: ignore[arg-type]
    env = Env.of(config.task, config.reward, config.env)
    actor, rng = Actor.of(env.fields, env.cameras, network), np.random.default_rng(0)
    started = actor.init(rng, np.asarray(env.hover))
    spread = lambda x: (x + rng.normal(0.0, 0.2, x.shape)).astype(np.float32)  # noqa: E731
    layers = lambda some: [(spread(w), spread(b)) for w, b in some]  # noqa: E731
    cell = started.cell and type(started.cell)(*(spread(x) for x in vars(started.cell).values()))
    weights = Weights(tuple(layers(encoder) for encoder in started.encoders), cell, layers(started.head))
    export_policy(folder / "policy.onnx", weights, actor, contract_of(env, config))
    return folder / "policy.onnx", weights, actor, config, env


@pytest.mark.parametrize(
    ("cameras", "network"),
    [
        ((DEPTH,), POOLED),
        ((dataclasses.replace(DEPTH, encoding="linear"),), dataclasses.replace(POOLED, activation="tanh")),
        ((dataclasses.replace(DEPTH, encoding="log"),), POOLED),
        ((dataclasses.replace(DEPTH, sees="range", projection="spherical"),), POOLED),
        ((MASK,), POOLED),
        ((RGB,), POOLED),
        ((MASK,), CONVOLVED),
        ((MASK, RGB), dataclasses.replace(CONVOLVED, recurrent=7)),
        ((dataclasses.replace(RGB, sees="normal"), DEPTH), dataclasses.replace(POOLED, recurrent=7)),
        ((), NetworkConfig((8,), recurrent=7)),
    ],
    ids=["inverse", "linear", "log", "range", "mask", "rgb", "convolved", "convolved-gru", "normal-depth-gru", "gru"],
)
def test_parity(tmp_path: Path, cameras: tuple[CameraConfig, ...], network: NetworkConfig) -> None:
    path, weights, actor, _, _ = exported(tmp_path, cameras, network)
    assert parity(path, weights, actor, count=300) <= 1e-5
    if cameras:
        layers = [(w, b + 0.1) for w, b in weights.encoders[0]]
        moved = dataclasses.replace(weights, encoders=(layers, *weights.encoders[1:]))
        assert parity(path, moved, actor, count=20) > 1e-3


def test_parity_over_a_flight_that_is_remembered(tmp_path: Path) -> None:
    path, weights, actor, _, _ = exported(tmp_path, (DEPTH,), dataclasses.replace(POOLED, recurrent=5))
    policy, rng = load_policy(path), np.random.default_rng(1)
    observations = random_observations(rng, actor.features.fields, 40)
    images = random_images(rng, policy.contract.images[0], 40)
    theirs, ours, forgetful = actor.memory(1), None, []
    features, asked = jax.jit(actor.features), jax.jit(actor)
    for observation, image in zip(observations, images, strict=True):
        action, ours = policy.act(observation, [image], ours)
        wanted, theirs = asked(weights, features(observation[None], [image[None]]), theirs)
        np.testing.assert_allclose(action, wanted[0], atol=1e-5)
        np.testing.assert_allclose(ours, theirs[0], atol=1e-5)
        forgetful.append(np.abs(policy.act(observation, [image])[0] - action).max())
    assert max(forgetful) > 0.01  # the memory matters


def test_the_contract_of_images(tmp_path: Path) -> None:
    camera = dataclasses.replace(DEPTH, position=(0.1, 0.0, -0.02), pitch=0.25, fov=(1.5, 1.0))
    _, _, _, config, env = exported(tmp_path, (camera, MASK), dataclasses.replace(POOLED, recurrent=7))
    said = json.loads(contract_of(env, config).to_json())
    assert said["contract_version"] == 2
    assert said["memory_size"] == 7
    assert said["images"][0] == {
        "name": "image_0",
        "sees": "depth",
        "of": "none",
        "width": 16,
        "height": 12,
        "projection": "pinhole",
        "fov_rad": [1.5, 1.0],
        "reach_m": [0.3, 8.0],
        "position_m": [0.1, 0.0, -0.02],
        "pitch_rad": 0.25,
        "rate_hz": 15.0,
        "latency_range_s": [0.0, 0.05],
        "encoding": "inverse",
        "pool": [4, 4],
        "description": "depth along the optical axis, m; 0: a hole, or nearer than 0.3 m; 8: that far or farther",
        "preprocessing": "inside the graph: 1 m over it, less 1 m over 8 m; nearer than 0.3 m as there; a hole: 0, as "
        "the farthest; the largest of each cell of 4 rows and 4 columns",
    }
    mask = said["images"][1]
    assert [mask[key] for key in ("name", "sees", "of", "encoding", "rate_hz")] == [
        "image_1", "mask", "pad", "none", 30.0,
    ]  # fmt: skip
    assert mask["description"] == "1 where pad is seen, else 0"
    assert mask["preprocessing"] == (
        "inside the graph: averaged to 4 rows and 4 columns; beside itself times 1 over (its norm plus 0.01)"
    )


def test_a_lone_file_brings_its_cameras_and_acts_in_compiled_programs(tmp_path: Path) -> None:
    """As the weights do."""
    network = dataclasses.replace(POOLED, recurrent=5)
    path, weights, actor, config, _ = exported(tmp_path, (MASK, DEPTH), network, imu=ImuConfig(observed=True))
    policy = load_policy(path)
    task, rebuilt = config_from_contract(policy)
    assert rebuilt.cameras == (dataclasses.replace(MASK, rate=30.0), DEPTH)
    again = Env.of(task, RewardConfig({"prog2": 1.0}), rebuilt)
    check_observation(policy, again)
    rng, n = np.random.default_rng(0), 250
    observation = random_observations(rng, again.fields, n)
    images = tuple(random_images(rng, image, n) for image in policy.contract.images)

    def twice(act: Act) -> Any:
        _, memory = act.act(observation, images, act.begin(n))
        return act.act(observation, images, memory)

    by_file, by_weights = jax.jit(lambda: [twice(act) for act in (act_of(policy), acting(actor, weights))])()
    for a, b in zip(by_file, by_weights, strict=True):
        np.testing.assert_allclose(a, b, atol=1e-5)
    other = dataclasses.replace(rebuilt, cameras=(rebuilt.cameras[1],))
    with pytest.raises(
        ValueError, match=r"^images: the policy wants \[\('mask', 'pad', 16, 16\).*the environment give"
    ):
        check_observation(policy, Env.of(task, config.reward, other))


def test_a_lone_file_of_one_s_own_vehicle_is_flown_with_the_vehicle_s_file(tmp_path: Path) -> None:
    shipped = (resources.files("e2efly.vehicles") / "vis_r.toml").read_text()
    mine = tmp_path / "mine.toml"
    mine.write_text(re.sub(r"(\[mass\]\nvalue = )[0-9.]+", r"\g<1>0.7", shipped))
    assert load_vehicle(str(mine)).hash != load_vehicle("vis_r").hash
    path, *_ = exported(tmp_path, (), NetworkConfig((8,)), vehicle=str(mine))
    policy = load_policy(path)
    with pytest.raises(ValueError, match=r"vehicle_hash is .* accepted: the file of that vehicle with --vehicle"):
        config_from_contract(policy)
    with pytest.raises(ValueError, match="vehicle_hash is"):
        config_from_contract(policy, "vis_h")
    assert config_from_contract(policy, str(mine))[1].vehicle == str(mine)


def test_a_file_in_its_run_s_folder_is_that_run_s(tmp_path: Path) -> None:
    run = RunDirectory(tmp_path / "run")
    run.create(presets.preset("hover", "ppo"))
    assert run_of(run.path) == run_of(run.policy) == run
    assert run_of(tmp_path / "policy.onnx") is None
    assert run_of(run.path / "other.onnx") is None


def test_cameras_of_another_environment_are_refused(tmp_path: Path) -> None:
    path, weights, actor, config, env = exported(tmp_path, (DEPTH,), POOLED)
    with pytest.raises(ValueError, match="cameras of the environment are"):
        contract_of(dataclasses.replace(env, cameras=()), config)
    contract = contract_of(env, config)
    with pytest.raises(ValueError, match=r"contract\.images is \(\); accepted: that of the policy"):
        export_policy(path, weights, actor, dataclasses.replace(contract, images=()))
    with pytest.raises(ValueError, match=r"contract\.memory_size is 3; accepted: that of the policy, 0"):
        export_policy(path, weights, actor, dataclasses.replace(contract, memory_size=3))


@pytest.mark.parametrize(
    ("encoding", "at"),
    [
        ("inverse", lambda d: 1 / d - 1 / 8),
        ("log", lambda d: np.log(8 / d)),
        ("linear", lambda d: 1 - d / 8),
    ],
)
def test_what_is_near_stands_out_and_a_hole_is_as_the_farthest(encoding: Any, at: Any) -> None:
    """A camera shows what is beyond its range as a hole, or as the farthest: the network sees the same."""
    camera = dataclasses.replace(DEPTH, width=4, height=2, encoding=encoding)
    image = np.array([[0.0, 8.0, 0.1, 0.3], [0.5, 2.0, 4.0, 7.0]], np.float32)
    got = View.of(camera, NetworkConfig(pool=(2, 4)))(image)
    expected = [0.0, 0.0, at(0.3), at(0.3), at(0.5), at(2.0), at(4.0), at(7.0)]
    np.testing.assert_allclose(got, expected, atol=1e-5)
    cells = View.of(camera, NetworkConfig(pool=(1, 2)))(image)
    np.testing.assert_allclose(cells, [at(0.5), at(0.3)], atol=1e-5)


def test_a_convolution_is_that_of_patches() -> None:
    """One patch of 4 x 4 after the other, row by row, the channels beside each other; then all flat."""
    view = View.of(RGB, dataclasses.replace(CONVOLVED, convolution=(3,)))
    assert (view.rows, view.columns, view.patches, view.size) == (8, 8, (4,), 192)
    rng = np.random.default_rng(0)
    image = rng.random((8, 8, 3)).astype(np.float32)
    (weight, _), (last, _) = view.init(rng, NetworkConfig(convolution=(3,), encoder=(2,)))
    patches = [np.tanh(image[r : r + 4, c : c + 4].ravel() @ weight) for r in (0, 4) for c in (0, 4)]
    got = view.encode([(weight, 0.0), (last, 0.0)], view(image), "tanh")  # type: ignore[list-item]
    np.testing.assert_allclose(got, np.tanh(np.concatenate(patches) @ last), atol=1e-5)


@pytest.mark.parametrize(
    ("network", "message"),
    [
        (NetworkConfig(convolution=(8, 8, 8)), r"network.convolution is \(8, 8, 8\); .*16 rows and 16 columns: 2$"),
        (NetworkConfig(pool=(5, 4)), r"network.pool is \(5, 4\); accepted: divisors of the image's 16 rows"),
        (NetworkConfig(encoder=()), r"network.encoder is \(\); accepted: one size or more where"),
    ],
)
def test_networks_that_do_not_fit_are_refused(network: NetworkConfig, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Actor.of((), (MASK,), network)
