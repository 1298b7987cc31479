"""The watchdog's own code, both ends of it, in a rig's time: its process is a thread that runs when it is told."""

import socket
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any
from unittest import mock

from e2efly.flight import watched_link
from e2efly.flight.link import Link
from e2efly.flight.watched_link import Lander, WatchedLink
from tests.faults.faulty import inner

UNUSED = "tcp:127.0.0.1:1"
"""The link that a process would open; the thread is given one."""


class _Ended(BaseException):
    """The thread is to end wherever it is: nobody kills a thread."""


class VirtualWatchdog:
    """A bridge's link through a watchdog. One at a time: the modules' clock is the rig's while it lives."""

    def __init__(self, now: Callable[[], float], link: Link, lander: Lander, timeout: float) -> None:
        self.stopped = False
        """Whether its process stands still."""
        self._link, self._lander, self._ending = link, lander, False
        self._problem: BaseException | None = None
        self._go, self._back = threading.Semaphore(0), threading.Semaphore(0)
        self._taken, really = False, lander.land

        def land(link: Link) -> None:
            self._taken = True
            really(link)

        clock = SimpleNamespace(monotonic=now, sleep=lambda seconds: self._wait())
        fakes = {
            "time": clock,
            "select": SimpleNamespace(select=lambda *_: (self._wait(), ([], [], []))[1]),
            "subprocess": SimpleNamespace(Popen=self._start, DEVNULL=None, TimeoutExpired=TimeoutError),
            "Lifeline": mock.Mock(side_effect=OSError),  # it tells of a death, and nobody dies here
        }
        self._patches = [mock.patch.object(watched_link, name, fake) for name, fake in fakes.items()]
        self._patches += [mock.patch(f"{type(lander).__module__}.time", clock), mock.patch.object(lander, "land", land)]
        for patch in self._patches:
            patch.start()
        self._watched = WatchedLink("unused", UNUSED, timeout)

    alive, reason, connections, taken_over, send, receive, plan = (
        inner(name, of="_watched")
        for name in ("alive", "reason", "connections", "taken_over", "send", "receive", "plan")
    )

    @property
    def has_taken_over(self) -> bool:
        """Whether it has the controller. The bridge may not know yet, and never does if it stands still for good."""
        return self._taken

    def poll(self, now: float) -> None:
        """One round of it, then what the bridge's end does."""
        self.step()
        self._watched.poll(now)

    def step(self) -> None:
        """Let it run until it waits, unless it stands still or has ended; whatever ended it is raised."""
        if not self.stopped and self._thread.is_alive():
            self._go.release()
            self._back.acquire()
        if self._problem is not None:
            raise self._problem

    def close(self) -> None:
        self.stopped, self._ending = False, True
        self._watched.close()
        for patch in self._patches:
            patch.stop()
        self._link.close()

    def _start(self, command: list[str], pass_fds: list[int], **_: Any) -> SimpleNamespace:
        timeout = float(command[4])
        mine = socket.socket(fileno=socket.dup(pass_fds[0]))
        self._thread = threading.Thread(target=self._serve, args=(mine, timeout), daemon=True)
        self._thread.start()
        return SimpleNamespace(wait=lambda seconds: self.step(), poll=lambda: None)

    def _serve(self, mine: socket.socket, timeout: float) -> None:
        self._go.acquire()
        try:
            with mine:
                watched_link.serve(mine, None, self._link, self._lander, timeout)
        except _Ended:
            pass
        except BaseException as problem:  # told to whoever waits
            self._problem = problem
        self._back.release()

    def _wait(self) -> None:
        """Until it is told to go on."""
        self._back.release()
        self._go.acquire()
        if self._ending:
            raise _Ended
