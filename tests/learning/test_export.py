"""The exported graph is the trained policy, and its contract says so."""

import dataclasses
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest

from e2efly.config import EnvConfig, ImuConfig, NetworkConfig, TrainConfig
from e2efly.control import COMMAND_MODES
from e2efly.environment import Env
from e2efly.learning.networks import ACTIVATIONS, Actor, Layers, Weights, init_mlp
from e2efly.learning.onnx_export import contract_of, export_policy
from e2efly.policy.contract import METADATA_KEY, Contract
from e2efly.policy.loader import load_policy
from e2efly.policy.observation import ATTITUDE, BODY_RATE, VELOCITY, Field, past_actions
from e2efly.policy.random_inputs import random_observations
from e2efly.runs import presets
from e2efly.tasks import TASKS
from e2efly.vehicles.loading import load_vehicle, vehicle_names
from tests.learning.parity import parity

GOALS = Field("goals", 6, "world", "m", 3.0, "two positions minus vehicle position")


@cache
def configured(task: str = "hover", **env: Any) -> tuple[TrainConfig, Env]:
    config = dataclasses.replace(presets.preset(task, "ppo"), env=EnvConfig(**env))
    return config, Env.of(config.task, config.reward, config.env)


def shaped(fields: tuple[Field, ...], activation: Any = "relu", hidden: tuple[int, ...] = (64, 64)) -> Actor:
    """A policy without cameras."""
    return Actor.of(fields, (), NetworkConfig(hidden, activation))


def test_a_policy_has_an_activation_that_can_be_written() -> None:
    with pytest.raises(ValueError, match=r"network\.activation is 'gelu'; accepted: 'relu', 'tanh', 'elu'"):
        shaped((), "gelu")


def learned(actor: Actor) -> Weights:
    """Random weights of the size that training ends at; biases included."""
    rng = np.random.default_rng(1)
    layers = init_mlp(rng, (actor.features.size, *actor.network.hidden, 4), 1.0)
    return Weights((), None, [(w, rng.normal(0.0, 0.3, b.shape).astype(np.float32)) for w, b in layers])


def of_head(layers: Layers) -> Weights:
    return Weights((), None, layers)


def with_layer(weights: Weights, index: int, weight: Any = None, bias: Any = None) -> Weights:
    """With another weight or bias of one layer of the head."""
    layers = list(weights.head)
    w, b = layers[index]
    layers[index] = (w if weight is None else weight, b if bias is None else bias)
    return of_head(layers)


def a_contract(fields: tuple[Field, ...]) -> Contract:
    config, env = configured()
    return dataclasses.replace(contract_of(env, config), observation=fields)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("activation", list(ACTIVATIONS))
@pytest.mark.parametrize("task", list(TASKS))
def test_parity_on_ten_thousand_observations(tmp_path: Path, task: str, activation: str) -> None:
    config, env = configured(task)
    config = dataclasses.replace(config, network=dataclasses.replace(config.network, recurrent=0))  # as the actor
    actor, path = shaped(env.fields, activation), tmp_path / "policy.onnx"
    export_policy(path, learned(actor), actor, contract_of(env, config))
    assert parity(path, learned(actor), actor) <= 1e-5


def test_parity_with_inertial_sensors_and_many_past_actions(tmp_path: Path) -> None:
    config, env = configured("race", imu=ImuConfig(observed=True), past_actions=5, command_mode="velocity")
    assert "gyroscope" in [f.name for f in env.fields]
    actor, path = shaped(env.fields, "elu", (32,)), tmp_path / "policy.onnx"
    export_policy(path, learned(actor), actor, contract_of(env, config))
    assert parity(path, learned(actor), actor, count=1000) <= 1e-5


@pytest.mark.parametrize(
    "fields",
    [(ATTITUDE, BODY_RATE, GOALS), (BODY_RATE, GOALS, ATTITUDE), (ATTITUDE,), (past_actions(2), ATTITUDE)],
    ids=lambda fields: "-".join(f.name for f in fields),
)
def test_parity_in_any_order_of_fields(tmp_path: Path, fields: tuple[Field, ...]) -> None:
    actor, path = shaped(fields, "tanh", ()), tmp_path / "policy.onnx"
    export_policy(path, learned(actor), actor, a_contract(fields))
    assert parity(path, learned(actor), actor, count=100) <= 1e-5


