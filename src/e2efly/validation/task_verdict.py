"""The task's own verdict on flights, whatever flew them."""

from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

from e2efly.environment import Env
from e2efly.simulation.physics import State
from e2efly.tasks.task import Outcome, Task
from e2efly.validation.plant_flight import Trajectory
from e2efly.validation.starts import Starts


@dataclass(frozen=True)
class Verdicts:
    """Results of `n` flights: the fields of `evaluate.Episodes` that follow from the flight alone."""

    success: np.ndarray
    """(n,) bool."""
    crashed: np.ndarray
    """(n,) bool: ended by a failure before the time was over."""
    duration: np.ndarray
    """(n,) until success, failure or time-out, s."""
    final_error: np.ndarray
    """(n,) the task's error at the end, m."""
    mean_error: np.ndarray
    """(n,) mean error over the episode after `settle`, m."""
    top_speed: np.ndarray
    """(n,) largest speed, m/s."""
    mean_speed: np.ndarray
    """(n,) along the path, m/s."""
    top_rate: np.ndarray
    """(n,) largest body rate, rad/s."""
    roughness: np.ndarray
    """(n,) mean length of the change of the action from one step to the next."""


def judge(env: Env, starts: Starts, flights: list[Trajectory], settle: float = 0.0) -> Verdicts:
    """Let the task judge flights, one per start, step by step, as it judges its own episodes.

    A flight that stopped before its episode was over (a fault) has not succeeded. The mean error counts after `settle`
    s.

    Raises:
        ValueError: when there is not one flight per start, or when a flight has another control period.
    """
    period = env.control_period
    if len(flights) != len(starts) or not flights:
        raise ValueError(f"{len(flights)} flights for {len(starts)} starts; accepted: one flight a start, at least one")
    for i, flight in enumerate(flights):
        if len(flight.time) > 1 and abs(flight.time[1] - period) > 1e-6:
            raise ValueError(
                f"flights[{i}] has a control period of {flight.time[1]} s; accepted: the task's, {period} s"
            )
    flown = np.array([len(flight.action) for flight in flights])
    steps = env.episode_steps  # the longest episode: one program for all
    states = _states(flights, steps)
    outcome = jax.tree.map(np.asarray, _advance(env.task, starts.memory, states, period))
    step = np.arange(steps)[:, None]
    late = (step + 1) * period >= float(env.task.episode_s) - 1e-3 * period
    done = (outcome.terminated | late) & (step < flown)
    length = np.where(done.any(0), done.argmax(0) + 1, np.minimum(flown, steps))
    last, columns = np.maximum(length - 1, 0), np.arange(len(flights))
    live = step < length
    counts = live & ((step + 1) * period > settle)
    success = done.any(0) & outcome.success[last, columns]
    action = _stack([np.concatenate([np.asarray(env.hover)[None], f.action]) for f in flights], steps + 1)
    change = np.linalg.norm(np.diff(action, axis=0), axis=-1)
    speed, turn = (np.linalg.norm(x[1:], axis=-1) for x in (states.velocity, states.body_rate))
    return Verdicts(
        success=success,
        crashed=done.any(0) & outcome.terminated[last, columns] & ~success,
        duration=length * period,
        final_error=outcome.error[last, columns],
        mean_error=(outcome.error * counts).sum(0) / np.maximum(counts.sum(0), 1),
        top_speed=(speed * live).max(0),
        mean_speed=(speed * live).sum(0) / np.maximum(length, 1),
        top_rate=(turn * live).max(0),
        roughness=(change * live).sum(0) / np.maximum(length, 1),
    )


def _states(flights: list[Trajectory], steps: int) -> State:
    """The states of all flights, each leaf (steps + 1, n, ...). Rotor speeds are zero, because no task uses them."""

    def column(name: str) -> Array:
        return jnp.asarray(_stack([getattr(f, name) for f in flights], steps + 1), jnp.float32)

    rotors = jnp.zeros((steps + 1, len(flights), 4), jnp.float32)
    return State(column("position"), column("velocity"), column("quaternion"), column("body_rate"), rotors)


def _stack(rows: list[np.ndarray], length: int) -> np.ndarray:
    """(length, n, ...) from n arrays. Each is cut, or extended by repetitions of its last row."""
    return np.stack([x[np.minimum(np.arange(length), len(x) - 1)] for x in rows], axis=1)


@jax.jit
def _advance(task: Task, memory: Any, states: State, period: float) -> Outcome:
    """The outcome of every step, each leaf (steps, n)."""

    def one(memory: Any, row: tuple[Array, State, State]) -> tuple[Any, Outcome]:
        index, before, after = row
        time = jnp.full(after.position.shape[:1], (index + 1) * period)
        return task.advance(memory, before, after, time, time >= task.episode_s - 1e-3 * period)

    count = states.position.shape[0] - 1
    before, after = jax.tree.map(lambda x: x[:-1], states), jax.tree.map(lambda x: x[1:], states)
    return jax.lax.scan(one, memory, (jnp.arange(count), before, after))[1]
