"""Races of one policy against another. Used by `e2efly eval --rival`."""

import dataclasses
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, PRNGKeyArray

from e2efly.config import RewardConfig
from e2efly.config.changes import changed
from e2efly.courses.tracks import load_track
from e2efly.environment import UNSEEN, Env, EnvState, random_key
from e2efly.environment.episodes import Act, wilson
from e2efly.policy.contract import Contract
from e2efly.policy.observation import PAST_ACTIONS
from e2efly.simulation.device import prepare, wide_vectors
from e2efly.tasks.race import RaceConfig
from e2efly.tasks.race_duel import RaceDuelConfig
from e2efly.validation.candidate import candidate
from e2efly.validation.evaluation import SEED, act_of

LAPS = 3
"""Laps of a race on a closed track."""
LONGEST = 40.0
"""Time after which a race is over, s."""
WORLDS = 125
"""Number of races that are flown at once."""


@dataclass(frozen=True)
class Duels:
    """The results of w races of a policy and its rivals. The rows are racers: (w, a), the policy's first."""

    time: np.ndarray
    """(w, a) time at the finish, s. Infinite for a racer that does not finish, or that was out or touched another."""
    touched: np.ndarray
    """(w, a) whether the racer touched another before it had finished."""
    out: np.ndarray
    """(w, a) whether the racer missed or touched a gate, or left the track."""

    @property
    def won(self) -> np.ndarray:
        """(w,) the policy finished before all of its rivals."""
        return np.isfinite(self.time[:, 0]) & (self.time[:, 0] < self.time[:, 1:].min(axis=1))

    @property
    def lost(self) -> np.ndarray:
        """(w,) a rival finished before the policy."""
        return np.isfinite(self.time[:, 1:].min(axis=1)) & (self.time[:, 1:].min(axis=1) < self.time[:, 0])

    def as_json(self) -> dict[str, Any]:
        """Shares of the races, with the 95 % interval of the wins by Wilson, and mean times of those that finish."""

        def mean(times: np.ndarray) -> float | None:
            finite = times[np.isfinite(times)]
            return round(float(finite.mean()), 3) if finite.size else None

        n = len(self.won)
        return {
            "races": n,
            "won": float(self.won.mean()),
            "won_interval_95": [round(x, 4) for x in wilson(int(self.won.sum()), n)],
            "lost": float(self.lost.mean()),
            "touched": float(self.touched.any(axis=1).mean()),
            "out": float(self.out[:, 0].mean()),
            "rival_out": float(self.out[:, 1:].mean()),
            "seconds": mean(self.time[:, 0]),
            "rival_seconds": mean(self.time[:, 1:]),
        }


