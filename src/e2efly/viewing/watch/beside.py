"""The viewer as a separate process during a training or a flight. It computes only while these leave a core idle."""

import json
import socket
import subprocess
import sys
from contextlib import suppress
from typing import Any

from e2efly.viewing.watch.port import free_port

HOST = "127.0.0.1"
"""Address at which the page is served and poses are received."""


class Beside:
    """`e2efly watch WHAT` as a process beside the program that produces WHAT. That program continues, whatever happens
    to the viewer.
    """

    def __init__(self, port: int, *what: str) -> None:
        """Find a port. The process starts with `begin`.

        Args:
            port: port of the page. 0: any free port.
            what: arguments of `e2efly watch`.

        Raises:
            ValueError: for a port that is invalid or in use; when viser is not installed.
        """
        if not 0 <= port <= 65535:
            raise ValueError(f"--watch is {port}; accepted: a port, 1 to 65535, or 0 for any")
        self.what, self.port = what, free_port(HOST, port)
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self.port}"

    def begin(self) -> None:
        """Start the process, unless it was started already."""
        if self._process is not None:
            return
        where = ["--idle", "--host", HOST, "--port", str(self.port)]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "e2efly", "watch", *self.what, *where], start_new_session=True,
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip

    def wait(self) -> None:
        """Wait until the user ends the viewer with Ctrl-C, which also ends this waiting."""
        with suppress(KeyboardInterrupt):
            if self._process is not None:
                self._process.wait()

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.terminate()
            with suppress(subprocess.TimeoutExpired):
                self._process.communicate(timeout=5)
            self._process.kill()


class Shown:
    """Takes the same records as a flight log and shows the vehicle on a page. It sends datagrams, which never block."""

    def __init__(self, port: int, *what: str) -> None:
        """Start the viewer.

        Args:
            port: port of the page. 0: any free port.
            what: more arguments of `e2efly watch`.

        Raises:
            ValueError: for a port that is invalid or in use; when viser is not installed.
        """
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind((HOST, 0))
            self._to = probe.getsockname()
        self.page = Beside(port, f"udp:{self._to[1]}", *what)
        self.page.begin()

    def record(self, channel: str, time: float, values: dict[str, Any]) -> None:
        """Show an odometry record. Other records are ignored."""
        if channel == "odometry" and values.get("position") is not None and values.get("quaternion") is not None:
            self.show(time, values["position"], values["quaternion"])

    def show(self, time: float, position: Any, quaternion: Any) -> None:
        """Show the vehicle at a position, (3,) m, with an attitude, (4,) wxyz, at a time, s."""
        pose = {"stamp": time, "position": [*map(float, position)], "quaternion": [*map(float, quaternion)]}
        with suppress(OSError):
            self._socket.sendto(json.dumps(pose).encode(), self._to)

    def close(self) -> None:
        """End the viewer."""
        self._socket.close()
        self.page.close()
