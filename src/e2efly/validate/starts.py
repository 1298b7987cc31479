"""Starts that a task draws, and the goals that a policy flies to from them."""

from dataclasses import dataclass
from typing import Any

import jax
import numpy as np
from jaxtyping import Array

from e2efly.deploy.goals import Goal
from e2efly.env import UNSEEN, Env, random_key
from e2efly.physics import State
from e2efly.registry import origin
from e2efly.tasks import TASKS
from e2efly.tasks.task import Task, world_of
from e2efly.validate.plant import RigidState

BATCH = 250
"""Starts that are drawn at once: as `e2efly eval` does, so that they are the same."""


@dataclass(frozen=True)
class Starts:
    """`n` starts of a task."""

    states: tuple[RigidState, ...]
    """Where each begins."""
    goals: tuple[Goal, ...]
    """Where each is to fly, for the runtime."""
    memory: Any
    """The task's own state, each leaf (n, ...), for the judge: the references drawn, for instance."""

    def __len__(self) -> int:
        return len(self.states)

    def of(self, rows: list[int]) -> "Starts":
        """Some of them, in the order named."""
        memory = jax.tree.map(lambda x: x[np.array(rows)], self.memory)
        return Starts(tuple(self.states[i] for i in rows), tuple(self.goals[i] for i in rows if self.goals), memory)


def draw_starts(env: Env, n: int, seed: int) -> Starts:
    """The first `n` starts of a seed: those of `e2efly eval`."""
    drawn = [_draw(env, random_key(seed, UNSEEN, i)) for i in range(-(-n // BATCH))]
    vehicle, memory = jax.tree.map(lambda *x: np.concatenate(x)[:n], *drawn)
    fields = (vehicle.position, vehicle.velocity, vehicle.quaternion, vehicle.body_rate)
    states = tuple(RigidState(*(x[i].astype(np.float64) for x in fields)) for i in range(n))
    every = Starts(states, (), memory)
    return Starts(states, tuple(goal_of(env.task, every.of([i]).memory) for i in range(n)), memory)


@jax.jit
def _draw(env: Env, key: Array) -> tuple[State, Any]:
    state = env.reset(key, BATCH)[0]
    return state.vehicle, state.memory


def goal_of(task: Task, memory: Any) -> Goal:
    """The goal of one episode of a task, for the runtime.

    Args:
        task: of the environment.
        memory: its state at the start of that episode, NumPy leaves (1, ...).

    Raises:
        ValueError: for a task without a goal for the runtime.
    """
    if "flight_goal" not in vars(type(task)):  # inherited, it would be another task's
        able = ", ".join(name for name, options in TASKS.items() if "flight_goal" in vars(world_of(options)))
        raise ValueError(f"task is {origin(type(task))}, which has no flight_goal for the runtime; accepted: {able}")
    return task.flight_goal(memory)  # type: ignore[attr-defined]