def test_parity_sees_a_difference(tmp_path: Path) -> None:
    config, env = configured()
    actor, path = shaped(env.fields), tmp_path / "policy.onnx"
    weights = learned(actor)
    export_policy(path, weights, actor, contract_of(env, config))
    assert parity(path, with_layer(weights, 1, bias=weights.head[1][1] + 0.01), actor, count=100) > 1e-4
    assert parity(path, weights, shaped(env.fields, "tanh"), count=100) > 1e-2


def test_a_turn_of_the_world_about_up_changes_nothing(tmp_path: Path) -> None:
    fields = (GOALS, ATTITUDE, VELOCITY, BODY_RATE)
    actor, path = shaped(fields), tmp_path / "policy.onnx"
    export_policy(path, learned(actor), actor, a_contract(fields))
    policy = load_policy(path)
    x = random_observations(np.random.default_rng(2), fields, 200)
    angle = 1.2
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    turned = x.astype(np.float64)
    for start in (0, 3, 10):
        turned[:, start : start + 3] = x[:, start : start + 3] @ turn.T
    w, z = np.cos(angle / 2), np.sin(angle / 2)
    left = np.array([[w, 0, 0, -z], [0, w, -z, 0], [0, z, w, 0], [z, 0, 0, w]])
    turned[:, 6:10] = x[:, 6:10] @ left.T
    np.testing.assert_allclose(policy.act(turned)[0], policy.act(x)[0], atol=1e-5)
    turned[:, 6:10] = x[:, 6:10]  # but turning only the vectors does
    assert np.abs(policy.act(turned)[0] - policy.act(x)[0]).max() > 0.1


def test_the_opposite_quaternion_is_the_same_attitude(tmp_path: Path) -> None:
    fields = (GOALS, ATTITUDE)
    actor, path = shaped(fields), tmp_path / "policy.onnx"
    export_policy(path, learned(actor), actor, a_contract(fields))
    x = random_observations(np.random.default_rng(2), fields, 20)
    other = np.concatenate([x[:, :6], -x[:, 6:]], axis=1)
    np.testing.assert_array_equal(load_policy(path).act(other)[0], load_policy(path).act(x)[0])


def test_features_by_hand(tmp_path: Path) -> None:
    """Heading along world y, a goal ahead of it: in the body it lies along x; up is up. Nose down, up is behind."""
    goal = Field("goal", 3, "world", "m", 2.0, "position minus vehicle position")
    fields, path = (goal, ATTITUDE), tmp_path / "policy.onnx"
    weight = np.zeros((6, 4), np.float32)
    weight[[0, 1, 3, 5], range(4)] = 1.0
    weights = Weights((), None, [(weight, np.zeros(4, np.float32))])
    export_policy(path, weights, shaped(fields, hidden=()), a_contract(fields))
    h = np.sqrt(0.5)
    x = np.array([[0, 1, 0, h, 0, 0, h], [0, 0, 0, h, 0, h, 0]])
    expected = np.tanh([[0.5, 0, 0, 1], [0, 0, -1, 0]])
    np.testing.assert_allclose(load_policy(path).act(x)[0], expected, atol=1e-6)


def test_the_file(tmp_path: Path) -> None:
    config, env = configured()
    contract, path = contract_of(env, config), tmp_path / "policy.onnx"
    actor = shaped(env.fields)
    export_policy(path, learned(actor), actor, contract)
    model = onnx.load(str(path))
    onnx.checker.check_model(model, full_check=True)
    assert [(o.domain, o.version) for o in model.opset_import] == [("", 17)]
    assert model.ir_version == 8
    shapes = [
        (v.name, v.type.tensor_type.elem_type, [d.dim_param or d.dim_value for d in v.type.tensor_type.shape.dim])
        for v in (*model.graph.input, *model.graph.output)
    ]
    assert shapes == [("observation", 1, ["n", env.observation_size]), ("action", 1, ["n", 4])]
    assert [p.key for p in model.metadata_props] == [METADATA_KEY, "sha256"]
    assert Contract.from_json(model.metadata_props[0].value) == contract == load_policy(path).contract
    assert [file.name for file in tmp_path.iterdir()] == ["policy.onnx"]


def test_the_same_policy_is_the_same_file(tmp_path: Path) -> None:
    config, env = configured()
    actor = shaped(env.fields)
    for name in ("a", "b"):
        export_policy(tmp_path / name, learned(actor), actor, contract_of(env, config))
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()


