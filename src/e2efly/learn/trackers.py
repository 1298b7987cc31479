"""Experiment trackers of others, each behind the same three calls: open, send, close. Imports no JAX.

Of the machine and of the publishing process they are told nothing: only what they are handed.
"""

import secrets
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any, NamedTuple


@dataclass(frozen=True)
class Asked:
    """The run as it is to be there."""

    project: str
    """Of the tracker."""
    name: str
    """Of the run, for people."""
    id: str | None
    """Of the run there, which goes on; None: it is new."""
    config: Mapping[str, Any]
    """What the run is made from."""


class Opened(NamedTuple):
    """A run there."""

    id: str
    """By which it is opened again."""
    send: Callable[[Mapping[str, float], int], None]
    """Numbers by name, at a step; steps rise."""


Tracker = Callable[[Asked], AbstractContextManager[Opened]]


@contextmanager
def _trackio(asked: Asked) -> Iterator[Opened]:
    """In a folder of this machine, unless Trackio's own settings name a Space or a server.

    It knows runs by their names alone, so that a name of its own is made for each.
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
    """Where W&B's own settings say: its service, a server of one's own, or with WANDB_MODE=offline a folder."""
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
"""By the name of the package, which is the name of the extra, too."""


def tracker(name: str) -> Tracker:
    """A tracker.

    Raises:
        ValueError: for one that is not known, or not installed, with what is accepted.
    """
    if name not in TRACKERS:
        raise ValueError(f"--to is {name!r}; accepted: {', '.join(TRACKERS)}")
    if find_spec(name) is None:
        raise ValueError(f"--to {name} needs the package {name}; accepted: pip install 'e2efly[{name}]'")
    return TRACKERS[name]
