"""Shorter trainings and flights, so that what stands in the documentation is run in little time."""

import dataclasses
from collections.abc import Callable
from typing import Any

from e2efly.learning import runner
from e2efly.learning.setup import Setup
from e2efly.runs.rundir import RunDirectory
from e2efly.validation import evaluation, starts, stress

STARTS = 50
"""From so many starts a policy is judged by a training, which takes 1000 otherwise."""
TOGETHER = 10
"""So many starts are flown together, where 250 are otherwise, of which most are not looked at here."""


def shorten(patch: Callable[[Any, str, Any], None] = setattr) -> None:
    """Make trainings one update long, and flights few.

    Args:
        patch: sets an attribute of a module.
    """
    usual = runner.train

    def train(setup: Setup, run: RunDirectory, *args: Any, **options: Any) -> dict[str, Any]:
        short = dataclasses.replace(setup.config, steps=1, chunk=1, eval_episodes=STARTS)
        return usual(Setup.of(short), run, *args, **options)

    patch(runner, "train", train)
    patch(runner, "REPORT_EPISODES", STARTS)
    for module in (evaluation, stress, starts):
        patch(module, "BATCH", TOGETHER)
