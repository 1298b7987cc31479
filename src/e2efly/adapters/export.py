"""Export a policy that Stable-Baselines3 or PyTorch has learned as a `policy.onnx` with a contract.

`pip install 'e2efly[sb3]'` or `'e2efly[torch]'`.
"""

import copy
import dataclasses
import os
import tempfile
from pathlib import Path
from typing import Any

import jax.numpy as jnp
import numpy as np
import torch

from e2efly.adapters.stepper import Stepper
from e2efly.config import NetworkConfig
from e2efly.deploy.policy.draws import random_observations
from e2efly.deploy.policy.loader import load_policy
from e2efly.learn.export import contract_of, write_policy
from e2efly.learn.graph import perceptron_graph
from e2efly.learn.networks import Layers
from e2efly.storage import write_atomically

OPERATORS = {
    torch.nn.Identity: "Identity", torch.nn.Tanh: "Tanh", torch.nn.ReLU: "Relu", torch.nn.ELU: "Elu",
    torch.nn.Sigmoid: "Sigmoid", torch.nn.Softplus: "Softplus", torch.nn.LeakyReLU: "LeakyRelu",
}  # fmt: skip
"""ONNX operators for activations with their default parameters."""
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
        policy: a model of Stable-Baselines3 (PPO, A2C, SAC, TD3 or DDPG with MlpPolicy), whose deterministic action is
            exported, or a `torch.nn.Sequential` of linear layers and activations. Actions are clipped to [-1, 1].
        path: the file to write.
        env: the environment of `e2efly.adapters` in which the policy was learned, with its wrappers. The normalisation
            of a `VecNormalize` is exported, too. May be omitted for a model of Stable-Baselines3, which knows its
            environment.

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
    layers, operators = _layers(policy)
    if (shown := layers[0][0].shape[0]) != stepper.size:
        raise ValueError(f"policy takes {shown} numbers; accepted: {stepper.size}, as its environment shows")
    if (acts := layers[-1][0].shape[1]) != 4:
        raise ValueError(f"policy returns {acts} numbers; accepted: 4, the commands of a quadrotor")
    if not all(np.isfinite(x).all() for layer in layers for x in layer):
        raise ValueError("policy has weights that are not finite; accepted: finite numbers (did the training diverge?)")
    graph = perceptron_graph(stepper.features, layers, operators, stepper.raw, _normal(normalize))
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
    while not hasattr(env, "stepper"):
        name = type(env).__name__
        if name not in WRAPPERS:
            accepted = f"an environment of e2efly.adapters, also inside of {', '.join(WRAPPERS)}"
            raise ValueError(f"env is {env!r}; accepted: {accepted}")
        normalize = env if name == "VecNormalize" else normalize
        inner = next(getattr(env, field) for field in ("venv", "envs", "env") if hasattr(env, field))
        env = inner[0] if isinstance(inner, list | tuple) else inner
    return env.stepper, normalize


def _normal(normalize: Any) -> tuple[np.ndarray, np.ndarray, float] | None:
    """Mean, standard deviation and clipping limit of a `VecNormalize`. None: observations are not normalised."""
    if normalize is None or not normalize.norm_obs:
        return None
    rms = normalize.obs_rms
    return rms.mean, np.sqrt(rms.var + normalize.epsilon), float(normalize.clip_obs)


def _layers(policy: Any) -> tuple[Layers, list[str]]:
    """Weights and biases of each linear layer, and the operator after it (after the last: Tanh or Identity)."""
    network, squashed = _network(policy)
    layers: Layers = []
    operators: list[str] = []
    for part in _leaves(network):
        if isinstance(part, torch.nn.Linear):
            operators += ["Identity"] * (len(layers) - len(operators))
            bias = torch.zeros(part.out_features) if part.bias is None else part.bias
            layers.append((_float32(part.weight.T), _float32(bias)))
        elif type(part) in OPERATORS and len(layers) == len(operators) + 1:
            operators.append(OPERATORS[type(part)])
        elif not isinstance(part, torch.nn.Identity | torch.nn.Flatten | torch.nn.Dropout):
            accepted = ", ".join(kind.__name__ for kind in OPERATORS)
            raise ValueError(f"policy has a layer {part!r}; accepted: Linear, each with one of {accepted}")
    if not layers:
        raise ValueError("policy has no linear layer; accepted: one or more")
    last = operators.pop() if len(operators) == len(layers) else "Identity"
    if last not in ("Tanh", "Identity"):
        raise ValueError(f"policy ends with the activation {last}; accepted: Tanh, or none")
    return layers, [*operators, "Tanh" if squashed else last]


def _network(policy: Any) -> tuple[torch.nn.Sequential, bool]:
    """The network from observation to action, and whether a hyperbolic tangent follows it."""
    learned = getattr(policy, "policy", policy)
    actor: Any = getattr(learned, "actor", learned)
    if _is_recurrent(actor):
        raise ValueError(f"policy {type(policy).__name__} is recurrent; accepted: networks without memory")
    if isinstance(actor, torch.nn.Sequential):
        return actor, False
    extractor = type(getattr(actor, "features_extractor", None)).__name__
    if extractor not in ("NoneType", "FlattenExtractor"):
        raise ValueError(f"policy extracts features by {extractor}; accepted: MlpPolicy's FlattenExtractor")
    if hasattr(actor, "action_net"):
        return torch.nn.Sequential(actor.mlp_extractor.policy_net, actor.action_net), actor.squash_output
    if hasattr(actor, "mu"):
        return torch.nn.Sequential(getattr(actor, "latent_pi", torch.nn.Identity()), actor.mu), True
    raise ValueError(
        f"policy is a {type(policy).__name__}; accepted: PPO, A2C, SAC, TD3 or DDPG of Stable-Baselines3 with "
        "MlpPolicy, or a torch.nn.Sequential"
    )


def _is_recurrent(network: Any) -> bool:
    kinds = torch.nn.RNNBase | torch.nn.RNNCellBase
    return isinstance(network, torch.nn.Module) and any(isinstance(part, kinds) for part in network.modules())


def _leaves(part: torch.nn.Module) -> list[torch.nn.Module]:
    if not isinstance(part, torch.nn.Sequential):
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
