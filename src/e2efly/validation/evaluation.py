"""Fly a policy's file from unseen starts of its task. Used by `e2efly.evaluate`, `e2efly eval` and validation."""

import dataclasses
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import numpy as np

from e2efly.config import TaskConfig
from e2efly.config.budget import FASTEST, check_memory, check_time
from e2efly.environment import UNSEEN, random_key
from e2efly.environment.episodes import Act, Episodes, rows, run_stepwise, summary
from e2efly.policy.loader import Policy, level_and_still
from e2efly.simulation.device import prepare
from e2efly.simulation.physics import State
from e2efly.validation.baseline import Baseline
from e2efly.validation.candidate import Candidate, candidate
from e2efly.vehicles.vehicle import Controller

SEED = 1_000_000
"""Default seed of the starts."""
BATCH = 250
"""Number of starts that are flown at once, or a few more for whole worlds."""
FIGURES, ROW = 200, 3000
"""Bytes for the figures of one start, and for its row of the report."""
UNITS = {
    "duration": "s", "final_error": "m", "mean_error": "m",
    "top_speed": "m/s", "mean_speed": "m/s", "top_rate": "rad/s",
    "roughness": "mean |change of action| per step, action in [-1, 1]",
    "start": "position m, velocity m/s (world), quaternion wxyz (body to world), body_rate rad/s",
    "knots": "one each 0.5 s: position m, velocity m/s, acceleration m/s^2 (world)",
}  # fmt: skip
"""Units of a start's row of a report."""


@dataclass(frozen=True)
class Evaluation:
    """Results of a policy in each criterion of its task."""

    candidate: Candidate
    """What flew."""
    seed: int
    """Seed of the starts."""
    flown: dict[str, Episodes]
    """The episodes of each criterion; NumPy arrays."""
    starts: dict[str, State]
    """The initial states of the episodes, by criterion; NumPy arrays."""
    drawn: dict[str, dict[str, np.ndarray]]
    """What else each episode draws, by criterion: `Goal.drawn`."""

    def __repr__(self) -> str:
        """The success rate of each criterion."""
        told = ", ".join(f"{name} {np.mean(e.success):.1%} of {len(e.success)}" for name, e in self.flown.items())
        return f"Evaluation({told})"

    @property
    def success(self) -> float:
        """The success rate of the worst criterion."""
        return min(float(np.mean(e.success)) for e in self.flown.values())

    def as_json(self) -> dict[str, Any]:
        """The report that `e2efly eval --json` writes: a summary for each criterion, and a row for every start."""
        return {
            **self.candidate.as_json(),
            "vehicles": self.candidate.vehicles,
            "changed": self.candidate.changed,
            "outside_of_training": self.candidate.outside,
            "env": dataclasses.asdict(self.candidate.env),
            "seed": self.seed,
            "units": UNITS,
            "criteria": {name: summary(e) | {"starts": self._rows(name)} for name, e in self.flown.items()},
        }

    def _rows(self, name: str) -> list[dict[str, Any]]:
        start, suite = self.starts[name], self.candidate.task.criteria()[name]
        begun = {f: getattr(start, f).round(6).tolist() for f in ("position", "velocity", "quaternion", "body_rate")}
        courses = course_rows(suite, self.drawn[name], len(start.position))
        return [
            row | {"start": {f: x[i] for f, x in begun.items()}} | courses[i]
            for i, row in enumerate(rows(self.flown[name]))
        ]


def course_rows(suite: TaskConfig, drawn: Mapping[str, np.ndarray], n: int) -> list[dict[str, Any]]:
    """What each of n episodes of a criterion was to fly, as JSON: an object with `course`, or an empty one."""
    shared, columns = suite.course(), {name: _rounded(x) for name, x in drawn.items()}
    if not (shared or columns):
        return [{}] * n
    return [{"course": shared | {name: column[i] for name, column in columns.items()}} for i in range(n)]


def _rounded(column: np.ndarray) -> list[Any]:
    """Numbers as JSON, rounded. Boolean values and counts are unchanged."""
    values = np.asarray(column)
    return (values.round(6) if np.issubdtype(values.dtype, np.floating) else values).tolist()


