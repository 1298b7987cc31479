"""What tests of processes and sockets wait for, and where: conditions, ports, ends of processes."""

import socket
import time
from collections.abc import Callable
from pathlib import Path


def until(done: Callable[[], object], seconds: float = 20.0, said: Callable[[], object] = lambda: "") -> None:
    """Wait until a condition holds. `said`: what explains that it does not hold in time."""
    end = time.monotonic() + seconds
    while not done():
        assert time.monotonic() < end, f"it did not happen in time {said()}"
        time.sleep(0.002)


def free_port(udp: bool = False) -> int:
    """A port of this machine that nobody uses at the moment."""
    with socket.socket(type=socket.SOCK_DGRAM if udp else socket.SOCK_STREAM) as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def running(pid: int) -> bool:
    """Whether a process is there and is no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
