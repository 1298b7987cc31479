"""Ablation of a reward: train with the full reward, and with each part left out, for several seeds at the same time.

A part is a term, or all terms of one of the paper's groups (`e2efly.simulation.rewards.GROUPS`).

All runs are members of one compiled program: the weights of the reward and the seeds are its leaves. The members are
divided among the devices, whereas a single run divides its environments among them. Each member runs on one device.
"""

import dataclasses
import json
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from e2efly.config import TrainConfig
from e2efly.environment import Env, random_key
from e2efly.environment.episodes import Episodes, run_episodes
from e2efly.learning.algorithm import TrainState, begin
from e2efly.learning.checkpoint import load_checkpoint, read_about, save_checkpoint
from e2efly.learning.devices import AXIS, OWN, SAME, on_each
from e2efly.learning.judge import WATCHED
from e2efly.learning.networks import Weights
from e2efly.learning.programs import acting
from e2efly.learning.setup import Setup
from e2efly.runs.inputs import different_values
from e2efly.simulation.rewards import grouped

FULL = "full"
"""Name of the reward with all terms."""
By = Literal["term", "group"]
"""Which part of a reward is left out in each variant."""


@dataclass(frozen=True)
class Curves:
    """How each variant learned."""

    variants: tuple[str, ...]
    """`FULL` and the names of the terms or groups that were left out."""
    steps: Float[np.ndarray, " t"]
    """Environment steps at each evaluation."""
    success: dict[str, Float[np.ndarray, "v s t"]]
    """Success rate by criterion: for each variant and seed, at each evaluation."""
    error: dict[str, Float[np.ndarray, "v s t"]]
    """The error of the task, m: the mean over the flight if the task follows something, else the error at its end."""


@dataclass(frozen=True)
class KeptRun:
    """Where an ablation stores its progress, so that it can continue after it was stopped."""

    path: Path
    """The file of the checkpoint."""
    about: dict[str, Any]
    """Everything that determines the curves, as JSON."""
    period: float = 10.0
    """Minimum time between two checkpoints, s."""

    def done(self) -> int:
        """The number of evaluations that an earlier process completed.

        Raises:
            ValueError: for a checkpoint that is damaged, or that belongs to another ablation.
        """
        if not self.path.exists():
            return 0
        found = read_about(self.path)
        wanted = json.loads(json.dumps(self.about))
        if different := list(different_values(found.get("ablation"), wanted)):
            raise ValueError(f"{self.path} is of another ablation: {'; '.join(different)}; accepted: another --out")
        return int(found["done"])


