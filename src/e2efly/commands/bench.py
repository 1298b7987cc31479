"""`e2efly bench`: a measurement of this machine in a few seconds. The published figures come from benchmarks/."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from rich.table import Table

from e2efly.commands.terminal import Terminal
from e2efly.config.storage import write_json
from e2efly.simulation.device import cores, prepare, processor


@dataclass(frozen=True)
class Bench:
    """Measure this machine: physics, environment and training steps a second. (`e2efly benchmark` scores policies.)"""

    json: Path | None = None
    """Write the figures to this file."""
    device: Literal["cpu", "gpu"] | None = None
    """Device to compute on."""


def run(options: Bench) -> int:
    """Measure, print and write."""
    prepare(options.device)
    console, figures = Terminal(), measure()
    table = Table("what", "per second", box=None, header_style="bold")
    for name, value in figures.items():
        table.add_row(name, f"{value / 1e6:.2f} M" if value >= 1e6 else f"{value / 1e3:.0f} k")
    model, avx512 = processor()
    with_avx512 = {True: ", with AVX-512", False: ", without AVX-512", None: ""}[avx512]
    console.print(f"{cores()} cores of {model}{with_avx512}", style="dim")
    console.print(table)
    if options.json:
        about = {"cpu": model, "avx512": avx512, "cores": cores()}
        write_json(options.json, {**about, "per_second": figures})
    return 0


def measure() -> dict[str, float]:
    """Steps per second, by kind of step: the best of several runs after compilation."""
    import jax

    from e2efly.learning.step_rates import environment_steps, physics_substeps, training_steps
    from e2efly.runs import presets

    def training(algo: str) -> float:
        return training_steps(presets.starting("hover", algo, presets.NOMINAL, device=jax.default_backend()))

    return {
        "physics sub-steps, 1024 vehicles": physics_substeps(1024),
        "environment steps, 1024 environments, hover": environment_steps("hover", 1024),
        "PPO training steps, hover preset": training("ppo"),
        "BPTT training steps, hover preset": training("bptt"),
    }
