"""Serves images over TCP to any number of readers, each at the pace that it can bear."""

from __future__ import annotations

import importlib
import selectors
import socket
import time
from contextlib import suppress
from typing import Any

READERS = 16
"""Most readers at once."""
STALLED_S = 2.0
"""A reader that takes nothing for so long, s, is dropped."""
LONGEST = 4096
"""Most bytes of a reader that are looked at together, and that wait for it beside an image."""


class Peer:
    """One reader."""

    def __init__(self, connection: socket.socket, beginning: bytes) -> None:
        self.connection = connection
        self.waiting = bytearray(beginning)
        """What is still to be sent."""
        self.took = time.monotonic()
        """When it last took something, or had nothing to take, s."""
        self._said = b""

    def send(self) -> bool:
        """Send what goes without waiting; whether the reader is still there."""
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
        """Answer its pings; whether the reader is still there and says nothing else."""
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
            if len(self.waiting) < LONGEST:  # behind an image an answer would tell nothing
                self.waiting += stream.MESSAGE.pack(stream.ANSWER, 0, number, time.monotonic())
        return True


def serve(given: Any, host: str, port: str, exact: str) -> None:
    """Serve until the node ends.

    Raises:
        OSError: when the port cannot be had.
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
                if not peer.waiting:  # who is not done with the last one misses this one
                    peer.waiting += message
        for connection, peer in list(peers.items()):
            if not peer.send():
                drop(connection)
