"""A point of a run, from which it goes on: what a checkpoint holds."""

import dataclasses
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import numpy as np

from e2efly.environment import random_key
from e2efly.learning import hosts
from e2efly.learning.algorithm import TrainState
from e2efly.learning.checkpoint import load_checkpoint, read_about, save_checkpoint
from e2efly.learning.devices import placed
from e2efly.learning.networks import Weights
from e2efly.learning.programs import start_program
from e2efly.learning.setup import Setup
from e2efly.runs.rundir import versions


@dataclass(frozen=True)
class Progress:
    """The progress of a run, as stored in the header of a checkpoint."""

    update: int = 0
    seconds: float = 0.0
    best_score: float = -math.inf
    best_update: int = 0
    best_success: float = 0.0
    last_success: float = 0.0
    stage: int = 0
    """Stage of the curriculum."""
    stage_update: int = 0
    """The update at which this stage began."""
    reached: dict[str, float] = dataclasses.field(default_factory=dict)
    """Seconds since the start of the process, and environment steps, at the first evaluation that reached `stop_at`.
    Empty before that."""


@dataclass(frozen=True)
class Point:
    """What a run has learned after an update, and how far it is."""

    state: TrainState
    """The state of each device."""
    best: Weights
    """The policy with the best score so far."""
    progress: Progress

    @property
    def weights(self) -> Weights:
        """The weights of the policy, on the host."""
        return weights_of(self.state)

    def save(self, path: Path, seed: int) -> None:
        """Write a checkpoint. Process 0 writes the file; all processes contribute their part."""
        whole = hosts.gather({"state": self.state, "best": self.best})
        if hosts.first():
            about = {**dataclasses.asdict(self.progress), "version": versions()["e2efly"], "seed": seed}
            save_checkpoint(path, whole, about)

    @staticmethod
    def resumed(path: Path, setup: Setup, parameters: Any) -> "Point":
        """The point in process 0's checkpoint."""
        like, loaded, about = _like(setup, parameters), None, None
        if hosts.first():
            loaded, about = load_checkpoint(path, like), read_about(path)
        loaded, about = hosts.broadcast(loaded, like), hosts.broadcast_json(about)
        known = {field.name: about[field.name] for field in dataclasses.fields(Progress)}
        if known["best_score"] is None:  # as JSON has no infinities
            known["best_score"] = -math.inf
        return Point(placed(loaded["state"], setup.devices), loaded["best"], Progress(**known))


def weights_of(state: TrainState) -> Weights:
    """The weights of the policy, on the host. They are the same on every device."""
    return jax.tree.map(
        lambda x: np.asarray(x.addressable_data(0) if isinstance(x, jax.Array) else x)[0], state.parameters.policy
    )


def load_policy_weights(path: Path, setup: Setup, which: str) -> Weights:
    """The `best` or the `last` policy of a checkpoint.

    Raises:
        ValueError: when there is no complete checkpoint.
    """
    loaded = load_checkpoint(path, _like(setup, setup.parameters()))
    return loaded["best"] if which == "best" else weights_of(loaded["state"])


def _like(setup: Setup, parameters: Any) -> dict[str, Any]:
    """Shapes and types of the content of a checkpoint."""
    state = jax.eval_shape(start_program(setup), setup.env, parameters, random_key(0))
    return {"state": state, "best": parameters.policy}
