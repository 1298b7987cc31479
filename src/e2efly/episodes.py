"""Episodes of a policy from given seeds, without new starts: what training watches and `eval` reports."""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.env import Env, EnvState, Step
from e2efly.physics import State


@dataclass(frozen=True)
class Act:
    """A policy, as a function that JAX can compile."""

    act: Callable[[Float[Array, "n o"], tuple[Array, ...], Array], tuple[Float[Array, "n 4"], Array]]
    """(observation, images, memory) -> (action, next memory)."""
    begin: Callable[[int], Array] = lambda n: jnp.zeros((n, 0))
    """How many -> their memory at the start of an episode, (n, k)."""

    @staticmethod
    def of(function: Callable[[Float[Array, "n o"]], Float[Array, "n 4"]]) -> "Act":
        """Of a function of the observation alone."""
        return Act(lambda observation, images, memory: (function(observation), memory))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Episodes:
    """How each of n episodes went."""

    success: Bool[Array, " n"]
    duration: Float[Array, " n"]
    """Until success, failure or time-out, s."""
    final_error: Float[Array, " n"]
    """The task's error at its end, m."""
    mean_error: Float[Array, " n"]
    """Mean error over the episode after `settle`, m."""
    top_speed: Float[Array, " n"]
    """m/s."""
    top_rate: Float[Array, " n"]
    """Largest body rate, rad/s."""
    roughness: Float[Array, " n"]
    """Mean length of the change of the action between two steps (its range is [-1, 1] per axis)."""
    reward: Float[Array, " n"]
    """Sum over the episode."""
    crashed: Bool[Array, " n"]
    """Ended for ill before time was out."""


def run_episodes(
    env: Env,
    act: Act,
    key: PRNGKeyArray,
    n: int,
    steps: int,
    settle: float = 0.0,
    part: tuple[Array | int, int] = (0, 1),
    altered: Callable[[EnvState], EnvState] = lambda state: state,
) -> Episodes:
    """Fly episodes of at most `steps` control steps; each stands still once it has ended.

    Args:
        env: the environment.
        act: the policy.
        key: decides the starts.
        n: how many.
        steps: control steps of the longest.
        settle: seconds before the mean error counts.
        part: which of how many equal parts of the episodes to fly. All parts together, in order, are the `n` episodes
            of the one part (0, 1), whatever their number; where it does not divide `n`, the last ends with repetitions.
        altered: what is to be different from what the environment draws for an episode.
    """
    state, observation = env.reset(key, n)
    state, observation = part_of(altered(state), observation, part)
    n = observation.shape[0]
    zero, no = jnp.zeros(n), jnp.zeros(n, bool)
    first = (state, observation, act.begin(n), no, Episodes(no, zero, zero, zero, zero, zero, zero, zero, no), zero)

    def step(carry: tuple, _: None) -> tuple[tuple, None]:
        state, observation, memory, over, e, counted = carry
        action, memory = act.act(observation, state.images, memory)
        reached, out = env.step(state, action, restart=False)
        live = 1.0 - over
        counts = live * (reached.time > settle)
        speed = jnp.linalg.norm(reached.vehicle.velocity, axis=-1)
        turn = jnp.linalg.norm(reached.vehicle.body_rate, axis=-1)
        change = jnp.linalg.norm(jnp.clip(action, -1, 1) - jnp.clip(state.actions[:, 0], -1, 1), axis=-1)
        e = Episodes(
            success=e.success | (out.success & ~over),
            duration=e.duration + live * env.control_period,
            final_error=jnp.where(over, e.final_error, out.error),
            mean_error=e.mean_error + counts * out.error,
            top_speed=jnp.maximum(e.top_speed, live * speed),
            top_rate=jnp.maximum(e.top_rate, live * turn),
            roughness=e.roughness + live * change,
            reward=e.reward + live * out.reward,
            crashed=e.crashed | (out.terminated & ~out.success & ~over),
        )
        return (reached, out.final_observation, memory, over | out.done, e, counted + counts), None

    (*_, e, counted), _ = jax.lax.scan(step, first, None, length=steps)
    flown = jnp.maximum(e.duration / env.control_period, 1.0)
    return dataclasses.replace(e, mean_error=e.mean_error / jnp.maximum(counted, 1.0), roughness=e.roughness / flown)


