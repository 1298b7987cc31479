"""What needs no flight hardware runs where Linux's own calls, and those of Unix, do not exist."""

import os
import subprocess
import sys

import pytest

from e2efly.commands.cli import run
from e2efly.config.storage import cache_folder

FLIGHT = (
    "flight", "logs.scripts", "validation",
    *(f"commands.{name}" for name in ("fly", "fly_check", "hil", "hil_rehearsal", "rehearsals", "sweep")),
)  # fmt: skip
"""Rooms and modules that need Linux, or at least Unix: flight, firmware, and the sweep."""

AS_WINDOWS = r"""
import importlib, os, pkgutil, signal, sys, types, warnings
from pathlib import Path

import gymnasium, jax, matplotlib.pyplot, onnx, onnxruntime, optax, rich.progress, scipy.stats, stable_baselines3, viser

jax.devices()
sys.platform = "win32"
for module in "fcntl grp pty pwd resource termios tty".split():
    sys.modules[module] = None
signals = "SIGABRT SIGFPE SIGILL SIGINT SIGSEGV SIGTERM".split()
for name in vars(signal).copy():
    if name.startswith("SIG") and "_" not in name and name not in signals:
        delattr(signal, name)
unix = "fork forkpty getloadavg getpgid getpriority getsid killpg mkfifo nice pread pwrite set_blocking setpriority " \
    "setsid sysconf uname wait eventfd memfd_create posix_fadvise sendfile O_CLOEXEC O_NONBLOCK".split()
for name in vars(os).copy():
    if name.startswith(("sched_", "SCHED_", "PRIO_")) or name in unix:
        delattr(os, name)
kill = os.kill
os.kill = lambda process, number: kill(process, number) if number else os._exit(3)  # 0 is Ctrl-C there


def locking(file, mode, count):
    where = os.lseek(file, 0, os.SEEK_CUR), os.fstat(file).st_ino
    if where in LOCKED:
        raise PermissionError(13, "Permission denied")
    LOCKED.append(where)


LOCKED = []
sys.modules["msvcrt"] = types.SimpleNamespace(locking=locking, LK_NBLCK=2)
# a file for which no encoding is named has another one than UTF-8 there
warnings.filterwarnings("error", category=EncodingWarning, module="e2efly")

from e2efly.flight.process import end_at_interrupt, open_streams

open_streams()
end_at_interrupt()
import e2efly
from e2efly.commands.cli import run
from e2efly.config.storage import held

for module in pkgutil.walk_packages(e2efly.__path__, "e2efly."):
    flies = any(f"{module.name}.".startswith(f"e2efly.{name}.") for name in sys.argv[1:])
    if not flies and "__main__" not in module.name:
        importlib.import_module(module.name)
with held(Path("kept")):
    try:
        with held(Path("kept")):
            pass
    except ValueError as error:
        print(error)
small = "--steps 2000 --chunk 1 --algo.envs 20 --eval-episodes 20 --no-plots --fast-compile".split()
for command in (
    ["train", "hover", "--preset", "nominal", "--algo", "ppo", *small, "--algo.minibatch", "20", "--out", "run"],
    ["export", "run"],
    ["eval", "run", "--episodes", "20"],
    ["fly", "run"],
):
    LOCKED.clear()  # closing a file would do it
    print(command[0], run(command), flush=True)
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> str:
    """What a process writes that has no more of the operating system than Windows has."""
    # the programs that were compiled before serve here, too
    environment = os.environ | {"PYTHONWARNDEFAULTENCODING": "1", "XDG_CACHE_HOME": str(cache_folder().parent)}
    command = [sys.executable, "-c", AS_WINDOWS, *FLIGHT]
    done = subprocess.run(
        command, cwd=tmp_path_factory.mktemp("there"), env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.parametrize("line", ["train 0", "export 0", "eval 0", "fly 2", "--out kept is in use by process"])
def test_training_evaluation_and_export_need_no_call_of_unix(told: str, line: str) -> None:
    assert [said for said in told.splitlines() if said.startswith(line)]


@pytest.mark.parametrize(
    ("command", "system", "said"),
    [
        ("fly", "darwin", "`e2efly fly` does not run on macOS; accepted: Linux"),
        ("hil", "win32", "`e2efly hil` does not run on Windows; accepted: Linux"),
        ("firmware", "win32", "`e2efly firmware` does not run on Windows; accepted: Linux"),
        ("sweep", "win32", "`e2efly sweep` does not run on Windows; accepted: Linux or macOS"),
        (
            "validate hover --plant betaflight --episodes 1",
            "darwin",
            "the firmware does not run on macOS; accepted: Linux",
        ),
    ],
)
def test_what_needs_another_system_says_so(
    command: str, system: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "platform", system)
    assert run(command.split()) == 2
    assert said in " ".join(capsys.readouterr().err.split())
