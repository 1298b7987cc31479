"""What the part that flies takes, beside the whole: installed size, start-up and memory of `e2efly fly`.

    python benchmarks/onboard.py [--pythons python3.11 python3.12 python3.13] [--starts 5] [--json FILE]

`e2efly-fly` is installed by pip into a new environment of each Python, and the whole into one of the first. Each then
starts `e2efly fly hover` beside a controller that answers as recorded firmware did, with its watchdog process and its
log, until its loop tells a service manager that it is ready. Size: of the environment, with what pip compiles, without
pip itself. Memory: the most that the bridge and its watchdog process have resided in. Medians of the starts.
"""

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from common import arguments, median, table, write
from tests.commands.test_fly import free_port
from tests.flight.test_msp_client import controller, recorded

ROOT = Path(__file__).parents[1]
PARTS = {"e2efly-fly": "onboard", "e2efly": "."}
"""Distributions by name, and the folder of each."""
LOOP_S = 2.0
"""The loop runs for so long before its memory is taken, s."""
ALONE = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
TREE = ("onboard", "src", "pyproject.toml", "README.md", "LICENSE")
"""What is copied, so that no build leaves anything in the repository."""


def installed(python: str, part: str, folder: Path) -> tuple[Path, float, int]:
    """A new environment with a distribution: its Python, its size in MB, and how many packages it has."""
    subprocess.run([python, "-m", "venv", folder / "env"], check=True)
    own = folder / "env" / "bin" / "python"
    (site,) = folder.glob("env/lib/python*/site-packages")
    before = size(folder / "env")
    for name in TREE:
        source, ignored = ROOT / name, shutil.ignore_patterns("build", "*.egg-info", "__pycache__")
        shutil.copytree(source, folder / name, ignore=ignored) if source.is_dir() else shutil.copy(source, folder)
    pip = [own, "-m", "pip", "install", "-q", "--disable-pip-version-check", "--no-cache-dir"]
    place = str(folder / PARTS[part])
    subprocess.run([*pip, "-c", ROOT / "constraints.txt", place], check=True, env=ALONE, stderr=subprocess.DEVNULL)
    packages = len([path for path in site.glob("*.dist-info") if not path.name.startswith(("pip-", "setuptools-"))])
    return own, (size(folder / "env") - before) / 1e6, packages


def size(folder: Path) -> int:
    """Bytes of the files of a folder."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file() and not path.is_symlink())


def seconds_of_help(python: Path) -> float:
    """Of `fly --help`."""
    began = time.perf_counter()
    subprocess.run([python, "-m", "e2efly", "fly", "--help"], check=True, env=ALONE, stdout=subprocess.DEVNULL)
    return time.perf_counter() - began


def flight(python: Path, folder: Path) -> tuple[float, float, float]:
    """Seconds until the loop runs, and MB of memory of the bridge and of its watchdog process."""
    path = folder / "notify"
    path.unlink(missing_ok=True)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager, controller(recorded) as client:
        manager.bind(str(path))
        manager.settimeout(60)
        command = [python, "-m", "e2efly", "fly", "hover", "--link", client.link.name]  # type: ignore[attr-defined]
        command += ["--pose", f"udp:{free_port()}", "--log", folder / f"{time.monotonic_ns()}.mcap"]
        began = time.perf_counter()
        process = subprocess.Popen(command, env={**ALONE, "NOTIFY_SOCKET": str(path)}, stdout=subprocess.DEVNULL)
        try:
            manager.recv(4096)
            taken, end = time.perf_counter() - began, time.monotonic() + LOOP_S
            while time.monotonic() < end:
                manager.recv(4096)
            children = Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split()
            memory = [resident(number) for number in (process.pid, *map(int, children))]
            process.send_signal(signal.SIGINT)
            if process.wait(30):
                raise SystemExit(f"{python}: the bridge has ended with {process.returncode}")
        finally:
            process.kill()
            process.wait()
    return taken, memory[0], sum(memory[1:])


def resident(number: int) -> float:
    """The most that a process has resided in, MB."""
    lines = Path(f"/proc/{number}/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 / 1e6 for line in lines if line.startswith("VmHWM"))


def row(python: str, part: str, starts: int) -> dict[str, Any]:
    """All figures of a distribution on a Python."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place)
        own, megabytes, packages = installed(python, part, folder)
        version = subprocess.run([own, "--version"], capture_output=True, text=True, check=True).stdout.split()[1]
        seconds_of_help(own)  # files that were read once are read faster
        told = [seconds_of_help(own) for _ in range(starts)]
        flights = [flight(own, folder) for _ in range(starts)]
    loop, bridge, watchdog = (median(list(values)) for values in zip(*flights, strict=True))
    return {
        "part": part, "python": version, "installed_mb": megabytes, "packages": packages, "help_s": median(told),
        "loop_s": loop, "bridge_mb": bridge, "watchdog_mb": watchdog,
    }  # fmt: skip


def main() -> None:
    """Measure, print a table, write JSON."""
    options = arguments(__doc__ or "", pythons=[sys.executable], starts=5)
    asked = [(options.pythons[0], "e2efly"), *((python, "e2efly-fly") for python in options.pythons)]
    rows = [row(python, part, options.starts) for python, part in asked]
    shown = [
        {
            "installed": found["part"], "Python": found["python"], "size, MB": f"{found['installed_mb']:.0f}",
            "packages": str(found["packages"]), "fly --help, s": f"{found['help_s']:.2f}",
            "until the loop runs, s": f"{found['loop_s']:.2f}", "memory, bridge, MB": f"{found['bridge_mb']:.0f}",
            "memory, watchdog, MB": f"{found['watchdog_mb']:.0f}",
        }
        for found in rows
    ]  # fmt: skip
    write("onboard", options.json, {"table": shown, "rows": rows})
    print(table(shown))


if __name__ == "__main__":
    main()
