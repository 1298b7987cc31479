"""Sends a run's metrics to an experiment tracker, in a separate process, so that the training never waits for it.

The file RUN/published/TRACKER/published.json records how far a run has been published, so that nothing is sent twice.
This also holds when the command is started again, or when the run was killed and repeats some updates. Imports no JAX.
"""

import dataclasses
import hashlib
import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from e2efly.config.reading import read
from e2efly.learn.rundir import RunDirectory
from e2efly.learn.trackers import Asked, tracker
from e2efly.storage import held, is_held, read_json, write_json

LOOK_S = 2.0
"""Time between two checks of a run that is still in progress, s."""


@dataclass(frozen=True)
class Published:
    """How far a run has been published."""

    project: str
    """Project of the tracker."""
    id: str
    """Identifier of the run in the tracker."""
    update: int
    """The last update that was sent. 0: none."""
    config_sha256: str
    """SHA-256 of the run's config.json."""


def publish(
    run: RunDirectory,
    to: str,
    project: str,
    name: str,
    begun: Callable[[], None] = lambda: None,
    look_s: float = LOOK_S,
) -> int:
    """Send the configuration once, and each row of the metrics by environment steps, until the run's process ends.

    Args:
        run: a run that is finished, was stopped early, or is in progress.
        to: a name of `TRACKERS`.
        project: project of the tracker.
        name: name of the run in the tracker.
        begun: called when the tracker has opened its run. Other programs must not delay that.
        look_s: time between two checks of the run, s.

    Returns:
        The number of rows that were sent.

    Raises:
        ValueError: for an unknown tracker; for a folder without a run; when another process publishes the run; when the
            run was published in another project, or when the folder now holds another run.
        OSError: when the tracker or the folder cannot be written to.
    """
    opened, sent = tracker(to), 0
    _wait_for_config(run, look_s)
    folder = run.path / "published" / to
    file = folder / "published.json"
    with held(folder, "RUN"):
        before = _read(file)
        _check(run, file, before, project)
        with opened(Asked(project, name, before.id if before else None, _config(run))) as there:
            done = before or Published(project, there.id, 0, _digest(run))
            _keep(run, file, done)
            begun()
            while True:
                going = is_held(run.path)  # checked first, so that the last rows of its process are read below
                _check(run, file, done, project)
                rows = [row for row in run.rows() if row["update"] > done.update]
                for row in rows:
                    there.send(_numbers(row), int(row["steps"]))
                if rows:
                    sent += len(rows)
                    done = dataclasses.replace(done, update=int(rows[-1]["update"]))
                    _keep(run, file, done)
                if not going:
                    return sent
                time.sleep(look_s)


def _wait_for_config(run: RunDirectory, look_s: float) -> None:
    """Wait until a training that has just begun has written its config.json."""
    while not (run.path / "config.json").is_file():
        if not is_held(run.path):
            raise ValueError(f"{run.path} holds no run: there is no config.json")
        time.sleep(look_s)


def _check(run: RunDirectory, file: Path, known: Published | None, project: str) -> None:
    """Refuse to continue if that would mix two runs or two projects."""
    if known is None:
        return
    if known.project != project:
        raise ValueError(
            f"--project is {project!r}, but {run.path} was published in {known.project!r}; accepted: that, or to "
            f"delete {file.parent}, which publishes the run anew"
        )
    if _digest(run) != known.config_sha256 or _read(file) != known:
        raise _another(run, file)


def _another(run: RunDirectory, file: Path) -> ValueError:
    return ValueError(
        f"{run.path} holds another run than was published; accepted: to start the command again, or to delete "
        f"{file.parent}, which publishes the run anew"
    )


def _keep(run: RunDirectory, file: Path, done: Published) -> None:
    """Write how far the run has been published, unless the folder was deleted with the run."""
    try:
        write_json(file, dataclasses.asdict(done))
    except OSError:
        if file.parent.is_dir():
            raise
        raise _another(run, file) from None


def _read(file: Path) -> Published | None:
    if not file.is_file():
        return None
    return read(Published, read_json(file), str(file))


def _digest(run: RunDirectory) -> str:
    """SHA-256 of the configuration. Empty if there is none, for example while a run is being overwritten."""
    file = run.path / "config.json"
    return hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else ""


def _config(run: RunDirectory) -> dict[str, Any]:
    """Everything that determines the result, from the files of the run."""
    return {**run.read_json("config.json"), "versions": run.read_json("versions.json")}


def _numbers(row: Mapping[str, float]) -> dict[str, float]:
    """All finite numbers of an update. Trackers cannot represent numbers that are not finite."""
    return {name: value for name, value in row.items() if name != "steps" and math.isfinite(value)}
