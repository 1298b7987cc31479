"""Export a policy that Stable-Baselines3 or PyTorch has learned as a `policy.onnx` with a contract.

`pip install 'e2efly[sb3]'` or `'e2efly[torch]'`.
"""

import copy
import dataclasses
import math
import os
import tempfile
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import torch

from e2efly.adapters.stepper import Stepper
from e2efly.config import NetworkConfig
from e2efly.config.storage import write_atomically
from e2efly.learning.networks import Layers
from e2efly.learning.onnx_export import contract_of, write_policy
from e2efly.learning.onnx_layers import perceptron_graph
from e2efly.policy.loader import load_policy
from e2efly.policy.random_inputs import random_observations

OPERATORS = {
    torch.nn.Identity: "Identity", torch.nn.Tanh: "Tanh", torch.nn.ReLU: "Relu", torch.nn.ELU: "Elu",
    torch.nn.Sigmoid: "Sigmoid", torch.nn.Softplus: "Softplus", torch.nn.LeakyReLU: "LeakyRelu",
}  # fmt: skip
"""ONNX operators for activations with their default parameters."""
EXTRACTOR = "stable_baselines3.common.torch_layers.FlattenExtractor"
"""The features extractor that is exported: it hands the observation on."""
POLICIES = {
    "stable_baselines3.common.policies.ActorCriticPolicy": "PPO, A2C, TRPO",
    "stable_baselines3.sac.policies.SACPolicy": "SAC",
    "stable_baselines3.td3.policies.TD3Policy": "TD3, DDPG",
    "sb3_contrib.tqc.policies.TQCPolicy": "TQC",
}
"""The classes of `MlpPolicy` whose deterministic action is known, and the algorithms that learn them. gSDE
(`use_sde`) and `squash_output` included."""
WRAPPERS = (
    "DummyVecEnv", "Monitor", "NormalizeReward", "OrderEnforcing", "PassiveEnvChecker", "RecordEpisodeStatistics",
    "RecordVideo", "SB3VecEnv", "SyncVectorEnv", "TimeLimit", "VecCheckNan", "VecMonitor", "VecNormalize",
    "VecVideoRecorder",
)  # fmt: skip
"""Wrappers that change neither observations nor actions, and `VecNormalize`, which is exported with the policy."""
CLOSE = 1e-5
"""Largest accepted difference between an action of the exported file and the action of the policy."""


def export(policy: Any, path: str | os.PathLike[str], env: Any = None) -> Path:
    """Write a policy of another framework as `policy.onnx`. It can be evaluated, validated and flown like a policy of
    e2efly.

    Before the file is written, its actions are compared with those of the policy on 1000 random observations.

    Args:
        policy: a model of Stable-Baselines3 with one of `POLICIES`, whose deterministic action is exported, or a
            `torch.nn.Sequential` of linear layers and activations. Actions are clipped to [-1, 1].
        path: the file to write.
        env: the environment of `e2efly.adapters` in which the policy was learned, with its wrappers. The normalisation
            of a `VecNormalize` is exported, too; a model that was learned under one is refused without it. May be
            omitted for a model of Stable-Baselines3, which knows its environment.

    Returns:
        The path.

    Raises:
        ValueError: naming what cannot be exported and what is accepted.
        OSError: when the file cannot be written.
    """
    env = policy.get_env() if env is None and hasattr(policy, "get_env") else env
    stepper, normalize = _stepper(env)
    if stepper.env.cameras:
        raise ValueError("env has cameras; accepted: a task flown by state")
    if hasattr(policy, "predict"):
        _check_model(policy, normalize)
    layers, operators, most = _layers(policy)
    if (shown := layers[0][0].shape[0]) != stepper.size:
        raise ValueError(f"policy takes {shown} numbers; accepted: {stepper.size}, as its environment shows")
    if (acts := layers[-1][0].shape[1]) != (wanted := stepper.env.action_size):
        raise ValueError(f"policy returns {acts} numbers; accepted: {wanted}, the commands of the vehicle")
    if not all(np.isfinite(x).all() for layer in layers for x in layer):
        raise ValueError("policy has weights that are not finite; accepted: finite numbers (did the training diverge?)")
    graph = perceptron_graph(stepper.features, layers, operators, stepper.raw, _normal(normalize), most)
    config = dataclasses.replace(stepper.config, network=NetworkConfig())  # the preset's network does not apply
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "policy.onnx"
        write_policy(file, graph, contract_of(stepper.env, config))
        _compare(file, policy, stepper, normalize)
        write_atomically(Path(path), file.read_bytes())
    return Path(path)


