"""A process of its own between bridge and flight controller, which lands the vehicle when the bridge dies or hangs.

Under MSP override, Betaflight goes on with the last sticks it was sent, for ever. So the link belongs to this small
process. It hands bytes through; when the bridge is gone, or silent for `TIMEOUT_S` in flight, it takes over for good:
level by the controller's own attitude, a gentle descent by the throttle that the bridge had learned, then the throttle
closed. It imports neither NumPy nor ONNX Runtime.
"""

import json
import os
import select
import socket
import subprocess
import sys
import time
from bisect import bisect_right
from contextlib import suppress
from dataclasses import asdict, dataclass

from e2efly.deploy.msp.codec import REPLY, Decoder, Frame, encode
from e2efly.deploy.msp.link import Link, open_link
from e2efly.deploy.msp.messages import Attitude, set_raw_rc

TIMEOUT_S = 0.1
"""Silence of the bridge in flight after which this process takes over, s."""
PERIOD_S = 0.01
"""Between two frames of a take-over, s."""
LEVEL_GAIN = 4.0
"""Body rate over tilt, 1/s."""
LEVEL_RATE = 3.0
"""Largest body rate of levelling, rad/s."""
BYTES, PLAN, STATUS, TAKEN = b"B", b"P", b"S", b"T"
"""First byte of a packet: bytes of the link; bridge's plan; state of the link; this process has taken over."""
_PACKET = 1 << 16


@dataclass(frozen=True)
class Plan:
    """What to do without the bridge, in pulses, so that nothing need be known of controller or vehicle."""

    flying: bool
    """Whether silence is to be answered at all."""
    rates: tuple[float, ...]
    """Body rates, rad/s, rising: where `pulses` are given."""
    pulses: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
    """us of the roll, pitch and yaw sticks at each of `rates`."""
    places: tuple[int, int, int, int]
    """Where roll, pitch, yaw and throttle stand in a frame of channels."""
    throttle: tuple[tuple[float, int], ...]
    """(s since the take-over, us), rising in time: the descent; the last holds."""
    channels: tuple[int, ...]
    """A frame to begin from, us."""


def descent(plan: Plan, elapsed: float, attitude: Attitude | None) -> list[int]:
    """The channels of a take-over, us.

    Args:
        plan: the bridge's last.
        elapsed: since the take-over, s.
        attitude: the controller's newest; None: its rates are set to zero instead.
    """
    wanted = [0.0, 0.0, 0.0]
    if attitude is not None:
        for i, angle in enumerate((attitude.roll, attitude.pitch)):
            wanted[i] = max(-LEVEL_RATE, min(LEVEL_RATE, -LEVEL_GAIN * angle))
    channels = list(plan.channels)
    for place, rate, pulses in zip(plan.places, wanted, plan.pulses, strict=False):
        channels[place] = round(_interpolate(plan.rates, pulses, rate))
    times = [at for at, _ in plan.throttle]
    channels[plan.places[3]] = plan.throttle[max(bisect_right(times, elapsed) - 1, 0)][1]
    return channels


def _interpolate(xs: tuple[float, ...], ys: tuple[int, ...], x: float) -> float:
    i = min(max(bisect_right(xs, x) - 1, 0), len(xs) - 2)
    share = min(max((x - xs[i]) / (xs[i + 1] - xs[i]), 0.0), 1.0)
    return ys[i] + share * (ys[i + 1] - ys[i])


