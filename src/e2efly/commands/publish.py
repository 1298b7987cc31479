"""`e2efly publish`: a run's metrics on an experiment tracker."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import tyro

from e2efly.process import be_idle, raise_at_interrupt
from e2efly.terminal import Terminal


@dataclass(frozen=True)
class Publish:
    """Send a run's configuration and metrics to an experiment tracker. A run in progress is followed to its end.

    A second call sends what is new since the first one. The tracker's own settings determine where it stores the data.
    See docs/network.md for what leaves the machine.
    """

    run: tyro.conf.Positional[Annotated[Path, tyro.conf.arg(metavar="RUN")]]
    """Run directory. The run may be finished, interrupted, or in progress."""
    to: Literal["trackio", "wandb"]
    """The tracker: Trackio (pip install 'e2efly[trackio]') or Weights & Biases (pip install 'e2efly[wandb]')."""
    project: str = "e2efly"
    """Name of the project in the tracker."""
    name: str | None = None
    """Name of the run in the tracker. If omitted, the folder's name."""


def run(options: Publish) -> int:
    """Send the metrics that exist, and those that follow while the run is in progress.

    Raises:
        ValueError: for a tracker that is not installed, and for a folder without a run. Also for a folder that was
            published as another project, that holds another run now, or that another process publishes.
        OSError: when the tracker cannot be reached as its settings say.
    """
    from e2efly.learn.publish import publish
    from e2efly.learn.rundir import RunDirectory

    raise_at_interrupt()  # what the tracker was handed is written in order
    o, console = options, Terminal()
    name = o.name or o.run.resolve().name
    rows = publish(RunDirectory(o.run), o.to, o.project, name, begun=be_idle)  # a training beside it goes first
    console.print(f"Published {rows} {'update' if rows == 1 else 'updates'} of {o.run} to {o.to}, project {o.project}")
    return 0