def _stepper(env: Any) -> tuple[Stepper, Any]:
    """The stepper of the environment of `e2efly.adapters` inside the wrappers, and the `VecNormalize` around it, or
    None.
    """
    normalize = None
    while "stepper" not in getattr(env, "__dict__", ()):  # a wrapper may pass on the attributes of what it wraps
        name, package = type(env).__name__, type(env).__module__.partition(".")[0]
        if name not in WRAPPERS or package not in ("e2efly", "gymnasium", "stable_baselines3"):
            accepted = f"an environment of e2efly.adapters, also inside of {', '.join(WRAPPERS)}"
            raise ValueError(f"env is {env!r}; accepted: {accepted}")
        normalize = env if name == "VecNormalize" else normalize
        inner = next(getattr(env, field) for field in ("venv", "envs", "env") if hasattr(env, field))
        env = inner[0] if isinstance(inner, list | tuple) else inner
    return env.stepper, normalize


def _check_model(model: Any, normalize: Any) -> None:
    """Refuse a model of Stable-Baselines3 whose environment acts or shows otherwise than the one that is exported."""
    low, high = (np.asarray(getattr(model.action_space, end, np.nan)) for end in ("low", "high"))
    if not (np.all(low == -1) and np.all(high == 1)):
        raise ValueError(
            f"policy acts in {model.action_space}; accepted: [-1, 1], as the environments of e2efly.adapters"
        )
    own = None
    if model.get_env() is not None:
        own = _stepper(model.get_env())[1]
    # what `VecNormalize` was given stands in the model's file, too
    learned = model._last_obs is not None
    under = own is not None or model._last_original_obs is not None
    pickled = "VecNormalize.load('vecnormalize.pkl', SB3VecEnv(...)), which was saved with the model"
    if under and normalize is None:
        raise ValueError(f"policy was learned under a VecNormalize, and env has none; accepted: env={pickled}")
    if normalize is None or not normalize.norm_obs:
        return
    if learned and not under:
        raise ValueError("env has a VecNormalize, without which policy was learned; accepted: env without it")
    if learned and normalize.obs_rms.count < 1:
        raise ValueError(f"env has a VecNormalize that has seen no observation; accepted: env={pickled}")
    if (
        own is not None
        and own.norm_obs
        and not all(np.array_equal(getattr(own.obs_rms, x), getattr(normalize.obs_rms, x)) for x in ("mean", "var"))
    ):
        raise ValueError("env has another VecNormalize than policy, with other statistics; accepted: that of policy")