def ablate(
    config: TrainConfig,
    seeds: int,
    told: Callable[[float, float], None] = lambda share, best: None,
    kept: KeptRun | None = None,
    by: By = "term",
) -> Curves:
    """Train all variants.

    Args:
        config: the configuration with the full reward; its seed is the first seed.
        seeds: number of runs for each variant.
        told: called after each evaluation with (fraction of the work done, mean success of the full reward).
        kept: where to store the progress, and from where to continue.
        by: what is left out in each variant: a term, or one of the paper's groups.

    Raises:
        ValueError: for a configuration that cannot be used: one with a curriculum, or a reward with only one part; for
            a checkpoint that is damaged or belongs to another ablation.
    """
    terms = tuple(config.reward.weights)
    parts = grouped(terms) if by == "group" else {term: (term,) for term in terms}
    if len(parts) < 2 or seeds < 1 or config.curriculum:
        raise ValueError(
            f"an ablation of {len(parts)} reward {by}s over {seeds} seeds, with {len(config.curriculum)} stages of a "
            f"curriculum; accepted: two {by}s or more, a seed or more, no curriculum"
        )
    setup = Setup.of(dataclasses.replace(config, devices=1))
    variants = (FULL, *parts)
    without: dict[str, tuple[str, ...]] = {FULL: (), **parts}
    members = len(variants) * seeds
    setup.check(members)
    devices = min(len(jax.devices()), members)
    room = -(-members // devices) * devices  # copies of the last member fill the devices
    places = np.minimum(np.arange(room), members - 1)
    of_seed = places % seeds
    weights = {
        term: np.array([0.0 if term in without[variants[i // seeds]] else weight for i in places], np.float32)
        for term, weight in config.reward.weights.items()
    }
    each = [setup.algorithm.init(setup.env, config.algo, config.seed + i) for i in range(seeds)]
    parameters = jax.tree.map(lambda *x: np.stack([np.asarray(x[i]) for i in of_seed]), *each)
    keys = jnp.stack([random_key(config.seed + int(i)) for i in of_seed])
    start, chunk, evaluate = _programs(setup, devices)
    points = setup.updates // config.chunk
    found: dict[str, list[tuple[np.ndarray, ...]]] = {name: [] for name in setup.judges}
    if done := kept.done() if kept else 0:
        begun = jax.eval_shape(start, setup.env, weights, parameters, keys)
        one = np.zeros((members, done), np.float32)
        loaded = load_checkpoint(kept.path, {"state": begun, "found": dict.fromkeys(found, (one, one))})  # pyright: ignore
        state = loaded["state"]
        found = {name: list(zip(*(x.T for x in both), strict=True)) for name, both in loaded["found"].items()}
    else:
        state = start(setup.env, weights, parameters, keys)
    saved = time.monotonic()
    for point in range(done, points):
        state = chunk(setup.env, weights, state, point * config.chunk)
        for name, env in setup.judges.items():
            flown = evaluate(env, state.parameters.policy)
            measured = (flown.success, flown.mean_error if setup.config.task.settling_s else flown.final_error)
            found[name].append(tuple(np.asarray(jnp.mean(x, axis=1), np.float32)[:members] for x in measured))
        if kept and time.monotonic() - saved >= kept.period:
            both = {name: tuple(np.stack(x, axis=-1) for x in zip(*rows, strict=True)) for name, rows in found.items()}
            save_checkpoint(kept.path, {"state": state, "found": both}, {"ablation": kept.about, "done": point + 1})
            saved = time.monotonic()
        told((point + 1) / points, min(float(np.mean(x[-1][0][:seeds])) for x in found.values()))

    def shaped(which: int) -> dict[str, np.ndarray]:
        stacked = {name: np.stack([x[which] for x in rows], axis=-1) for name, rows in found.items()}
        return {name: x.reshape(len(variants), seeds, points) for name, x in stacked.items()}

    steps = (1.0 + np.arange(points)) * config.chunk * setup.steps_per_update
    return Curves(variants, steps, shaped(0), shaped(1))


def _programs(setup: Setup, devices: int) -> tuple[Callable, Callable, Callable]:
    """Programs that run all members. The members are the leading axis of every value that differs between them."""
    config, algorithm = setup.config, setup.algorithm

    def weighted(env: Env, weights: dict[str, Any]) -> Env:
        return dataclasses.replace(env, weights=weights)

    def start(env: Env, weights: Any, parameters: Any, keys: Any) -> TrainState:
        def one(w: Any, p: Any, k: Any) -> TrainState:
            return begin(algorithm, weighted(env, w), config.algo, p, k)

        return _each(_alone(one), weights, parameters, keys)

    def chunk(env: Env, weights: Any, state: TrainState, first: Any) -> TrainState:
        def one(w: Any, state: TrainState) -> TrainState:
            def update(state: TrainState, index: jax.Array) -> tuple[TrainState, None]:
                return algorithm.update(weighted(env, w), config.algo, state, index / setup.updates)[0], None

            return jax.lax.scan(update, state, first + jnp.arange(config.chunk))[0]

        return _each(_alone(one), weights, state)

    def evaluate(env: Env, policy: Weights) -> Episodes:
        def one(policy: Weights) -> Episodes:
            act = acting(setup.actor, policy)
            return run_episodes(
                env,
                act,
                random_key(0, WATCHED, 0),
                env.whole(config.eval_episodes),
                setup.episode_steps,
                setup.config.task.settling_s,
            )

        return _each(one, policy)

    return (
        on_each(start, devices, (SAME, OWN, OWN, OWN), OWN, axis="members"),
        on_each(chunk, devices, (SAME, OWN, OWN, SAME), OWN, donate=(2,), axis="members", vehicles=config.algo.envs),
        on_each(evaluate, devices, (SAME, OWN), OWN, axis="members", vehicles=config.eval_episodes),
    )


def _each(function: Callable, *members: Any) -> Any:
    """Apply a function to every member. On a CPU the members run one after another. That takes two thirds of the time,
    and each member draws the same random numbers as a single run, which a batch would not.
    """
    if jax.default_backend() == "cpu":
        return jax.lax.map(lambda member: function(*member), members)
    return jax.vmap(function)(*members)


def _alone(function: Callable) -> Callable:
    """Make a function that takes means over the devices run on a single device."""

    def called(*args: Any) -> Any:
        out = jax.vmap(lambda _: function(*args), axis_name=AXIS, axis_size=1)(jnp.zeros(1))
        return jax.tree.map(lambda x: x[0], out)

    return called
