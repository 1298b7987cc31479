"""What the bridge tells systemd, where systemd has started it: that it is ready, and that its loop goes on.

By sd_notify's protocol (sd_notify(3)): datagrams of lines to the socket that the environment names.
"""

import os
import socket
from contextlib import suppress

SOCKET = "NOTIFY_SOCKET"
"""Environment variable with the socket's path; one that begins with @ is abstract."""
PERIOD_S = 0.1
"""The manager is told no more often, s."""


class Service:
    """The bridge's word to the service manager. Nothing here blocks or raises: what cannot be told is left out."""

    def __init__(self, address: str | None = None) -> None:
        """Begin; `address` is the manager's socket, None: what the environment says, if anything."""
        address = os.environ.get(SOCKET, "") if address is None else address
        self._address = f"\0{address[1:]}" if address.startswith("@") else address
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) if address else None
        self._told: float | None = None
        if self._socket is not None:
            self._socket.setblocking(False)

    def stepped(self, now: float) -> None:
        """A control step is done, at `now` s: the first makes the service ready, and all feed its watchdog."""
        if self._told is None:
            self._tell("READY=1\nWATCHDOG=1")
        elif now - self._told < PERIOD_S:
            return
        else:
            self._tell("WATCHDOG=1")
        self._told = now

    def stopping(self) -> None:
        """It lands and ends."""
        self._tell("STOPPING=1\nSTATUS=landing, and waiting to be disarmed")

    def close(self) -> None:
        """Say no more."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def _tell(self, lines: str) -> None:
        if self._socket is not None:
            with suppress(OSError):
                self._socket.sendto(lines.encode(), self._address)
