"""What other frameworks have learned becomes a policy.onnx that is evaluated and flown like one of ours."""

import dataclasses
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from stable_baselines3 import A2C, PPO, SAC, TD3
from stable_baselines3.common.vec_env import VecFrameStack, VecMonitor, VecNormalize

import e2efly
from e2efly.adapters.gym import QuadrotorVectorEnv
from e2efly.adapters.stable_baselines3 import SB3VecEnv
from e2efly.adapters.torch import TorchEnv
from e2efly.config import NetworkConfig
from e2efly.policy.random_inputs import random_observations
from e2efly.runs import presets

pytestmark = pytest.mark.usefixtures("quick")

NETWORK = {"net_arch": [16, 16]}


def agree(path: Path, adapter: Any, wanted: Any) -> None:
    """The file acts as the policy does on what it would be shown."""
    observation = random_observations(np.random.default_rng(1), adapter.stepper.env.fields, 200)
    shown = np.array(adapter.stepper.shown(observation))
    action = e2efly.load_policy(path).act(observation)[0]
    np.testing.assert_allclose(action, np.clip(wanted(shown), -1, 1), atol=1e-5)
    assert np.std(action) > 1e-3


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("algorithm", "kind", "sde"),
    [
        (PPO, {}, False), (A2C, {"activation_fn": torch.nn.ELU}, False), (SAC, {}, False), (TD3, {}, False),
        (PPO, {"share_features_extractor": False}, True), (A2C, {"squash_output": True}, True),
        (SAC, {"clip_mean": 0.7}, True), (SAC, {"clip_mean": 0.0}, True),
    ],
)  # fmt: skip
def test_models_of_stable_baselines3(algorithm: Any, kind: dict[str, Any], sde: bool, tmp_path: Path) -> None:
    env = SB3VecEnv("hover", 4)
    options = {"use_sde": True} if sde else {}
    model = algorithm("MlpPolicy", env, policy_kwargs=NETWORK | kind, seed=0, device="cpu", **options)
    if sde:  # far out, where actions and means are clipped
        with torch.no_grad():
            for layer in getattr(model, "actor", model.policy).modules():
                if isinstance(layer, torch.nn.Linear) and layer.out_features == 4:
                    layer.weight *= 50
    path = e2efly.export(model, tmp_path / "policy.onnx")  # the model knows its environment
    agree(path, env.envs, lambda shown: model.predict(shown, deterministic=True)[0])
    contract = e2efly.load_policy(path).contract
    assert (contract.task, contract.vehicle, contract.control_rate_hz) == ("hover", "vis_r", 30.0)


@pytest.mark.whole
def test_the_contract_is_that_of_our_own_policies(tmp_path: Path) -> None:
    e2efly.train("hover", "ppo", preset_name="nominal", out=tmp_path / "own", steps=4096, chunk=1, eval_episodes=10)
    exported = e2efly.export(sequence(20), tmp_path / "policy.onnx", TorchEnv("hover", 2))
    assert e2efly.load_policy(exported).contract == e2efly.load_policy(tmp_path / "own").contract


@pytest.mark.whole
def test_a_normalised_environment_and_raw_observations(tmp_path: Path) -> None:
    env = VecMonitor(VecNormalize(SB3VecEnv("hover", 8, raw=True)))
    model = PPO("MlpPolicy", env, n_steps=16, batch_size=64, policy_kwargs=NETWORK, seed=0, device="cpu").learn(256)
    path, normalize, adapter = tmp_path / "policy.onnx", env.venv, env.venv.venv.envs  # type: ignore[attr-defined]
    e2efly.export(model, path, env)
    agree(path, adapter, lambda shown: model.predict(normalize.normalize_obs(shown), deterministic=True)[0])
    network = sequence(adapter.stepper.size)
    e2efly.export(network, path, env)
    agree(path, adapter, lambda shown: network(torch.as_tensor(normalize.normalize_obs(shown))).detach().numpy())


