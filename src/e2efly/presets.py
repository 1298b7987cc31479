"""The configurations that a task is learned by: our own, the paper's, and variants of the task. Imports no JAX.

A preset is a `TrainConfig`; a variant of one is `dataclasses.replace`.
"""

import dataclasses
import math
from collections.abc import Iterator
from typing import Any

from e2efly.config import (
    ALGORITHMS,
    ABPTConfig,
    AlgorithmConfig,
    BPTTConfig,
    EnvConfig,
    PPOConfig,
    RewardConfig,
    TaskConfig,
    TrainConfig,
)
from e2efly.tasks import TASKS
from e2efly.vehicles.names import unknown

OURS, PAPER = "ours", "paper"


def names() -> tuple[str, ...]:
    """The presets that there are; not every task has each."""
    return OURS, PAPER, *dict.fromkeys(name for task in TASKS.values() for name in task.variants)


def preset(task: str, algo: str, name: str = OURS) -> TrainConfig:
    """The configuration of a task and an algorithm.

    Args:
        task: its name, or the reference of one's own: `path/to/file.py:Name`, `package.module:Name`.
        algo: of `ALGORITHMS`.
        name: of `names()`.

    Raises:
        ValueError: for an unknown name, with the nearest one and all there are; for a preset that the task has not.
    """
    options = TASKS.find(task)
    for kind, value, known in (("algorithm", algo, ALGORITHMS), ("preset", name, names())):
        if value not in known:
            raise ValueError(unknown(kind, value, known))
    if name == PAPER:
        return _paper(options, algo)
    config = _ours(options, algo)
    if name == OURS:
        return config
    if name not in options.variants:
        having = ", ".join(other for other, known in TASKS.items() if name in known.variants)
        raise ValueError(f"preset {name!r}: accepted for task {having}, not {options.name!r}")
    return options.variant(name, config)


def _ours(task: type[TaskConfig], algo: str) -> TrainConfig:
    return task.recipe(algo) if algo in ("ppo", "bptt") else _with_critic(task, algo)


def _with_critic(task: type[TaskConfig], algo: str) -> TrainConfig:
    """BPTT's preset with critics, and rewards that suit them."""
    config = task.recipe("bptt")
    shared = ("max_grad_norm", "gradient_decay") if algo == "foppo" else (
        "max_grad_norm", "gradient_decay", "learning_rate", "learning_rate_end", "envs"
    )  # fmt: skip
    taken: dict[str, Any] = {name: getattr(config.algo, name) for name in shared} | task.with_critic(algo)
    smooth = task.smooth
    reward = task.recipe("ppo").reward if smooth is None else RewardConfig(dict(smooth), config.reward.parameters)
    return dataclasses.replace(config, algo=dataclasses.replace(ALGORITHMS[algo], **taken), reward=reward)


def _paper(task: type[TaskConfig], algo: str) -> TrainConfig:
    """The paper's rewards, sizes and learning rates (its tables; see docs/rewards.md for what it leaves open)."""
    if algo in ("shac", "foppo"):
        raise ValueError(f"preset 'paper': the paper does not train by {algo!r}; accepted: ppo, bptt, abpt")
    given = task.paper
    if given is None:
        having = ", ".join(name for name, known in TASKS.items() if known.paper is not None)
        raise ValueError(f"preset 'paper': the paper has no reward for task {task.name!r}; accepted: {having}")
    weights = dict(given.weights)
    if algo == "ppo":
        weights |= given.ppo
        settings: AlgorithmConfig = PPOConfig(
            envs=100, horizon=256, minibatch=25_600, epochs=10, learning_rate=1e-4, learning_rate_end=1e-5,
            gamma=0.99,
        )  # fmt: skip
    elif algo == "abpt":
        settings = ABPTConfig(
            envs=100, horizon=96, collect=10, buffer=100_000, places=1000, minibatch=25_600, learning_rate=1e-3,
            learning_rate_end=1e-5, critic_rate=1.0, gamma=0.99, target_share=0.005,
        )  # fmt: skip
    else:
        settings = BPTTConfig(envs=100, horizon=96, learning_rate=1e-3, learning_rate_end=1e-5)
    steps = given.millions[algo != "ppo"] * 1_000_000
    seen = tuple(dataclasses.replace(camera, width=64, height=64) for camera in task.cameras)
    return TrainConfig(
        task.training(), settings, RewardConfig(weights), EnvConfig(cameras=seen), steps=steps, chunk=10,
        curriculum=task.curriculum,
    )  # fmt: skip


def algorithm_name(config: AlgorithmConfig) -> str:
    """The name of an algorithm's configuration."""
    return next(name for name, known in ALGORITHMS.items() if type(known) is type(config))


def check(config: TrainConfig) -> None:
    """Check the numbers of a run.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    for name, value in _whole_numbers("", config):
        if abs(value) >= (10**300 if name == "steps" else 2**53):  # of steps, the time is told
            raise ValueError(f"{name} is {value}; accepted: whole numbers below 2^53")
    for name in ("steps", "chunk", "eval_episodes"):
        if getattr(config, name) <= 0:
            raise ValueError(f"{name} is {getattr(config, name)}; accepted: more than 0")
    config.algo.check()
    if not config.network.hidden or min(config.network.hidden) <= 0:
        raise ValueError(f"network.hidden is {config.network.hidden}; accepted: one or more positive sizes")
    if not 0 <= config.seed < 2**32:
        raise ValueError(f"seed is {config.seed}; accepted: 0 to 2^32 - 1")
    if config.stop_at is not None and not 0 < config.stop_at <= 1:
        raise ValueError(f"stop_at is {config.stop_at}; accepted: above 0, at most 1")
    for name, value in (*config.reward.weights.items(), *config.reward.parameters.items()):
        if not math.isfinite(value):
            raise ValueError(f"reward {name} is {value}; accepted: a finite number")
    if not config.reward.weights:
        raise ValueError("reward.weights is empty; accepted: at least one term (see `e2efly list`)")


def _whole_numbers(name: str, value: Any) -> Iterator[tuple[str, int]]:
    """Every whole number of a configuration, with its name."""
    if dataclasses.is_dataclass(value):
        for field in dataclasses.fields(value):
            yield from _whole_numbers(f"{name}.{field.name}" if name else field.name, getattr(value, field.name))
    elif isinstance(value, tuple):
        for i, entry in enumerate(value):
            yield from _whole_numbers(f"{name}[{i}]", entry)
    elif isinstance(value, int):
        yield name, value
