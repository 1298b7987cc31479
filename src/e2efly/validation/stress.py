"""Results of a policy in the rows of the stress, with one compiled program."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import jax
import numpy as np

from e2efly.environment import UNSEEN, random_key
from e2efly.environment.episodes import Episodes, run_stepwise, summary
from e2efly.environment.stress_rows import ROWS, Draw, StressRow, check_rows, check_seen, rows_for, with_longer_queue
from e2efly.simulation.device import prepare
from e2efly.validation.evaluation import BATCH, SEED, Candidate, act_of, candidate
from e2efly.vehicles.vehicle import Controller, Vehicle


@dataclass(frozen=True)
class Report:
    """Results of a policy in each row."""

    candidate: Candidate
    seed: int
    flown: dict[str, dict[str, Any]]
    """For each row and criterion: `Episodes`, or the verdicts on a plant; NumPy arrays."""
    plant: str = "training"
    """Where it flew: the training simulator, or a plant."""
    left_out: Mapping[str, str] = field(default_factory=dict)
    """Rows that the plant cannot reproduce, and what it cannot change."""

    @property
    def success(self) -> dict[str, float]:
        """The success rate of the worst criterion, by row."""
        return {row: min(float(np.mean(e.success)) for e in criteria.values()) for row, criteria in self.flown.items()}

    @property
    def worst(self) -> str:
        """The row with the lowest success rate."""
        return min(self.success, key=lambda row: self.success[row])

    def as_json(self) -> dict[str, Any]:
        """The report that `--stress --json` writes: a summary by row and criterion."""
        return {
            **self.candidate.as_json(),
            "plant": self.plant,
            "seed": self.seed,
            "left_out": dict(self.left_out),
            "stress": {row: {name: summary(e) for name, e in found.items()} for row, found in self.flown.items()},
        }


def stress(
    policy: str | os.PathLike[str],
    episodes: int = 1000,
    *,
    rows: tuple[str, ...] = (),
    vehicle: str | None = None,
    controller: Controller = "policy",
    seed: int = SEED,
    device: str | None = None,
    baseline: str | None = None,
) -> Report:
    """Fly a policy's file in every row of `ROWS`, from the unseen starts of `evaluate`.

    Args:
        policy: a run directory, a policy.onnx, or the name of a task: the zoo's policy of it.
        episodes: starts per row and criterion.
        rows: names of rows. Empty: all rows; the rows of cameras only if the policy has cameras.
        vehicle: the vehicle that flies in the nominal row and that the other rows change. If omitted, the policy's own
            vehicle.
        controller: the vehicle for which the flight controller is tuned in every row: policy or plant.
        seed: the seed of the starts.
        device: cpu or gpu.
        baseline: the hover controller that flies in place of the policy; see `evaluate`.

    Raises:
        ValueError: naming the option, its value and what is accepted.
    """
    if episodes <= 0:
        raise ValueError(f"--episodes is {episodes}; accepted: more than 0")
    check_rows(rows)
    prepare(device)
    found = candidate(policy, vehicle, controller, baseline=baseline)
    if found.draws:
        raise ValueError(
            f"--vehicle is {vehicle or 'left out'}; accepted with --stress: one vehicle within the ranges of "
            f"{found.vehicle}, about which the rows lie"
        )
    check_seen(rows, found.env.cameras)
    return Report(found, seed, fly_rows(found, rows or rows_for(found.env.cameras), episodes, seed))


def fly_rows(found: Candidate, rows: tuple[str, ...], episodes: int, seed: int) -> dict[str, dict[str, Episodes]]:
    """Fly `episodes` starts per row and criterion."""
    flown: dict[str, dict[str, Episodes]] = {row: {} for row in rows}
    batches = range(-(-episodes // BATCH))
    for name, suite in found.task.criteria().items():
        env = with_longer_queue(found.environment(suite))
        steps, settle = env.episode_steps, suite.settling_s
        for row in rows:
            parts = []
            for i in batches:
                draw = Draw.of(ROWS[row], env.physics.flown, _generator(ROWS[row], seed, i), BATCH)
                draw = jax.tree.map(lambda x: np.asarray(x, np.float32), draw)
                key, act = random_key(seed, UNSEEN, i), act_of(found.policy)
                altered = partial(draw.state, env)
                parts.append(run_stepwise(draw.env(env), act, key, BATCH, steps, settle, altered)[0])
            flown[row][name] = jax.tree.map(lambda *x: np.concatenate(x)[:episodes], *parts)
    return flown


def draws(row: StressRow, vehicle: Vehicle, seed: int, n: int) -> Draw:
    """The first n episodes of a row for the seed of the starts. They do not depend on the number of episodes."""
    batches = [Draw.of(row, vehicle, _generator(row, seed, i), BATCH) for i in range(-(-n // BATCH))]
    return jax.tree.map(lambda *x: np.concatenate(x)[:n], *batches)


def _generator(row: StressRow, seed: int, batch: int) -> np.random.Generator:
    return np.random.default_rng([seed, UNSEEN, batch, list(ROWS).index(row.name)])
