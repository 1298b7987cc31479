"""Links that carry bytes to a controller and back: serial ports, TCP, UDP. Nothing here blocks or raises in flight.

`poll` connects, and connects again after a failure. `send` and `receive` work while the link is alive, and do nothing
otherwise. `reason` says why the link is not alive.
"""

import os
import select
import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Protocol
from urllib.parse import parse_qsl

BAUD = 115200
"""The default baud rate. A USB port has no baud rate and accepts any."""
RETRY_S = 0.1
"""The wait before another attempt to connect, s. In flight, the controller holds the last command until then."""
CONNECT_TIMEOUT = 2.0
"""How long an attempt to connect may take, s."""
MAX_UNSENT = 4096
"""If more bytes than this wait to be sent, the link counts as broken."""
MOST = 4096
"""The largest number of received bytes that are decoded in a control step. If there are more, only the newest are
decoded, because there is no time for all."""
_CHUNK = 65536
_DATAGRAM = 1400
"""Largest datagram, bytes: what one frame of Ethernet holds."""
_ACCEPTED = "serial:/dev/ttyACM0?baud=115200, /dev/ttyACM0, tcp:HOST:PORT, udp:HOST:PORT or udpout:HOST:PORT"


class Link(Protocol):
    """Bytes to a controller and back."""

    @property
    def alive(self) -> bool:
        """Whether the link is connected."""
        ...

    @property
    def reason(self) -> str:
        """Why the link is not alive. Empty while it is."""
        ...

    @property
    def connections(self) -> int:
        """How often it has connected. When this changes, everything that was under way is lost."""
        ...

    def poll(self, now: float) -> None:
        """Connect if necessary. `now` is in s on the monotonic clock."""
        ...

    def send(self, data: bytes) -> None:
        """Send bytes. If the link is not alive, they are dropped."""
        ...

    def receive(self) -> bytes:
        """The bytes that have come. Empty if there are none."""
        ...

    def close(self) -> None:
        """Close for good."""
        ...


class _Port(Protocol):
    """An open port. Its methods do not block and raise `OSError` when it is gone."""

    def connected(self) -> bool: ...
    def read(self) -> bytes: ...
    def write(self, data: bytes) -> int: ...
    def close(self) -> None: ...


@dataclass
class StreamLink:
    """The link over any port that can be opened again. Make it with `open_link`."""

    name: str
    """The text with which the link was requested."""
    opener: Callable[[], _Port]
    """Opens the port, or begins to open it. Raises `OSError`."""
    connections: int = 0
    """How often it has connected."""
    reason: str = "not polled yet"
    """Why the link is not alive. Empty while it is."""
    _port: _Port | None = None
    _alive: bool = False
    _closed: bool = False
    _unsent: bytearray = field(default_factory=bytearray)
    _retry_at: float | None = None
    _give_up_at: float = 0.0

    @property
    def alive(self) -> bool:
        """Whether the link is connected."""
        return self._alive

    def poll(self, now: float) -> None:
        """Connect if necessary, one step per call. This never blocks."""
        if self._closed or self._alive:
            return
        try:
            if self._port is None:
                if self._retry_at is None:  # broken since the last poll; the very first attempt has no wait
                    self._retry_at = now + (RETRY_S if self.connections else 0.0)
                if now < self._retry_at:
                    return
                self._port = self.opener()
                self._give_up_at = now + CONNECT_TIMEOUT
            if self._port.connected():
                self._alive, self.reason, self._retry_at = True, "", None
                self.connections += 1
            elif now > self._give_up_at:
                raise TimeoutError("no answer to the attempt to connect")
        except OSError as error:
            self._break(error)
            self._retry_at = now + RETRY_S

    def send(self, data: bytes) -> None:
        """Send bytes. What the port does not accept at once is kept for later.

        If the link is not alive, the bytes are dropped.
        """
        if not self._alive:
            return
        self._unsent += data
        if self._flush() and len(self._unsent) > MAX_UNSENT:
            self._break(TimeoutError(f"it has stalled: {len(self._unsent)} bytes wait to be sent"))

    def receive(self) -> bytes:
        """The bytes that have come. First, the bytes that wait to be sent are tried again."""
        if not self._alive or self._port is None or not self._flush():
            return b""
        try:
            return self._port.read()
        except OSError as error:
            self._break(error)
            return b""

    def close(self) -> None:
        """Close for good. A second call does no harm."""
        self._break(OSError("closed"))
        self._closed = True

    def _flush(self) -> bool:
        if self._unsent and self._port is not None:
            try:
                del self._unsent[: self._port.write(bytes(self._unsent))]
            except OSError as error:
                self._break(error)
        return self._alive

    def _break(self, error: OSError) -> None:
        port, self._port, self._alive, self._retry_at = self._port, None, False, None
        self._unsent.clear()
        if not self._closed:
            self.reason = f"{self.name}: {error.strerror or error}"
        if port is not None:
            with suppress(OSError):  # gone either way, and the reason above is the one that matters
                port.close()


