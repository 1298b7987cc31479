"""A link that belongs to a separate process, which lands the vehicle when the bridge dies or hangs.

The process passes all bytes on. When the bridge has ended, or has been silent for an allowed time in flight, it takes
over for good, and lands as its `Lander` does. It imports neither NumPy nor ONNX Runtime. It ends only with the bridge:
no signal but SIGKILL stops it.
"""

import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from typing import Any, Protocol

from e2efly.flight.lifeline import Lifeline, watch
from e2efly.flight.link import Link

STALL_S = 0.05
"""The longest time that one loop of this process may add to the silence of the bridge, s. If the whole machine stood
still, the bridge then has the chance to send first."""
BYTES, PLAN, STATUS, TAKEN = b"B", b"P", b"S", b"T"
"""First byte of a packet: bytes of the link, the plan of the bridge, the state of the link, or the message that this
process has taken over."""
PACKETS = 64
"""The largest number of packets that the bridge reads from this process at a time."""
_PACKET = 1 << 17
"""The longest packet, bytes. It is longer than what a link delivers at a time."""


class Lander(Protocol):
    """How one kind of autopilot is landed without the bridge. Nothing here raises."""

    @property
    def flying(self) -> bool:
        """The vehicle is in flight, so silence of the bridge leads to a take-over."""
        ...

    def passed(self, data: bytes) -> None:
        """Bytes of the bridge have been passed on."""
        ...

    def follow(self, content: bytes) -> None:
        """Take a new plan. One that cannot be read leaves the last one: it must not end this process."""
        ...

    def land(self, link: Link) -> None:
        """Land the vehicle, and close the link."""
        ...


class WatchedLink:
    """The bridge's side: a `Link` through the watchdog process, for as long as the thread that creates it lives."""

    def __init__(self, program: str, target: str, timeout: float) -> None:
        """Start the process.

        Args:
            program: the module of its `Lander`, which calls `watch_over`.
            target: the text of the link.
            timeout: the silence of the bridge in flight after which the process takes over, s.
        """
        self.connections, self.reason = 0, "not polled yet"
        self.taken_over = ""
        """Why the watchdog has taken over. Empty: it has not."""
        self._link_alive = False
        mine, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        for end in (mine, other):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20)
        mine.setblocking(False)
        self._lifeline: Lifeline | None = None
        with suppress(OSError):  # on other systems than Linux, the socket shows the bridge's death some ms later
            self._lifeline = Lifeline()
        given = [other.fileno(), *([self._lifeline.descriptor] if self._lifeline else [])]
        with other:
            self._process = subprocess.Popen(
                [sys.executable, "-m", program, target, str(timeout), *map(str, given)],
                pass_fds=given,
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C must reach only the bridge
            )
        self._socket = mine
        self._received = bytearray()

    @property
    def alive(self) -> bool:
        """Whether the autopilot is connected and the bridge is still in control."""
        return self._link_alive and not self.taken_over

    def poll(self, now: float) -> None:
        """Read what the watchdog reports. It connects by itself."""
        del now
        if not self._link_alive and not self.taken_over:
            self._hand(BYTES)  # nothing is sent on a link that is gone, and silence would be the end of the bridge
        for _ in range(PACKETS):
            try:
                packet = self._socket.recv(_PACKET)
            except BlockingIOError:
                return
            except OSError as error:
                packet, self.reason = b"", str(error)
            if not packet:
                self._link_alive = False
                self.reason = self.taken_over or "the watchdog process has ended"
                self._process.poll()
                return
            kind, content = packet[:1], packet[1:]
            if kind == BYTES:
                self._received += content
            elif kind == STATUS:
                self._link_alive, self.reason, self.connections = json.loads(content)
            elif kind == TAKEN:
                self.taken_over = self.reason = f"the watchdog has taken over: {content.decode()}"

    def send(self, data: bytes) -> None:
        """Send bytes to the autopilot."""
        self._hand(BYTES + data)

    def receive(self) -> bytes:
        """The bytes from the autopilot."""
        self.poll(0.0)
        data = bytes(self._received)
        self._received.clear()
        return data

    def plan(self, plan: Any) -> None:
        """Tell the watchdog what to do if the bridge falls silent. `plan` is a dataclass that its lander can read."""
        self._hand(PLAN + json.dumps(asdict(plan)).encode())

    def close(self) -> None:
        """End the watchdog, if the vehicle is on the ground. In the air, the watchdog treats this as the end of the
        bridge, and lands.
        """
        self._socket.close()
        if self._lifeline:
            self._lifeline.close()
        self._link_alive = False
        with suppress(subprocess.TimeoutExpired):  # it is landing the vehicle
            self._process.wait(2.0)

    def _hand(self, packet: bytes) -> None:
        try:
            self._socket.send(packet)
        except OSError as error:
            self.reason = f"the watchdog process does not listen: {error}"


