"""Whether a process lives, told at its death.

A socket of a killed process closes only when its last thread has gone and its memory has been taken back: 5 to 16 ms
for a bridge of 60 MB. A *robust* mutex in shared memory is handed on by the kernel before that, as the thread that
holds it exits (`pthread_mutexattr_setrobust(3)`): 0.2 ms.
"""

import ctypes
import errno
import mmap
import os
import socket
import threading
from contextlib import suppress

_BYTES = mmap.PAGESIZE
"""Room for a `pthread_mutex_t`, which takes 40 bytes on x86-64 and 48 on ARM."""
_ATTRIBUTES = 64
"""Room for a `pthread_mutexattr_t`, which takes 4 or 8."""
_libc = ctypes.CDLL(None)
_libc.mmap.restype = ctypes.c_void_p
_libc.mmap.argtypes = (ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int, ctypes.c_int, ctypes.c_int, ctypes.c_long)


class Lifeline:
    """Held by the thread that makes it, until it closes it or dies.

    Raises:
        OSError: the system has no robust mutexes or no anonymous files (it is not Linux).
    """

    def __init__(self) -> None:
        """Make the shared memory, and take the mutex in it."""
        if not hasattr(os, "memfd_create") or not hasattr(_libc, "pthread_mutexattr_setrobust"):
            raise OSError(errno.ENOSYS, "this system has no robust mutexes")
        self.descriptor = os.memfd_create("lifeline")
        """To be handed to the process that watches."""
        os.ftruncate(self.descriptor, _BYTES)
        self._mutex: ctypes.c_void_p | None = _mapped(self.descriptor)
        attributes = (ctypes.c_char * _ATTRIBUTES)()
        _libc.pthread_mutexattr_init(attributes)
        _libc.pthread_mutexattr_setpshared(attributes, 1)
        _libc.pthread_mutexattr_setrobust(attributes, 1)
        _libc.pthread_mutex_init(self._mutex, attributes)
        _libc.pthread_mutex_lock(self._mutex)

    def close(self) -> None:
        """Let go; by another thread than the one that made it, it stays held until that thread ends."""
        # while it is locked it stands in a list of the thread's, and must stay where it is
        if self._mutex is not None and _libc.pthread_mutex_unlock(self._mutex) == 0:
            _libc.munmap(self._mutex, ctypes.c_size_t(_BYTES))
            self._mutex = None
            os.close(self.descriptor)


def watch(descriptor: int) -> socket.socket:
    """A socket that can be read once the holder of the lifeline behind `descriptor` has died without letting go."""
    told, telling = socket.socketpair()
    mutex = _mapped(descriptor)

    def wait() -> None:
        with telling:
            if _libc.pthread_mutex_lock(mutex) != errno.EOWNERDEAD:
                threading.Event().wait()  # let go: nothing will ever be told
            with suppress(OSError):
                telling.send(b"x")

    threading.Thread(target=wait, name="lifeline", daemon=True).start()
    return told


def _mapped(descriptor: int) -> ctypes.c_void_p:
    """Shared memory that no garbage collector gives back."""
    access = mmap.PROT_READ | mmap.PROT_WRITE
    return ctypes.c_void_p(_libc.mmap(None, _BYTES, access, mmap.MAP_SHARED, descriptor, 0))
