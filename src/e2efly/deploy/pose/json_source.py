"""Poses as JSON, one object a message: UDP datagrams, or lines over TCP."""

import contextlib
import json
import math
import socket
import struct
import time
from typing import Any

import numpy as np

from e2efly.deploy.contract_json import unique
from e2efly.deploy.odometry import Sample
from e2efly.deploy.pose.source import LARGEST_BATCH, Inbox
from e2efly.vehicles.names import nearest

ARRAYS = {"position": 3, "quaternion": 4, "velocity": 3, "body_rate": 3}
"""Numbers of each array; the first two must be there."""
KEYS = (*ARRAYS, "stamp", "frame")
"""All keys of a message."""
LONGEST = 4096
"""Most bytes of a message."""
LONGEST_GUESS = 20
"""Characters of an unknown key for which a known one is looked for: the comparison takes long for long ones."""
RETRY = 0.5
"""Time between attempts to connect, s."""
SILENCE = 2.0
"""A TCP link that brings nothing for so long is opened anew, s."""
BUFFER = 32 << 10
"""Bytes that the kernel is asked to keep between two reads, some 80 poses. It keeps the oldest: the less, the newer."""
DRAIN = 128
"""Most datagrams that one `read` takes, which is more than the buffer holds; most are thrown away unread."""
CHUNK, CHUNKS = 64 << 10, 8
"""Bytes of a TCP link that are taken at a time, and most such times of one `read`."""
_TIMESTAMP = 35  # SO_TIMESTAMPNS of Linux, which Python's socket module does not name


def parse_pose(message: bytes, received: float) -> Sample:
    """Read one message.

    Args:
        message: a JSON object in UTF-8; see `docs/pose-sources.md`.
        received: when it arrived, s on the local monotonic clock.

    Raises:
        ValueError: naming the key, the value and what is accepted.
    """
    if len(message) > LONGEST:
        raise ValueError(f"pose: {len(message)} bytes; accepted: at most {LONGEST}")
    try:
        content = json.loads(message.decode(), object_pairs_hook=unique, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"pose: not JSON: {error}") from None
    if not isinstance(content, dict):
        raise ValueError(f"pose: {_short(content)}; accepted: an object with {', '.join(KEYS)}")
    for key in content:
        if key not in KEYS:
            guess = nearest(key[:LONGEST_GUESS], KEYS)
            hint = f"; did you mean {guess!r}?" if guess else ""
            raise ValueError(f"pose: unknown key {_short(key)}{hint} (accepted: {', '.join(KEYS)})")
    if missing := [key for key in ("position", "quaternion") if key not in content]:
        raise ValueError(f"pose: missing key {', '.join(map(repr, missing))}")
    arrays = {key: _array(key, content[key], size) for key, size in ARRAYS.items() if key in content}
    stamp = _number("stamp", content["stamp"], "a finite number of seconds") if "stamp" in content else None
    frame = content.get("frame", "")
    if not isinstance(frame, str):
        raise ValueError(f"pose: frame is {_short(frame)}; accepted: a text")
    return Sample(received=received, stamp=stamp, frame=frame, **arrays)


def _array(key: str, value: Any, size: int) -> np.ndarray:
    accepted = f"a list of {size} finite numbers"
    if not isinstance(value, list) or len(value) != size:
        raise ValueError(f"pose: {key} is {_short(value)}; accepted: {accepted}")
    return np.array([_number(key, entry, accepted) for entry in value])


def _number(key: str, value: Any, accepted: str) -> float:
    if type(value) in (int, float):  # not bool, which is an int to Python
        with contextlib.suppress(OverflowError):
            number = float(value)
            if math.isfinite(number):
                return number
    raise ValueError(f"pose: {key} is {_short(value)}; accepted: {accepted}")


def _no_constant(name: str) -> float:
    raise ValueError(f"{name} is no number; accepted: finite numbers")


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else f"{text[:77]}..."