@pytest.mark.whole
def test_a_lost_or_wrong_normalisation_is_refused(tmp_path: Path) -> None:
    env, file = SB3VecEnv("hover", 4), tmp_path / "model.zip"

    def learned(algorithm: Any, under: Any, **more: Any) -> Any:
        return algorithm("MlpPolicy", under, policy_kwargs=dict(NETWORK), device="cpu", **more).learn(16)

    def refused(model: Any, under: Any, message: str) -> None:
        with pytest.raises(ValueError, match=message):
            e2efly.export(model, tmp_path / "policy.onnx", under)

    normalized = VecNormalize(env)
    model = learned(PPO, normalized, n_steps=4, batch_size=16, n_epochs=1)
    model.save(file)
    normalized.save(str(tmp_path / "normalize.pkl"))
    refused(model, env, "was learned under a VecNormalize, and env has none; accepted: env=VecNormalize.load")
    loaded = PPO.load(file, device="cpu")
    refused(loaded, env, "was learned under a VecNormalize, and env has none; accepted: env=VecNormalize.load")
    refused(loaded, VecNormalize(env), "VecNormalize that has seen no observation; accepted: env=VecNormalize.load")
    kept = VecNormalize.load(str(tmp_path / "normalize.pkl"), env)
    e2efly.export(loaded, tmp_path / "policy.onnx", kept)
    agree(
        tmp_path / "policy.onnx", env.envs, lambda x: model.predict(normalized.normalize_obs(x), deterministic=True)[0]
    )
    kept.obs_rms.mean = kept.obs_rms.mean + 0.1
    refused(model, kept, "another VecNormalize than policy, with other statistics")
    off_policy = learned(SAC, VecNormalize(env), learning_starts=100)
    off_policy.save(file)
    refused(SAC.load(file, device="cpu"), env, "was learned under a VecNormalize, and env has none")
    plain = learned(PPO, env, n_steps=4, batch_size=16, n_epochs=1)
    refused(plain, normalized, "a VecNormalize, without which policy was learned")


class Doubled(PPO.policy_aliases["MlpPolicy"]):  # type: ignore[misc]
    """Acts otherwise than its layers say."""

    def _predict(self, observation: Any, deterministic: bool = False) -> Any:
        return 2 * super()._predict(observation, deterministic)


class VecMonitorOfOurs(VecMonitor):
    """A wrapper of somebody else."""


VecMonitorOfOurs.__name__ = "VecMonitor"


def test_what_acts_or_shows_otherwise_is_refused_by_name(tmp_path: Path) -> None:
    env = SB3VecEnv("hover", 2)
    for policy, wrapped, message in (
        (Doubled, env, "policy is a tests.adapters.test_export.Doubled; accepted: PPO, A2C"),
        ("MlpPolicy", VecMonitorOfOurs(env), "env is <.*VecMonitor.* accepted: an environment of e2efly.adapters"),
    ):
        model = PPO(policy, wrapped, policy_kwargs=NETWORK, device="cpu")
        with pytest.raises(ValueError, match=message):
            e2efly.export(model, tmp_path / "policy.onnx")
    model = PPO("MlpPolicy", env, policy_kwargs=NETWORK, device="cpu")
    model.action_space = gymnasium.spaces.Box(0.0, 1.0, (4,))
    with pytest.raises(ValueError, match=r"policy acts in Box\(0.0, 1.0, \(4,\), float32\); accepted: \[-1, 1\]"):
        e2efly.export(model, tmp_path / "policy.onnx")


def test_environments_that_stable_baselines3_makes_of_a_gymnasium_id(tmp_path: Path) -> None:
    model = PPO("MlpPolicy", "e2efly/hover-v0", n_steps=16, batch_size=16, policy_kwargs=NETWORK, seed=0, device="cpu")
    path = e2efly.export(model, tmp_path / "policy.onnx")
    agree(path, QuadrotorVectorEnv("hover", 1), lambda shown: model.predict(shown, deterministic=True)[0])


