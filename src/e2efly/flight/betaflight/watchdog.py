"""A separate process between bridge and flight controller, which lands the vehicle when the bridge dies or hangs.

Under MSP override, Betaflight continues with the last sticks that it received. Some versions do so for ever, others for
0.3 s. After that the pilot's own sticks are used, but the pilot may not be holding them. So the link belongs to this
small process, which passes all bytes on. When the bridge has ended, or has been silent for `TIMEOUT_S` in flight, this
process takes over for good. It levels the vehicle with the controller's own attitude and descends gently with the
throttle that the bridge had learned. Then it keeps the throttle closed until the pilot disarms. It imports neither
NumPy nor ONNX Runtime. It ends only with the bridge: no signal but SIGKILL stops it.
"""

import json
import os
import select
import signal
import socket
import subprocess
import sys
import time
from bisect import bisect_right
from contextlib import suppress
from dataclasses import asdict, dataclass
from itertools import chain, pairwise
from math import inf
from typing import Any

from e2efly.flight.attitude import Attitude
from e2efly.flight.betaflight.codec import REPLY, Decoder, MspFrame, encode
from e2efly.flight.betaflight.descent import Descent, Sense, between, command, feel, move, sent
from e2efly.flight.betaflight.messages import (
    CHANNEL_RANGE,
    MAX_CHANNELS,
    SET_RAW_RC,
    AttitudeReply,
    RawImu,
    StatusEx,
    set_raw_rc,
)
from e2efly.flight.lifeline import Lifeline, watch
from e2efly.flight.link import MOST, Link, open_link
from e2efly.vehicles.gravity import GRAVITY

TIMEOUT_S = 0.1
"""Silence of the bridge in flight after which this process takes over, s."""
PERIOD_S = 0.01
"""Time between two frames of a take-over, s."""
STALL_S = 0.05
"""The longest time that one loop of this process may add to the silence of the bridge, s. If the whole machine stood
still, the bridge then has the chance to send first."""
STALE_S = 0.2
"""A controller's attitude that is older than this is not used for levelling, s."""
DEAF_S = 10.0
"""If the controller has not reported for this time whether it is armed, it is given up after the descent, s. After such
a silence the descent goes on, too."""
ASKED = (StatusEx, *(AttitudeReply, RawImu) * 5)
"""What the frames of a take-over ask for, in turn, ..."""
ASKED_AFTER = (StatusEx, AttitudeReply)
"""... and after it."""
ARM = 1
"""Bit of the mode ARM in `StatusEx.boxes`: it is always the first."""
LEVEL_GAIN = 4.0
"""Body rate divided by tilt, 1/s."""
LEVEL_RATE = 3.0
"""Largest body rate of levelling, rad/s."""
BYTES, PLAN, STATUS, TAKEN = b"B", b"P", b"S", b"T"
"""First byte of a packet: bytes of the link, the plan of the bridge, the state of the link, or the message that this
process has taken over."""
PACKETS = 64
"""The largest number of packets that the bridge reads from this process at a time."""
_PACKET = 1 << 17
"""The longest packet, bytes. It is longer than what a link delivers at a time."""


@dataclass(frozen=True)
class DescentPlan:
    """What to do without the bridge. It is given in pulses, so nothing about controller or vehicle need be known.

    Raises:
        ValueError: a field has a value that cannot be used for flight. The message names the field.
    """

    flying: bool
    """The vehicle is in flight, so silence of the bridge leads to a take-over."""
    rates: tuple[float, ...]
    """Body rates for which `pulses` are given, rad/s, increasing."""
    pulses: tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]
    """Pulses of the roll, pitch and yaw sticks at each of `rates`, us."""
    places: tuple[int, int, int, int]
    """The positions of roll, pitch, yaw and throttle in a frame of channels."""
    throttle: tuple[tuple[float, int], ...]
    """The descent: (time since the take-over, s, throttle pulse, us), with increasing times. The last pulse is held."""
    channels: tuple[int, ...]
    """The frame whose other channels are kept, us."""
    sense: Sense | None = None
    """What a descent by the accelerometer starts from: of `throttle`, only the last time is then used. None: the
    descent is that of `throttle`."""

    def __post_init__(self) -> None:
        n, count = len(self.rates), len(self.channels)
        times = [at for at, _ in self.throttle]
        given = [*self.channels, *(pulse for _, pulse in self.throttle), *chain(*self.pulses)]
        low, high = CHANNEL_RANGE
        good = {
            "rates": n >= 2 and all(a < b for a, b in pairwise(self.rates)),
            "pulses": len(self.pulses) == 3 and all(len(row) == n for row in self.pulses),
            "places": len(set(self.places)) == 4 and all(0 <= place < count for place in self.places),
            "throttle": bool(times) and all(a <= b for a, b in pairwise(times)) and 0 <= times[0] <= times[-1] < inf,
            "channels": 4 <= count <= MAX_CHANNELS and all(type(p) is int and low <= p <= high for p in given),
        }
        for name, fine in good.items():
            if not fine:
                raise ValueError(f"plan: {name} is {getattr(self, name)}; accepted: as documented, {low} to {high} us")