def part_of(state: EnvState, observation: Array, part: tuple[Array | int, int]) -> tuple[EnvState, Array]:
    """One of so many equal parts of a batch, (index, count), with random numbers of its own; the last part is filled up
    with repetitions.
    """
    index, count = part
    if count == 1:
        return state, observation
    n = observation.shape[0]
    size = math.ceil(n / count)
    rows = (index * size + jnp.arange(size)) % n
    state = jax.tree.map(lambda x: x[rows] if x.shape[:1] == (n,) else x, state)
    return dataclasses.replace(state, key=jax.random.fold_in(state.key, index)), observation[rows]


def trace(
    env: Env, act: Act, key: PRNGKeyArray, n: int, steps: int
) -> tuple[State, Float[Array, "t n 4"], Float[Array, "t n 3"], Step]:
    """`n` episodes step by step, without new starts.

    Returns:
        Of every control step, each leaf (steps, n, ...): the state reached, the command in physical units, where to be
        then, and the outcome. An episode goes on after its end: `Step.done` tells where that was.
    """
    state, observation = env.reset(key, n)

    def step(carry: tuple[EnvState, Array, Array], _: None) -> tuple[tuple[EnvState, Array, Array], Any]:
        state, observation, memory = carry
        action, memory = act.act(observation, state.images, memory)
        reached, out = env.step(state, action, restart=False)
        goal = env.task.goal(reached.memory, reached.time)
        return (reached, out.final_observation, memory), (reached.vehicle, env.command(action), goal, out)

    return jax.lax.scan(step, (state, observation, act.begin(n)), None, length=steps)[1]


def wilson(successes: int, n: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson's score interval of a success rate; with z = 1.96 it holds the true rate in 95 % of cases.

    Raises:
        ValueError: when the counts are no counts of successes among trials.
    """
    if not 0 <= successes <= n:
        raise ValueError(f"{successes} successes of {n}; accepted: from 0 to the number of trials")
    if n == 0:
        return 0.0, 1.0
    centre = (successes + z**2 / 2) / (n + z**2)
    half = z / (n + z**2) * math.sqrt(successes * (n - successes) / n + z**2 / 4)
    return max(centre - half, 0.0), min(centre + half, 1.0)


def summary(e: Any) -> dict[str, Any]:
    """How episodes went, as JSON: what training's report, `evaluate` and `validate` say of a criterion.

    Args:
        e: n `Episodes`, or other columns of the same names, as NumPy arrays.

    Returns:
        The number of episodes, the rate of success with its 95 % interval by Wilson, how many crashed; means of the
        errors and the roughness, the mean time of a success (None without any), the largest speed and body rate.
    """
    ok = np.asarray(e.success)

    def rounded(x: Any) -> float:
        return round(float(x), 6)

    return {
        "episodes": len(ok),
        "success": rounded(np.mean(ok)),
        "success_interval_95": [rounded(bound) for bound in wilson(int(ok.sum()), len(ok))],
        "crashed": int(np.sum(e.crashed)),
        "final_error_m": rounded(np.mean(e.final_error)),
        "mean_error_m": rounded(np.mean(e.mean_error)),
        "seconds_of_success": rounded(np.mean(np.asarray(e.duration)[ok])) if ok.any() else None,
        "top_speed_m_s": rounded(np.max(e.top_speed)),
        "top_rate_rad_s": rounded(np.max(e.top_rate)),
        "roughness": rounded(np.mean(e.roughness)),
    }


def rows(e: Any) -> list[dict[str, Any]]:
    """Episodes as JSON: an object for each, with the names of the columns."""
    columns = {field.name: np.asarray(getattr(e, field.name)).tolist() for field in dataclasses.fields(e)}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
