"""Poses in lines over TCP, one JSON object per line."""

import math
import socket

from e2efly.flight.lines import LONGEST, Lines
from e2efly.flight.pose.json_source import parse_pose
from e2efly.flight.pose.pose_source import LARGEST_BATCH, Inbox
from e2efly.flight.pose.registry import part_of, port_of, register
from e2efly.policy.odometry import Sample

RETRY = 0.5
"""Time between attempts to connect, s."""
SILENCE = 2.0
"""A TCP link that delivers nothing for this time is opened again, s."""
CHUNK, CHUNKS = 64 << 10, 8
"""Bytes of a TCP link that are read at a time, and the largest number of such reads in one `read`."""


@register("tcp", "tcp:HOST:PORT")
def open_tcp(where: str) -> "TcpSource":
    """Connect to the server at HOST:PORT."""
    host, _, port = where.rpartition(":")
    return TcpSource(part_of(host), port_of(port))


class TcpSource:
    """One JSON object per line, from a server. It connects again whenever the link is lost or silent."""

    def __init__(self, host: str, port: int) -> None:
        """Look up the host. The first `read` connects.

        Raises:
            ValueError: if the host has no address.
        """
        self._inbox = Inbox(parse_pose)
        self._name = f"tcp:{host}:{port}"
        try:
            self._address = socket.getaddrinfo(host, port, socket.AF_INET, socket.SOCK_STREAM)[0][4]
        except OSError as error:
            raise ValueError(
                f"pose source {self._name}: {host!r} has no address: {error.strerror}; accepted: the name or the "
                "address of a host"
            ) from None
        self._socket: socket.socket | None = None
        self._tried = -math.inf
        self._heard = 0.0
        self._lines = Lines()
        self._link_problem: str | None = "not connected yet"

    @property
    def refused(self) -> int:
        """Lines that were malformed or too many."""
        return self._inbox.refused

    @property
    def problem(self) -> str | None:
        """The problem with the link, or otherwise the last problem with a line."""
        return f"{self._name}: {self._link_problem}" if self._link_problem else self._inbox.problem

    def read(self, now: float) -> list[Sample]:
        """The samples of the lines since the last call."""
        if self._socket is None and now - self._tried >= RETRY:
            self._connect(now)
        if self._socket is not None:
            self._receive(self._socket, now)
        samples = self._inbox.take()
        # Lines without a stamp that were read together cannot be separated in time: only the newest is used.
        return [sample for i, sample in enumerate(samples, 1) if sample.stamp is not None or i == len(samples)]

    def close(self) -> None:
        """Close the link."""
        self._lose("closed")
        self._tried = math.inf

    def describe(self) -> str:
        """The server."""
        return self._name

    def _connect(self, now: float) -> None:
        self._tried = self._heard = now
        link = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        link.setblocking(False)
        self._socket, self._lines = link, Lines()
        try:
            link.connect(self._address)
        except BlockingIOError:
            pass  # on its way
        except OSError as error:
            self._lose(error.strerror or str(error))

    def _receive(self, link: socket.socket, now: float) -> None:
        try:
            for _ in range(CHUNKS):
                data = link.recv(CHUNK)
                if not data:
                    self._lose("the server has closed the link")
                    return
                self._heard, self._link_problem = now, None
                lines, overlong, dropped = self._lines.feed(data, LARGEST_BATCH)
                self._inbox.extend(lines, now, dropped)
                if overlong:
                    text = f"pose: a line of more than {LONGEST} bytes; accepted: at most {LONGEST}"
                    self._inbox.refuse(text, overlong)
        except BlockingIOError:
            if now - self._heard > SILENCE:
                self._lose(f"silent for {SILENCE:g} s")
        except OSError as error:
            self._lose(error.strerror or str(error))

    def _lose(self, problem: str) -> None:
        if self._socket is not None:
            self._socket.close()
        self._socket, self._link_problem = None, problem
