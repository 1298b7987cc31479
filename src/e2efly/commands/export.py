"""`e2efly export`."""

from pathlib import Path

from e2efly.commands.terminal import Terminal
from e2efly.device import prepare


def export_command(run_path: Path, out: Path | None, which: str) -> int:
    """Write policy.onnx from the checkpoint of a run."""
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
    Terminal().print(f"Wrote the {which} policy of {run_path} to {path}")
    return 0
