"""The first process of a container: `python -m e2efly.flight.scripts.first COMMAND ...`.

When the first process of a container ends, all others end with it. This includes the watchdog, which lands the vehicle
when the bridge has died. So this process starts the command and forwards signals to it. It ends only when the last of
its descendants has ended, with the command's exit status.
"""

import ctypes
import os
import signal
import subprocess
import sys
from contextlib import suppress
from typing import Any

ADOPT = 36
"""Linux's PR_SET_CHILD_SUBREAPER: orphaned processes become children of this process, even if it is not the first one
of the container."""
HANDED_ON = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
"""Signals that ask the bridge for a landing."""


def main(command: list[str]) -> int:
    """Run a command until it and all processes that it leaves behind have ended. Returns its exit status."""
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(ADOPT, 1, 0, 0, 0)
    process = None
    early: list[int] = []  # a signal that comes before the command runs is for the command, too

    def hand_on(number: int, _: Any) -> None:
        if process is None:
            early.append(number)
            return
        with suppress(ProcessLookupError):
            os.kill(process.pid, number)

    for number in HANDED_ON:
        signal.signal(number, hand_on)
    process = subprocess.Popen(command)
    for number in early:
        hand_on(number, None)
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
