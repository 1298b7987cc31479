"""The radio between the bridge and the vehicle, as a process of its own: what the bridge sends arrives later.

    python -m e2efly.validation.link_process --to PORT --delay S

It prints one line of JSON, `{"link": "tcp:127.0.0.1:PORT"}`: where the bridge connects in place of the firmware. What
comes from the bridge goes on to the firmware's port after the delay, in order; the firmware's answers pass at once. One
connection at a time. The process ends with its standard input.
"""

import argparse
import json
import os
import select
import socket
import sys
import time
from collections import deque

from e2efly.process import be_punctual

PRIORITY = 8
"""Real-time priority: below the bridge's."""
LOOK_S = 0.001
"""Between two looks at what is due, s."""
_LARGEST = 65536


class Line:
    """Bytes under way; `now` is any steady clock, s, the same in both methods."""

    def __init__(self, delay: float) -> None:
        self.delay = delay
        self._waiting: deque[tuple[float, bytes]] = deque()

    def send(self, data: bytes, now: float) -> None:
        """Take in what is to arrive a delay later."""
        self._waiting.append((now + self.delay, data))

    def arrived(self, now: float) -> bytes:
        """What has arrived by now and was not read yet, in order."""
        ready = []
        while self._waiting and self._waiting[0][0] <= now:
            ready.append(self._waiting.popleft()[1])
        return b"".join(ready)


def serve(listener: socket.socket, port: int, delay: float) -> None:
    """Carry connections to a port of the loopback interface until standard input ends."""
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
            if not _carry(bridge, firmware, Line(delay)):
                return


def _carry(bridge: socket.socket, firmware: socket.socket, line: Line) -> bool:
    """One connection, until either end closes it; False when standard input has ended."""
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