def open_link(target: str) -> StreamLink:
    """A link from its text: `serial:/dev/ttyACM0?baud=115200`, `/dev/ttyACM0`, `tcp:HOST:PORT`, `udp:HOST:PORT` (an
    address of this machine, to which the controller sends) or `udpout:HOST:PORT` (the controller's address).

    It connects when it is first polled.

    Raises:
        ValueError: the text is not valid. The message names it and what is accepted.
    """
    kind, _, rest = target.partition(":")
    if target.startswith("/"):
        kind, rest = "serial", target
    if kind == "serial":
        path, _, query = rest.partition("?")
        options = dict(parse_qsl(query, keep_blank_values=True))
        baud = options.pop("baud", str(BAUD))
        if not path or options or not (baud.isascii() and baud.isdigit() and 0 < int(baud) <= 10_000_000):
            raise ValueError(f"link {target!r}; accepted: {_ACCEPTED}")
        return StreamLink(target, lambda: _SerialPort(path, int(baud)))
    host, _, port = rest.rpartition(":")
    if kind not in _TYPES or not host or not (port.isascii() and port.isdigit() and 0 < int(port) < 65536):
        raise ValueError(f"link {target!r}; accepted: {_ACCEPTED}")
    try:
        family, _, _, _, address = socket.getaddrinfo(host.strip("[]"), int(port), type=_TYPES[kind])[0]
    except (OSError, UnicodeError) as error:
        raise ValueError(f"link {target!r}: no such host ({error}); accepted: {_ACCEPTED}") from None
    if kind == "tcp":
        return StreamLink(target, lambda: _TcpPort(family, address))
    return StreamLink(target, lambda: _UdpPort(family, address, listens=kind == "udp"))


_TYPES = {"tcp": socket.SOCK_STREAM, "udp": socket.SOCK_DGRAM, "udpout": socket.SOCK_DGRAM}


def _events(descriptor: int, kind: int) -> bool:
    """Whether the wanted event is there already, or a failure, which the next call on the port then reports."""
    poller = select.poll()
    poller.register(descriptor, kind)
    return bool(poller.poll(0))


class _SerialPort:
    def __init__(self, path: str, baud: int) -> None:
        import serial  # only where a serial port is used

        try:
            self._serial: Any = serial.Serial(path, baud, timeout=0, write_timeout=0, exclusive=True)
        except ValueError as error:
            raise OSError(f"the port refuses {baud} baud: {error}") from None
        self._fd: int = self._serial.fileno()

    def connected(self) -> bool:
        return True

    def read(self) -> bytes:
        # uses the descriptor, which is non-blocking: pyserial's own write spins while the port accepts nothing
        if not _events(self._fd, select.POLLIN):
            return b""
        data = os.read(self._fd, _CHUNK)
        if not data:
            raise ConnectionError("the device has gone")
        return data

    def write(self, data: bytes) -> int:
        try:
            return os.write(self._fd, data)
        except BlockingIOError:
            return 0

    def close(self) -> None:
        self._serial.close()


class _TcpPort:
    def __init__(self, family: int, address: Any) -> None:
        self._socket = socket.socket(family, socket.SOCK_STREAM)
        try:
            self._socket.setblocking(False)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._socket.connect(address)
        except BlockingIOError:
            pass  # under way
        except OSError:
            self._socket.close()
            raise

    def connected(self) -> bool:
        if not _events(self._socket.fileno(), select.POLLOUT):
            return False
        if error := self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR):
            raise OSError(error, os.strerror(error))
        return True

    def read(self) -> bytes:
        try:
            data = self._socket.recv(_CHUNK)
        except BlockingIOError:
            return b""
        if not data:
            raise ConnectionError("the other end has closed the connection")
        return data

    def write(self, data: bytes) -> int:
        try:
            return self._socket.send(data)
        except BlockingIOError:
            return 0

    def close(self) -> None:
        self._socket.close()


class _UdpPort:
    """Datagrams of one peer: of the given one, or of the first that sends."""

    def __init__(self, family: int, address: Any, *, listens: bool) -> None:
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            if listens:
                self._socket.bind(address)
            else:
                self._socket.connect(address)
        except OSError:
            self._socket.close()
            raise
        self._connected = not listens

    def connected(self) -> bool:
        if not self._connected and _events(self._socket.fileno(), select.POLLIN):
            _, peer = self._socket.recvfrom(0, socket.MSG_PEEK)
            self._socket.connect(peer)  # from now on, the system drops what others send
            self._connected = True
        return self._connected

    def read(self) -> bytes:
        data = bytearray()
        with suppress(BlockingIOError):
            while len(data) < _CHUNK:
                data += self._socket.recv(_CHUNK)
        return bytes(data)

    def write(self, data: bytes) -> int:
        try:
            return self._socket.send(data[:_DATAGRAM])
        except BlockingIOError:
            return 0

    def close(self) -> None:
        self._socket.close()
