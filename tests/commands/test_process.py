"""The command line as a process: its streams, Ctrl-C, and what it prints."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from rich.table import Table

from e2efly.commands.cli import run
from e2efly.commands.terminal import Terminal


def e2efly(*arguments: str, **how: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "e2efly", *arguments]
    return subprocess.run(command, stderr=subprocess.PIPE, text=True, check=False, **how)  # pyright: ignore


@pytest.mark.parametrize("closed", [">&-", ">&- 2>&- <&-"])
@pytest.mark.parametrize(("command", "status"), [("--version", 0), ("fly-report nothing.mcap", 2)])
def test_closed_streams_are_no_error(closed: str, command: str, status: int) -> None:
    shell = f"exec {sys.executable} -m e2efly {command} {closed}"
    done = subprocess.run(["bash", "-c", shell], stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode == status
    assert "Traceback" not in done.stderr


def test_a_terminal_that_knows_ascii_alone_is_told_everything() -> None:
    done = e2efly("eval", "rün.onnx", env=os.environ | {"PYTHONIOENCODING": "ascii"}, stdout=subprocess.PIPE)
    assert done.returncode == 2
    assert "r\\xfcn.onnx" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("name", ["[/]", "[red]", ":ok:"])
def test_what_a_user_calls_a_folder_is_no_markup(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["export", f"runs/{name}"]) == 2
    assert f"unknown policy 'runs/{name}'" in capsys.readouterr().err
    table = Table("file")
    table.add_row(name)
    Terminal().print(table)
    Terminal().print(f"Plots: {name}")
    assert capsys.readouterr().out.count(name) == 2


def test_every_command_writes_to_a_terminal_without_markup() -> None:
    sources = (Path(__file__).parents[2] / "src").rglob("*.py")
    assert not [file for file in sources if " Console(" in file.read_text() and file.name != "terminal.py"]


@pytest.mark.parametrize(
    ("arguments", "name"),
    [
        (["eval", "/dev/zero"], "policy"),
        (["eval", "hover", "--json", "/dev/null"], "json"),
        (["export", "/dev/zero"], "run"),
        (["fly-report", "/dev/zero"], "log"),
        (["fly", "--throttle-map", "/dev/zero"], "throttle_map"),
        (["train", "hover", "--out", "/dev/null"], "out"),
    ],
)
def test_a_device_is_neither_read_nor_replaced(
    arguments: list[str], name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(arguments) == 2
    assert f"{name} is {arguments[-1]}; accepted: the path of a file or of a folder" in capsys.readouterr().err
    assert Path(arguments[-1]).is_char_device()


@pytest.mark.whole(but=1)
@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("XLA_FLAGS", "--nonsense", "XLA_FLAGS is '--nonsense'; accepted: flags and values that XLA knows (Unknown fl"),
        ("XLA_FLAGS", "--xla_cpu_prefer_vector_width=wide", "Couldn't interpret value wide for flag xla_cpu_prefer"),
        ("XLA_FLAGS", "no/file", "XLA_FLAGS is 'no/file'; accepted: flags and values that XLA knows (Could not open"),
        ("JAX_ENABLE_X64", "1", "JAX_ENABLE_X64 is True; accepted: False, which the programs here need"),
        ("JAX_NUM_CPU_DEVICES", "0", "--device cpu is not available: Unable to initialize backend 'cpu'"),
        ("JAX_DISABLE_JIT", "1", "JAX_DISABLE_JIT is True; accepted: False, which the programs here need"),
        ("JAX_NUMPY_RANK_PROMOTION", "raise", "JAX_NUMPY_RANK_PROMOTION is raise; accepted: allow, which"),
    ],
)
def test_an_environment_that_nothing_computes_in_is_named(name: str, value: str, said: str) -> None:
    done = e2efly("list", env=os.environ | {name: value}, stdout=subprocess.PIPE)
    assert done.returncode == 2
    assert said in done.stderr
    assert "Traceback" not in done.stderr


def test_an_interrupt_ends_the_process_in_the_middle_of_native_code() -> None:
    code = (
        "import os, signal, threading, zlib\n"
        "from e2efly.flight.process import end_at_interrupt\n"
        "end_at_interrupt()\n"
        "threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        "data = os.urandom(1 << 28)\n"
        "zlib.compress(data, 9)\n"
        "print('went on')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (130, "", "interrupted\n")


def test_an_ignored_interrupt_stays_ignored() -> None:
    code = (
        "import os, signal\n"
        "signal.signal(signal.SIGINT, signal.SIG_IGN)\n"
        "from e2efly.flight.process import end_at_interrupt\n"
        "end_at_interrupt()\n"
        "os.kill(os.getpid(), signal.SIGINT)\n"
        "print('went on')"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "went on\n")


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("seconds", [1.0, 3.0])
def test_an_evaluation_can_be_interrupted(seconds: float, tmp_path: Path) -> None:
    """While it is imported, compiled or flown."""
    command = [sys.executable, "-m", "e2efly", "eval", "race", "--episodes", "100000", "--plots", str(tmp_path)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(seconds)
    process.send_signal(signal.SIGINT)
    told = process.communicate()
    assert process.returncode == 130
    assert told == ("", "interrupted\n")