def test_contract_of_hovering_on_vis_r() -> None:
    config, env = configured()
    contract = contract_of(env, config)
    vehicle = load_vehicle("vis_r")
    assert (contract.task, contract.vehicle, contract.vehicle_hash) == ("hover", "vis_r", vehicle.hash)
    assert (contract.control_rate_hz, contract.latency_s) == (vehicle.control_rate, vehicle.latency)
    assert contract.latency_range_s == (vehicle.latency, vehicle.latency)
    assert contract.observation_latency_range_s == (0.0, 0.0)
    assert contract.observation == env.fields
    assert contract.action.high == (4 * vehicle.thrust_range[1] / vehicle.mass, *vehicle.body_rate_max)
    assert contract.action.low == (0.0, *(-vehicle.body_rate_max))
    assert contract.hover_action[0] == pytest.approx(2 * 9.81 / contract.action.high[0] - 1, abs=1e-6)
    assert contract.hover_action[1:] == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("mode", list(COMMAND_MODES))
@pytest.mark.parametrize("vehicle", vehicle_names())
def test_every_contract_is_valid_and_maps_as_the_environment_does(mode: str, vehicle: str) -> None:
    config, env = configured(vehicle=vehicle, command_mode=mode, control_rate=49.0, action_latency=(0.01, 0.03))
    contract = contract_of(env, config)
    assert Contract.from_json(contract.to_json()) == contract
    assert (contract.control_rate_hz, contract.latency_s, contract.latency_range_s) == (49.0, 0.02, (0.01, 0.03))
    low, high = np.array(contract.action.low), np.array(contract.action.high)
    for action in (-1.0, 0.3, 1.0):
        command = np.asarray(env.command(np.full((1, env.action_size), action, np.float32)))[0]
        np.testing.assert_allclose(command, low + (action + 1) / 2 * (high - low), rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(
    ("other", "message"),
    [
        ({"command_mode": "velocity"}, "command_mode of the environment is velocity"),
        ({"control_rate": 40.0}, "control_period of the environment is 0.025"),
        ({"vehicle": "vis_h"}, "vehicle vis_r: mass of the environment is"),
    ],
)
def test_an_environment_of_another_configuration_is_refused(other: dict, message: str) -> None:
    config, _ = configured()
    with pytest.raises(ValueError, match=f"^{message}.*; its configuration and vehicle say"):
        contract_of(configured(**other)[1], config)


def test_another_position_range_is_refused() -> None:
    config, _ = configured(command_mode="position")
    with pytest.raises(ValueError, match=r"^position_range \(half range"):
        contract_of(configured(command_mode="position", position_range=9.0)[1], config)


def test_what_does_not_fit_is_refused_and_the_old_file_stays(tmp_path: Path) -> None:
    config, env = configured()
    contract, actor, path = contract_of(env, config), shaped(env.fields), tmp_path / "policy.onnx"
    weights = learned(actor)
    path.write_text("old")
    nan = np.full((64, 64), np.nan, np.float32)
    cases: list[tuple[Weights, Actor, Contract, str]] = [
        (of_head([]), actor, contract, r"weights has the arrays ; accepted: \.head\[0\]\[0\], "),
        (of_head(weights.head[:2]), actor, contract, r"weights has the arrays .*, \.head\[1\]\[1\]; accepted: "),
        (
            with_layer(weights, 0, weight=nan),
            actor,
            contract,
            r"head\[0\]\[0\] has shape \(64, 64\); accepted: \(20, 64\)",
        ),
        (
            with_layer(weights, 1, bias=np.zeros(63)),
            actor,
            contract,
            r"weights\.head\[1\]\[1\] has shape \(63,\); accepted: \(64,\)",
        ),
        (with_layer(weights, 1, weight=nan), actor, contract, r"weights\.head\[1\]\[0\] is not finite"),
        (weights, shaped(env.fields[::-1]), contract, r"contract.observation is .*accepted: that of the policy"),
        (weights, actor, dataclasses.replace(contract, task=""), "contract: task is ''"),
    ]
    for given, shape, about, message in cases:
        with pytest.raises(ValueError, match=message):
            export_policy(path, given, shape, about)
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["policy.onnx"]


def test_a_failed_write_leaves_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    config, env = configured()
    path = tmp_path / "policy.onnx"
    path.write_text("old")
    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match=r"cannot write .*policy.onnx"):
        export_policy(path, learned(shaped(env.fields)), shaped(env.fields), contract_of(env, config))
    assert path.read_text() == "old"
    assert [file.name for file in tmp_path.iterdir()] == ["policy.onnx"]
