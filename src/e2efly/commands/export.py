"""`e2efly export`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from e2efly.device import prepare
from e2efly.storage import write_atomically
from e2efly.terminal import Terminal


@dataclass(frozen=True)
class Export:
    """Write policy.onnx from the checkpoint of a run, or a page in which a policy flies."""

    run: tyro.conf.Positional[Path]
    """A run directory; or a policy.onnx of an older e2efly, to give it the digest that is checked when it is loaded;
    with --web also the name of a task: the zoo's policy of it."""
    out: Path | None = None
    """The file to write; RUN/policy.onnx, or the older file itself, when left out."""
    which: Literal["best", "last"] = "best"
    """The best policy by evaluation, or the last."""
    web: Path | None = None
    """Write a page into this folder in which the policy.onnx of the run flies: vehicle and task are simulated in the
    browser, and wind, mass and delay can be changed. Open its index.html, or put the folder on any host of files."""
    vehicle: str | None = None
    """What flies in the page, a name or a .toml file; the policy's own vehicle when left out."""


def run(options: Export) -> int:
    """Write policy.onnx from a checkpoint, or anew from a file of an older e2efly; or a page, see `Export.web`."""
    if options.web is not None:
        return _write_page(options, options.web)
    if options.vehicle is not None:
        raise ValueError(f"--vehicle is {options.vehicle!r}; accepted: with --web alone: policy.onnx names its own")
    console, out = Terminal(), options.out
    if options.run.is_file():
        from e2efly.deploy.policy.loader import sealed_policy

        write_atomically(out or options.run, sealed_policy(options.run))
        console.print(f"Wrote {options.run} with its digest to {out or options.run}")
        return 0
    prepare("cpu")
    from e2efly.learn.export import contract_of, export_policy
    from e2efly.learn.rundir import RunDirectory
    from e2efly.learn.runner import load_policy_weights
    from e2efly.learn.setup import Setup

    folder = RunDirectory(options.run)
    setup = Setup.of(folder.config())
    weights = load_policy_weights(setup, folder, options.which)
    path = out or folder.policy
    export_policy(path, weights, setup.actor, contract_of(setup.env, setup.config))
    console.print(f"Wrote the {options.which} policy of {options.run} to {path}")
    return 0


def _write_page(options: Export, folder: Path) -> int:
    for name, value, default in (("out", options.out, None), ("which", options.which, "best")):
        if value != default:
            raise ValueError(
                f"--{name} is {str(value)!r}, which has no effect with --web; accepted: one of the two: a page flies "
                "the policy.onnx that there is"
            )
    prepare("cpu")
    from e2efly.evaluation import candidate
    from e2efly.web.page import write_page

    found = candidate(options.run, options.vehicle)
    write_page(folder, found)
    Terminal().print(f"Wrote a page that flies {found.file}: open {folder / 'index.html'}")
    return 0
