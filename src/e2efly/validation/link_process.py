"""The radio between the bridge and the vehicle, as a process of its own: what the bridge sends arrives later.

    python -m e2efly.validation.link_process --to PORT --delay S

It prints one line of JSON, `{"link": "tcp:127.0.0.1:PORT"}`. The bridge connects to this address in place of the
firmware. Bytes from the bridge go to the firmware's port after the delay, in order. The firmware's answers pass at
once. There is one connection at a time. The process ends when its standard input ends.
"""

import argparse
import json
import os
import select
import socket
import sys
import time
from collections import deque

from e2efly.flight.process import be_punctual

PRIORITY = 8
"""Real-time priority, below that of the bridge."""
LOOK_S = 0.001
"""Interval between two checks for bytes that are due, s."""
_LARGEST = 65536


class DelayLine:
    """Bytes in transit. `now` is any steady clock, s, the same in both methods."""

    def __init__(self, delay: float) -> None:
        self.delay = delay
        self._waiting: deque[tuple[float, bytes]] = deque()

    def send(self, data: bytes, now: float) -> None:
        """Accept bytes that are to arrive a delay later."""
        self._waiting.append((now + self.delay, data))

    def arrived(self, now: float) -> bytes:
        """The bytes that have arrived by now and were not read yet, in order."""
        ready = []
        while self._waiting and self._waiting[0][0] <= now:
            ready.append(self._waiting.popleft()[1])
        return b"".join(ready)


def serve(listener: socket.socket, port: int, delay: float) -> None:
    """Forward connections to a port of the loopback interface until standard input ends."""
    while True:
        readable, _, _ = select.select([listener, sys.stdin], [], [])
        if sys.stdin in readable and not os.read(sys.stdin.fileno(), 1):
            return
        if listener not in readable:
            continue
        bridge, _ = listener.accept()
        with bridge, socket.create_connection(("127.0.0.1", port)) as firmware:
            for end in (bridge, firmware):
                end.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            if not _carry(bridge, firmware, DelayLine(delay)):
                return


def _carry(bridge: socket.socket, firmware: socket.socket, line: DelayLine) -> bool:
    """Forward one connection until either end closes it. False if standard input has ended."""
    while True:
        readable, _, _ = select.select([bridge, firmware, sys.stdin], [], [], LOOK_S)
        if sys.stdin in readable and not os.read(sys.stdin.fileno(), 1):
            return False
        try:
            if bridge in readable:
                if not (data := bridge.recv(_LARGEST)):
                    return True
                line.send(data, time.monotonic())
            if firmware in readable:
                if not (data := firmware.recv(_LARGEST)):
                    return True
                bridge.sendall(data)
            if data := line.arrived(time.monotonic()):
                firmware.sendall(data)
        except OSError:
            return True


def main() -> None:
    """Open the port and serve."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--to", type=int, required=True, help="the firmware's TCP port on 127.0.0.1")
    parser.add_argument("--delay", type=float, required=True, help="how late what the bridge sends arrives, s")
    options = parser.parse_args()
    be_punctual(PRIORITY)  # it stands for hardware
    with socket.create_server(("127.0.0.1", 0)) as listener:
        print(json.dumps({"link": f"tcp:127.0.0.1:{listener.getsockname()[1]}"}), flush=True)
        serve(listener, options.to, options.delay)


if __name__ == "__main__":
    main()
