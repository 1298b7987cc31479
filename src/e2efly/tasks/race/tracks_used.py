"""Options of tasks of which every episode has one of several tracks: `track`, and `only` for one of them."""

import dataclasses
from pathlib import Path
from typing import Any

from e2efly.config import TaskConfig


def used(options: Any) -> tuple[str, ...]:
    """The names of the tracks that episodes have."""
    return options.track if options.only < 0 else (options.track[int(options.only)],)


def by_track(judged: Any) -> dict[str, TaskConfig]:
    """A criterion for each of these tracks, by its name; for a single one, by the task's."""
    if len(judged.track) == 1:
        return {judged.name: judged}
    where = range(len(judged.track)) if judged.only < 0 else [int(judged.only)]
    return {Path(judged.track[i]).stem: dataclasses.replace(judged, only=float(i)) for i in where}
