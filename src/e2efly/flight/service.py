"""What the bridge tells systemd, if systemd has started it: that it is ready, and that its loop is running.

It uses the protocol of sd_notify(3): datagrams that contain lines, sent to the socket that the environment names.
"""

import os
import socket
from contextlib import suppress

SOCKET = "NOTIFY_SOCKET"
"""Environment variable with the path of the socket. A path that begins with @ is an abstract socket."""
PERIOD_S = 0.1
"""The shortest time between two messages to the service manager, s."""


class Service:
    """Messages of the bridge to the service manager. Nothing here blocks or raises. A message that cannot be sent is
    dropped.
    """

    def __init__(self, address: str | None = None) -> None:
        """Begin. `address` is the manager's socket. None: the socket that the environment names, if any."""
        address = os.environ.get(SOCKET, "") if address is None else address
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) if address else None
        self._told: float | None = None
        if self._socket is not None:
            self._socket.setblocking(False)

    def stepped(self, now: float) -> None:
        """A control step is done, at `now` s. The first call makes the service ready, and every call feeds its
        watchdog.
        """
        if self._told is None:
            self._tell("READY=1\nWATCHDOG=1")
        elif now - self._told < PERIOD_S:
            return
        else:
            self._tell("WATCHDOG=1")
        self._told = now

    def stopping(self) -> None:
        """Tell the manager that the bridge is landing and will then end."""
        self._tell("STOPPING=1\nSTATUS=landing, and waiting to be disarmed")

    def close(self) -> None:
        """Close the socket. Nothing is sent afterwards."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _tell(self, lines: str) -> None:
        if self._socket is not None:
            with suppress(OSError):
                self._socket.sendto(lines.encode(), self._address)
