"""A client of MessagePack-RPC over TCP, for AirSim's server (rpclib).

A request is [0, id, method, [parameters]], an answer is [1, id, error, result] (the MessagePack-RPC specification).
rpclib passes the requests of one connection to several threads. Answers therefore come in any order, and a method that
blocks does not delay the next one.
"""

import importlib
import socket
import time
from typing import Any

PORT = 41451
"""Port of AirSim, unless its settings give another one."""
TIMEOUT_S = 10.0
"""Longest time to wait for an answer, s."""
_REQUEST, _ANSWER = 0, 1
_QUICK = getattr(socket, "TCP_QUICKACK", None)
_LARGEST = 1 << 28
"""Largest accepted answer, bytes."""


# The package cosysairsim does not replace this client. Its image calls are those of Cosys-AirSim alone (rpclib refuses
# them in AirSim 1.8.1, which takes another number of parameters). Its transport, rpc-msgpack 0.6, reports a server that
# closes the connection only by a time-out, 11 s later instead of at once, and takes twice the time for a call (71 us
# instead of 35 us). It cannot wait for one answer for a limited time, by which a command is confirmed. It installs
# 33 MB and Tornado.
class RpcError(OSError):
    """A server that refuses, gives an invalid answer or does not answer. The error names its address."""


class Rpc:
    """A connection to one server."""

    def __init__(self, host: str, port: int, timeout: float = TIMEOUT_S) -> None:
        """Connect. `timeout` is the longest time for the connection and for each answer, s.

        Raises:
            RpcError: when no server answers there.
        """
        self.where, self._timeout = f"airsim:{host}:{port}", timeout
        self._msgpack: Any = importlib.import_module("msgpack")
        try:
            self._socket = socket.create_connection((host, port), timeout)
        except OSError as error:
            raise RpcError(
                f"{self.where}: nobody answers ({error}); accepted: the address of an AirSim that runs"
            ) from None
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._unpacker = self._msgpack.Unpacker(unicode_errors="replace", max_buffer_size=_LARGEST)
        self._pending: dict[int, str] = {}
        self._answers: dict[int, tuple[Any, Any]] = {}
        self._count = 0

    def call(self, method: str, *parameters: Any, timeout: float | None = None) -> Any:
        """Call a method and wait for its result.

        Raises:
            RpcError: naming the method, for an error of the server, an invalid answer, no answer, or a connection that
                is closed.
        """
        number = self.send(method, *parameters)
        wait = self._timeout if timeout is None else timeout
        if not self.arrived(number, wait):
            raise RpcError(f"{self.where}: no answer to {method} within {wait:g} s")
        return self.result(number)

    def send(self, method: str, *parameters: Any) -> int:
        """Send a request without waiting. Returns its number.

        Raises:
            RpcError: when the connection is closed.
        """
        number = self._count
        self._count += 1
        try:
            self._socket.settimeout(self._timeout)
            self._socket.sendall(self._msgpack.packb([_REQUEST, number, method, list(parameters)]))
        except OSError as error:
            raise RpcError(f"{self.where}: {method} cannot be sent ({error})") from None
        self._pending[number] = method
        return number

    def arrived(self, number: int, seconds: float) -> bool:
        """Wait for the answer to a request, up to `seconds`. Returns whether it has come.

        Raises:
            RpcError: for an invalid answer, an answer without a request, or a connection that is closed.
        """
        until = time.monotonic() + seconds
        while number not in self._answers:
            left = until - time.monotonic()
            if left <= 0:
                return False
            self._socket.settimeout(left)
            try:
                if _QUICK is not None:  # the server sends its second answer only when the first one is acknowledged
                    self._socket.setsockopt(socket.IPPROTO_TCP, _QUICK, 1)
                data = self._socket.recv(1 << 16)
            except TimeoutError:
                return False
            except OSError as error:
                raise RpcError(f"{self.where}: the connection broke ({error})") from None
            if not data:
                raise RpcError(f"{self.where}: the server closed the connection, asked for {self._pending[number]}")
            self._take(data)
        return True

    def result(self, number: int) -> Any:
        """The result of a request whose answer has come.

        Raises:
            RpcError: for an error of the server.
        """
        error, result = self._answers.pop(number)
        method = self._pending.pop(number)
        if error is not None:
            raise RpcError(f"{self.where}: {method} failed: {error}")
        return result

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def _take(self, data: bytes) -> None:
        try:
            self._unpacker.feed(data)
            messages = list(self._unpacker)
        except (ValueError, self._msgpack.exceptions.UnpackException) as error:
            told = type(error).__name__
            raise RpcError(f"{self.where}: answers what is no MessagePack ({told}); accepted: AirSim's port") from None
        for message in messages:
            if not (isinstance(message, list) and len(message) == 4 and message[0] == _ANSWER):
                told = repr(message)[:60]
                raise RpcError(f"{self.where}: answers {told}; accepted: [1, id, error, result], as AirSim's port does")
            number = message[1]
            if number not in self._pending or number in self._answers:
                asked = ", ".join(map(str, self._pending)) or "none"
                raise RpcError(f"{self.where}: answers request {number!r}; accepted: those that are open ({asked})")
            self._answers[number] = message[2], message[3]