def drawn_by(task: Any, memory: Any) -> dict[str, Any]:
    """What episodes of a task draw in addition to their starts. A user's own task need not define this."""
    return task.drawn(memory) if hasattr(task, "drawn") else {}


def evaluate(
    policy: str | os.PathLike[str],
    episodes: int = 1000,
    *,
    vehicle: str | None = None,
    controller: Controller = "policy",
    env: Mapping[str, Any] | None = None,
    task: Mapping[str, Any] | None = None,
    seed: int = SEED,
    device: str | None = None,
    kept: int = 0,
    baseline: str | None = None,
) -> Evaluation:
    """Fly a policy's file from unseen starts of its task, in the training simulator.

    Args:
        policy: a run directory, a policy.onnx, or the name of a task: the zoo's policy of it.
        episodes: number of starts per criterion.
        vehicle: the vehicle that flies, a name or a .toml file. If omitted, the policy's own vehicle.
        controller: the vehicle for which the flight controller is tuned. policy: the policy's own vehicle, whatever
            flies. plant: the vehicle that flies. Neither choice changes the policy.
        env: options of `EnvConfig` by dotted name, which replace the values from the policy's run or contract:
            {"wind": 3.0, "randomize": {"mass": 0.2}, "disturbance.gust": 1.0}.
        task: options of its task by dotted name, likewise: {"track": "four_gates"}.
        seed: the seed of the starts.
        device: cpu or gpu.
        kept: bytes that the caller keeps for every start (`ROW` for a report), for the check of the memory.
        baseline: the hover controller that flies in place of the policy, under its contract: pid, geometric, indi, mpc,
            or the reference of your own controller.

    Raises:
        ValueError: naming the field or the option, its value and what is accepted.
    """
    if episodes <= 0:
        raise ValueError(f"--episodes is {episodes}; accepted: more than 0")
    prepare(device)
    found = candidate(policy, vehicle, controller, env, task, baseline)
    return Evaluation(found, seed, *fly_criteria(found, episodes, seed, kept))


def fly_criteria(
    found: Candidate, episodes: int, seed: int, kept: int = 0
) -> tuple[dict[str, Episodes], dict[str, State], dict[str, dict[str, np.ndarray]]]:
    """Fly `episodes` starts of every criterion of a task.

    `kept` counts the bytes that the caller keeps for every start, in addition to the figures.

    Returns:
        For each criterion name: the results of the episodes, their starts, and what else they drew; NumPy arrays.

    Raises:
        ValueError: for more starts than fit into the machine's memory, or that would take far too long.
    """
    flown, starts, drawn = {}, {}, {}
    suites = found.task.criteria()
    envs = {name: found.environment(suite) for name, suite in suites.items()}
    asked = f"--episodes is {episodes}"
    check_memory({asked: float(episodes) * len(suites) * (FIGURES + kept)})
    check_time({asked: sum(env.episode_steps for env in envs.values()) * float(episodes) / FASTEST})
    for name, suite in suites.items():
        steps, settle = envs[name].episode_steps, suite.settling_s
        size, parts = envs[name].whole(BATCH), []
        for i in range(-(-episodes // size)):
            key = random_key(seed, UNSEEN, i)
            went, begun = run_stepwise(envs[name], act_of(found.policy), key, size, steps, settle)
            told = begun.vehicle, drawn_by(envs[name].task, begun.memory)
            parts.append((went, *jax.tree.map(np.asarray, told)))
        flown[name], starts[name], drawn[name] = jax.tree.map(lambda *x: np.concatenate(x)[:episodes], *parts)
    return flown, starts, drawn


def act_of(policy: Policy | Baseline) -> Act:
    """A policy's ONNX graph, or a baseline, asked outside of JAX."""
    contract = policy.contract

    def act(observation: np.ndarray, images: Sequence[np.ndarray], memory: Any) -> tuple[np.ndarray, Any]:
        finite = np.isfinite(observation).all(axis=-1, keepdims=True)
        if not finite.all():  # an episode that is over goes on: what tumbles without a rate loop leaves all numbers
            observation = np.where(finite, observation, level_and_still(contract))
        return policy.act(observation, images, memory)

    remembers = isinstance(policy, Policy)
    return Act(act, lambda n: np.zeros((n, contract.memory_size), np.float32) if remembers else None)