class WatchedLink:
    """The bridge's end: a `Link` through the watchdog process."""

    def __init__(self, target: str) -> None:
        self.connections, self.reason = 0, "not polled yet"
        self.taken_over = ""
        """Why the watchdog has taken over; empty: it has not."""
        self._link_alive = False
        mine, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        for end in (mine, other):
            end.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1 << 20)
        mine.setblocking(False)
        with other:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "e2efly.deploy.watchdog", str(other.fileno()), target],
                pass_fds=[other.fileno()],
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C is for the bridge
            )
        self._socket = mine
        self._received = bytearray()

    @property
    def alive(self) -> bool:
        """The controller is connected and the bridge is still in charge."""
        return self._link_alive and not self.taken_over

    def poll(self, now: float) -> None:
        """Take in what the watchdog says; it connects by itself."""
        del now
        while True:
            try:
                packet = self._socket.recv(_PACKET)
            except BlockingIOError:
                return
            except OSError as error:
                packet, self.reason = b"", str(error)
            if not packet:
                self._link_alive, self.reason = False, "the watchdog process has ended"
                return
            kind, content = packet[:1], packet[1:]
            if kind == BYTES:
                self._received += content
            elif kind == STATUS:
                status = json.loads(content)
                self._link_alive, self.reason = status["alive"], status["reason"]
                self.connections = status["connections"]
            elif kind == TAKEN:
                self.taken_over = self.reason = f"the watchdog has taken over: {content.decode()}"

    def send(self, data: bytes) -> None:
        """Bytes for the controller."""
        self._hand(BYTES + data)

    def receive(self) -> bytes:
        """Bytes of the controller."""
        self.poll(0.0)
        data = bytes(self._received)
        self._received.clear()
        return data

    def plan(self, plan: Plan) -> None:
        """What to do should the bridge fall silent."""
        self._hand(PLAN + json.dumps(asdict(plan)).encode())

    def close(self) -> None:
        """End the watchdog; on the ground only, as it takes this for the end of the bridge otherwise."""
        self._socket.close()
        try:
            self._process.wait(2.0)
        except subprocess.TimeoutExpired:
            if not self._process.poll():
                return  # it is landing the vehicle
        self._link_alive = False

    def _hand(self, packet: bytes) -> None:
        try:
            self._socket.send(packet)
        except OSError as error:
            self.reason = f"the watchdog process does not listen: {error}"


def serve(bridge: socket.socket, link: Link) -> str:
    """Hand bytes through until the bridge ends on the ground, or take over and land; returns what happened."""
    plan: Plan | None = None
    heard = time.monotonic()
    bridge.setblocking(False)
    status = ""
    while True:
        select.select([bridge], [], [], 0.0005)
        now = time.monotonic()
        link.poll(now)
        gone = False
        while True:
            try:
                packet = bridge.recv(_PACKET)
            except BlockingIOError:
                break
            except OSError:
                packet = b""
            if not packet:
                gone = True
                break
            heard = now
            if packet[:1] == PLAN:
                plan = _plan(packet[1:])
            else:
                link.send(packet[1:])
        flying = plan is not None and plan.flying
        if gone and not flying:
            link.close()
            return "the bridge has ended"
        if flying and plan is not None and (gone or now - heard > TIMEOUT_S):
            why = "the bridge has ended" if gone else f"the bridge was silent for {now - heard:.2f} s"
            _hand(bridge, TAKEN + why.encode())
            print(f"watchdog: {why}: landing", file=sys.stderr, flush=True)
            land(link, plan)
            return why
        if data := link.receive():
            _hand(bridge, BYTES + data)
        said = json.dumps({"alive": link.alive, "reason": link.reason, "connections": link.connections})
        if said != status and _hand(bridge, STATUS + said.encode()):
            status = said


def land(link: Link, plan: Plan) -> None:
    """Level, descend, close the throttle, and keep it closed for a while."""
    decoder, attitude = Decoder(), None
    began = time.monotonic()
    end = plan.throttle[-1][0] + 10.0
    while (elapsed := time.monotonic() - began) < end:
        link.poll(time.monotonic())
        for frame in decoder.feed(link.receive()):
            if frame.direction == REPLY and frame.code == Attitude.CODE:
                try:
                    attitude = Attitude.parse(frame.payload)
                except ValueError:
                    attitude = None
        link.send(encode(set_raw_rc(descent(plan, elapsed, attitude))) + encode(Frame(Attitude.CODE)))
        time.sleep(PERIOD_S)
    link.close()


def _plan(content: bytes) -> Plan:
    x = json.loads(content)
    roll, pitch, yaw = (tuple(pulses) for pulses in x["pulses"])
    a, b, c, d = x["places"]
    steps = tuple((at, pulse) for at, pulse in x["throttle"])
    return Plan(x["flying"], tuple(x["rates"]), (roll, pitch, yaw), (a, b, c, d), steps, tuple(x["channels"]))


def _hand(bridge: socket.socket, packet: bytes) -> bool:
    try:
        bridge.send(packet)
    except OSError:  # full or gone: bytes of the controller are lost, as on a bad line
        return False
    return True


def main() -> None:
    """Serve the bridge at the other end of a socket whose descriptor is given, over the link that is named."""
    descriptor, target = sys.argv[1:]
    with suppress(OSError):  # where it is not allowed to, it is light enough
        os.nice(-10)
    with socket.socket(fileno=int(descriptor)) as bridge:
        serve(bridge, open_link(target))


if __name__ == "__main__":
    main()
