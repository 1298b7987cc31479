"""Episodes of a policy from given seeds, without restarts, for the evaluations of training and for `eval`."""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, PRNGKeyArray

from e2efly.environment import Env, EnvState, Step
from e2efly.simulation.device import fast_compile, wide_vectors
from e2efly.simulation.physics import State


@dataclass(frozen=True)
class Act:
    """A policy as a function, which JAX can compile or not (`run_stepwise`, `trace`)."""

    act: Callable[[Any, tuple[Any, ...], Any], tuple[Any, Any]]
    """(observation (n, o), images, memory (n, k)) -> (action (n, c), next memory)."""
    begin: Callable[[int], Any] = lambda n: jnp.zeros((n, 0))
    """(number of vehicles) -> their memory at the start of an episode, (n, k)."""

    @staticmethod
    def of(function: Callable[[Float[Array, "n o"]], Float[Array, "n c"]]) -> "Act":
        """A policy that is a function of the observation only."""
        return Act(lambda observation, images, memory: (function(observation), memory))


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Episodes:
    """The results of n episodes."""

    success: Bool[Array, " n"]
    duration: Float[Array, " n"]
    """Time until success, failure or time-out, s."""
    final_error: Float[Array, " n"]
    """The task's error at the end, m."""
    mean_error: Float[Array, " n"]
    """Mean error over the episode after `settle`, m."""
    top_speed: Float[Array, " n"]
    """Largest speed, m/s."""
    mean_speed: Float[Array, " n"]
    """Mean speed along the path, m/s."""
    top_rate: Float[Array, " n"]
    """Largest body rate, rad/s."""
    roughness: Float[Array, " n"]
    """Mean length of the change of the action between two steps (the action's range is [-1, 1] per axis)."""
    reward: Float[Array, " n"]
    """Sum over the episode."""
    crashed: Bool[Array, " n"]
    """Ended by a failure before the time was over."""


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class EpisodesUnderWay:
    """The state of n episodes between two control steps, and their results so far."""

    state: EnvState
    observation: Float[Array, "n o"]
    over: Bool[Array, " n"]
    """Which episodes have ended. They fly on, but their results do not change any more."""
    so_far: Episodes
    """The results so far. The mean error, the mean speed and the roughness are sums."""
    counted: Float[Array, " n"]
    """Number of control steps in the mean error."""

    @staticmethod
    def of(state: EnvState, observation: Float[Array, "n o"]) -> "EpisodesUnderWay":
        """The episodes at their start."""
        n = observation.shape[0]
        zero, no = jnp.zeros(n), jnp.zeros(n, bool)
        none = Episodes(no, zero, zero, zero, zero, zero, zero, zero, zero, no)
        return EpisodesUnderWay(state, observation, no, none, zero)

    def after(self, env: Env, action: Float[Array, "n c"], settle: Any) -> "EpisodesUnderWay":
        """The episodes one control step later. The mean error counts from `settle` s on."""
        state, over, e = self.state, self.over, self.so_far
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
            mean_speed=e.mean_speed + live * speed,
            top_rate=jnp.maximum(e.top_rate, live * turn),
            roughness=e.roughness + live * change,
            reward=e.reward + live * out.reward,
            crashed=e.crashed | (out.terminated & ~out.success & ~over),
        )
        return EpisodesUnderWay(reached, out.final_observation, over | out.done, e, self.counted + counts)

    def episodes(self, env: Env) -> Episodes:
        """The results of the episodes."""
        e = self.so_far
        flown = jnp.maximum(e.duration / env.control_period, 1.0)
        mean_error = e.mean_error / jnp.maximum(self.counted, 1.0)
        return dataclasses.replace(
            e, mean_error=mean_error, mean_speed=e.mean_speed / flown, roughness=e.roughness / flown
        )


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
    """Fly episodes of at most `steps` control steps, until all have ended.

    Args:
        env: the environment.
        act: the policy, which JAX can compile.
        key: random key that determines the starts.
        n: number of episodes.
        steps: control steps of the longest episode.
        settle: time before the mean error counts, s.
        part: which of how many equal parts of the episodes to fly. All parts together, in order, are the same `n`
            episodes as the one part (0, 1), whatever their number. If this number does not divide `n`, the last part
            ends with repetitions.
        altered: function that changes what the environment draws for an episode.
    """
    state, observation = env.reset(key, n)
    state, observation = part_of(altered(state), observation, part)

    def goes_on(carry: tuple[Array, EpisodesUnderWay, Array]) -> Array:
        done, flight, _ = carry
        return (done < steps) & ~jnp.all(flight.over)

    def step(carry: tuple[Array, EpisodesUnderWay, Array]) -> tuple[Array, EpisodesUnderWay, Array]:
        done, flight, memory = carry
        action, memory = act.act(flight.observation, flight.state.images, memory)
        return done + 1, flight.after(env, action, settle), memory

    first = jnp.zeros((), jnp.int32), EpisodesUnderWay.of(state, observation), act.begin(observation.shape[0])
    return jax.lax.while_loop(goes_on, step, first)[1].episodes(env)


