"""A good configuration for every task and algorithm, and the paper's. Imports no JAX.

A preset is a function that returns a `TrainConfig`; a variant of one is `dataclasses.replace`.
"""

import dataclasses
import math
from collections.abc import Callable

from e2efly.config import (
    AlgorithmConfig,
    BPTTConfig,
    HoverConfig,
    LandConfig,
    PPOConfig,
    RaceConfig,
    RewardConfig,
    TaskConfig,
    TrackConfig,
    TrainConfig,
)
from e2efly.vehicles.names import unknown

TASKS: dict[str, TaskConfig] = {
    "hover": HoverConfig(),
    "land": LandConfig(),
    "track": TrackConfig(),
    "race": RaceConfig(laps=0),
}
"""The task that each name trains on. Races go on for lap after lap; evaluation ends after one."""

ALGORITHMS: dict[str, AlgorithmConfig] = {"ppo": PPOConfig(), "bptt": BPTTConfig()}
"""Algorithms by name, with the defaults of their presets."""

_PAPER_WEIGHTS: dict[str, dict[str, float]] = {
    "hover": {"prog2": 0.01, "ori2": 0.0001, "v1": 0.002, "anglev": 0.002},
    "land": {"progxy": 0.04, "vz": 0.1, "anglev": 0.001},
    "track": {"prog2": 0.02, "ori2": 0.001, "v1": 0.002, "anglev": 0.002},
    "race": {"prog1": 0.9, "ori2": 0.001, "v1": 0.002, "anglev": 0.002},
}
_PAPER_PPO_EXTRA: dict[str, dict[str, float]] = {
    "hover": {"act3": 1.0, "goal": 1.0, "crash": 1.0},
    "land": {"act3": 1.0, "goal": 1.0, "crash": 1.0},
    "track": {"act3": 1.0, "crash": 1.0},
    "race": {"act3": 1.0, "goal": 5.0, "crash": 4.0},
}