class UdpSource:
    """One JSON object a datagram; bound to an address of this machine."""

    def __init__(self, host: str, port: int) -> None:
        """Bind.

        Args:
            host: address of this machine; 0.0.0.0 listens to the whole network.
            port: 0 takes a free one.

        Raises:
            ValueError: when it cannot be bound.
        """
        self._inbox = Inbox(parse_pose)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER)
        with contextlib.suppress(OSError):  # elsewhere than on Linux `now` has to do
            self._socket.setsockopt(socket.SOL_SOCKET, _TIMESTAMP, 1)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise ValueError(
                f"pose source udp:{host}:{port} cannot be bound: {error.strerror}; accepted: an address of this "
                "machine and a port that no other program listens to"
            ) from None
        self.address: tuple[str, int] = self._socket.getsockname()

    @property
    def refused(self) -> int:
        """Datagrams that were malformed or too many."""
        return self._inbox.refused

    @property
    def problem(self) -> str | None:
        """What was wrong last."""
        return self._inbox.problem

    def read(self, now: float) -> list[Sample]:
        """Datagrams since the last call; `received` is when the kernel took them, not when they were read."""
        del now
        for _ in range(DRAIN):
            try:
                message, extra, flags, _ = self._socket.recvmsg(LONGEST, 64)
            except BlockingIOError:
                break
            except OSError as error:
                self._inbox.refuse(f"{self.describe()}: {error.strerror or error}")
                break
            if flags & socket.MSG_TRUNC:
                self._inbox.refuse(f"pose: a datagram of more than {LONGEST} bytes; accepted: at most {LONGEST}")
            else:
                # not `now`: this process may have been held up since, and a time too early would spoil the clock map
                self._inbox.put(message, time.monotonic() - _waited(extra))
        return self._inbox.take()

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()

    def describe(self) -> str:
        """The address that it listens to."""
        return f"udp:{self.address[0]}:{self.address[1]}"


def _waited(extra: list[tuple[int, int, bytes]]) -> float:
    """How long ago the kernel took a datagram, s, from the time stamp it gives along (wall clock); 0 without one."""
    for level, kind, data in extra:
        if level == socket.SOL_SOCKET and kind == _TIMESTAMP and len(data) == struct.calcsize("@ll"):
            seconds, nanoseconds = struct.unpack("@ll", data)
            waited = time.time() - seconds - nanoseconds * 1e-9
            return waited if 0 < waited < 1 else 0.0  # the wall clock may have been set meanwhile
    return 0.0


class TcpSource:
    """One JSON object a line, from a server; connects anew whenever the link is lost or silent."""

    def __init__(self, host: str, port: int) -> None:
        """Look the host up; the first `read` connects.

        Raises:
            ValueError: when the host has no address.
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
        """What ails the link, or else what was wrong with a line last."""
        return f"{self._name}: {self._link_problem}" if self._link_problem else self._inbox.problem

    def read(self, now: float) -> list[Sample]:
        """Lines since the last call."""
        if self._socket is None and now - self._tried >= RETRY:
            self._connect(now)
        if self._socket is not None:
            self._receive(self._socket, now)
        samples = self._inbox.take()
        # Lines without a stamp that were read at once cannot be told apart in time: the newest counts.
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


class Lines:
    """Cuts a stream of bytes into lines of bounded length."""

    def __init__(self) -> None:
        self._rest = b""
        self._skip = False

    def feed(self, data: bytes, most: int | None = None) -> tuple[list[bytes], int, int]:
        """The complete lines that are not empty, how many overlong ones were dropped, and how many for their number.

        Args:
            data: the next bytes of the stream.
            most: of more complete lines than this the newest are cut out, and the others only counted; None: any.
        """
        *lines, rest = (self._rest + data).rsplit(b"\n", -1 if most is None else most + 1)
        dropped = 0
        if most is not None and len(lines) > most:  # the first may be many that were not cut
            older, *lines = lines
            dropped, self._skip = older.count(b"\n") + 1, False
        if lines and self._skip:  # the end of a line that was dropped already
            lines, self._skip = lines[1:], False
        overlong = sum(len(line) > LONGEST for line in lines)
        if len(rest) > LONGEST:
            overlong += not self._skip
            rest, self._skip = b"", True
        self._rest = b"" if self._skip else rest
        return [line for line in lines if line.strip() and len(line) <= LONGEST], overlong, dropped
