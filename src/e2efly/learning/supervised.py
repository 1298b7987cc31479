"""A process supervised by another one. If several hosts train together and one is lost, JAX aborts the others.

The coordination service of JAX ends its process with SIGABRT and a stack of C++ functions, and nothing in that process
can prevent it. The run is therefore a separate process, and its supervisor reports what happened.

What JAX 0.10 does by itself does not suffice. Without the supervisor, the loss of process 0 leaves status 134 and 45
lines of a stack, and no word of how to go on. With `jax_enable_recoverability` there is no abort, and a killed process
is an error in Python at once. But then nothing ends the wait for a process that hangs: it went on after 75 s, instead
of ending after the 20 s of the heartbeat.
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
"""Environment variable of the supervised process. It contains the process number of the supervisor."""
_FATAL = re.compile(rb"[EF]\d{4} \d\d:\d\d:\d\d.*(coordination|client\.h)")
_DIE_WITH_PARENT = 1  # PR_SET_PDEATHSIG
_LOST = "another process of the run ended, hangs, or cannot be reached, or HOST:PORT is of another program"


def is_watched() -> bool:
    """Whether this process is supervised. If so, it ends when the supervisor ends."""
    watcher = os.environ.get(WATCHED)
    if watcher is None:
        return False
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_DIE_WITH_PARENT, signal.SIGKILL)
        if os.getppid() != int(watcher):  # the supervisor has already ended
            os._exit(2)
    return True


def watched(command: list[str], lost: Callable[[str], str]) -> int:
    """Run a command. Returns its exit status, or 2 with an error message after an abort by JAX's coordination service.

    Signals that ask this process to end are passed on to the command. Its output to stderr is passed on, too. Only the
    messages of the coordination service are held back until the end, and are shown only if there was no abort.

    Args:
        command: program and arguments.
        lost: (reason) -> the error to print after an abort.
    """
    environment = os.environ | {WATCHED: str(os.getpid())}
    process = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, start_new_session=True)

    def hand_on(signum: int, frame: Any) -> None:
        del frame
        process.send_signal(signum)

    ending = (signal.SIGINT, signal.SIGTERM, *([] if sys.platform == "win32" else [signal.SIGHUP]))
    before = {number: signal.signal(number, hand_on) for number in ending}
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
    """The message of the coordination service, as far as a user can understand it."""
    text = b"".join(lines).decode(errors="replace")
    known = re.search(r"(UNAVAILABLE|DEADLINE_EXCEEDED|ABORTED|INVALID_ARGUMENT|ALREADY_EXISTS)[^\n]*", text)
    return f"{_LOST} ({known.group(0)[:160]})" if known else _LOST
