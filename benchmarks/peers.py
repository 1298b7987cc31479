"""Other simulators, each in a virtual environment of its own in the user's cache folder, made on first use."""

import os
import subprocess
import sys
from pathlib import Path

from e2efly.device import cache_folder, cores

PEERS = {
    "Crazyflow 0.4": ("crazyflow_rate.py", ("crazyflow==0.4.0",)),
    "RotorPy 3.0": ("rotorpy_rate.py", ("rotorpy[batched]==3.0.0", "torch==2.13.0")),
}
"""By name: the script that prints physics steps/s, and what it needs."""


def interpreter(peer: str) -> Path:
    """The Python that has a peer."""
    needs = PEERS[peer][1]
    folder = cache_folder() / needs[0].replace("==", "-").replace("[batched]", "")
    python = folder / "bin" / "python"
    if not (folder / ".ready").exists():
        subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
        subprocess.run([str(python), "-m", "pip", "install", "--quiet", *needs], check=True)
        (folder / ".ready").touch()
    return python


def physics_steps(peer: str, vehicles: int) -> float:
    """A peer's physics steps/s: the better of one XLA device (one is all the same to PyTorch) and one for each core."""
    found = []
    for devices in {1, cores()}:
        flags = {**os.environ, "XLA_FLAGS": f"--xla_force_host_platform_device_count={devices}"}
        command = [str(interpreter(peer)), str(Path(__file__).parent / PEERS[peer][0]), str(vehicles)]
        done = subprocess.run(command, env=flags, capture_output=True, text=True, check=False)
        if done.returncode:
            raise SystemExit(f"{peer} could not be measured:\n{done.stderr}")
        found.append(float(done.stdout.split()[-1]))
    return max(found)