def sequence(inputs: int, *last: torch.nn.Module) -> torch.nn.Sequential:
    torch.manual_seed(0)
    return torch.nn.Sequential(torch.nn.Linear(inputs, 8), torch.nn.ReLU(), torch.nn.Linear(8, 4, bias=False), *last)


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("last", [(), (torch.nn.Tanh(),), (torch.nn.Sequential(torch.nn.Dropout(), torch.nn.Tanh()),)])
def test_a_network_of_pytorch(last: tuple[torch.nn.Module, ...], tmp_path: Path) -> None:
    env = TorchEnv("hover", 2)
    network = sequence(env.stepper.size, *last)
    path = e2efly.export(network.double(), tmp_path / "policy.onnx", env)
    assert network.training  # as it was
    network.float().eval()
    agree(path, env, lambda shown: network(torch.as_tensor(shown)).detach().numpy())
    assert e2efly.evaluate(path, episodes=5).success == 0.0


@pytest.mark.parametrize(
    ("policy", "message"),
    [
        (sequence(7), "policy takes 7 numbers; accepted: 20, as its environment shows"),
        (torch.nn.Sequential(torch.nn.Linear(20, 3)), "policy returns 3 numbers; accepted: 4"),
        (torch.nn.Sequential(torch.nn.Linear(20, 4), torch.nn.ReLU()), "ends with the activation Relu; accepted: Tanh"),
        (torch.nn.Sequential(torch.nn.Conv1d(1, 1, 1)), r"policy has a layer Conv1d.*; accepted: Linear, each with"),
        (torch.nn.LSTM(20, 4), "policy LSTM is recurrent; accepted: networks without memory"),
        (torch.nn.Linear(20, 4), "policy is a torch.*Linear; accepted: PPO, A2C, TRPO, SAC"),
        (torch.nn.Sequential(), "policy has no linear layer"),
        (torch.nn.Sequential(torch.nn.Linear(20, 4), torch.nn.Dropout(), torch.nn.Softmax()), "a layer Softmax"),
        (torch.nn.Sequential(torch.nn.Linear(20, 9), torch.nn.ELU(0.5), torch.nn.Linear(9, 4)), "default parameters"),
    ],
)
def test_what_cannot_be_exported_is_named_and_the_file_stays_as_it_was(
    policy: Any, message: str, tmp_path: Path
) -> None:
    path = tmp_path / "policy.onnx"
    path.write_text("as it was")
    with pytest.raises(ValueError, match=message):
        e2efly.export(policy, path, TorchEnv("hover", 2))
    assert [file.read_text() for file in tmp_path.iterdir()] == ["as it was"]


@pytest.mark.parametrize(
    ("wrap", "message"),
    [
        (lambda: None, "env is None; accepted: an environment of e2efly.adapters"),
        (lambda: TorchEnv("avoid", 2), "env has cameras; accepted: a task flown by state"),
        (lambda: VecFrameStack(SB3VecEnv("hover", 2), 2), "env is <.*VecFrameStack.*; accepted: .*VecNormalize"),
        (lambda: gymnasium.wrappers.NormalizeObservation(gymnasium.make("e2efly/hover-v0")), "NormalizeObservation"),
        (lambda: gymnasium.wrappers.RescaleAction(gymnasium.make("e2efly/hover-v0"), 0, 1), "env is <RescaleAction"),
    ],
)
def test_an_environment_that_shows_something_else_is_refused(wrap: Any, message: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=message):
        e2efly.export(sequence(20), tmp_path / "policy.onnx", wrap())


def test_recurrent_models_weights_that_are_not_finite_and_a_preset_with_memory(tmp_path: Path) -> None:
    model = PPO("MlpPolicy", SB3VecEnv("hover", 2), policy_kwargs=NETWORK, device="cpu")
    model.policy.lstm_actor = torch.nn.LSTM(20, 20)  # as RecurrentPPO of sb3-contrib has it
    with pytest.raises(ValueError, match="policy PPO is recurrent"):
        e2efly.export(model, tmp_path / "policy.onnx")
    broken = sequence(20)
    torch.nn.init.constant_(broken[0].weight, float("nan"))
    with pytest.raises(ValueError, match="weights that are not finite"):
        e2efly.export(broken, tmp_path / "policy.onnx", TorchEnv("hover", 2))
    config = dataclasses.replace(presets.preset("hover", "ppo"), network=NetworkConfig(recurrent=8))
    path = e2efly.export(sequence(20), tmp_path / "policy.onnx", TorchEnv(config, 2))
    assert e2efly.load_policy(path).contract.memory_size == 0
