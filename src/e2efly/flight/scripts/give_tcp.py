"""Serves images over TCP to several readers. Each reader gets them as fast as it can take them."""

from __future__ import annotations

import importlib
import selectors
import socket
import time
from contextlib import suppress
from typing import Any

READERS = 16
"""The largest number of readers at the same time."""
STALLED_S = 2.0
"""A reader that takes nothing for this time is disconnected, s."""
LONGEST = 4096
"""The largest number of bytes that are read from a reader at once. Pings are answered only while fewer bytes than this
wait to be sent to the reader."""


class Peer:
    """One reader."""

    def __init__(self, connection: socket.socket, beginning: bytes) -> None:
        self.connection = connection
        self.waiting = bytearray(beginning)
        """Bytes that still have to be sent."""
        self.took = time.monotonic()
        """When the reader last took something, or had nothing to take, s."""
        self._said = b""

    def send(self) -> bool:
        """Send what can be sent without waiting. Returns whether the reader is still there."""
        if self.waiting:
            try:
                del self.waiting[: self.connection.send(self.waiting)]
            except BlockingIOError:
                return time.monotonic() - self.took < STALLED_S
            except OSError:
                return False
        self.took = time.monotonic()
        return True

    def hear(self, stream: Any) -> bool:
        """Answer the reader's pings. Returns whether the reader is still there and sends nothing but pings."""
        try:
            said = self.connection.recv(LONGEST)
        except BlockingIOError:
            return True
        except OSError:
            return False
        if not said:
            return False
        self._said += said
        while len(self._said) >= stream.PING.size:
            magic, number = stream.PING.unpack_from(self._said)
            self._said = self._said[stream.PING.size :]
            if magic != stream.PING_MAGIC:
                return False
            if len(self.waiting) < LONGEST:  # an answer that waits behind an image would be useless
                self.waiting += stream.MESSAGE.pack(stream.ANSWER, 0, number, time.monotonic())
        return True


def serve(given: Any, host: str, port: str, exact: str) -> None:
    """Serve until the node ends.

    Raises:
        RuntimeError: the port cannot be opened.
    """
    stream, shared = importlib.import_module("image_stream"), importlib.import_module("shared_images")
    look = importlib.import_module("give").LOOK_S
    kind, old = given.type(exact == "exact"), given.images.layout
    layout = shared.Layout.wanted(old.shape, kind, given.fov)
    try:
        server = socket.create_server((host, int(port)))
    except OSError as error:
        raise RuntimeError(f"port {port} of {host}: {error.strerror}") from None
    server.setblocking(False)
    events = selectors.DefaultSelector()
    events.register(server, selectors.EVENT_READ)
    peers: dict[socket.socket, Peer] = {}
    given.speech.say("ready", f"{host}:{server.getsockname()[1]}, {kind}")

    def drop(connection: socket.socket) -> None:
        events.unregister(connection)
        connection.close()
        del peers[connection]

    while not given.speech.closing.is_set():
        for key, _ in events.select(look):
            if key.fileobj is server:
                with suppress(OSError):
                    connection, _ = server.accept()
                    if len(peers) >= READERS:
                        connection.close()
                        continue
                    connection.setblocking(False)
                    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    peers[connection] = peer = Peer(connection, stream.header(layout))
                    events.register(connection, selectors.EVENT_READ, peer)
            elif not key.data.hear(stream):
                drop(key.data.connection)
        new = given.images.take()
        if new is not None and any(not peer.waiting for peer in peers.values()):
            number, moment, raw = new
            message = stream.image(number, moment, given.values(raw, kind))
            for peer in peers.values():
                if not peer.waiting:  # a reader that has not taken the last one misses this one
                    peer.waiting += message
        for connection, peer in list(peers.items()):
            if not peer.send():
                drop(connection)
