"""What a process of the command line begins with: its standard streams, and what Ctrl-C does.

Imports next to nothing, so that it holds before anything else is imported.
"""

import ctypes
import gc
import io
import os
import signal
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

_once = threading.Lock()


def open_streams() -> None:
    """Make standard streams that are there and take every text.

    One that was closed (`>&-`) becomes the null device: a file of the run would get its number, and what is printed.
    What the terminal's encoding lacks is printed as an escape.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free
    sys.stdout = sys.stdout or os.fdopen(1, "w", closefd=False)
    sys.stderr = sys.stderr or os.fdopen(2, "w", closefd=False)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def write_nowhere(number: int = 1) -> None:
    """Let go of a stream by its number, or of standard output: what it still holds goes to the null device."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, number)
    os.close(nowhere)


def end_at_interrupt() -> None:
    """Make Ctrl-C end the process at once, with 130: also within an import, a compilation or a callback.

    An exception cannot do that: it would pass through C++ code that does not expect it, or Python would end under XLA's
    running threads. What the program was told to ignore stays ignored.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return
    signal.signal(signal.SIGINT, _end)
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    signal.set_wakeup_fd(writing, warn_on_full_buffer=False)

    def watch() -> None:
        """Python runs its handler between two of the main thread's instructions: after a compilation, not in it."""
        while signals := os.read(reading, 64):
            if signal.SIGINT in signals and signal.getsignal(signal.SIGINT) is _end:
                _end()

    threading.Thread(target=watch, daemon=True, name="interrupts").start()


def raise_at_interrupt() -> None:
    """Make Ctrl-C raise `KeyboardInterrupt` again, in a command that has other processes or devices to close."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def be_idle() -> None:
    """Let this process, and the threads that it starts from now on, compute only while no other of its session wants
    a core; and where it has a session of its own, let that have a tenth of a core that another session wants, too.
    """
    with suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
        if os.getsid(0) == os.getpid():  # Linux shares cores among sessions first; less would starve it for minutes
            Path("/proc/self/autogroup").write_text("10")


MLOCK_CURRENT, MLOCK_FUTURE, MLOCK_ONFAULT = 1, 2, 4
"""Flags of Linux's mlockall(2)."""


def be_punctual(priority: int) -> None:
    """Let nothing hold up this process, whose work must not wait: neither other processes nor its own memory.

    Its threads, and those that they start, are scheduled before all usual ones, where that is allowed; where it is not,
    an idle core is needed. Objects that are there now are no longer looked at by the garbage collector: of a process
    with JAX, it would take tenths of a second.

    Args:
        priority: of real time, 1 to 99.
    """
    gc.collect()
    gc.freeze()
    with suppress(OSError, AttributeError):  # pages that were touched stay: none is read from a disk in flight
        ctypes.CDLL(None).mlockall(MLOCK_CURRENT | MLOCK_FUTURE | MLOCK_ONFAULT)
    with suppress(OSError, AttributeError):
        for thread in threads():
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))


def threads() -> list[int]:
    """Of this process, as the operating system knows them; the one that asks, where it does not say."""
    with suppress(OSError):
        return [int(thread.name) for thread in Path("/proc/self/task").iterdir()]
    return [threading.get_native_id()]


def _end(*_: Any) -> None:
    if not _once.acquire(blocking=False):  # another thread is about it, or an earlier Ctrl-C
        return
    if "multiprocessing" in sys.modules:
        import multiprocessing

        for child in multiprocessing.active_children():  # they ignore interrupts
            child.kill()
    cursor = b"\x1b[?25h\r\n" if os.isatty(1) else b""  # a progress bar hides it
    os.write(2, cursor + b"interrupted\n")
    os._exit(130)