def serve(bridge: socket.socket, died: socket.socket | None, link: Link, lander: Lander, timeout: float) -> str:
    """Pass bytes on until the bridge ends on the ground, or take over and land.

    Args:
        bridge: the socket to the bridge. When it is closed, the bridge has ended.
        died: a socket that becomes readable when the bridge has died, earlier than `bridge` closes (see `lifeline`).
            None: there is none.
        link: the link to the autopilot.
        lander: how it lands.
        timeout: silence of the bridge in flight after which it counts as ended, s.

    Returns:
        Why this process has landed the vehicle. Empty: the bridge ended on the ground.
    """
    heard = [bridge] if died is None else [bridge, died]
    status: tuple[bool, str, int] | None = None
    silence, before = 0.0, time.monotonic()
    bridge.setblocking(False)
    while True:
        ready, _, _ = select.select(heard, [], [], 0.001)
        now = time.monotonic()
        silence, before = silence + min(now - before, STALL_S), now
        link.poll(now)
        packets, gone = _packets(bridge)
        gone = gone or died in ready
        for packet in packets:
            silence = 0.0
            if packet[:1] == BYTES:
                link.send(packet[1:])
                lander.passed(packet[1:])
            else:
                lander.follow(packet[1:])
        if gone and not lander.flying:
            link.close()
            return ""
        if lander.flying and (gone or silence > timeout):
            why = "the bridge has ended" if gone else f"the bridge was silent for {silence:.2f} s"
            _hand(bridge, TAKEN + why.encode())
            lander.land(link)
            return f"{why}: landed"
        if data := link.receive():
            _hand(bridge, BYTES + data)
        said = link.alive, link.reason, link.connections
        if said != status and _hand(bridge, STATUS + json.dumps(said).encode()):
            status = said


def _packets(bridge: socket.socket) -> tuple[list[bytes], bool]:
    """The packets that have come, and whether the bridge has ended."""
    packets = []
    while True:
        try:
            packet = bridge.recv(_PACKET)
        except BlockingIOError:
            return packets, False
        except OSError:
            packet = b""
        if not packet:
            return packets, True
        packets.append(packet)


def _hand(bridge: socket.socket, packet: bytes) -> bool:
    try:
        bridge.send(packet)
    except OSError:  # full or closed: bytes of the autopilot are lost, as on a bad line
        return False
    return True


def watch_over(opens: Callable[[str], Link], lander: Lander) -> None:
    """Serve the bridge over a link: all that the process does.

    The arguments of the process are the text of the link, the timeout in s, the file descriptor of the socket to the
    bridge and, if there is one, that of its lifeline. `opens` makes a link from its text.
    """
    target, timeout, descriptor, *lifeline = sys.argv[1:]
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    with suppress(OSError, AttributeError):  # without the permission for it, the process is still light enough
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(20))  # a bridge that spins must not starve it
    with socket.socket(fileno=int(descriptor)) as bridge:
        died = watch(int(lifeline[0])) if lifeline else None
        said = serve(bridge, died, opens(target), lander, float(timeout))
    with suppress(OSError):  # maybe nobody reads this, so it comes only after the landing
        sys.stderr.write(f"watchdog: {said}\n" if said else "")
