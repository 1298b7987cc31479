"""What a script of this folder begins with: lines to the process that started it, and an end when that one ends.

Lines that it writes: `waiting TEXT` for what it waits for, `ready TEXT` once, `failed TEXT` when it cannot go on,
`problem TEXT` for what it passed over, `solved` when that is over, and what else the script has to tell. It ends when
its standard input does, however the other process ends.
"""

from __future__ import annotations

import os
import threading
import time
from contextlib import suppress
from typing import Any, Callable, Mapping, Sequence  # noqa: UP035  # Python 3.8


class Speech:
    """The lines, and whether it is time to end."""

    def __init__(self) -> None:
        """Take the standard output for the lines; what packages print there goes to the standard error."""
        self.closing = threading.Event()
        """Set when the other process has ended or wants an end."""
        self.leave: Callable[[], Any] = bool
        """Called at the end."""
        self._lines = os.fdopen(os.dup(1), "w", errors="backslashreplace")
        os.dup2(2, 1)
        self._lock = threading.Lock()

    def say(self, *words: str) -> None:
        """Write a line, from any thread."""
        with self._lock:
            self._lines.write(" ".join(words).replace("\n", " ") + "\n")
            self._lines.flush()

    def fail(self, why: str) -> None:
        """Say why it cannot go on and end, from any thread."""
        with suppress(BrokenPipeError):
            self.say("failed", why)
        self.end(1)

    def end(self, status: int = 0) -> None:
        """End without the packages' own farewells, which may hang."""
        self.leave()
        os._exit(status)


def main(kinds: Mapping[str, Callable[..., None]], arguments: Sequence[str]) -> None:
    """Run one kind until the standard input ends; never returns.

    Args:
        kinds: functions by name, each given the speech and the other arguments.
        arguments: the name of a kind, and what that is given.
    """
    speech = Speech()

    def watch() -> None:
        while os.read(0, 1024):
            pass
        speech.closing.set()
        time.sleep(1)  # for a clean end; what still blocks then is cut off
        speech.end()

    threading.Thread(target=watch, daemon=True).start()
    try:
        kinds[arguments[0]](speech, *arguments[1:])
    except BrokenPipeError:
        pass  # the other process is gone
    except Exception as error:
        speech.fail(f"{type(error).__name__}: {error}")
    speech.end()
