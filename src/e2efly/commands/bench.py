"""`e2efly bench`: what this machine does in a few seconds. The published figures are made by benchmarks/."""

import os
from pathlib import Path

from rich.table import Table

from e2efly.commands.terminal import Terminal
from e2efly.device import prepare
from e2efly.storage import write_json


def bench_command(report: Path | None, device: str | None) -> int:
    """Measure and print; exit status 0."""
    prepare(device)
    console = Terminal()
    figures = measure()
    table = Table("what", "per second", box=None, header_style="bold")
    for name, value in figures.items():
        table.add_row(name, f"{value / 1e6:.2f} M" if value >= 1e6 else f"{value / 1e3:.0f} k")
    console.print(table)
    if report:
        write_json(report, {"cores": os.cpu_count(), "per_second": figures})
    return 0


def measure() -> dict[str, float]:
    """Steps a second by what is counted: the best of several runs after compilation."""
    from e2efly.learn.benchmark import environment_steps, physics_substeps, training_steps

    return {
        "physics sub-steps, 1024 vehicles": physics_substeps(1024),
        "environment steps, 1024 environments, hover": environment_steps("hover", 1024),
        "PPO training steps, hover preset": training_steps("hover", "ppo"),
        "BPTT training steps, hover preset": training_steps("hover", "bptt"),
    }
