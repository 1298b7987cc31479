"""The presets `paper` and `authors`: a task as the paper trains it, and as its authors' public code does.

What the paper gives are the weights, steps and sizes of its tables. What it does not give is a `Sourced`, with its
source. Imports no JAX.
"""

import dataclasses
from typing import Any

from e2efly.config import (
    ABPTConfig,
    AlgorithmConfig,
    BPTTConfig,
    EnvConfig,
    PPOConfig,
    RewardConfig,
    Sourced,
    TaskConfig,
    TrainConfig,
)
from e2efly.config.run import CRL_RACING, VISFLY
from e2efly.tasks import TASKS

NAMES = ("paper", "authors")
"""The names of the presets. Their sizes are conditions of somebody else's result: the same on every device."""
SILENT = (
    Sourced("algo.decay", "linear", f"{VISFLY}: utils/algorithms/lr_scheduler.py"),
    Sourced("algo.epochs", 10, "default of Stable-Baselines3, on which VisFly's PPO is built", "ppo"),
    Sourced("algo.log_std", -1.0, "ours: theirs, 0, is for body rates of 1 to 3 rad/s; VIS-R's go to 10", "ppo"),
    Sourced("env.past_actions", 0, "the paper's observations have 13, 16, 17 and 40 numbers: none for past actions"),
)
"""Values of every task that the paper does not give."""
AUTHORS = (
    Sourced("env.control_rate", 1 / 0.03, f"{VISFLY}: envs/base/dynamics.py, ctrl_dt 0.03 s"),
    Sourced("env.action_latency", (0.06, 0.06), f"{VISFLY}: envs/base/dynamics.py, comm_delay"),
    Sourced(
        "env.command_range", ((0.0, -2.0, -2.0, -2.0), (29.43, 2.0, 2.0, 2.0)),
        f"{VISFLY}: configs/drone/drone_state.json, max_rate 2.0 rad/s and max_acc 3 g",
    ),
    Sourced("task.episode_s", 7.68, f"{VISFLY}: max_episode_steps 256 of 0.03 s"),
    Sourced("algo.learning_rate", 1e-3, f"{CRL_RACING}: examples/ete_racing_sim/run.py", "ppo"),
    Sourced("algo.learning_rate_end", 1e-4, f"{CRL_RACING}: examples/ete_racing_sim/run.py, lr_schedule", "ppo"),
    Sourced("algo.epochs", 5, f"{VISFLY}: exps/examples/alg_cfgs/landing/PPO.yaml", "ppo"),
    Sourced("algo.log_std", 0.0, "default of Stable-Baselines3, on which VisFly's PPO is built", "ppo"),
)  # fmt: skip
"""Values of every task in the authors' public code."""


def papers(task: type[TaskConfig], algo: str) -> TrainConfig:
    """The preset `paper`: the paper's rewards, sizes, learning rates and observations.

    Raises:
        ValueError: for a task or an algorithm that the paper does not have.
    """
    config = _tables(task, algo)
    return _with(config, (*SILENT, *task.paper.silent))  # type: ignore[union-attr]


def authors(task: type[TaskConfig], algo: str) -> TrainConfig:
    """The preset `authors`: the preset `paper` with the starts, limits, delays and rewards of the public code.

    Raises:
        ValueError: for a task or an algorithm that the paper does not have.
    """
    return _with(papers(task, algo), (*AUTHORS, *task.paper.authors))  # type: ignore[union-attr]


def _tables(task: type[TaskConfig], algo: str) -> TrainConfig:
    """What the paper's tables give."""
    if algo not in ("ppo", "bptt", "abpt"):
        raise ValueError(f"presets 'paper', 'authors': the paper does not train by {algo!r}; accepted: ppo, bptt, abpt")
    given = task.paper
    if given is None:
        having = ", ".join(name for name, known in TASKS.items() if known.paper is not None)
        raise ValueError(
            f"presets 'paper', 'authors': the paper has no reward for task {task.name!r}; accepted: {having}"
        )
    if algo == "ppo":
        settings: AlgorithmConfig = PPOConfig(
            envs=100, horizon=256, minibatch=25_600, learning_rate=1e-4, learning_rate_end=1e-5, gamma=0.99,
        )  # fmt: skip
    elif algo == "abpt":
        settings = ABPTConfig(
            envs=100, horizon=96, collect=10, buffer=100_000, places=1000, minibatch=25_600, learning_rate=1e-3,
            learning_rate_end=1e-5, critic_rate=1.0, gamma=0.99, target_share=0.005,
        )  # fmt: skip
    else:
        settings = BPTTConfig(envs=100, horizon=96, learning_rate=1e-3, learning_rate_end=1e-5)
    seen = tuple(dataclasses.replace(camera, width=64, height=64) for camera in task.cameras)
    return TrainConfig(
        task.training(), settings, RewardConfig(dict(given.weights)), EnvConfig(cameras=seen),
        steps=given.millions[algo != "ppo"] * 1_000_000, chunk=10, curriculum=task.curriculum,
    )  # fmt: skip


def _with(config: TrainConfig, given: tuple[Sourced, ...]) -> TrainConfig:
    """A configuration with those of the values that are for its algorithm."""
    for one in given:
        if one.algo in ("", config.algo.name):
            config = _set(config, one.field.split("."), one.value)
    return config


def _set(options: Any, path: list[str], value: Any) -> Any:
    name, *rest = path
    if isinstance(options, dict):
        return {key: x for key, x in (options | {name: value}).items() if x != 0}
    return dataclasses.replace(options, **{name: _set(getattr(options, name), rest, value) if rest else value})
