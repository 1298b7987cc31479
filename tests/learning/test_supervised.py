"""Hosts that train together: what JAX aborts for is an error with a word, and status 2."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from e2efly.learning.supervised import watched

SAID = b"""E1123 04:53:24.168798   23518 coordination_service.cc:1549] [17] Use error polling to propagate the error
F1123 04:53:24.198490   23529 client.h:80] Terminating process because the service detected fatal errors.
UNAVAILABLE: The following tasks are unhealthy (stopped sending heartbeats):
*** Check failure stack trace: ***
    @     0x7f9e6ae40634  absl::lts_20260107::log_internal::LogMessage::SendToLog()
"""


def child(then: str) -> list[str]:
    code = f"import os, sys\nos.write(2, b'a warning\\n' + {SAID!r})\n{then}"
    return [sys.executable, "-c", code]


def test_an_abort_is_an_error_with_what_it_was_and_without_a_stack(capfd: pytest.CaptureFixture[str]) -> None:
    assert watched(child("os.abort()"), lambda reason: f"{reason}; go on") == 2
    said = capfd.readouterr().err
    assert said.startswith("a warning\nerror: another process of the run ended, hangs, or cannot be reached, or ")
    assert said.endswith("(UNAVAILABLE: The following tasks are unhealthy (stopped sending heartbeats):); go on\n")
    assert "absl" not in said


@pytest.mark.parametrize(("then", "status"), [("sys.exit(0)", 0), ("sys.exit(2)", 2), ("os.kill(os.getpid(), 9)", 137)])
def test_other_ends_are_as_they_are(then: str, status: int, capfd: pytest.CaptureFixture[str]) -> None:
    assert watched(child(then), str) == status
    assert capfd.readouterr().err.encode() == b"a warning\n" + SAID


WATCH = "import sys; from e2efly.learning.supervised import watched; sys.exit(watched(sys.argv[1:], str))"
WAIT = """
from e2efly.learning.supervised import is_watched; import os, time
assert is_watched()
print(os.getpid(), flush=True)
"""


def watcher(code: str) -> "tuple[subprocess.Popen[str], int]":
    """A process that watches another, and that other's number."""
    command = [sys.executable, "-c", WATCH, sys.executable, "-c", WAIT + code]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    return process, int(process.stdout.readline())


def test_an_interrupt_is_handed_on() -> None:
    code = "try: time.sleep(60)\nexcept KeyboardInterrupt: raise SystemExit(130)"
    process, _ = watcher(code)
    process.send_signal(signal.SIGINT)
    process.communicate()
    assert process.returncode == 130


def test_the_watched_process_ends_with_the_one_that_watches() -> None:
    process, number = watcher("time.sleep(60)")
    process.kill()
    process.communicate()
    end = time.monotonic() + 10
    while Path(f"/proc/{number}").exists() and time.monotonic() < end:
        time.sleep(0.01)
    assert not Path(f"/proc/{number}").exists()


def test_a_host_that_finds_another_program_at_the_address_says_so(tmp_path: Path) -> None:
    """As a coordinator of one process alone, to which a second one comes."""
    flags = ["--hosts.coordinator", "", "--hosts.count", "2", "--hosts.index", "1", "--out", str(tmp_path / "run")]
    with subprocess.Popen(
        [sys.executable, "-c", FOREIGN], stdout=subprocess.PIPE, text=True, env=os.environ
    ) as foreign:
        assert foreign.stdout is not None
        flags[1] = f"127.0.0.1:{foreign.stdout.readline().strip()}"
        command = [sys.executable, "-m", "e2efly", "train", "hover", *flags]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        foreign.kill()
    assert done.returncode == 2, done.stderr
    assert (
        "error: another process of the run ended, hangs, or cannot be reached, or HOST:PORT is of another"
        in done.stderr
    )
    assert "stack trace" not in done.stderr


FOREIGN = """
from jax._src.lib import _jax
import socket
with socket.socket() as free:
    free.bind(("127.0.0.1", 0))
    port = free.getsockname()[1]
service = _jax.get_distributed_runtime_service(f"127.0.0.1:{port}", 1)
print(port, flush=True)
import time
time.sleep(120)
"""
