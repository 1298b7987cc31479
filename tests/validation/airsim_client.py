"""The published client of AirSim, and a tap on the wire between a client and a server: for tests."""

import socket
import socketserver
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

import cosysairsim
import msgpack


class Tap(socketserver.ThreadingTCPServer):
    """Hands a connection on to a server, and keeps what the client sends."""

    allow_reuse_address, daemon_threads = True, True

    def __init__(self, port: int) -> None:
        tap = self
        self.sent = bytearray()

        class Pipe(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                with suppress(OSError), socket.create_connection(("127.0.0.1", port)) as onward:
                    back = threading.Thread(target=_pump, args=(onward, self.request, bytearray()), daemon=True)
                    back.start()
                    _pump(self.request, onward, tap.sent)

        super().__init__(("127.0.0.1", 0), Pipe)
        self.port = int(self.server_address[1])
        threading.Thread(target=self.serve_forever, kwargs={"poll_interval": 0.02}, daemon=True).start()

    def requests(self) -> dict[str, bytes]:
        """What was sent for each method the last time, behind the request's number."""
        unpacker, begin, found = msgpack.Unpacker(), 0, {}
        unpacker.feed(bytes(self.sent))
        for kind, number, method, _ in unpacker:
            whole = bytes(self.sent[begin : unpacker.tell()])
            head = b"\x94" + packed(kind) + packed(number)
            assert whole.startswith(head)
            found[method], begin = whole[len(head) :], unpacker.tell()
        return found


def packed(value: Any) -> bytes:
    data = msgpack.packb(value)
    assert isinstance(data, bytes)
    return data


def _pump(source: socket.socket, sink: socket.socket, kept: bytearray) -> None:
    with suppress(OSError):
        while data := source.recv(1 << 16):
            kept.extend(data)
            sink.sendall(data)


@contextmanager
def published(port: int) -> Iterator[cosysairsim.MultirotorClient]:
    """The published client, as AirSim's users have it."""
    client = cosysairsim.MultirotorClient(port=port, timeout_value=10)
    try:
        yield client
    finally:
        client.client.close()
