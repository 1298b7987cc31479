"""Rates of physics, environment and training, with Crazyflow 0.4 measured in the same run.

    python benchmarks/rates.py [--crazyflow-python PATH] [--rounds 5] [--json FILE]

Without --crazyflow-python a virtual environment with crazyflow==0.4.0 is made in the user's cache folder.
Both sides are timed in turn, `rounds` times; the table has the medians and the ratio of the medians.
"""

import os
import subprocess
import sys
from pathlib import Path

from common import arguments, median, table, write

from e2efly.device import cache_folder, cores, prepare
from e2efly.learn.benchmark import environment_steps, physics_substeps, training_steps

WORLDS = 1024


def crazyflow_python() -> Path:
    """An interpreter that has Crazyflow, made on first use."""
    folder = cache_folder() / "crazyflow-0.4.0"
    python = folder / "bin" / "python"
    if not (folder / ".ready").exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", "crazyflow==0.4.0"], check=True)
        (folder / ".ready").touch()
    return python


def crazyflow(python: Path) -> float:
    """Crazyflow's physics steps/s: `first_principles`, `body_rate`, 10 physics steps a call.

    The better of its default and of its worlds distributed over as many devices as there are cores.
    """
    script = Path(__file__).parent / "crazyflow_rate.py"
    found = []
    for devices in {1, cores()}:
        flags = {**os.environ, "XLA_FLAGS": f"--xla_force_host_platform_device_count={devices}"}
        command = [str(python), str(script), str(WORLDS)]
        done = subprocess.run(command, env=flags, capture_output=True, text=True, check=False)
        if done.returncode:
            raise SystemExit(f"Crazyflow could not be measured:\n{done.stderr}")
        found.append(float(done.stdout.split()[-1]))
    return max(found)


def main() -> None:
    """Measure, print a table, write JSON."""
    options = arguments(__doc__ or "", crazyflow_python=None, rounds=5)
    prepare("cpu")
    python = Path(options.crazyflow_python) if options.crazyflow_python else crazyflow_python()
    ours, general, theirs, steps = [], [], [], []
    for _ in range(options.rounds):
        theirs.append(crazyflow(python))
        ours.append(physics_substeps(WORLDS))
        general.append(physics_substeps(WORLDS, general=True))
        steps.append(environment_steps("hover", WORLDS))
    substeps, own, peer, env = median(ours), median(general), median(theirs), median(steps)
    figures = {
        f"Crazyflow 0.4 physics steps, {WORLDS} worlds over all cores": peer,
        f"Crazyflow 0.4 control steps (10 physics steps), {WORLDS} worlds": peer / 10,
        f"e2efly physics sub-steps, {WORLDS} vehicles": substeps,
        f"e2efly physics sub-steps, {WORLDS} vehicles, each with parameters of its own": own,
        f"e2efly environment steps (7 sub-steps, everything included), {WORLDS} environments, hover": env,
        "e2efly PPO training steps, hover": training_steps("hover", "ppo"),
        "e2efly BPTT training steps, hover": training_steps("hover", "bptt"),
        "e2efly BPTT training steps, hover, 100 environments, horizon 96, networks 192-96": training_steps(
            "hover", "bptt", wide=True
        ),
    }
    rows = [{"what": name, "a second": f"{value:,.0f}"} for name, value in figures.items()]
    ratios = {
        "physics": substeps / peer,
        "physics, parameters as constants over each its own": substeps / own,
        "environment over Crazyflow's bare control steps": env / (peer / 10),
    }
    rows += [{"what": f"ratio, {name}", "a second": f"{value:.2f}"} for name, value in ratios.items()]
    rounds = {"e2efly": ours, "general": general, "crazyflow": theirs, "environment": steps}
    write("rates", options.json, {"table": rows, "figures": figures, "ratios": ratios, "rounds": rounds})
    print(table(rows))


if __name__ == "__main__":
    main()
