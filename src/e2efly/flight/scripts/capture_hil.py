"""Receives the images that `e2efly hil` serves over TCP on another computer, and converts their times to the local
clock.
"""

from __future__ import annotations

import importlib
import select
import socket
import time
from typing import Any

CONNECT_S = 5.0
"""The longest time for connecting, or for waiting until something can be sent, s."""
FIRST, OFTEN_S, SELDOM_S = 8, 0.02, 1.0
"""The number of first pings, the period of these pings, s, and the period of all later pings, s."""
SILENT_S = 3.5
"""A server that answers no ping for this time counts as lost, s."""
RETRY_S = 0.2
"""Time between two attempts to connect again, s."""


def capture(output: Any, where: str) -> None:
    """Receive images from HOST:PORT. Once an image has come, a lost connection is made again, until the process ends.

    Raises:
        RuntimeError: no server answers there, or the stream ends before its first image.
        ValueError: it is not a stream of images.
    """
    follower, lost = Follower(output, where), False
    while not output.speech.closing.is_set():
        try:
            follower.follow()
        except OSError as error:
            if not follower.shown:
                raise RuntimeError(
                    f"{where}: {error.strerror or error}; accepted: where e2efly hil serves tcp"
                ) from None
        if follower.came:
            lost = False
        if not lost and not output.speech.closing.is_set():
            lost = True
            output.speech.say("problem", "connection lost, trying again")
        output.speech.closing.wait(RETRY_S)


class Follower:
    """Follows the streams of one server, one connection after the other."""

    def __init__(self, output: Any, where: str) -> None:
        self._output, self._where = output, where
        self.shown = False
        """Whether an image has ever come."""
        self.came = False
        """Whether an image has come over the present connection."""
        self._stream = importlib.import_module("image_stream")
        self._shared = importlib.import_module("shared_images")

    def follow(self) -> None:
        """Connect and receive until this process ends. The difference of the clocks is measured again.

        Raises:
            OSError: there is no connection, or it is lost.
            ValueError: it is not a stream of images.
        """
        self.came = False
        host, _, port = self._where.rpartition(":")
        with socket.create_connection((host, int(port)), CONNECT_S) as connection:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            self._receive(connection)

    def _receive(self, connection: socket.socket) -> None:
        stream, shared, where = self._stream, self._shared, self._where
        clocks, layout, got = stream.Clocks(), None, bytearray()
        pings, due, heard = 0, time.monotonic(), time.monotonic()
        while not self._output.speech.closing.is_set():
            now = time.monotonic()
            if now - heard > SILENT_S:
                raise ConnectionError(f"has said nothing for {SILENT_S:g} s")
            if now >= due:
                connection.sendall(clocks.ping(now))
                pings += 1
                due = now + (OFTEN_S if pings < FIRST else SELDOM_S)
            if not select.select([connection], [], [], max(min(due - now, 0.1), 0.0))[0]:
                continue
            data = connection.recv(1 << 16)
            now = heard = time.monotonic()
            if not data:
                raise ConnectionError("has ended the stream")
            got += data
            if layout is None:
                if len(got) < shared.HEADER.size:
                    continue
                begin = bytes(got[: len(stream.MAGIC)])
                if begin != stream.MAGIC:
                    raise ValueError(f"{where} begins with {begin!r}; accepted: {stream.MAGIC!r}")
                layout = shared.Layout.of(shared.MAGIC + bytes(got[len(begin) : shared.HEADER.size]), where)
                del got[: shared.HEADER.size]
            while len(got) >= stream.MESSAGE.size:
                kind, length, number, moment = stream.MESSAGE.unpack_from(got)
                if kind not in (stream.IMAGE, stream.ANSWER) or length > 2 * layout.bytes + 1024:
                    raise ValueError(f"{where} sends a message of kind {kind} with {length} bytes")
                if len(got) < stream.MESSAGE.size + length:
                    break
                content = bytes(got[stream.MESSAGE.size : stream.MESSAGE.size + length])
                del got[: stream.MESSAGE.size + length]
                if kind == stream.ANSWER:
                    clocks.answered(number, moment, now)
                elif clocks.best is not None and pings >= FIRST:
                    self._show(moment, stream.unpacked(content, layout.bytes), layout, clocks.best)

    def _show(self, moment: float, values: bytes, layout: Any, best: Any) -> None:
        """Publish an image that was exposed at `moment`, s on the server's clock."""
        detail = f"clocks agree within {1e3 * best.doubt:.2f} ms"
        self._output.put(moment - best.ahead, values, layout.shape, layout.type, layout.fov, detail)
        if self.shown and not self.came:
            self._output.speech.say("solved")
        self.shown = self.came = True