def descent(plan: DescentPlan, elapsed: float, attitude: Attitude | None) -> list[int]:
    """The channels of a take-over without an accelerometer, us. `elapsed` is the time since the take-over, s. If the
    controller's attitude is unknown, the body rates are zero.
    """
    times = [at for at, _ in plan.throttle]
    return _channels(plan, plan.throttle[max(bisect_right(times, elapsed) - 1, 0)][1], attitude)


def _channels(
    plan: DescentPlan, throttle: int, attitude: Attitude | None, lean: tuple[float, float] = (0.0, 0.0)
) -> list[int]:
    """The channels that turn towards a roll and pitch, rad, with a throttle pulse, us."""
    wanted = [0.0, 0.0, 0.0]
    if attitude is not None:
        for i, angle in enumerate((lean[0] - attitude.roll, lean[1] - attitude.pitch)):
            wanted[i] = max(-LEVEL_RATE, min(LEVEL_RATE, LEVEL_GAIN * angle))
    channels = list(plan.channels)
    for place, rate, pulses in zip(plan.places, wanted, plan.pulses, strict=False):
        channels[place] = round(between(plan.rates, pulses, rate))
    channels[plan.places[3]] = throttle
    return channels


class WatchedLink:
    """The bridge's side: a `Link` through the watchdog process. It works as long as the thread that creates it lives.

    Raises:
        ValueError: the target does not name a link.
    """

    def __init__(self, target: str, timeout: float = TIMEOUT_S) -> None:
        """Start the process. `target` is the text of the link, as for `open_link`. `timeout` is the silence of the
        bridge in flight after which the process takes over, s.
        """
        open_link(target)  # raises here for a bad target; nothing is opened before the first poll
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
                [sys.executable, "-m", "e2efly.flight.betaflight.watchdog", target, str(timeout), *map(str, given)],
                pass_fds=given,
                stdin=subprocess.DEVNULL,
                start_new_session=True,  # Ctrl-C must reach only the bridge
            )
        self._socket = mine
        self._received = bytearray()

    @property
    def alive(self) -> bool:
        """Whether the controller is connected and the bridge is still in control."""
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
        """Send bytes to the controller."""
        self._hand(BYTES + data)

    def receive(self) -> bytes:
        """The bytes from the controller."""
        self.poll(0.0)
        data = bytes(self._received)
        self._received.clear()
        return data

    def plan(self, plan: DescentPlan) -> None:
        """Tell the watchdog what to do if the bridge falls silent."""
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


def serve(bridge: socket.socket, died: socket.socket | None, link: Link, timeout: float = TIMEOUT_S) -> str:
    """Pass bytes on until the bridge ends on the ground, or take over and land.

    Args:
        bridge: the socket to the bridge. When it is closed, the bridge has ended.
        died: a socket that becomes readable when the bridge has died, earlier than `bridge` closes (see `lifeline`).
            None: there is none.
        link: the link to the controller.
        timeout: silence of the bridge in flight after which it counts as ended, s.

    Returns:
        Why this process has landed the vehicle. Empty: the bridge ended on the ground.
    """
    heard = [bridge] if died is None else [bridge, died]
    plan: DescentPlan | None = None
    status: tuple[bool, str, int] | None = None
    silence, before, held = 0.0, time.monotonic(), b""
    planned = before
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
                held = packet[1:] if packet[5:6] == bytes([SET_RAW_RC]) else held
            else:
                plan, planned = _plan(packet[1:]) or plan, now
        flying = plan is not None and plan.flying
        if gone and not flying:
            link.close()
            return ""
        if plan is not None and flying and (gone or silence > timeout):
            why = "the bridge has ended" if gone else f"the bridge was silent for {silence:.2f} s"
            _hand(bridge, TAKEN + why.encode())
            land(link, plan, held, now - planned)
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


