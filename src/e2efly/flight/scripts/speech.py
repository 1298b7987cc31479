"""The common part of the scripts in this folder: lines to the process that started them, and an end when it ends.

A script writes these lines: `waiting TEXT` for what it waits for, `ready TEXT` once, `failed TEXT` when it cannot
continue, `problem TEXT` for what it skipped, `solved` when the problem is over, and lines of its own. It ends when its
standard input ends, in whatever way the other process ends.
"""

from __future__ import annotations

import os
import threading
import time
from contextlib import suppress
from typing import Any, Callable, Mapping, Sequence  # noqa: UP035  # Python 3.8


class Speech:
    """Writes the lines, and knows whether the script has to end."""

    def __init__(self) -> None:
        """Reserve the standard output for the lines. What packages print there goes to the standard error instead."""
        self.closing = threading.Event()
        """Set when the other process has ended, or has asked this script to end."""
        self.leave: Callable[[], Any] = bool
        """Called at the end."""
        self._lines = os.fdopen(os.dup(1), "w", errors="backslashreplace")
        os.dup2(2, 1)
        self._lock = threading.Lock()

    def say(self, *words: str) -> None:
        """Write a line. Any thread may call this."""
        with self._lock:
            self._lines.write(" ".join(words).replace("\n", " ") + "\n")
            self._lines.flush()

    def fail(self, why: str) -> None:
        """Report why the script cannot continue, and end it. Any thread may call this."""
        with suppress(BrokenPipeError):
            self.say("failed", why)
        self.end(1)

    def end(self, status: int = 0) -> None:
        """End the process without the packages' own clean-up, which may hang."""
        self.leave()
        os._exit(status)


def main(kinds: Mapping[str, Callable[..., None]], arguments: Sequence[str]) -> None:
    """Run one kind until the standard input ends. Never returns. `kinds` has functions by name. Each is called with the
    speech and with the arguments that follow the name of its kind.
    """
    speech = Speech()

    def watch() -> None:
        while os.read(0, 1024):
            pass
        speech.closing.set()
        time.sleep(1)  # time for a clean end; whatever still blocks then is stopped
        speech.end()

    threading.Thread(target=watch, daemon=True).start()
    try:
        kinds[arguments[0]](speech, *arguments[1:])
    except BrokenPipeError:
        pass  # the other process is gone
    except Exception as error:
        speech.fail(f"{type(error).__name__}: {error}")
    speech.end()
