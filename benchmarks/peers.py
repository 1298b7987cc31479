"""Other simulators, each in a virtual environment of its own in the user's cache folder, made on first use."""

import os
import subprocess
import sys
from pathlib import Path

from e2efly.config.storage import cache_folder
from e2efly.simulation.device import cores

PEERS = {
    "Crazyflow 0.4": ("crazyflow_rate.py", {1, cores()}, ("crazyflow==0.4.0",)),
    "RotorPy 3.0": ("rotorpy_rate.py", {1}, ("rotorpy[batched]==3.0.0", "torch==2.13.0")),
    "L2F 2.0, RK4": ("l2f_rate.py", {1}, ("l2f==2.0.18", "numpy")),
    "PyFlyt 0.29, 64 vehicles": ("pyflyt_rate.py", {1}, ("pyflyt==0.29.0",)),
}
"""By name: the script that prints physics steps/s, on how many XLA devices to run it, and what it needs."""


def interpreter(*needs: str) -> Path:
    """The Python of a virtual environment that has what is needed."""
    folder = cache_folder() / needs[0].replace("==", "-").replace("[batched]", "")
    python = folder / "bin" / "python"
    if not (folder / ".ready").exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", *needs], check=True)
        (folder / ".ready").touch()
    return python


def packages(*needs: str) -> Path:
    """The folder of packages of a virtual environment that has what is needed, for this Python to import them from."""
    where = [str(interpreter(*needs)), "-c", "import sysconfig; print(sysconfig.get_path('platlib'))"]
    return Path(subprocess.run(where, capture_output=True, text=True, check=True).stdout.strip())


def physics_steps(peer: str, vehicles: int) -> float:
    """A peer's physics steps/s: the best of its numbers of devices."""
    script, counts, needs = PEERS[peer]
    found = []
    for devices in counts:
        flags = {**os.environ, "XLA_FLAGS": f"--xla_force_host_platform_device_count={devices}"}
        command = [str(interpreter(*needs)), str(Path(__file__).parent / script), str(vehicles)]
        done = subprocess.run(command, env=flags, capture_output=True, text=True, check=False)
        if done.returncode:
            raise SystemExit(f"{peer} could not be measured:\n{done.stderr}")
        found.append(float(done.stdout.split()[-1]))
    return max(found)
