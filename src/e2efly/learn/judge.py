"""How good a policy is: episodes of every criterion, and what to make of them."""

import math
from typing import Any

import jax
import numpy as np

from e2efly.config import TaskConfig
from e2efly.env import random_key
from e2efly.evaluate import Episodes
from e2efly.learn.networks import Weights
from e2efly.learn.setup import Setup

WATCHED, CONFIRMED, REPORTED = 1, 2, 3
"""Streams of starts: those that training watches, those that a goal is met on, and the unseen ones of the report."""


def judge(
    setup: Setup, evaluate: Any, weights: Weights, stream: int, episodes: int, seed: int = 0, stage: int = -1
) -> dict[str, Episodes]:
    """Fly at least `episodes` starts of a stream for every criterion of a stage; NumPy arrays."""
    once = setup.config.eval_episodes
    flown = {}
    for name, env in setup.stages[stage].judges.items():
        keys = [random_key(seed, stream, i) for i in range(math.ceil(episodes / once))]
        parts = [jax.tree.map(lambda x: np.asarray(x)[:once], evaluate(env, weights, key)) for key in keys]
        flown[name] = jax.tree.map(lambda *x: np.concatenate(x)[:episodes], *parts)
    return flown


def success(flown: dict[str, Episodes]) -> float:
    """The success rate of the worst criterion."""
    return min(float(np.mean(e.success)) for e in flown.values())


def score(task: TaskConfig, flown: dict[str, Episodes]) -> float:
    """What the best policy is chosen by: success of the worst criterion; among equals, the task's `precision`.

    No precision counts as much as one more success among the episodes.
    """

    def cost(e: Episodes) -> float:
        if task.precision == "duration":
            return float(np.mean(e.duration[e.success])) / 10 if np.any(e.success) else math.inf
        return float(np.mean(getattr(e, task.precision)))

    return min(float(np.mean(e.success)) - 0.5 * math.tanh(cost(e)) / len(e.success) for e in flown.values())


def digest(e: Episodes) -> dict[str, float | None]:
    """Means over episodes, and over the successful ones for the time: None without any."""
    ok = np.asarray(e.success)
    return {
        "success": round(float(np.mean(ok)), 4),
        "final_error_m": round(float(np.mean(e.final_error)), 5),
        "mean_error_m": round(float(np.mean(e.mean_error)), 5),
        "seconds_of_success": round(float(np.mean(e.duration[ok])), 4) if ok.any() else None,
        "top_speed_m_s": round(float(np.max(e.top_speed)), 3),
        "roughness": round(float(np.mean(e.roughness)), 5),
    }