def _hover(algo: str) -> TrainConfig:
    if algo == "ppo":
        weights = {"near": 1.0, "v1": 0.02, "anglev_sq": 0.002, "act2_sq": 0.02}
        return TrainConfig(HoverConfig(), PPOConfig(), RewardConfig(weights), steps=2_500_000)
    weights = {"prog2": 1.0, "v1": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
    return TrainConfig(HoverConfig(), BPTTConfig(), RewardConfig(weights), steps=1_000_000, chunk=10)


def _land(algo: str) -> TrainConfig:
    if algo == "ppo":
        weights = {
            "prog1": 4.0, "descent": 0.2, "upright": 0.05, "anglev_sq": 0.002, "act2_sq": 0.02,
            "goal": 10.0, "crash": 10.0,
        }  # fmt: skip
        settings: AlgorithmConfig = PPOConfig(learning_rate=5e-3, learning_rate_end=5e-4)
        return TrainConfig(LandConfig(), settings, RewardConfig(weights), steps=2_000_000)
    weights = {"progxy": 1.0, "descent": 1.0, "upright": 0.1, "anglev_sq": 0.02, "act2_sq": 0.02}
    return TrainConfig(LandConfig(), BPTTConfig(learning_rate=8e-3), RewardConfig(weights), steps=1_000_000, chunk=10)


def _track(algo: str) -> TrainConfig:
    if algo == "ppo":
        weights = {"near": 1.0, "anglev_sq": 0.002, "act2_sq": 0.02}
        settings: AlgorithmConfig = PPOConfig(horizon=48, gamma=0.95, learning_rate=5e-3)
        return TrainConfig(TrackConfig(), settings, RewardConfig(weights), steps=2_000_000)
    weights = {"prog2": 1.0, "anglev_sq": 0.01, "act2_sq": 0.02}
    settings = BPTTConfig(horizon=32, learning_rate=8e-3)
    return TrainConfig(TrackConfig(), settings, RewardConfig(weights), steps=1_000_000)


def _race(algo: str) -> TrainConfig:
    if algo == "ppo":
        weights = {"prog1": 1.0, "anglev_sq": 0.0005, "act2_sq": 0.005, "goal": 1.0, "crash": 1.0}
        settings: AlgorithmConfig = PPOConfig(gamma=0.97, learning_rate=5e-3, learning_rate_end=5e-4)
        return TrainConfig(RaceConfig(laps=0), settings, RewardConfig(weights), steps=3_000_000)
    weights = {"prog1": 1.0, "near": 0.1, "anglev_sq": 0.0005, "act2_sq": 0.005}
    settings = BPTTConfig(learning_rate=8e-3, max_grad_norm=1.0, gradient_decay=1.0)
    return TrainConfig(RaceConfig(laps=0), settings, RewardConfig(weights), steps=2_500_000, chunk=15)


_OURS: dict[str, Callable[[str], TrainConfig]] = {"hover": _hover, "land": _land, "track": _track, "race": _race}


def _paper(task: str, algo: str) -> TrainConfig:
    """The paper's rewards, sizes and learning rates (its tables; see docs/rewards.md for what it leaves open)."""
    weights = dict(_PAPER_WEIGHTS[task])
    if algo == "ppo":
        weights |= _PAPER_PPO_EXTRA[task]
        settings: AlgorithmConfig = PPOConfig(
            envs=100, horizon=256, minibatch=25_600, epochs=10, learning_rate=1e-4, learning_rate_end=1e-5,
            gamma=0.99,
        )  # fmt: skip
        steps = {"hover": 50, "land": 100, "track": 50, "race": 100}[task] * 1_000_000
    else:
        settings = BPTTConfig(envs=100, horizon=96, learning_rate=1e-3, learning_rate_end=1e-5)
        steps = {"hover": 10, "land": 10, "track": 20, "race": 50}[task] * 1_000_000
    return TrainConfig(TASKS[task], settings, RewardConfig(weights), steps=steps, chunk=10)


PRESETS: dict[str, Callable[[str, str], TrainConfig]] = {
    "ours": lambda task, algo: _OURS[task](algo),
    "paper": _paper,
}
"""Presets by name: functions of the task's and the algorithm's name."""


def preset(task: str, algo: str, name: str = "ours") -> TrainConfig:
    """The configuration of a task and an algorithm.

    Raises:
        ValueError: for an unknown name, with the nearest one and all there are.
    """
    for kind, value, known in (("task", task, TASKS), ("algorithm", algo, ALGORITHMS), ("preset", name, PRESETS)):
        if value not in known:
            raise ValueError(unknown(kind, value, known))
    return PRESETS[name](task, algo)


def task_name(config: TaskConfig) -> str:
    """The name of a task's configuration."""
    return next(name for name, known in TASKS.items() if type(known) is type(config))


def algorithm_name(config: AlgorithmConfig) -> str:
    """The name of an algorithm's configuration."""
    return next(name for name, known in ALGORITHMS.items() if type(known) is type(config))


def suites(config: TaskConfig) -> dict[str, TaskConfig]:
    """What a task is evaluated on, by name: its criteria. A policy counts by its worst.

    Tracking trained on random references is judged on a circle and on a lemniscate, which it never saw; a race is
    judged on one lap.
    """
    if isinstance(config, TrackConfig) and config.reference == "polynomial":
        return {
            "circle": dataclasses.replace(config, reference="circle", mean_error=0.08),
            "lemniscate": dataclasses.replace(config, reference="lemniscate", mean_error=0.15),
        }
    if isinstance(config, RaceConfig):
        return {"race": dataclasses.replace(config, laps=max(config.laps, 1))}
    return {task_name(config): config}


def check(config: TrainConfig) -> None:
    """Check the numbers of a run.

    Raises:
        ValueError: naming the field, the value and what is accepted.
    """
    algo = config.algo
    positive = {
        "steps": config.steps, "chunk": config.chunk, "eval_episodes": config.eval_episodes,
        "algo.envs": algo.envs, "algo.horizon": algo.horizon, "algo.learning_rate": algo.learning_rate,
        "algo.learning_rate_end": algo.learning_rate_end, "algo.max_grad_norm": algo.max_grad_norm,
    }  # fmt: skip
    if isinstance(algo, PPOConfig):
        positive |= {"algo.epochs": algo.epochs, "algo.minibatch": algo.minibatch}
    for name, value in positive.items():
        if not (math.isfinite(value) and value > 0):
            raise ValueError(f"{name} is {value}; accepted: more than 0")
    if not 0 < algo.gamma <= 1:
        raise ValueError(f"algo.gamma is {algo.gamma}; accepted: above 0, at most 1")
    if isinstance(algo, PPOConfig) and (algo.envs * algo.horizon) % algo.minibatch:
        raise ValueError(
            f"algo.minibatch is {algo.minibatch}; accepted: a divisor of algo.envs * algo.horizon "
            f"({algo.envs * algo.horizon})"
        )
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