def land(link: Link, plan: DescentPlan, held: bytes = b"", age: float = 0.0) -> None:
    """Level, descend, close the throttle, and keep it closed until the pilot has disarmed or nobody answers.

    The closed throttle must be sent all the time. Some controllers return the control to the receiver when they hear no
    override any more, and the throttle stick, which rests in its middle, would then control the motors.

    While the link is gone, the controller holds what it got last, and the descent does not go on. `plan` is the last
    plan of the bridge, and `age` how old it is, s. `held` is the last stick frame of the bridge, which the controller
    has held since.
    """
    decoder, attitude, levelled, disarmed, rounds = Decoder(), None, time.monotonic(), 0, 0
    sense, down = plan.sense, plan.throttle[-1][0]
    before = heard = told = time.monotonic()
    fall = None if sense is None else Descent.of(sense, down, _thrust(plan, sense, held), before, age)
    elapsed, thrust, closed_at = 0.0, 0.0, inf
    while True:
        link.poll(now := time.monotonic())
        for frame in decoder.feed(link.receive()[-MOST:]):
            if frame.direction != REPLY:
                continue
            heard = now
            with suppress(ValueError):  # a reply that cannot be parsed is ignored
                if frame.code == AttitudeReply.CODE:
                    attitude, levelled = AttitudeReply.parse(frame.payload), now
                elif frame.code == StatusEx.CODE:
                    disarmed, told = 0 if StatusEx.parse(frame.payload).boxes & ARM else disarmed + 1, now
                elif frame.code == RawImu.CODE and fall is not None and sense is not None:
                    fall = feel(fall, sense, RawImu.parse(frame.payload), now)
        attitude = attitude if now - levelled < STALE_S else None
        acts = link.alive and now - heard < STALE_S
        goes_on, dt = acts or now - heard > DEAF_S, now - before
        elapsed, before = elapsed + dt * goes_on, now
        if fall is None or sense is None:
            channels = descent(plan, elapsed, attitude)
            over = elapsed >= down
        else:
            if attitude is not None or now - levelled > STALE_S:
                fall = move(fall, sense, attitude, now, alive=goes_on)
            fall, wanted, lean = command(fall, attitude, dt)
            pulse, over = round(between(sense.forces, sense.pulses, wanted)), fall.over
            channels = _channels(plan, plan.throttle[-1][1] if over else pulse, attitude, lean)
            thrust = wanted if acts else fall.thrusts[-1][1]
            fall = sent(fall, thrust, now)
        closed_at = min(closed_at, now) if over else inf
        if over and (disarmed >= 2 or now - max(told, closed_at) > DEAF_S):
            break
        asked = ASKED_AFTER if over else ASKED
        link.send(encode(set_raw_rc(channels)) + encode(MspFrame(asked[rounds % len(asked)].CODE)))
        rounds += 1
        time.sleep(PERIOD_S)
    link.close()


def _thrust(plan: DescentPlan, sense: Sense, frame: bytes) -> float:
    """The thrust of a stick frame, m/s^2. Without one, that of hover."""
    for told in Decoder().feed(frame):
        at = 2 * plan.places[3]
        if told.code == SET_RAW_RC and len(told.payload) >= at + 2:
            return between(sense.pulses, sense.forces, int.from_bytes(told.payload[at : at + 2], "little"))
    return GRAVITY


def _plan(content: bytes) -> DescentPlan | None:
    """The plan in a packet. None: it is not a valid plan, because an unreadable plan must not end this process."""
    try:
        x = json.loads(content)
        roll, pitch, yaw = (tuple(pulses) for pulses in x["pulses"])
        a, b, c, d = x["places"]
        steps = tuple((at, pulse) for at, pulse in x["throttle"])
        known: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in (x["sense"] or {}).items()}
        sense = Sense(**known) if known else None
        channels = tuple(x["channels"])
        return DescentPlan(x["flying"], tuple(x["rates"]), (roll, pitch, yaw), (a, b, c, d), steps, channels, sense)
    except (ValueError, TypeError, KeyError, AttributeError):
        return None


def _hand(bridge: socket.socket, packet: bytes) -> bool:
    try:
        bridge.send(packet)
    except OSError:  # full or closed: bytes of the controller are lost, as on a bad line
        return False
    return True


def main() -> None:
    """Serve the bridge over a link.

    The arguments of the process are the text of the link, the timeout in s, the file descriptor of the socket to the
    bridge and, if there is one, that of its lifeline.
    """
    target, timeout, descriptor, *lifeline = sys.argv[1:]
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    with suppress(OSError, AttributeError):  # without the permission for it, the process is still light enough
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(20))  # a bridge that spins must not starve it
    with socket.socket(fileno=int(descriptor)) as bridge:
        died = watch(int(lifeline[0])) if lifeline else None
        said = serve(bridge, died, open_link(target), float(timeout))
    with suppress(OSError):  # maybe nobody reads this, so it comes only after the landing
        sys.stderr.write(f"watchdog: {said}\n" if said else "")


if __name__ == "__main__":
    main()
