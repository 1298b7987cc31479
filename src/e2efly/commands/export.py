"""`e2efly export`."""

from pathlib import Path

from e2efly.commands.terminal import Terminal
from e2efly.deploy.policy import sealed_policy
from e2efly.device import prepare
from e2efly.storage import write_atomically


def export_command(run_path: Path, out: Path | None, which: str) -> int:
    """Write policy.onnx from the checkpoint of a run, or anew from a file of an older e2efly, with its digest."""
    console = Terminal()
    if run_path.is_file():
        write_atomically(out or run_path, sealed_policy(run_path))
        console.print(f"Wrote {run_path} with its digest to {out or run_path}")
        return 0
    prepare("cpu")
    from e2efly.learn.export import contract_of, export_policy
    from e2efly.learn.rundir import RunDirectory
    from e2efly.learn.runner import load_policy_weights
    from e2efly.learn.setup import Setup

    run = RunDirectory(run_path)
    setup = Setup.of(run.config())
    weights = load_policy_weights(setup, run, which)
    path = out or run.policy
    export_policy(path, weights, setup.actor, contract_of(setup.env, setup.config))
    console.print(f"Wrote the {which} policy of {run_path} to {path}")
    return 0
