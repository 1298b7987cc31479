"""A tap on the line between a bridge's process and the firmware: bytes pass unchanged, stick frames are noted."""

import select
import socket
import threading
import time
from contextlib import suppress

from e2efly.flight.betaflight.codec import Decoder
from e2efly.flight.betaflight.messages import SET_RAW_RC

THROTTLE = 2
"""Where the throttle stands in a stick frame, in the order AETR."""
_PIECE = 65536


class Tap:
    """Carries one TCP connection at a time. Use it as a context manager."""

    def __init__(self, target: str) -> None:
        """Listen on a free port of the loopback interface.

        Args:
            target: `tcp:HOST:PORT` of the firmware.
        """
        _, host, port = target.split(":")
        self._target = (host, int(port))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.link = f"tcp:127.0.0.1:{self._listener.getsockname()[1]}"
        """What the bridge is to open."""
        self.throttle: list[tuple[float, int]] = []
        """When each stick frame passed, s on the monotonic clock, and its throttle, us."""
        self._ended, self._end = socket.socketpair()
        self._thread = threading.Thread(target=self._carry, daemon=True)

    def __enter__(self) -> "Tap":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.close()
        self._thread.join()
        self._ended.close()
        self._listener.close()

    def _carry(self) -> None:
        while self._listener in select.select([self._listener, self._ended], [], [])[0]:
            bridge, _ = self._listener.accept()
            with bridge, suppress(OSError), socket.create_connection(self._target) as firmware:
                for end in (bridge, firmware):
                    end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._pass(bridge, firmware)

    def _pass(self, bridge: socket.socket, firmware: socket.socket) -> None:
        decoder = Decoder()
        while True:
            readable, _, _ = select.select([bridge, firmware, self._ended], [], [])
            if self._ended in readable:
                return
            for end in readable:
                data = end.recv(_PIECE)
                now = time.monotonic()
                if not data:
                    return
                (firmware if end is bridge else bridge).sendall(data)
                if end is bridge:
                    sticks = (frame.payload for frame in decoder.feed(data) if frame.code == SET_RAW_RC)
                    at = slice(2 * THROTTLE, 2 * THROTTLE + 2)
                    self.throttle += [(now, int.from_bytes(payload[at], "little")) for payload in sticks]
