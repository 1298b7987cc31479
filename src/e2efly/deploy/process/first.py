"""The first process of a container: `python -m e2efly.deploy.process.first COMMAND ...`.

A container ends with its first process, and all others with it: the watchdog, too, which lands the vehicle when the
bridge has died. So this process starts the command, hands signals on to it, and ends when the last of its descendants
has: with the command's exit status.
"""

import ctypes
import os
import signal
import subprocess
import sys
from contextlib import suppress
from typing import Any

ADOPT = 36
"""Linux's PR_SET_CHILD_SUBREAPER: orphans become children of this process even where it is not the first."""
HANDED_ON = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
"""Signals that ask the bridge for a landing."""


def main(command: list[str]) -> int:
    """Run a command to its end and to that of all that it leaves behind; returns its exit status."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(ADOPT, 1, 0, 0, 0)
    process = subprocess.Popen(command)

    def hand_on(number: int, _: Any) -> None:
        with suppress(ProcessLookupError):
            os.kill(process.pid, number)

    for number in HANDED_ON:
        signal.signal(number, hand_on)
    status = 0
    while True:
        try:
            ended, how = os.wait()
        except ChildProcessError:
            return status
        if ended == process.pid:
            code = os.waitstatus_to_exitcode(how)
            status = code if code >= 0 else 128 - code


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