def duel(
    policy: str,
    rival: str,
    races: int = 500,
    *,
    task: Mapping[str, Any] | None = None,
    seed: int = SEED,
    device: str | None = None,
) -> Duels:
    """Race policies of `race_duel` and of `race`, which see no others, from unseen starts. One racer of each world is
    the policy's, the others are the rival's.

    Args:
        policy: a run directory, a policy.onnx, or a task of the zoo.
        rival: the same.
        races: number of races.
        task: options of the policy's task by dotted name. By default a closed track has `LAPS` laps.
        seed: the seed of the starts.
        device: cpu or gpu.

    Raises:
        ValueError: for no races, for a policy of another task, and for a rival that observes or commands something
            else.
    """
    if races <= 0:
        raise ValueError(f"--episodes is {races}; accepted: more than 0")
    prepare(device)
    found = candidate(policy)
    own = found.task
    if not isinstance(own, RaceConfig):
        raise ValueError(f"--rival is given for a policy of {own.name}; accepted: a policy of race_duel or race")
    own = own if isinstance(own, RaceDuelConfig) else RaceDuelConfig(track=own.track)
    other = candidate(rival)
    asked: Any = changed(own, task or {}, "task")
    laps = LAPS if load_track(asked.track).closed else 1
    flown = changed(asked, {"laps": laps, "episode_s": LONGEST} | dict(task or {}), "task")
    (suite,) = flown.criteria().values()
    racers = (found.policy, other.policy)
    seen = dataclasses.replace(found.env, past_actions=max(racer.contract.past_actions for racer in racers))
    flies = None if found.draws else found.flown
    env = Env.of(dataclasses.replace(suite, collisions_end=False), RewardConfig({"prog2": 1.0}), seen, flown=flies)
    columns = [_columns(env, racer.contract, found.policy.contract) for racer in racers]
    parts, size = [], env.agents * min(WORLDS, races)
    for i in range(-(-races // WORLDS)):
        acts = [act_of(racer) for racer in racers]
        parts.append(_raced(env, acts, columns, size, random_key(seed, UNSEEN, i)))
    return Duels(*(np.concatenate(x)[:races] for x in zip(*parts, strict=True)))


def _columns(env: Env, racer: Contract, own: Contract) -> np.ndarray:
    """The entries of the observation that a racer observes, in its order."""
    ends = np.cumsum([field.size for field in env.fields])
    there = {field.name: np.arange(end - field.size, end) for field, end in zip(env.fields, ends, strict=True)}
    kept = racer.action.size * racer.past_actions
    there[PAST_ACTIONS] = there.get(PAST_ACTIONS, np.arange(0))[:kept]  # the newest are the first
    if wrong := [f"{f.name} ({f.size})" for f in racer.observation if len(there.get(f.name, ())) != f.size]:
        offered = ", ".join(f"{f.name} ({f.size})" for f in env.fields)
        raise ValueError(f"--rival observes {', '.join(wrong)}; accepted: {offered}")
    for name in ("control_rate_hz", "action"):
        if getattr(racer, name) != getattr(own, name):
            raise ValueError(
                f"{name} of --rival is {getattr(racer, name)}; accepted: that of the policy, {getattr(own, name)}"
            )
    return np.concatenate([there[field.name] for field in racer.observation])


def _raced_on(env: Env, state: EnvState, action: Float[Array, "n c"]) -> tuple[EnvState, Float[Array, "n o"]]:
    """The next state, and what is observed of it. A racer that is out lies on the ground where that happened."""
    gone = (state.memory.touched | state.memory.out)[:, None]
    reached, _ = env.step(state, action, restart=False)
    lying = state.vehicle.position.at[:, 2].set(env.task.shape.feet_height)
    vehicle = dataclasses.replace(
        reached.vehicle,
        position=jnp.where(gone, lying, reached.vehicle.position),
        velocity=jnp.where(gone, 0.0, reached.vehicle.velocity),
    )
    reached = dataclasses.replace(reached, vehicle=vehicle)
    return reached, env._observe(reached)


def _raced(
    env: Env, acts: Sequence[Act], columns: Sequence[np.ndarray], n: int, key: PRNGKeyArray
) -> tuple[np.ndarray, ...]:
    """The fields of `Duels` of n racers, whose every a-th is the policy's."""
    options = wide_vectors(n)
    step = jax.jit(_raced_on, compiler_options=options)
    state, observation = jax.jit(lambda env, key: env.reset(key, n), compiler_options=options)(env, key)
    rows = np.arange(n) % env.agents
    whose = [np.flatnonzero(rows == 0), np.flatnonzero(rows > 0)]
    memories = [act.begin(len(mine)) for act, mine in zip(acts, whose, strict=True)]
    time, action, race = np.full(n, np.inf), np.zeros((n, env.action_size), np.float32), state.memory
    for _ in range(env.episode_steps):
        seen = np.asarray(observation)
        for i, (act, mine, given) in enumerate(zip(acts, whose, columns, strict=True)):
            action[mine], memories[i] = act.act(seen[np.ix_(mine, given)], (), memories[i])
        state, observation = step(env, state, action)
        race = state.memory
        finished, failed = np.asarray(race.finished), np.asarray(race.touched | race.out)
        time = np.where(finished & ~failed & np.isinf(time), np.asarray(state.time), time)
        if np.all(finished | failed):
            break
    return tuple(np.asarray(x).reshape(-1, env.agents) for x in (time, race.touched, race.out))
