"""Starts that a task draws, and the courses that a policy flies from them."""

import dataclasses
from dataclasses import dataclass, field
from typing import Any

import jax
import numpy as np
from jaxtyping import Array

from e2efly.config import TaskConfig
from e2efly.environment import UNSEEN, Env, random_key
from e2efly.environment.stress_cameras import CameraDraw, with_noise
from e2efly.policy.goal import Course
from e2efly.simulation.physics import State
from e2efly.simulation.scenes.scene import Scene
from e2efly.simulation.sensors.eyes import Eye
from e2efly.tasks.route import goal_of
from e2efly.tasks.task import Task
from e2efly.validation.evaluation import drawn_by
from e2efly.validation.plant import RigidState
from e2efly.validation.plant_sight import Sight

BATCH = 250
"""Number of starts that are drawn at once. It is the same as in `e2efly eval`, so that the starts are the same."""


@dataclass(frozen=True)
class Starts:
    """`n` starts of a task."""

    states: tuple[RigidState, ...]
    """The state at each start."""
    courses: tuple[Course, ...]
    """The course of each start, for the runtime."""
    memory: Any
    """The task's own state, each leaf (n, ...), for the judge. It contains, for instance, the references drawn."""
    eyes: tuple[Eye, ...] = ()
    """How the cameras of each vehicle are mounted, each leaf (n, ...)."""
    drawn: dict[str, np.ndarray] = field(default_factory=dict)
    """Other values that the episodes have drawn, for reports: columns (n, ...)."""

    def __len__(self) -> int:
        return len(self.states)

    def of(self, rows: list[int]) -> "Starts":
        """A selection of the starts, in the given order."""
        memory, eyes = jax.tree.map(lambda x: x[np.array(rows)], (self.memory, self.eyes))
        courses = tuple(self.courses[i] for i in rows if self.courses)
        return Starts(tuple(self.states[i] for i in rows), courses, memory, eyes)

    def sights(self, env: Env, seed: int, changed: CameraDraw | None = None) -> list[Sight | None]:
        """The cameras and world of each start in its environment. None for a policy that sees nothing.

        A row of the stress test replaces the cameras that the starts have drawn.
        """
        if not env.cameras:
            return [None] * len(self)
        cameras, eyes = env.cameras, self.eyes
        if changed is not None:
            cameras, eyes = with_noise(cameras), changed.eyes(cameras, eyes, env.control_period)
        scene, eyes = jax.tree.map(np.asarray, (_scene(env.task, self.memory), eyes))
        oldest = max(float(eye.latency.max()) for eye in eyes)
        period, sights = float(env.control_period), []
        for i in range(len(self)):
            own_eyes, own_scene = jax.tree.map(lambda x: x[i : i + 1], (eyes, scene))  # noqa: B023
            sights.append(Sight(cameras, own_eyes, own_scene, period, oldest, seed + i))
        return sights


def draw_starts(env: Env, n: int, seed: int) -> Starts:
    """The first `n` starts of a seed. They are those of `e2efly eval`.

    Raises:
        ValueError: for a number of vehicles that is not that of whole worlds, and for a load.
    """
    if n % env.agents:
        raise ValueError(f"{n} starts; accepted: a multiple of {env.agents}, the vehicles of a world")
    if env.payload is not None:
        raise ValueError(
            f"env.payload has mass {env.payload.mass}; accepted: 0, 0, as no load hangs from the vehicle of a plant "
            "(`e2efly eval` flies with loads)"
        )
    drawn = [_draw(env, random_key(seed, UNSEEN, i)) for i in range(-(-n // env.whole(BATCH)))]
    vehicle, memory, eyes = jax.tree.map(lambda *x: np.concatenate(x)[:n], *drawn)
    fields = (vehicle.position, vehicle.velocity, vehicle.quaternion, vehicle.body_rate)
    states = tuple(RigidState(*(x[i].astype(np.float64) for x in fields)) for i in range(n))
    every = Starts(states, (), memory)
    courses = tuple(course_of(env.task, every.of([i]).memory, states[i].position) for i in range(n))
    drawn = jax.tree.map(np.asarray, drawn_by(env.task, memory))
    return Starts(states, courses, memory, eyes, drawn)


@jax.jit
def _draw(env: Env, key: Array) -> tuple[State, Any, tuple[Eye, ...]]:
    state = env.reset(key, env.whole(BATCH))[0]
    return state.vehicle, state.memory, state.eyes


@jax.jit
def _scene(task: Task, memory: Any) -> Scene:
    return task.scene(memory)


def course_of(task: Task, memory: Any, start: np.ndarray) -> Course:
    """The course of one episode of a task, for the runtime: its goal in NumPy, without the part that trains.

    `memory` is the task's state at the start of that episode, NumPy leaves (1, ...).
    """
    options = getattr(task, "config", None)
    lean: Any = goal_of(type(options)) if isinstance(options, TaskConfig) else type(task)
    if hasattr(lean, "showing"):
        lean = lean.showing([field.name for field in task.fields])
    if lean is type(task):
        return Course(jax.tree.map(np.asarray, task), memory, start, duration=float(task.episode_s))
    parts = {f.name: jax.tree.map(np.asarray, getattr(task, f.name)) for f in dataclasses.fields(lean)}
    return Course(lean(**parts), lean.state(memory), start, duration=float(task.episode_s))
