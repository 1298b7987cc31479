"""Poses in UDP datagrams, one JSON object per datagram."""

import contextlib
import socket
import struct
import time
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from e2efly.flight.lines import LONGEST
from e2efly.flight.pose.json_source import parse_pose
from e2efly.flight.pose.pose_source import Inbox
from e2efly.flight.pose.registry import port_of, register
from e2efly.policy.odometry import Sample

BUFFER = 32 << 10
"""Bytes that the kernel is asked to buffer between two reads, about 80 poses. It keeps the oldest, so a smaller buffer
gives newer poses."""
DRAIN = 128
"""The largest number of datagrams that one `read` takes. This is more than the buffer holds. Most of them are then
dropped unparsed."""
T = TypeVar("T")
_TIMESTAMP = 35  # SO_TIMESTAMPNS of Linux, which Python's socket module does not name


@register("udp", "udp:PORT or udp:HOST:PORT, with HOST an address of this machine; without it 127.0.0.1")
def open_udp(where: str) -> "UdpSource[Sample]":
    """Listen at [HOST:]PORT."""
    return UdpSource(*address_of(where))


def address_of(where: str) -> tuple[str, int]:
    """The address at which to listen, from [HOST:]PORT.

    Raises:
        MalformedError: if it is not written in this form.
    """
    host, _, port = where.rpartition(":")
    return host or "127.0.0.1", port_of(port)


class UdpSource(Generic[T]):
    """One JSON object per datagram. The socket is bound to an address of this machine."""

    def __init__(
        self,
        host: str,
        port: int,
        parse: Callable[..., Any] = parse_pose,
        what: str = "pose",
        *,
        tells_sender: bool = False,
    ) -> None:
        """Bind the socket. 0.0.0.0 listens to the whole network, and port 0 selects a free one. `parse` takes a
        datagram and its time of arrival, s, and with `tells_sender` the address of the sender. `what` is the name of a
        datagram in messages.

        Raises:
            ValueError: if the socket cannot be bound.
        """
        self._inbox: Inbox[T] = Inbox(parse)
        self._what, self._tells_sender = what, tells_sender
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        with contextlib.suppress(OSError):  # not on Linux: no time stamps
            self._socket.setsockopt(socket.SOL_SOCKET, _TIMESTAMP, 1)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise ValueError(
                f"{what} source udp:{host}:{port} cannot be bound: {error.strerror}; accepted: an address of this "
                "machine and a port that no other program listens to"
            ) from None
        self.address: tuple[str, int] = self._socket.getsockname()

    @property
    def refused(self) -> int:
        """Datagrams that were malformed or too many."""
        return self._inbox.refused

    @property
    def problem(self) -> str | None:
        """The last problem."""
        return self._inbox.problem

    def read(self, now: float) -> list[T]:
        """The datagrams since the last call. `received` is the time at which the kernel took them, not when they were
        read.
        """
        del now
        for _ in range(DRAIN):
            try:
                message, extra, flags, address = self._socket.recvmsg(LONGEST, 64)
            except BlockingIOError:
                break
            except OSError as error:
                self._inbox.refuse(f"{self.describe()}: {error.strerror or error}")
                break
            if flags & socket.MSG_TRUNC:
                self._inbox.refuse(
                    f"{self._what}: a datagram of more than {LONGEST} bytes; accepted: at most {LONGEST}"
                )
            else:
                # not `now`: this process may have been held up since, and a time too early would spoil the clock map
                sender = (f"{address[0]}:{address[1]}",) if self._tells_sender else ()
                self._inbox.put(message, time.monotonic() - _waited(extra), *sender)
        return self._inbox.take()

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def describe(self) -> str:
        """The address that it listens to."""
        return f"udp:{self.address[0]}:{self.address[1]}"


def _waited(extra: list[tuple[int, int, bytes]]) -> float:
    """How long ago the kernel took a datagram, s, from the time stamp that comes with it (wall clock). 0 without a time
    stamp.
    """
    for level, kind, data in extra:
        if level == socket.SOL_SOCKET and kind == _TIMESTAMP and len(data) == struct.calcsize("@ll"):
            seconds, nanoseconds = struct.unpack("@ll", data)
            waited = time.time() - seconds - nanoseconds * 1e-9
            return waited if 0 < waited < 1 else 0.0  # the wall clock may have been set meanwhile
    return 0.0
