"""The policies of a run, during or after the training. The newest policy flies as soon as it is written."""

import time
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import jax
import numpy as np

from e2efly.environment.episodes import Act
from e2efly.learning import history
from e2efly.learning.networks import Actor
from e2efly.learning.setup import Setup
from e2efly.runs.rundir import RunDirectory

LOOK_S = 0.5
"""Time between two checks of the run's folder, s."""


@dataclass
class ShownProgress:
    """The policies that a run has, and the one that flies."""

    run: RunDirectory
    """The run."""
    setup: Setup
    """The setup from its configuration."""
    update: int = -1
    """Update of the policy that flies. -1: there is none yet."""
    newest: bool = True
    """Whether always the newest policy flies."""
    updates: list[int] = field(default_factory=list)
    """Updates of the available policies."""

    def __post_init__(self) -> None:
        self._like = self.setup.parameters().policy
        self._act = jax.jit(partial(_act, self.setup.actor))
        self._weights: Any = None
        self._looked = -np.inf

    @property
    def act(self) -> Act:
        """A policy that always acts as the one that flies at the time of the call."""

        def asked(observation: Any, images: Any, memory: Any) -> tuple[Any, Any]:
            action, memory = self._act(self._weights, observation, images, memory)
            return np.asarray(action), np.asarray(memory)

        return Act(asked, self.setup.actor.memory)

    def look(self) -> bool:
        """Check the folder, if it is time to, and switch to the newest policy if `newest` is set. Returns whether
        something is new.
        """
        now = time.monotonic()
        if now - self._looked < LOOK_S:
            return False
        self._looked = now
        updates = history.kept(self.run.history)
        if updates == self.updates:
            return False
        self.updates = updates
        if updates and self.newest:
            self.fly(updates[-1])
        return True

    def fly(self, update: int) -> None:
        """Let another policy fly.

        Raises:
            ValueError: when its file is damaged.
        """
        self._weights = history.policy_at(self.run.history, update, self._like)
        self.update = update

    def wait(self, seconds: float) -> bool:
        """Wait for a policy for at most `seconds`. Returns whether there is one."""
        end = time.monotonic() + seconds
        self.look()
        while self.update < 0 and time.monotonic() < end:
            time.sleep(0.1)
            self.look()
        return self.update >= 0


def _act(actor: Actor, weights: Any, observation: Any, images: Any, memory: Any) -> tuple[Any, Any]:
    return actor(weights, actor.features(observation, images), memory)


def of_run(run: RunDirectory) -> ShownProgress:
    """The progress of a run, for watching it.

    Raises:
        ValueError: when the folder holds no run, or a run of another version.
    """
    return ShownProgress(run, Setup.of(run.config()))
