"""The operator's terminal: what is shown there, and the signals that ask for a landing.

Nothing that happens to a terminal may end a flight. If a terminal stalls, loses its connection or cannot show a
character, lines are lost and the flight goes on. Text from outside is only shown; it has no other effect.
"""

import queue
import signal
import threading
import time
from contextlib import suppress
from typing import Any, TextIO

from e2efly.flight.process import printable, write_nowhere

LANDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
"""Signals that ask for a landing: Ctrl-C, a normal request to end (SIGTERM), a terminal that lost its connection,
Ctrl-\\, Ctrl-Z."""
WAITING = 100
"""The largest number of lines that wait to be printed."""


class Stop:
    """Whether a signal has asked for a landing and for the end on the ground."""

    def __init__(self) -> None:
        """Handle the signals of `LANDING`. A hang-up signal that is already ignored, as under nohup, stays ignored."""
        self.asked = False
        ignored = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        taken = (number for number in LANDING if not (ignored and number is signal.SIGHUP))
        self._before = {number: signal.signal(number, self._ask) for number in taken}

    def _ask(self, *_: Any) -> None:
        self.asked = True

    def __call__(self) -> bool:
        """Whether a signal has asked for it."""
        return self.asked

    def restore(self) -> None:
        """Restore the previous signal handlers."""
        for number, handler in self._before.items():
            signal.signal(number, handler)


class Speaker:
    """Prints lines from its own thread, so that a terminal that stalls does not stall the control loop."""

    def __init__(self, stream: TextIO) -> None:
        """Start the thread. `stream` is the terminal's stream."""
        self._stream = stream
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._start = time.monotonic()
        self._gone = False
        self._thread = threading.Thread(target=self._run, daemon=True, name="speaker")
        self._thread.start()

    def __call__(self, line: str) -> None:
        """Queue a line to be printed with the time. If too many lines are waiting, the line is lost."""
        if self._lines.qsize() < WAITING:
            self._lines.put(f"{time.monotonic() - self._start:7.2f}  {line}")

    def write(self, text: str) -> None:
        """Print now, in the caller's thread. Not for the control loop. Never raises."""
        encoding = getattr(self._stream, "encoding", None) or "utf-8"
        shown = "\n".join(map(printable, text.split("\n")))
        try:
            self._stream.write(shown.encode(encoding, "backslashreplace").decode(encoding) + "\n")
            self._stream.flush()
        except Exception:  # any kind of error: this line is lost, and the next one is tried
            self._gone = True

    def close(self) -> None:
        """Print the waiting lines, for at most one second."""
        self._lines.put(None)
        self._thread.join(1.0)
        if self._gone:  # what the stream still holds would fail again when the interpreter ends
            with suppress(Exception):
                write_nowhere(self._stream.fileno())

    def _run(self) -> None:
        while (line := self._lines.get()) is not None:
            self.write(line)
