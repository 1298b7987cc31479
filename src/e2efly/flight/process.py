"""The setup of a command-line process: its standard streams, and the effect of Ctrl-C.

It imports almost nothing, so that it takes effect before anything else is imported.
"""

import ctypes
import gc
import io
import os
import signal
import socket
import sys
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any

UNREAD = 141
"""Exit status when nobody reads the output any more: 128 and the number of SIGPIPE, which Windows does not have."""
SYSTEMS = {"linux": "Linux", "darwin": "macOS", "win32": "Windows"}
"""Names of operating systems, by those in `sys.platform`."""
_once = threading.Lock()


def need_system(what: str, *systems: str) -> None:
    """Refuse what does not run on this operating system.

    Args:
        what: the name of what was asked for.
        systems: the systems on which it runs, as `sys.platform` names them.

    Raises:
        OSError: on another one, naming it and them.
    """
    if sys.platform not in systems:
        accepted = " or ".join(SYSTEMS.get(system, system) for system in systems)
        raise OSError(f"{what} does not run on {SYSTEMS.get(sys.platform, sys.platform)}; accepted: {accepted}")


def open_streams() -> None:
    """Make sure that the standard streams exist and accept every text.

    A closed stream (`>&-`) becomes the null device. Otherwise a file of the run would get its number, and the output of
    prints. Characters that the terminal's encoding lacks are printed as escapes.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest free number
    sys.stdout = sys.stdout or os.fdopen(1, "w", closefd=False)
    sys.stderr = sys.stderr or os.fdopen(2, "w", closefd=False)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def printable(text: str) -> str:
    """The text on one line. Line ends, escape sequences and lone surrogates are shown as Python's escapes."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text)


def write_nowhere(number: int = 1) -> None:
    """Release a stream by its number, or standard output. Its buffered content goes to the null device."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, number)
    os.close(nowhere)


def end_at_interrupt() -> None:
    """Make Ctrl-C end the process at once, with status 130, also during an import, a compilation or a callback.

    An exception cannot do this: it would pass through C++ code that does not expect it, or Python would end while XLA's
    threads run. Signals that the program was told to ignore stay ignored.
    """
    if signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        return
    signal.signal(signal.SIGINT, _end)
    reading, writing = socket.socketpair()  # every system wakes a socket, but not every one a pipe
    writing.setblocking(False)
    signal.set_wakeup_fd(writing.detach(), warn_on_full_buffer=False)

    def watch() -> None:
        """Python runs its handler between two instructions of the main thread, so only after a compilation."""
        while signals := reading.recv(64):
            if signal.SIGINT in signals and signal.getsignal(signal.SIGINT) is _end:
                _end()

    threading.Thread(target=watch, daemon=True, name="interrupts").start()


def raise_at_interrupt() -> None:
    """Make Ctrl-C raise `KeyboardInterrupt` again, for a command that must close other processes or devices."""
    if signal.getsignal(signal.SIGINT) is _end:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def be_idle() -> None:
    """Let this process, and the threads that it starts from now on, use only idle time.

    They compute only while no other process of the session needs a core. If the process has a session of its own, this
    session gets about a tenth of a core that another session needs, too.
    """
    with suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))
        if os.getsid(0) == os.getpid():  # Linux shares cores among sessions first; less would stop it for minutes
            Path("/proc/self/autogroup").write_text("10", encoding="ascii")


MLOCK_CURRENT, MLOCK_FUTURE, MLOCK_ONFAULT = 1, 2, 4
"""Flags of Linux's mlockall(2)."""


def be_punctual(priority: int) -> None:
    """Let nothing delay this process, whose work must not wait: neither other processes nor its own memory.

    Its threads, and those that they start, are scheduled before all ordinary ones, if this is allowed. Otherwise an
    idle core is needed. The garbage collector ignores all objects that exist now: in a process with JAX, it would take
    tenths of a second for them.

    Args:
        priority: real-time priority, 1 to 99.
    """
    gc.collect()
    gc.freeze()
    with suppress(OSError, AttributeError):  # touched pages stay in memory: none is read from a disk in flight
        ctypes.CDLL(None).mlockall(MLOCK_CURRENT | MLOCK_FUTURE | MLOCK_ONFAULT)
    with suppress(OSError, AttributeError):
        for thread in threads():
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))


def threads() -> list[int]:
    """The threads of this process by their system numbers. Only the calling thread if the system does not list them."""
    with suppress(OSError):
        return [int(thread.name) for thread in Path("/proc/self/task").iterdir()]
    return [threading.get_native_id()]


def _end(*_: Any) -> None:
    if not _once.acquire(blocking=False):  # another thread or an earlier Ctrl-C already ends the process
        return
    if "multiprocessing" in sys.modules:
        import multiprocessing

        for child in multiprocessing.active_children():  # they ignore interrupts
            child.kill()
    cursor = b"\x1b[?25h\r\n" if os.isatty(1) else b""  # a progress bar hides the cursor
    os.write(2, cursor + b"interrupted\n")
    os._exit(130)