def _normal(normalize: Any) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Mean, standard deviation and clipping limit of a `VecNormalize`. None: observations are not normalised."""
    if normalize is None or not normalize.norm_obs:
        return None
    rms = normalize.obs_rms
    return rms.mean, np.sqrt(rms.var + normalize.epsilon), float(normalize.clip_obs)


def _layers(policy: Any) -> tuple[Layers, list[str], float]:
    """Weights and biases of each linear layer, the operator after it (after the last: Tanh or Identity), and the
    largest action.
    """
    network, squashed = _network(policy)
    leaves, most = _leaves(network), math.inf
    if leaves and isinstance(last := leaves[-1], torch.nn.Hardtanh) and last.min_val == -last.max_val:
        most = math.tanh(last.max_val) if squashed else last.max_val  # gSDE limits the mean, before the tangent
        leaves.pop()
    layers: Layers = []
    operators: list[str] = []
    for part in leaves:
        if type(part) is torch.nn.Linear:
            operators += ["Identity"] * (len(layers) - len(operators))
            bias = torch.zeros(part.out_features) if part.bias is None else part.bias
            layers.append((_float32(part.weight.T), _float32(bias)))
        elif type(part) in OPERATORS and len(layers) == len(operators) + 1:
            operators.append(OPERATORS[type(part)])
        elif type(part) not in (torch.nn.Identity, torch.nn.Flatten, torch.nn.Dropout):
            accepted = ", ".join(kind.__name__ for kind in OPERATORS)
            raise ValueError(f"policy has a layer {part!r}; accepted: Linear, each with one of {accepted}")
    if not layers:
        raise ValueError("policy has no linear layer; accepted: one or more")
    last = operators.pop() if len(operators) == len(layers) else "Identity"
    if last not in ("Tanh", "Identity"):
        raise ValueError(f"policy ends with the activation {last}; accepted: Tanh, or none")
    return layers, [*operators, "Tanh" if squashed else last], most


def _network(policy: Any) -> tuple[torch.nn.Sequential, bool]:
    """The network from observation to action, and whether a hyperbolic tangent follows it."""
    learned = getattr(policy, "policy", policy)
    actor: Any = getattr(learned, "actor", learned)
    if _is_recurrent(actor):
        raise ValueError(f"policy {type(policy).__name__} is recurrent; accepted: networks without memory")
    if type(actor) is torch.nn.Sequential:
        return actor, False
    if (kind := _kind(learned)) not in POLICIES:
        raise ValueError(
            f"policy is a {kind}; accepted: {', '.join(POLICIES.values())} of "
            "Stable-Baselines3 with MlpPolicy itself, or a torch.nn.Sequential"
        )
    if (extractor := _kind(actor.features_extractor)) != EXTRACTOR:
        raise ValueError(f"policy extracts features by {extractor}; accepted: MlpPolicy's FlattenExtractor")
    if hasattr(actor, "action_net"):
        return torch.nn.Sequential(actor.mlp_extractor.policy_net, actor.action_net), actor.squash_output
    return torch.nn.Sequential(getattr(actor, "latent_pi", torch.nn.Identity()), actor.mu), True


def _kind(thing: Any) -> str:
    """Module and name of a class: a class of the same name in another place is another one."""
    return f"{type(thing).__module__}.{type(thing).__qualname__}"


def _is_recurrent(network: Any) -> bool:
    kinds = torch.nn.RNNBase | torch.nn.RNNCellBase
    return isinstance(network, torch.nn.Module) and any(isinstance(part, kinds) for part in network.modules())


def _leaves(part: torch.nn.Module) -> list[torch.nn.Module]:
    if type(part) is not torch.nn.Sequential:
        return [part]
    return [leaf for child in part for leaf in _leaves(child)]


def _float32(x: torch.Tensor) -> np.ndarray:
    return x.detach().cpu().numpy().astype(np.float32)


def _compare(path: Path, policy: Any, stepper: Stepper, normalize: Any) -> None:
    observation = random_observations(np.random.default_rng(0), stepper.env.fields, 1000)
    shown = np.array(stepper.shown(jnp.asarray(observation)))
    shown = shown if normalize is None else normalize.normalize_obs(shown)
    if hasattr(policy, "predict"):
        wanted = policy.predict(shown, deterministic=True)[0]
    else:
        with torch.no_grad():
            wanted = copy.deepcopy(policy).cpu().float().eval()(torch.as_tensor(shown)).numpy()
    worst = float(np.abs(load_policy(path).act(observation)[0] - np.clip(wanted, -1, 1)).max())
    if not worst <= CLOSE:  # also for NaN
        raise ValueError(
            f"actions of the file differ by {worst:.2g} from the policy's; accepted: {CLOSE:g}, of activations with "
            "their default parameters"
        )
