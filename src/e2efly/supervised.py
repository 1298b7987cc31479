"""A process under another one's eyes: where several hosts train together, a lost one makes JAX abort the others.

The coordination service of JAX ends its process with SIGABRT and a stack of C++ functions; nothing in that process can
prevent it. So the run is a process of its own, and what watches it says in its place what happened.
"""

import ctypes
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable
from typing import Any

WATCHED = "E2EFLY_WATCHED"
"""Variable of the environment that the watched process has: the number of the one that watches it."""
_FATAL = re.compile(rb"[EF]\d{4} \d\d:\d\d:\d\d.*(coordination|client\.h)")
_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG
_LOST = "another process of the run ended, hangs, or cannot be reached, or HOST:PORT is of another program"


def is_watched() -> bool:
    """Whether this process is the watched one. If so, it ends with the one that watches."""
    watcher = os.environ.get(WATCHED)
    if watcher is None:
        return False
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != int(watcher):  # it has ended already
            os._exit(2)
    return True


def watched(command: list[str], lost: Callable[[str], str]) -> int:
    """Run a command; its exit status, or 2 and an error in place of an abort of JAX's coordination service.

    Signals that ask this process to end are handed on. What the command writes to stderr is, too, but for the words
    of the coordination service, which come at the end and only where there was no abort.

    Args:
        command: program and arguments.
        lost: (reason) -> the error to print after an abort.
    """
    environment = os.environ | {WATCHED: str(os.getpid())}
    process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, start_new_session=True)

    def hand_on(signum: int, frame: Any) -> None:
        del frame
        process.send_signal(signum)

    before = {s: signal.signal(s, hand_on) for s in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    kept: list[bytes] = []
    try:
        with process:
            for line in process.stderr or ():
                if kept or _FATAL.match(line):
                    kept.append(line)
                else:
                    sys.stderr.buffer.write(line)
                    sys.stderr.buffer.flush()
        status = process.returncode
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
    if status == -signal.SIGABRT:
        print(f"error: {lost(_reason(kept))}", file=sys.stderr, flush=True)
        return 2
    sys.stderr.buffer.write(b"".join(kept))
    sys.stderr.buffer.flush()
    return status if status >= 0 else 128 - status


def _reason(lines: list[bytes]) -> str:
    """What the coordination service says, as far as a user understands it."""
    text = b"".join(lines).decode(errors="replace")
    known = re.search(r"(UNAVAILABLE|DEADLINE_EXCEEDED|ABORTED|INVALID_ARGUMENT|ALREADY_EXISTS)[^\n]*", text)
    return f"{_LOST} ({known.group(0)[:160]})" if known else _LOST
