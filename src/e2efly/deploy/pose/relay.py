"""A pose source that runs in a process of its own and passes lines on: `process/pose_relay.py`."""

import os
import select
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from e2efly.deploy.odometry import Sample
from e2efly.deploy.pose.json_source import Lines, parse_pose
from e2efly.deploy.pose.source import Inbox
from e2efly.deploy.terminal import printable

T = TypeVar("T")
SCRIPT = Path(__file__).parent / "process" / "pose_relay.py"
"""What runs in the process."""
OPENING = 15.0
"""Longest time until a relay is ready, s."""
READS = 2
"""Most reads of one look, of 64 KiB each: what a pipe holds, and more."""
SYSTEM_PYTHON = "/usr/bin/python3"
"""The system's interpreter, where Debian and Ubuntu install ROS."""


class RelaySource:
    """Poses of a relay. Reading them takes neither a thread nor the packages of the peer in this process."""

    def __init__(self, name: str, python: str, *arguments: str) -> None:
        """Start the relay and wait until it is ready.

        Args:
            name: what to call the source.
            python: the interpreter that has the package of the peer.
            arguments: of the relay: its kind, and what it needs to know.

        Raises:
            ValueError: what the relay says of its failure, or that it does not answer in time.
        """
        self._inbox = Inbox(_parse)
        self._lines = Lines()
        self._name, self._detail = name, ""
        self._ended: str | None = None
        self._said = b""  # the last that it wrote to its standard error
        self._process = subprocess.Popen(
            [python, str(SCRIPT), *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
            start_new_session=True,  # Ctrl+C is the bridge's to act on
        )
        assert self._process.stdout is not None
        assert self._process.stderr is not None
        self._out, self._err = self._process.stdout.fileno(), self._process.stderr.fileno()
        os.set_blocking(self._out, False)
        os.set_blocking(self._err, False)
        deadline = time.monotonic() + OPENING
        while not self._detail and not self._ended:
            left = deadline - time.monotonic()
            if left <= 0:
                self._ended = f"no answer within {OPENING:g} s"
                break
            select.select([self._out], [], [], left)
            self._pump(time.monotonic())
        if self._ended:
            self.close()
            raise ValueError(f"pose source {name}: {self._ended}")

    @property
    def refused(self) -> int:
        """Messages that were malformed, of another type or too many."""
        return self._inbox.refused

    @property
    def problem(self) -> str | None:
        """Why the relay has ended, or else what was wrong with a message last."""
        return f"{self._name}: {self._ended}" if self._ended else self._inbox.problem

    def read(self, now: float) -> list[Sample]:
        """Poses since the last call; `received` is when the relay took them."""
        if self._ended is None:
            self._pump(now)
        return self._inbox.take()

    def close(self) -> None:
        """End the relay; takes up to 2 s."""
        self._ended = self._ended or "closed"
        process = self._process
        if process.stdin is None or process.stdin.closed:
            return
        process.stdin.close()
        try:
            process.wait(2)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        for pipe in (process.stdout, process.stderr):
            if pipe is not None:
                pipe.close()

    def describe(self) -> str:
        """What it listens to, and by which package of which interpreter."""
        return f"{self._name} ({self._detail})"

    def _pump(self, now: float) -> None:
        """Take what the relay has written."""
        self._said = (self._said + (_available(self._err) or b""))[-2000:]
        for _ in range(READS):
            data = _available(self._out)
            if data is None:
                return
            if not data:
                tail = self._said.strip().split(b"\n")[-1]
                self._ended = self._ended or f"its process has ended{': ' + _text(tail) if tail else ''}"
                return
            lines, overlong, _ = self._lines.feed(data)
            for line in lines:
                self._take(line, now)
            if overlong:
                self._inbox.refuse(f"{self._name}: an overlong message", overlong)

    def _take(self, line: bytes, now: float) -> None:
        kind, _, rest = line.partition(b" ")
        if kind == b"pose":
            self._inbox.put(rest, now)
        elif kind == b"ready":
            self._detail = _text(rest)
        elif kind == b"failed":
            self._ended = _text(rest)
        else:
            self._inbox.refuse(f"{self._name}: {_text(rest)}")


def _parse(message: bytes, now: float) -> Sample:
    """`RECEIVED JSON`; the monotonic clock is the same one in all processes of a machine."""
    received, _, content = message.partition(b" ")
    waited = time.monotonic() - float(received)
    return parse_pose(content, now - max(waited, 0.0))


def _text(said: bytes) -> str:
    """What another process says, which may have come from farther away."""
    return printable(said.decode(errors="replace"))


def _available(descriptor: int) -> bytes | None:
    """What can be read at once; empty at the end, None when there is nothing yet."""
    try:
        return os.read(descriptor, 65536)
    except BlockingIOError:
        return None


def open_relay(name: str, pythons: list[str], advice: str, *arguments: str) -> RelaySource:
    """Start a relay by the first interpreter that has its package.

    Raises:
        ValueError: with what each interpreter says, and the advice.
    """
    return first_that_opens(pythons, advice, lambda python: RelaySource(name, python, *arguments))


def first_that_opens(pythons: list[str], advice: str, start: Callable[[str], T]) -> T:
    """Start something by the first interpreter that has its package.

    Args:
        pythons: interpreters to try.
        advice: what to do where none has it.
        start: starts it by an interpreter; it raises ValueError with what the interpreter says.

    Raises:
        ValueError: with what each interpreter says, and the advice.
    """
    problems = []
    for python in dict.fromkeys(pythons):
        if not Path(python).exists():
            problems.append(f"{python} does not exist")
            continue
        try:
            return start(python)
        except ValueError as error:
            problems.append(f"{python}: {error}")
            if "ImportError" not in str(error) and "ModuleNotFoundError" not in str(error):
                break  # it has the package: another interpreter would fare no better
    raise ValueError("; ".join(problems) + f"; {advice}")


def pythons(variable: str) -> list[str]:
    """Interpreters to try: the one that an environment variable names, or else this one and the system's."""
    chosen = os.environ.get(variable)
    return [chosen] if chosen else [sys.executable, SYSTEM_PYTHON]
