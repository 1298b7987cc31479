"""A Foxglove client of the standard library alone: what a browser says and hears (ws-protocol, RFC 6455)."""

import base64
import json
import os
import socket
import struct
import time
from typing import Any


class FoxgloveClient:
    """Connects, reads what is advertised, subscribes to topics."""

    def __init__(self, host: str, port: int) -> None:
        self._socket = socket.create_connection((host, port), timeout=20)
        key = base64.b64encode(os.urandom(16)).decode()
        self._socket.sendall(
            f"GET / HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Key: {key}\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n".encode()
        )
        answer = b""
        while not answer.endswith(b"\r\n\r\n"):
            answer += self._bytes(1)
        assert b" 101 " in answer.split(b"\r\n")[0], answer
        self.channels: dict[str, dict[str, Any]] = {}

    def advertised(self, *topics: str) -> dict[str, dict[str, Any]]:
        """What the server offers, once it offers all of these."""
        while not set(topics) <= set(self.channels):
            self._next()
        return self.channels

    def subscribe(self, *topics: str) -> None:
        self.advertised(*topics)
        wanted = [{"id": self.channels[t]["id"], "channelId": self.channels[t]["id"]} for t in topics]
        self._send(json.dumps({"op": "subscribe", "subscriptions": wanted}).encode())

    def message(self, topic: str) -> tuple[int, bytes]:
        """The next message of a topic: its time, ns, and its content."""
        end = time.monotonic() + 20
        while time.monotonic() < end:
            found = self._next()
            if found is not None and found[0] == self.channels[topic]["id"]:
                return found[1:]
        raise AssertionError(f"no message on {topic}")

    def close(self) -> None:
        self._socket.close()

    def _next(self) -> tuple[int, int, bytes] | None:
        kind, data = self._frame()
        if kind == 1:
            said = json.loads(data)
            if said["op"] == "advertise":
                self.channels |= {channel["topic"]: channel for channel in said["channels"]}
        elif kind == 2 and data[0] == 1:
            return (*struct.unpack_from("<IQ", data, 1), data[13:])
        return None

    def _frame(self) -> tuple[int, bytes]:
        first, length = self._bytes(2)
        if length >= 126:
            (length,) = struct.unpack(">H" if length == 126 else ">Q", self._bytes(2 if length == 126 else 8))
        return first & 0x0F, self._bytes(length)

    def _send(self, data: bytes) -> None:
        mask = os.urandom(4)
        size = bytes([0x80 | len(data)]) if len(data) < 126 else bytes([0x80 | 126]) + struct.pack(">H", len(data))
        self._socket.sendall(b"\x81" + size + mask + bytes(x ^ mask[i % 4] for i, x in enumerate(data)))

    def _bytes(self, count: int) -> bytes:
        data = b""
        while len(data) < count:
            got = self._socket.recv(count - len(data))
            assert got, "the server hung up"
            data += got
        return data