def run_stepwise(
    env: Env,
    act: Act,
    key: PRNGKeyArray,
    n: int,
    steps: int,
    settle: float = 0.0,
    altered: Callable[[EnvState], EnvState] = lambda state: state,
) -> tuple[Episodes, EnvState]:
    """`run_episodes` for a policy that JAX need not compile.

    It runs one control step after the other until all episodes have ended. The programs do not depend on the policy.
    Those of each environment are compiled once, and later processes find them in the cache.

    Returns:
        The results of the episodes, NumPy arrays; and the states at their starts.
    """
    begin, after, _ = _programs(n, bool(env.cameras))
    state, observation = begin(env, key)
    first = altered(state)
    flight, memory = EpisodesUnderWay.of(first, observation), act.begin(n)
    for _ in range(steps):
        action, memory = _asked(act, flight.observation, flight.state, memory)
        flight = after(env, flight, action, settle)
        if np.all(flight.over):
            break
    return jax.tree.map(np.asarray, flight.episodes(env)), first


def _asked(act: Act, observation: Array, state: EnvState, memory: Array) -> tuple[Array, Array]:
    return act.act(np.asarray(observation), tuple(np.asarray(image) for image in state.images), memory)


@cache
def _programs(n: int, seeing: bool) -> tuple[Callable, Callable, Callable]:
    """The compiled programs for n episodes: their start; a step that judges; a step that records, see `trace`.

    With cameras, the rendering takes longer than its compilation.
    """

    def shown(env: Env, state: EnvState, action: Array) -> tuple[EnvState, Step, Array, Array]:
        reached, out = env.step(state, action, restart=False)
        return reached, out, env.command(action), env.task.goal(reached.memory, reached.time)

    options = wide_vectors(n) | ({} if seeing else fast_compile())
    programs = (lambda env, key: env.reset(key, n), lambda env, flight, *told: flight.after(env, *told), shown)
    begin, after, show = (jax.jit(program, compiler_options=options) for program in programs)
    return begin, after, show


def part_of(state: EnvState, observation: Array, part: tuple[Array | int, int]) -> tuple[EnvState, Array]:
    """One of several equal parts of a batch, (index, count), with its own random numbers.

    The last part is filled up with repetitions.
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
) -> tuple[State, Float[np.ndarray, "t n c"], Float[np.ndarray, "t n 3"], Step]:
    """`n` episodes step by step, without restarts, for a policy that JAX need not compile.

    Returns:
        For every control step, each leaf (steps, n, ...): the state reached, the command in physical units, the
        position to be at then, and the outcome; NumPy arrays. An episode goes on after its end. `Step.done` gives its
        end.
    """
    begin, _, shown = _programs(n, bool(env.cameras))
    (state, observation), memory, rows = begin(env, key), act.begin(n), []
    for _ in range(steps):
        action, memory = _asked(act, observation, state, memory)
        state, out, command, goal = shown(env, state, action)
        observation = out.final_observation
        rows.append((state.vehicle, command, goal, out))
    return jax.tree.map(lambda *x: np.stack(x), *rows)


def wilson(successes: float, n: int, z: float = 1.96) -> tuple[float, float]:
    """Wilson's score interval of a success rate. With z = 1.96 it contains the true rate in 95 % of cases.

    Raises:
        ValueError: when the counts are not possible counts of successes among trials.
    """
    if not 0 <= successes <= n:
        raise ValueError(f"{successes} successes of {n}; accepted: from 0 to the number of trials")
    if n == 0:
        return 0.0, 1.0
    centre = (successes + z**2 / 2) / (n + z**2)
    half = z / (n + z**2) * math.sqrt(successes * (n - successes) / n + z**2 / 4)
    return max(centre - half, 0.0), min(centre + half, 1.0)


def summary(e: Any) -> dict[str, Any]:
    """A summary of episodes as JSON, for the reports of training, `evaluate` and `validate` on a criterion.

    Args:
        e: `Episodes` of n episodes, or other columns of the same names, as NumPy arrays.

    Returns:
        The number of episodes, the success rate with its 95 % interval by Wilson, and the number of crashes; the means
        of the errors and the roughness, the mean time of a success and its mean speed along the path (None without any
        success), the largest speed and body rate.
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
        "mean_speed_m_s": rounded(np.mean(np.asarray(e.mean_speed)[ok])) if ok.any() else None,
        "top_speed_m_s": rounded(np.max(e.top_speed)),
        "top_rate_rad_s": rounded(np.max(e.top_rate)),
        "roughness": rounded(np.mean(e.roughness)),
    }


def rows(e: Any) -> list[dict[str, Any]]:
    """Episodes as JSON: one object per episode, with the names of the columns."""
    columns = {field.name: np.asarray(getattr(e, field.name)).tolist() for field in dataclasses.fields(e)}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
