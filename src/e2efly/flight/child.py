"""A script of `process/` that runs in its own process and reports in lines of text."""

import os
import select
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import TypeVar

from e2efly.flight.lines import Lines
from e2efly.flight.process import printable

SCRIPTS = Path(__file__).parent / "scripts"
"""Where the scripts are."""
OPENING = 15.0
"""The longest time until a script is ready, s."""
READS = 2
"""The largest number of reads per call, of 64 KiB each. This is more than a pipe holds."""
SYSTEM_PYTHON = "/usr/bin/python3"
"""The system's interpreter, where Debian and Ubuntu install ROS."""
ROS_PYTHON = "E2EFLY_ROS_PYTHON"
"""Environment variable that names the Python interpreter that has ROS."""

T = TypeVar("T")


class Child:
    """One script. Reading from it needs no thread, and needs none of the script's packages in this process."""

    def __init__(self, python: str, script: str, *arguments: str, seconds: float | None = None) -> None:
        """Start the script and wait until it is ready. The interpreter has the package that the script needs. `script`
        is the file name of one in `SCRIPTS`. `seconds` is the longest time until it is ready. None: `OPENING`.

        Raises:
            ValueError: with what the script reports about its failure, or because it does not answer in time.
        """
        seconds = OPENING if seconds is None else seconds
        self.detail = ""
        """What the script said when it was ready."""
        self._ended: str | None = None
        self._waiting = ""  # what the script is waiting for until it is ready
        self._silent = False  # the script has ended without saying why
        self._lines = Lines()
        self._kept: list[bytes] = []
        self._said = b""  # the last bytes that it wrote to its standard error
        self.process = subprocess.Popen(
            [python, str(SCRIPTS / script), *arguments],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            bufsize=0,
            start_new_session=True,  # only the bridge acts on Ctrl+C
        )
        assert self.process.stdout is not None
        assert self.process.stderr is not None
        self._out, self._err = self.process.stdout.fileno(), self.process.stderr.fileno()
        os.set_blocking(self._out, False)
        os.set_blocking(self._err, False)
        deadline = time.monotonic() + seconds
        while not self.detail and not self._ended:
            left = deadline - time.monotonic()
            if left <= 0:
                self._ended = f"no answer within {seconds:g} s"
                if self._waiting:
                    self._ended += f": {self._waiting}"
                break
            select.select([self._out], [], [], left)
            self._kept += self._pump()
        if self._silent:
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(2)
        if (ended := self.ended) is not None:
            self.close()
            raise ValueError(ended)

    @property
    def ended(self) -> str | None:
        """Why it has ended. None: it is running."""
        if self._silent and (status := self.process.poll()) is not None:
            self._silent = False
            tail = (self._said + (_available(self._err) or b"")).strip().split(b"\n")[-1]
            why = f"killed by {signal.Signals(-status).name}" if status < 0 else text_of(tail)
            self._ended = f"its process has ended{': ' + why if why else ''}"
        return self._ended

    def lines(self) -> list[bytes]:
        """The lines that it has written since the last call, oldest first, without those that this class handles
        itself.
        """
        kept, self._kept = self._kept, []
        return kept if self._ended is not None else kept + self._pump()

    def close(self) -> None:
        """End it. This takes up to 2 s."""
        self._ended, self._silent = self.ended or "closed", False
        process = self.process
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

    def _pump(self) -> list[bytes]:
        """Read what the script has written."""
        self._said = (self._said + (_available(self._err) or b""))[-2000:]
        found: list[bytes] = []
        for _ in range(READS):
            data = _available(self._out)
            if data is None:
                break
            if not data:
                if self._ended is None:
                    self._ended, self._silent = "its process has ended", True
                break
            lines, overlong, _ = self._lines.feed(data)
            for line in lines:
                kind, _, rest = line.partition(b" ")
                if kind == b"ready":
                    self.detail = text_of(rest)
                elif kind == b"waiting":
                    self._waiting = text_of(rest)
                elif kind == b"failed":
                    self._ended = text_of(rest)
                else:
                    found.append(line)
            found += [b"problem an overlong message"] * overlong
        return found


def text_of(said: bytes) -> str:
    """The text that another process sent, made printable. It may originally come from another machine."""
    return printable(said.decode(errors="replace"))


def _available(descriptor: int) -> bytes | None:
    """The bytes that can be read at once. Empty at the end of the stream, None if there is nothing yet."""
    try:
        return os.read(descriptor, 65536)
    except BlockingIOError:
        return None


def first_opened(pythons: list[str], advice: str, opens: Callable[[str], T], *, always: bool = False) -> T:
    """Open something with the first interpreter that has the required package.

    Args:
        pythons: interpreters to try, in this order.
        advice: what to do if none of them has the package.
        opens: opens it with the given interpreter. It raises ValueError if it fails.
        always: also give the advice if an interpreter has the package but opening fails.

    Returns:
        What `opens` returned.

    Raises:
        ValueError: with the message of the interpreter that has the package, or with all messages and the advice.
    """
    problems = []
    for python in dict.fromkeys(pythons):
        if not Path(python).exists():
            problems.append(f"{python} does not exist")
            continue
        try:
            return opens(python)
        except ValueError as error:
            if "ImportError" not in str(error) and "ModuleNotFoundError" not in str(error):
                if not always:
                    raise
                problems.append(f"{python}: {error}")
                break  # it has the package: another interpreter would fare no better
            problems.append(f"{python}: {error}")
    raise ValueError("; ".join(problems) + f"; {advice}")


def pythons(variable: str) -> list[str]:
    """Interpreters to try: the one that the environment variable names, or otherwise this one and the system's."""
    chosen = os.environ.get(variable)
    return [chosen] if chosen else [sys.executable, SYSTEM_PYTHON]
