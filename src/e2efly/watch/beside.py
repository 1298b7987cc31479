"""The viewer of a training, as a process that computes only while the training leaves a core idle."""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

from e2efly.watch.viewer import free_port


class Beside:
    """`e2efly watch RUN` beside the training that makes the run. Whatever becomes of it, the training goes on."""

    def __init__(self, run: Path, host: str, port: int) -> None:
        """Find a port; the process begins with `begin`.

        Raises:
            ValueError: where viser is not installed; where the port is in use.
            OSError: for an address that this machine does not have.
        """
        self.run, self.host, self.port = run, host, free_port(host, port)
        self._process: subprocess.Popen[bytes] | None = None

    @property
    def address(self) -> str:
        """Of the page."""
        return f"http://{self.host}:{self.port}"

    def begin(self) -> None:
        """Start the process, unless it was started already."""
        if self._process is not None:
            return
        command = [
            sys.executable,
            "-m",
            "e2efly",
            "watch",
            str(self.run),
            "--host",
            self.host,
            "--port",
            str(self.port),
        ]
        self._process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True, preexec_fn=_idle,
        )  # fmt: skip

    def wait(self) -> None:
        """Until somebody ends it with Ctrl-C, which ends it here, too."""
        with suppress(KeyboardInterrupt):
            if self._process is not None:
                with suppress(OSError, AttributeError):
                    os.sched_setscheduler(self._process.pid, os.SCHED_OTHER, os.sched_param(0))
                self._process.wait()

    def close(self) -> None:
        """End it."""
        if self._process is not None:
            self._process.terminate()
            with suppress(subprocess.TimeoutExpired):
                self._process.wait(5)
            self._process.kill()


def _idle() -> None:
    """Compute only while nobody else wants the core."""
    with suppress(OSError, AttributeError):
        os.nice(19)
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
