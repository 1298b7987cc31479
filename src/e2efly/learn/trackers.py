"""Third-party experiment trackers, each with the same three calls: open, send, close. Imports no JAX.

They receive only the data that is sent to them, and nothing about the machine or the publishing process.
"""

import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, NamedTuple


@dataclass(frozen=True)
class Asked:
    """The run to open in the tracker."""

    project: str
    """Project of the tracker."""
    name: str
    """Name of the run, for people."""
    id: str | None
    """Identifier of an existing run in the tracker, which is continued. None: the run is new."""
    config: Mapping[str, Any]
    """Configuration of the run."""


class Opened(NamedTuple):
    """An open run in the tracker."""

    id: str
    """Identifier with which the run is opened again."""
    send: Callable[[Mapping[str, float], int], None]
    """Send numbers by name, at a step. The steps must increase."""


Tracker = Callable[[Asked], AbstractContextManager[Opened]]


@contextmanager
def _trackio(asked: Asked) -> Iterator[Opened]:
    """Trackio: stores the run in a folder on this machine, unless Trackio's own settings name a Space or a server.

    Trackio identifies runs only by their names, so a unique name is made for each run.
    """
    import trackio  # pyright: ignore[reportMissingImports]

    name = asked.id or f"{asked.name}-{secrets.token_hex(3)}"
    try:
        run = trackio.init(
            project=asked.project, name=name, config=dict(asked.config), resume="must" if asked.id else "never",
            embed=False, auto_log_gpu=False, auto_log_cpu=False,
        )  # fmt: skip
    except ValueError as error:
        raise ValueError(f"--to trackio: {error}; accepted: the folder that it was published to") from None
    try:
        yield Opened(name, lambda numbers, step: run.log(dict(numbers), step=step))
    finally:
        run.finish()


@contextmanager
def _wandb(asked: Asked) -> Iterator[Opened]:
    """W&B: stores the run where W&B's own settings say: its service, a private server, or, with WANDB_MODE=offline, a
    folder.
    """
    import wandb

    alone = wandb.Settings(
        console="off", disable_code=True, disable_git=True, host="",
        x_disable_machine_info=True, x_disable_meta=True, x_disable_stats=True, x_save_requirements=False,
    )  # fmt: skip
    try:
        run = wandb.init(
            project=asked.project, name=asked.name, id=asked.id, resume="allow" if asked.id else None,
            config=None if asked.id else dict(asked.config), settings=alone,
        )  # fmt: skip
    except wandb.Error as error:
        raise OSError(f"--to wandb: {error}") from None
    try:
        yield Opened(str(run.id), lambda numbers, step: run.log(dict(numbers), step=step))
    finally:
        run.finish()


TRACKERS: dict[str, Tracker] = {"trackio": _trackio, "wandb": _wandb}
"""Trackers by the name of their package, which is also the name of the extra."""


def tracker(name: str) -> Tracker:
    """A tracker.

    Raises:
        ValueError: for a tracker that is unknown or not installed, with what is accepted.
    """
    if name not in TRACKERS:
        raise ValueError(f"--to is {name!r}; accepted: {', '.join(TRACKERS)}")
    if find_spec(name) is None:
        raise ValueError(f"--to {name} needs the package {name}; accepted: pip install 'e2efly[{name}]'")
    return TRACKERS[name]
