"""Comparison of runs: their options, their results, and the course of their training."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from e2efly.config.train import criterion
from e2efly.env import Env
from e2efly.learn.judge import rates
from e2efly.learn.rundir import RunDirectory, least_success, to_json


@dataclass(frozen=True)
class Compared:
    """One run."""

    path: Path
    """Folder of the run."""
    options: dict[str, Any]
    """Configuration of the run, by dotted name."""
    steps: Float[np.ndarray, " t"]
    """Environment steps at each evaluation."""
    seconds: Float[np.ndarray, " t"]
    """Time since the start of the process at each evaluation, s. For a resumed run, summed over all its processes."""
    success: Float[np.ndarray, " t"]
    """Success rate of the worst criterion at each evaluation."""
    vehicles: str
    """The name of what flies in training and its evaluations."""
    criterion: float
    """Success rate at which the run counts as having learned its task."""
    summary: dict[str, Any] | None
    """The summary that the run wrote at its end. None: it has not ended."""

    @staticmethod
    def of(path: Path) -> "Compared":
        """Read a run.

        Raises:
            ValueError: when the folder holds no run, or a run of another version.
        """
        run = RunDirectory(path)
        config = run.config()
        options, vehicles = dict(_flat(to_json(config))), Env.of(config.task, config.reward, config.env).vehicles
        rows = [row for row in run.rows() if "seconds" in row]
        steps, seconds = (np.array([row[name] for row in rows], float) for name in ("steps", "seconds"))
        ended = run.read_json("summary.json") if (path / "summary.json").is_file() else None
        success = np.array([least_success(row) for row in rows], float)
        least = criterion(config.stop_at, vehicles)
        return Compared(path, options, steps, seconds, success, vehicles, least, ended)

    @property
    def there(self) -> tuple[float, float] | None:
        """Environment steps and seconds when the run reached its criterion. None: it did not.

        With `stop_at` the run itself confirmed it. Otherwise it is the first evaluation with so much success.
        """
        if self.summary and (reached := self.summary.get("reached_criterion")):
            return reached["steps"], reached["seconds"]
        found = np.flatnonzero(self.success >= self.criterion)
        return (float(self.steps[found[0]]), float(self.seconds[found[0]])) if len(found) else None

    @property
    def shipped(self) -> str:
        """Success rates of the shipped policy, by the name of what flew."""
        if self.summary is None:
            return "has not ended"
        return ", ".join(f"{rate:.1%} ({name})" for name, rate in rates(self.summary).items())


def differing(runs: Sequence[Compared]) -> dict[str, list[Any]]:
    """The options in which runs differ, by dotted name, with the value of each run. The value is None if a run has no
    such option.
    """
    names = dict.fromkeys(name for run in runs for name in run.options)
    columns = {name: [run.options.get(name) for run in runs] for name in names}
    return {name: column for name, column in columns.items() if any(value != column[0] for value in column)}


def table(runs: Sequence[Compared]) -> list[dict[str, str]]:
    """One row per run, as text."""
    different = differing(runs)
    rows = []
    for i, run in enumerate(runs):
        there, ended = run.there, run.summary
        rows.append({
            "run": str(run.path),
            **{name: _text(column[i]) for name, column in different.items()},
            "steps": f"{run.steps[-1] / 1e6:.2f} M" if len(run.steps) else "none",
            "time": f"{run.seconds[-1]:.0f} s" if len(run.seconds) else "none",
            "reached": f"{100 * run.criterion:g}% ({run.vehicles}): "
            + ("never" if there is None else f"{there[0] / 1e6:.2f} M, {there[1]:.0f} s"),
            "success": run.shipped,
            "update": "" if ended is None else str(ended["shipped"]["update"]),
        })  # fmt: skip
    return rows


def _flat(values: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def _text(value: Any) -> str:
    return "" if value is None else f"{value:g}" if isinstance(value, float) else str(value)
