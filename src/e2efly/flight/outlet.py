"""The bridge's end of a process that publishes a flight. Records go to it through a socket, without waiting."""

import json
import os
import select
import socket
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

from e2efly.flight.child import OPENING
from e2efly.flight.process import printable

SCRIPT = Path(__file__).parents[1] / "logs" / "scripts" / "live.py"
"""The script that runs in the process."""
BUFFER = 1 << 20
"""Bytes of records that the kernel is asked to buffer for the process: some seconds of flight."""
CLOSING = 5.0
"""The longest time that the process has to publish what is waiting and to close its file, s."""


class Outlet:
    """One process. `send` takes some microseconds, even if the process stands still, is killed or is slow."""

    def __init__(self, name: str, python: str, config: dict[str, Any]) -> None:
        """Start the process and wait until it is ready. The interpreter has the package that the process needs. `name`
        is the name of the process in messages, and `config` the configuration for `scripts/live.py`.

        Raises:
            ValueError: with what the process reports about its failure, or because it does not answer in time.
        """
        self.name, self.detail = name, ""
        """`detail`: where it publishes, as it reports."""
        self.sent, self.dropped = 0, 0
        """Number of records that were handed over, and of those for which there was no room."""
        self.ended: str | None = None
        """Why it no longer takes records. None: it does."""
        self._said: list[str] = []
        self._lines = b""
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, BUFFER)
        self._errors, errors = os.pipe()
        for end in (self._errors, errors):
            os.set_blocking(end, False)  # unread output must not stop the process either
        try:
            self._process = subprocess.Popen(
                [python, str(SCRIPT), json.dumps(config)],
                stdin=theirs.fileno(),
                stdout=subprocess.PIPE,
                stderr=errors,
                bufsize=0,
                start_new_session=True,  # only the bridge acts on Ctrl+C
            )
        except OSError as error:
            self._socket.close()
            os.close(self._errors)
            raise ValueError(f"live {name}: {python}: {error.strerror}") from None
        finally:
            theirs.close()
            os.close(errors)
        assert self._process.stdout is not None
        self._out = self._process.stdout
        os.set_blocking(self._out.fileno(), False)
        deadline = time.monotonic() + OPENING
        while not self.detail and not self.ended:
            left = deadline - time.monotonic()
            if left <= 0:
                self.ended = f"no answer within {OPENING:g} s"
                break
            select.select([self._out], [], [], left)
            self._hear()
        if self.ended:
            reason = self.ended
            self.close(wait=0.0)
            raise ValueError(f"live {name}: {reason}")

    def send(self, data: bytes) -> bool:
        """Hand over a record, or drop it. Returns whether the process has ended since the last call."""
        if self.ended is not None:
            self.dropped += 1
            return False
        try:
            self._socket.send(data)
            self.sent += 1
            return False
        except BlockingIOError:
            self.dropped += 1
            return False
        except OSError as error:
            self.dropped += 1
            if not isinstance(error, ConnectionError):
                return False  # a record too long for the buffer
            self.ended = "its process has ended"
            return True

    @property
    def problems(self) -> list[str]:
        """The problems so far, for people."""
        if not self._out.closed:
            self._hear()
        found = list(self._said)
        if self.dropped:
            found.append(f"{self.dropped} of {self.dropped + self.sent} records were dropped: it did not take them")
        return ([self.ended] if self.ended else []) + found

    def close(self, wait: float = CLOSING) -> None:
        """Let the process finish, for at most `wait` s. May be called twice."""
        if self._out.closed:
            return
        self._socket.close()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(wait)
        if self._process.poll() is None:
            self._process.kill()
            self._process.wait()
            self.ended = self.ended or f"it did not end within {wait:g} s"
        self._hear(ended=True)
        self._out.close()
        os.close(self._errors)

    def _hear(self, *, ended: bool = False) -> None:
        """Read the lines that the process has written."""
        while True:
            try:
                data = os.read(self._out.fileno(), 65536)
            except BlockingIOError:
                break
            if not data:
                if not ended:
                    self.ended = self.ended or f"its process has ended{self._tail()}"
                break
            *lines, self._lines = (self._lines + data).split(b"\n")
            for line in lines:
                kind, _, rest = line.partition(b" ")
                text = printable(rest.decode(errors="replace"))
                if kind == b"ready":
                    self.detail = text
                elif kind == b"failed":
                    self.ended = text
                elif kind == b"lost":
                    self._said += [f"{text} records came too fast for it"] if text != "0" else []
                else:
                    self._said.append(text)

    def _tail(self) -> str:
        """The last line of its error output."""
        with suppress(OSError):
            said = os.read(self._errors, 65536).strip().split(b"\n")[-1]
            return f": {printable(said.decode(errors='replace'))}" if said else ""
        return ""
