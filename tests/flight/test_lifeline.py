"""The lifeline, between real processes: it tells of a death, and of nothing else."""

import select
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from e2efly.flight.lifeline import Lifeline, watch

HOLDER = """
import sys
from e2efly.flight.lifeline import Lifeline
memory = bytearray(256 << 20)
line = Lifeline()
sys.stdout.write(f"{line.descriptor}\\n")
sys.stdout.flush()
if sys.stdin.readline() == "close\\n":
    line.close()
    sys.stdout.write("closed\\n")
    sys.stdout.flush()
    sys.stdin.read()
"""


def readable(told: socket.socket, timeout: float) -> bool:
    return bool(select.select([told], [], [], timeout)[0])


def hold() -> tuple[subprocess.Popen[str], socket.socket, int]:
    """A process that holds a lifeline, what is watched, and the end of a socket pair that it keeps open."""
    mine, other = socket.socketpair()
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, pass_fds=[other.fileno()],
    )  # fmt: skip
    other.close()
    assert process.stdout
    descriptor = int(process.stdout.readline())
    with Path(f"/proc/{process.pid}/fd/{descriptor}").open("r+b", buffering=0) as shared:
        return process, watch(shared.fileno()), mine.detach()


def test_a_killed_holder_is_told_before_its_sockets_close() -> None:
    process, told, other = hold()
    with process, told, socket.socket(fileno=other) as closing:
        assert not readable(told, 0.3)
        process.send_signal(signal.SIGKILL)
        assert readable(told, 5.0)
        closing.settimeout(5.0)
        assert closing.recv(1) == b""


def test_a_holder_that_ends_without_closing_is_told() -> None:
    process, told, other = hold()
    with process, told, socket.socket(fileno=other):
        process.communicate("end\n")
        assert readable(told, 5.0)


def test_a_holder_that_lets_go_is_never_told_of() -> None:
    process, told, other = hold()
    with process, told, socket.socket(fileno=other):
        assert process.stdin and process.stdout
        process.stdin.write("close\n")
        process.stdin.flush()
        assert process.stdout.readline() == "closed\n"
        process.stdin.close()
        process.wait()
        assert not readable(told, 0.3)


def test_one_that_died_before_it_was_watched_is_told() -> None:
    made: list[Lifeline] = []
    thread = threading.Thread(target=lambda: made.append(Lifeline()))
    thread.start()
    thread.join()
    time.sleep(0.01)
    with watch(made[0].descriptor) as told:
        assert readable(told, 5.0)


def test_letting_go_gives_everything_back_and_can_be_said_twice() -> None:
    before = set(Path("/proc/self/fd").iterdir())
    line = Lifeline()
    line.close()
    line.close()
    assert set(Path("/proc/self/fd").iterdir()) <= before  # whatever else was let go meanwhile


def test_it_stays_held_when_another_thread_lets_go() -> None:
    line = Lifeline()
    thread = threading.Thread(target=line.close)
    thread.start()
    thread.join()
    with watch(line.descriptor) as told:
        line.close()
        assert not readable(told, 0.1)


def test_a_system_without_robust_mutexes_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("os.memfd_create")
    with pytest.raises(OSError, match="no robust mutexes"):
        Lifeline()
