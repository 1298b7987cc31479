"""How good a policy is: episodes for every criterion, and their evaluation."""

import math
from functools import partial
from typing import Any

import jax
import numpy as np

from e2efly.config import TaskConfig
from e2efly.config.env import FILE, RANDOM
from e2efly.config.run import criterion
from e2efly.environment import Env, random_key
from e2efly.environment.episodes import Episodes, run_episodes
from e2efly.environment.stress_rows import ALL, ROWS, Draw, with_longer_queue
from e2efly.learning.networks import Weights
from e2efly.learning.programs import acting
from e2efly.learning.setup import Setup
from e2efly.simulation.device import fast_compile, wide_vectors

WATCHED, CONFIRMED, REPORTED = 1, 2, 3
"""Streams of starts: those of the evaluations during training, those that confirm that `stop_at` is reached, and the
unseen starts of the report."""


def judge(
    evaluate: Any, once: int, weights: Weights, stream: int, episodes: int, judges: dict[str, Env]
) -> dict[str, Episodes]:
    """Fly `episodes` starts of a stream in every environment of `judges`. `evaluate` (`Programs.evaluate`) gives `once`
    at a time.

    Returns:
        The episodes by the name of their environment, as NumPy arrays.
    """
    flown = {}
    for name, env in judges.items():
        keys = [random_key(0, stream, i) for i in range(math.ceil(episodes / once))]
        parts = [jax.tree.map(lambda x: np.asarray(x)[:once], evaluate(env, weights, key)) for key in keys]
        flown[name] = jax.tree.map(lambda *x: np.concatenate(x)[:episodes], *parts)
    return flown


def stressed(setup: Setup, weights: Weights, episodes: int) -> dict[str, Episodes]:
    """Fly `episodes` starts for every criterion. The vehicle, the air and the sensors of each start are drawn from all
    rows of the stress test at once (`e2efly.environment.stress_rows`).

    Returns:
        The episodes by the name of their criterion, as NumPy arrays.
    """
    rng, flown, count = np.random.default_rng(REPORTED), {}, setup.env.whole(episodes)
    options = fast_compile() if setup.config.fast_compile else {}

    @partial(jax.jit, compiler_options=options | wide_vectors(count))
    def program(env: Env, weights: Weights, key: Any, draw: Draw) -> Episodes:
        act, steps = acting(setup.actor, weights), setup.episode_steps
        return run_episodes(
            draw.env(env), act, key, count, steps, setup.config.task.settling_s, altered=partial(draw.state, env)
        )

    for name, env in setup.judges.items():
        draw = Draw.of(ROWS[ALL], env.physics.nominal, env.latency, rng, count)
        draw = jax.tree.map(lambda x: np.asarray(x, np.float32), draw)
        found = program(with_longer_queue(env), weights, random_key(0, REPORTED), draw)
        flown[name] = jax.tree.map(lambda x: np.asarray(x)[:episodes], found)
    return flown


def success(flown: dict[str, Episodes]) -> float:
    """The success rate of the worst criterion."""
    return min(float(np.mean(e.success)) for e in flown.values())


def score(task: TaskConfig, flown: dict[str, Episodes]) -> float:
    """The score by which the best policy is chosen: the success rate of the worst criterion, and for equal success
    rates the task's `precision`.

    The precision always counts less than one more success among the episodes. A task whose precision is `pace` is
    different. There each success counts as one divided by its duration (success weighted by completion time, SCT), and
    the score is the geometric mean over the criteria.
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
    """The success rate of the worst criterion in `shipped` or `last` of a run's summary."""
    return min(criterion["success"] for name, criterion in found.items() if name != "update")


def rates(summary: dict[str, Any]) -> dict[str, float]:
    """The success rate of a run's best policy for the worst criterion, by the name of what flew: first the vehicle of
    the file, if it flew apart, then the vehicles of the training.
    """
    many = "nominal" in summary
    names = summary.get("vehicles", {"nominal": FILE, "shipped": RANDOM if many else FILE})  # older runs named nothing
    return {names[part]: worst_success(summary[part]) for part in ("nominal", "shipped") if part in summary}


def verdict(summary: dict[str, Any], stop_at: float | None) -> str:
    """A sentence that says whether a run learned its task: by its `criterion`, with the vehicles of the training, and
    without `stop_at` also with the vehicle of the file.

    Args:
        summary: summary of the run.
        stop_at: the success rate that the user asked for.
    """
    what, found = f"{summary['task']} by {summary['algorithm'].upper()}", rates(summary)
    told = "success " + ", ".join(f"{rate:.1%} ({name})" for name, rate in found.items())
    judged = list(found.items())[-1 if stop_at else 0 :]
    if summary["reached_criterion"] or all(rate >= criterion(stop_at, name) for name, rate in judged):
        return f"Learned {what}: {told}"
    if not any(found.values()):
        return f"Did not learn {what}: no success"
    return f"Did not learn {what} reliably: {told}"
