"""The metrics of a run: rows of metrics.csv and TensorBoard events."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from e2efly.environment.episodes import Episodes
from e2efly.learning import hosts
from e2efly.learning.point import Progress
from e2efly.runs.rundir import RunDirectory


class NonFiniteError(FloatingPointError):
    """A loss or reward term was not finite."""


@contextmanager
def writing(run: RunDirectory, steps: int) -> Iterator[Callable[[list[dict[str, float]]], None]]:
    """A function that writes rows to metrics.csv, and the last row to the TensorBoard events, by environment steps.

    In processes other than 0 it does nothing.
    """
    from e2efly.learning.events import event_file

    if not hosts.first():
        yield lambda rows: None
        return
    with event_file(run.events, steps) as log:

        def write(rows: list[dict[str, float]]) -> None:
            run.append(rows)
            log(rows[-1], int(rows[-1]["steps"]))

        yield write


def rows_of(
    metrics: dict[str, np.ndarray],
    flown: dict[str, Episodes],
    progress: Progress,
    rate: float,
    steps: int,
    stage: int | None,
) -> list[dict[str, Any]]:
    """One row per update of a chunk, of so many environment steps each. The last row also holds the evaluation."""
    chunk = len(next(iter(metrics.values())))
    rows = []
    for i in range(chunk):
        update = progress.update - chunk + 1 + i
        last = i == chunk - 1
        row: dict[str, Any] = {"update": update, "steps": update * steps}
        row |= {"seconds": round(progress.seconds, 3) if last else "", "rate": round(rate) if last else ""}
        row |= {} if stage is None else {"stage": stage}
        for name, e in flown.items():
            row[f"eval/{name}/success"] = float(np.mean(e.success)) if last else ""
            row[f"eval/{name}/final_error"] = float(np.mean(e.final_error)) if last else ""
            row[f"eval/{name}/duration"] = float(np.mean(e.duration)) if last else ""
            row[f"eval/{name}/reward"] = float(np.mean(e.reward)) if last else ""
        rows.append(row | {name: float(x[i]) for name, x in sorted(metrics.items())})
    return rows


def check_finite(metrics: dict[str, np.ndarray], update: int) -> None:
    """Refuse metrics of the updates after `update` that are not finite, the terms of the reward first."""
    for i in range(len(next(iter(metrics.values())))):
        for name in sorted(metrics, key=lambda n: (not n.startswith("reward/"), n)):
            if not np.isfinite(metrics[name][i]):
                kept = f"the checkpoint of update {update} is kept" if update else "there is no checkpoint yet"
                raise NonFiniteError(
                    f"{name} became {metrics[name][i]} in update {update + i + 1}; {kept} "
                    "(lower algo.learning-rate or algo.max-grad-norm, or look at that term)"
                )
