"""How good a policy is: episodes of every criterion, and what to make of them."""

import math
from functools import partial
from typing import Any

import jax
import numpy as np

from e2efly.config import TaskConfig
from e2efly.device import fast_compile, wide_vectors
from e2efly.env import Env, random_key
from e2efly.env.stress import ALL, ROWS, Draw, with_longer_queue
from e2efly.episodes import Episodes, run_episodes
from e2efly.learn.networks import Weights
from e2efly.learn.programs import acting
from e2efly.learn.setup import Setup

WATCHED, CONFIRMED, REPORTED = 1, 2, 3
"""Streams of starts: those that training watches, those that a goal is met on, and the unseen ones of the report."""
LEARNED = 0.95
"""Success by the worst criterion from which on a task counts as learned, where the user asks for no other."""


def judge(
    setup: Setup, evaluate: Any, weights: Weights, stream: int, episodes: int, judges: dict[str, Env] | None = None
) -> dict[str, Episodes]:
    """Fly at least `episodes` starts of a stream in every environment of `judges`, which are the task's own where none
    are given; NumPy arrays.
    """
    once = setup.config.eval_episodes
    flown = {}
    for name, env in (setup.judges if judges is None else judges).items():
        keys = [random_key(0, stream, i) for i in range(math.ceil(episodes / once))]
        parts = [jax.tree.map(lambda x: np.asarray(x)[:once], evaluate(env, weights, key)) for key in keys]
        flown[name] = jax.tree.map(lambda *x: np.concatenate(x)[:episodes], *parts)
    return flown


def stressed(setup: Setup, weights: Weights, episodes: int) -> dict[str, Episodes]:
    """Fly so many starts of every criterion, each with a vehicle, air and sensors that draw all rows of the stress at
    once (`e2efly.env.stress`); NumPy arrays.
    """
    rng, flown = np.random.default_rng(REPORTED), {}
    options = fast_compile() if setup.config.fast_compile else {}

    @partial(jax.jit, compiler_options=options | wide_vectors(episodes))
    def program(env: Env, weights: Weights, key: Any, draw: Draw) -> Episodes:
        act, steps = acting(setup.actor, weights), setup.episode_steps
        return run_episodes(draw.env(env), act, key, episodes, steps, setup.settle, altered=partial(draw.state, env))

    for name, env in setup.judges.items():
        draw = Draw.of(ROWS[ALL], env.physics.nominal, rng, episodes)
        draw = jax.tree.map(lambda x: np.asarray(x, np.float32), draw)
        found = program(with_longer_queue(env), weights, random_key(0, REPORTED), draw)
        flown[name] = jax.tree.map(np.asarray, found)
    return flown


def success(flown: dict[str, Episodes]) -> float:
    """The success rate of the worst criterion."""
    return min(float(np.mean(e.success)) for e in flown.values())


def score(task: TaskConfig, flown: dict[str, Episodes]) -> float:
    """What the best policy is chosen by: success of the worst criterion; among equals, the task's `precision`.

    No precision counts as much as one more success among the episodes, but for a task whose precision is `pace`: there
    each success counts by one over the time that it took (success weighted by completion time, SCT), by the geometric
    mean of the criteria.
    """
    if task.precision == "pace":
        paces = [float(np.mean(e.success / np.maximum(e.duration, 1e-3))) for e in flown.values()]
        return float(np.prod(paces)) ** (1 / len(paces))

    def cost(e: Episodes) -> float:
        if task.precision == "duration":
            return float(np.mean(e.duration[e.success])) / 10 if np.any(e.success) else math.inf
        return float(np.mean(getattr(e, task.precision)))

    return min(float(np.mean(e.success)) - 0.5 * math.tanh(cost(e)) / len(e.success) for e in flown.values())


def worst_success(found: dict[str, Any]) -> float:
    """The success rate of the worst criterion, of `shipped` or `last` in a run's summary."""
    return min(criterion["success"] for name, criterion in found.items() if name != "update")


def reported(summary: dict[str, Any]) -> float:
    """The success of a run's best policy: on the vehicle of the file, and by its worst criterion."""
    return worst_success(summary.get("nominal", summary["shipped"]))


def verdict(summary: dict[str, Any], stop_at: float | None) -> str:
    """Whether a run learned its task: what `stop_at` asks for, or most of the starts of its worst criterion.

    Args:
        summary: of the run.
        stop_at: the success that the user asked for.
    """
    what, rate = f"{summary['task']} by {summary['algorithm'].upper()}", reported(summary)
    if stop_at:  # which was asked of the vehicles of the training
        rate = worst_success(summary["shipped"])
    if summary["reached_criterion"] or rate >= (stop_at or LEARNED):
        return f"Learned {what}: {rate:.1%} success"
    if rate == 0:
        return f"Did not learn {what}: no success"
    return f"Did not learn {what} reliably: {rate:.1%} success"
