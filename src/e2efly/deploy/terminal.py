"""The operator's terminal: what is shown there, and the signals that ask for a landing.

Nothing that befalls a terminal may end a flight. It stalls, its connection ends, it cannot show a character: lines are
lost then, and the flight goes on. A text that came from outside shows itself and does nothing else.
"""

import queue
import signal
import threading
import time
from contextlib import suppress
from typing import Any, TextIO

from e2efly.process import write_nowhere

LANDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGTSTP)
"""Signals that ask for a landing: Ctrl-C, a polite end, a terminal whose connection has ended, Ctrl-\\, Ctrl-Z."""
WAITING = 100
"""Most lines that wait to be printed."""


def printable(text: str) -> str:
    """A text on one line, in which line ends, escape sequences and lone surrogates are shown as Python's escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


class Stop:
    """Whether a landing, and the end on the ground, has been asked for by a signal."""

    def __init__(self) -> None:
        """Take the signals of `LANDING`; a hang-up that is ignored already, as by nohup, stays ignored."""
        self.asked = False
        ignored = signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        taken = (number for number in LANDING if not (ignored and number is signal.SIGHUP))
        self._before = {number: signal.signal(number, self._ask) for number in taken}

    def _ask(self, *_: Any) -> None:
        self.asked = True

    def __call__(self) -> bool:
        """Whether it has been asked for."""
        return self.asked

    def restore(self) -> None:
        """Give the signals back."""
        for number, handler in self._before.items():
            signal.signal(number, handler)


class Speaker:
    """Prints lines from a thread of its own, so that a terminal that stalls does not stall the control loop."""

    def __init__(self, stream: TextIO) -> None:
        """Begin; `stream` is the terminal's."""
        self._stream = stream
        self._lines: queue.SimpleQueue[str | None] = queue.SimpleQueue()
        self._start = time.monotonic()
        self._gone = False
        self._thread = threading.Thread(target=self._run, daemon=True, name="speaker")
        self._thread.start()

    def __call__(self, line: str) -> None:
        """Have a line printed with the time; where many wait already, it is lost."""
        if self._lines.qsize() < WAITING:
            self._lines.put(f"{time.monotonic() - self._start:7.2f}  {line}")

    def write(self, text: str) -> None:
        """Print now, in the caller's thread: not for the control loop. Never raises."""
        encoding = getattr(self._stream, "encoding", None) or "utf-8"
        shown = "\n".join(map(printable, text.split("\n")))
        try:
            self._stream.write(shown.encode(encoding, "backslashreplace").decode(encoding) + "\n")
            self._stream.flush()
        except Exception:  # of whatever kind: the line is lost, and the next is tried
            self._gone = True

    def close(self) -> None:
        """Print what waits, for a second at most."""
        self._lines.put(None)
        self._thread.join(1.0)
        if self._gone:  # what the stream still holds would fail again as the interpreter ends
            with suppress(Exception):
                write_nowhere(self._stream.fileno())

    def _run(self) -> None:
        while (line := self._lines.get()) is not None:
            self.write(line)
