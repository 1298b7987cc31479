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
    """Write policy.onnx from the checkpoint of a run."""

    run: tyro.conf.Positional[Path]
    """A run directory; or a policy.onnx of an older e2efly, to give it the digest that is checked when it is loaded."""
    out: Path | None = None
    """The file to write; RUN/policy.onnx, or the older file itself, when left out."""
    which: Literal["best", "last"] = "best"
    """The best policy by evaluation, or the last."""


def run(options: Export) -> int:
    """Write policy.onnx from the checkpoint of a run, or anew from a file of an older e2efly, with its digest."""
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
