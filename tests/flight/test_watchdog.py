"""The watchdog: its descent, and the real process between a real bridge process and a controller on TCP."""

import dataclasses
import itertools
import json
import os
import re
import select
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict
from math import radians
from pathlib import Path
from unittest.mock import Mock

import pytest

from e2efly.flight.attitude import Attitude
from e2efly.flight.autopilots import check_link
from e2efly.flight.betaflight import watchdog
from e2efly.flight.betaflight.codec import REPLY, Decoder, MspFrame, encode
from e2efly.flight.betaflight.messages import SET_RAW_RC, AttitudeReply, StatusEx, set_raw_rc
from e2efly.flight.betaflight.watchdog import (
    LEVEL_GAIN,
    LEVEL_RATE,
    PROGRAM,
    STALE_S,
    TIMEOUT_S,
    DescentPlan,
    StickLander,
    descent,
)
from e2efly.flight.watched_link import WatchedLink
from tests.faults.virtual_watchdog import VirtualWatchdog
from tests.flight.test_msp_client import Wire
from tests.waiting import running, until

RATES = tuple(0.5 * i for i in range(-8, 9))
PULSES = tuple(1500 + round(100 * rate) for rate in RATES)
PLAN = DescentPlan(
    flying=True,
    rates=RATES,
    pulses=(PULSES, PULSES, tuple(reversed(PULSES))),
    places=(0, 1, 3, 2),
    throttle=((0.0, 1400), (0.15, 1450), (0.3, 1000)),
    channels=(1501, 1502, 1000, 1504, 1900, 1900, 1500, 1500),
)
GROUND = dataclasses.replace(PLAN, flying=False)
STEADY = (1510, 1520, 1600, 1490, 1900, 1900, 1500, 1500)
"""What the bridge sends in flight."""
REACTION = 2.0
"""Within this the sticks are the watchdog's, s. It waits for 1 s here, not TIMEOUT_S: a busy machine stops the bridges
of these tests for longer than that; benchmarks/firmware_faults.py measures the promise."""


class TestDescent:
    def test_levels_by_the_attitude_and_leaves_the_other_channels(self) -> None:
        channels = descent(PLAN, 0.0, Attitude(0.2, -0.1, 1.0))
        assert channels[:4] == [1500 - round(20 * LEVEL_GAIN), 1500 + round(10 * LEVEL_GAIN), 1400, 1500]
        assert channels[4:] == list(PLAN.channels[4:])

    def test_without_attitude_the_rates_are_zero(self) -> None:
        assert descent(PLAN, 0.0, None)[:4] == [1500, 1500, 1400, 1500]

    def test_rates_are_limited_and_read_between_the_entries(self) -> None:
        over = descent(PLAN, 0.0, Attitude(3.0, -3.0, 0.0))
        assert over[:2] == [1500 - round(100 * LEVEL_RATE), 1500 + round(100 * LEVEL_RATE)]
        assert descent(PLAN, 0.0, Attitude(-0.3 / LEVEL_GAIN, 0.0, 0.0))[0] == 1530
        narrow = dataclasses.replace(PLAN, rates=(-1.0, 1.0), pulses=((1400, 1600),) * 3)
        assert descent(narrow, 0.0, Attitude(3.0, -3.0, 0.0))[:2] == [1400, 1600]  # never beyond the table

    def test_the_throttle_follows_its_times_and_ends_closed(self) -> None:
        for elapsed, pulse in ((0.0, 1400), (0.1499, 1400), (0.15, 1450), (0.29, 1450), (0.3, 1000), (99.0, 1000)):
            assert descent(PLAN, elapsed, None)[2] == pulse
        for throttle, pulse in (
            (((0.5, 1300),), 1300),  # before the first, the first is held
            (((0.0, 1300), (0.0, 1400)), 1400),  # of steps at one time the last counts
        ):
            assert descent(dataclasses.replace(PLAN, throttle=throttle), 0.0, None)[2] == pulse

    @pytest.mark.parametrize(
        ("name", "value"),
        [
            ("rates", (0.0,)), ("rates", (1.0, *RATES[1:])), ("pulses", (PULSES, PULSES)),
            ("pulses", (PULSES, PULSES, PULSES[1:])), ("places", (0, 1, 2, 8)), ("places", (0, 1, 1, 2)),
            ("throttle", ()), ("throttle", ((0.3, 1400), (0.1, 1000))), ("throttle", ((float("nan"), 1400),)),
            ("channels", (1500,) * 19), ("channels", (*PLAN.channels[:7], 500)),
        ],
    )  # fmt: skip
    def test_a_plan_that_cannot_be_flown_is_refused(self, name: str, value: object) -> None:
        with pytest.raises(ValueError, match=f"plan: {name} is "):
            dataclasses.replace(PLAN, **{name: value})

    def test_a_throttle_that_is_no_pulse_is_refused(self) -> None:
        with pytest.raises(ValueError, match="plan: channels"):
            dataclasses.replace(PLAN, throttle=((0.0, 3000),))


def test_a_bridge_that_has_no_port_to_send_to_is_not_silent() -> None:
    now, gone = [0.0], Mock(alive=False, reason="unplugged", connections=1, receive=bytes)
    dog = VirtualWatchdog(lambda: now[0], gone, StickLander(), TIMEOUT_S)
    try:
        dog.plan(PLAN)
        for _ in range(50):
            now[0] += 0.01
            dog.poll(now[0])
        assert dog.taken_over == ""
        for _ in range(15):
            now[0] += 0.01
            dog.step()
        dog.poll(now[0])
        assert "the bridge was silent for" in dog.taken_over
    finally:
        dog.close()


class Controller:
    """The flight controller's side: records sticks, answers what its attitude is."""

    def __init__(self) -> None:
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.target = f"tcp:127.0.0.1:{self.listener.getsockname()[1]}"
        self.sticks: list[tuple[float, tuple[int, ...]]] = []
        """When they came, and the channels."""
        self.attitude: tuple[float, float] | None = (20.0, -10.0)
        """Roll and pitch, deg; None: it does not answer."""
        self.others: list[MspFrame] = []
        self.drop = threading.Event()
        self.accepted = 0
        self._stop, self._wake = os.pipe()
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def close(self) -> None:
        os.write(self._wake, b"x")
        self._thread.join(10.0)
        self.listener.close()
        os.close(self._stop)
        os.close(self._wake)

    def count(self) -> int:
        return len(self.sticks)

    def wait_for(self, more: int) -> None:
        """Until so many more have come."""
        count = self.count()
        until(lambda: self.count() > count + more)

    def _serve(self) -> None:
        peer, decoder = None, Decoder()
        while True:
            ready = select.select([self._stop, peer or self.listener], [], [], 0.01)[0]
            if self._stop in ready:
                break
            if self.drop.is_set() and peer is not None:
                self.drop.clear()
                peer.close()
                peer = None
                continue
            if not ready:
                continue
            if peer is None:
                peer, decoder = self.listener.accept()[0], Decoder()
                self.accepted += 1
                continue
            data = b""
            with suppress(OSError):  # it has gone
                data = peer.recv(65536)
                for frame in decoder.feed(data):
                    self._answer(peer, frame)
            if not data:
                peer.close()
                peer = None
        if peer is not None:
            peer.close()

    def _answer(self, peer: socket.socket, frame: MspFrame) -> None:
        now = time.monotonic()
        if frame.code == SET_RAW_RC:
            self.sticks.append((now, struct.unpack(f"<{len(frame.payload) // 2}H", frame.payload)))
        elif frame.code == AttitudeReply.CODE and self.attitude is not None:
            roll, pitch = self.attitude
            peer.sendall(encode(MspFrame(frame.code, struct.pack("<3h", int(10 * roll), int(10 * pitch), 0), REPLY)))
        elif frame.code != AttitudeReply.CODE:
            self.others.append(frame)
            peer.sendall(encode(MspFrame(frame.code, frame.payload, REPLY, frame.version)))


@pytest.fixture
def controller() -> Iterator[Controller]:
    held = Controller()
    yield held
    held.close()


BRIDGE = """
import json, sys, time
from e2efly.flight.betaflight.codec import encode
from e2efly.flight.betaflight.messages import set_raw_rc
from e2efly.flight.betaflight.watchdog import PROGRAM, DescentPlan
from e2efly.flight.watched_link import WatchedLink
target, sticks, plan = sys.argv[1], json.loads(sys.argv[2]), DescentPlan(**json.loads(sys.argv[3]))
link = WatchedLink(PROGRAM, target, 1.0)
print(link._process.pid, flush=True)
while not link.taken_over:
    link.poll(0.0)
    link.plan(plan)
    if link.alive:
        link.send(encode(set_raw_rc(sticks)))
    time.sleep(0.01)
print(link.alive, link.taken_over, flush=True)
sys.stdin.read()
"""


class Flying:
    """A bridge in a process of its own, and the watchdog that it has started."""

    def __init__(self, controller: Controller, plan: DescentPlan = PLAN, stderr: int | None = None) -> None:
        self.process = subprocess.Popen(
            [sys.executable, "-c", BRIDGE, controller.target, json.dumps(STEADY), json.dumps(asdict(plan))],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=stderr, text=True,
        )  # fmt: skip
        self.watchdog = int(self.process.stdout.readline())

    def struck(self, number: signal.Signals) -> float:
        """When the bridge's process got a signal, s."""
        since = time.monotonic()
        self.process.send_signal(number)
        return since

    def close(self) -> None:
        for pid in (self.process.pid, self.watchdog):
            if running(pid):
                os.kill(pid, signal.SIGKILL)
        self.process.communicate()


@pytest.fixture
def fly(controller: Controller) -> Iterator[Callable[..., Flying]]:
    flights: list[Flying] = []

    def begin(plan: DescentPlan = PLAN, stderr: int | None = None) -> Flying:
        flights.append(Flying(controller, plan, stderr))
        until(lambda: controller.count() > 20)
        return flights[-1]

    yield begin
    for flight in flights:
        flight.close()


def watched(controller: Controller) -> WatchedLink:
    link = WatchedLink(PROGRAM, controller.target, TIMEOUT_S)
    until(lambda: link.poll(0.0) or link.alive)
    return link


def check_landing(controller: Controller, since: float) -> None:
    """It levels by the attitude, descends by the plan, and ends with the throttle closed."""
    until(lambda: controller.count() and controller.sticks[-1][1][2] == 1000)
    until(lambda: controller.sticks[-1][0] - since > 1.0)
    mine = [(at, row) for at, row in controller.sticks if row != STEADY and at >= since]
    assert mine[0][0] - since < REACTION
    assert max(at for at, row in controller.sticks if row == STEADY) < mine[0][0]  # nobody else speaks
    throttles = [pulse for pulse, _ in itertools.groupby(row[2] for _, row in mine)]
    assert throttles == [1400, 1450, 1000]
    roll, pitch = (1500 - round(100 * LEVEL_GAIN * radians(angle)) for angle in (20.0, -10.0))
    assert mine[-1][1] == (roll, pitch, 1000, 1500, *PLAN.channels[4:])


def test_bytes_are_handed_through_both_ways_and_the_end_on_the_ground_is_silent(controller: Controller) -> None:
    link = WatchedLink(PROGRAM, controller.target, TIMEOUT_S)
    assert not link.alive and link.reason
    until(lambda: link.poll(0.0) or link.alive)
    assert link.connections == 1 and link.reason == ""
    every = encode(MspFrame(77, bytes(range(256)) * 3, version=2))
    decoder, got = Decoder(), []
    for _ in range(20):
        link.send(every)
    until(lambda: got.extend(decoder.feed(link.receive())) or len(got) == 20)
    assert {frame.payload for frame in got} == {bytes(range(256)) * 3} and decoder.skipped == 0
    link.plan(PLAN)
    link.send(encode(set_raw_rc(STEADY)))
    link.plan(GROUND)
    until(controller.count)
    process = link._process
    link.close()
    assert process.returncode == 0 and not link.alive
    assert [row for _, row in controller.sticks] == [STEADY]
    link.close()  # twice does no harm, nor does use after it
    link.send(b"late")
    link.poll(0.0)
    assert link.receive() == b"" and not link.alive and link.reason


def test_a_target_that_is_no_link_is_refused_at_once() -> None:
    with pytest.raises(ValueError, match="accepted: serial:"):
        check_link("udp:nowhere")


def test_a_bridge_that_hangs_in_flight_and_is_told_when_it_goes_on(
    controller: Controller, fly: Callable[..., Flying]
) -> None:
    flight = fly()
    since = flight.struck(signal.SIGSTOP)
    check_landing(controller, since)
    flight.process.send_signal(signal.SIGCONT)
    said = flight.process.stdout.readline()
    assert re.match(r"False the watchdog has taken over: the bridge was silent for 1\.\d+ s", said)
    assert all(row != STEADY for at, row in controller.sticks if at > since + REACTION)  # and it stays out of it


def test_an_attitude_that_is_no_longer_told_is_not_levelled_by(
    controller: Controller, fly: Callable[..., Flying]
) -> None:
    flight = fly(dataclasses.replace(PLAN, throttle=((0.0, 1400), (5.0, 1000))))
    flight.process.kill()
    until(lambda: controller.sticks[-1][1][0] < 1500)
    controller.attitude, since = None, time.monotonic()
    until(lambda: controller.sticks[-1][1][:4] == (1500, 1500, 1400, 1500))
    assert time.monotonic() - since < STALE_S + REACTION


def test_a_bridge_that_is_killed_on_the_ground_ends_the_watchdog_without_a_stick(
    controller: Controller, fly: Callable[..., Flying]
) -> None:
    flight = fly(GROUND)
    flight.process.kill()
    until(lambda: not running(flight.watchdog))
    assert {row for _, row in controller.sticks} == {STEADY}


def test_a_bridge_that_hangs_on_the_ground_is_waited_for(controller: Controller, fly: Callable[..., Flying]) -> None:
    flight = fly(GROUND)
    flight.process.send_signal(signal.SIGSTOP)
    time.sleep(1.5)
    flight.process.send_signal(signal.SIGCONT)
    controller.wait_for(10)
    assert {row for _, row in controller.sticks} == {STEADY}


@pytest.mark.whole(but=2)
@pytest.mark.parametrize("number", [0, signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_bridge_that_is_killed_in_flight_is_landed_for_and_no_signal_ends_that(
    number: int, controller: Controller, fly: Callable[..., Flying]
) -> None:
    flight = fly()
    os.kill(flight.watchdog, number)  # 0: none
    controller.wait_for(10)
    check_landing(controller, flight.struck(signal.SIGKILL))


def test_a_terminal_that_takes_nothing_does_not_hold_it_up(controller: Controller, fly: Callable[..., Flying]) -> None:
    """As when the terminal is paused or gone: whatever the watchdog has to say, it flies first."""
    out, end = os.pipe()
    os.set_blocking(end, False)
    with pytest.raises(BlockingIOError):
        while True:
            os.write(end, b"." * 65536)
    os.set_blocking(end, True)
    check_landing(controller, fly(stderr=end).struck(signal.SIGKILL))
    os.close(out)
    os.close(end)


def test_a_watchdog_that_dies_is_seen_as_a_lost_link_and_leaves_nothing_behind(controller: Controller) -> None:
    before = set(Path("/proc/self/fd").iterdir())
    link = watched(controller)
    os.kill(link._process.pid, signal.SIGKILL)
    until(lambda: link.poll(0.0) or not link.alive)
    assert link.reason == "the watchdog process has ended" and not link.taken_over
    until(lambda: link.poll(0.0) or link._process.returncode is not None)  # no zombie is left
    for _ in range(3):  # and nothing raises from here on
        link.send(b"x")
        link.plan(PLAN)
        assert link.receive() == b""
    assert "does not listen" in link.reason or "ended" in link.reason
    link.close()
    until(lambda: set(Path("/proc/self/fd").iterdir()) == before)  # the controller closes its side, too


def test_a_watchdog_that_hangs_never_blocks_the_bridge(controller: Controller) -> None:
    link = watched(controller)
    os.kill(link._process.pid, signal.SIGSTOP)
    for _ in range(3000):
        link.send(bytes(1000))
    assert "does not listen" in link.reason
    os.kill(link._process.pid, signal.SIGKILL)
    link.close()


def test_a_link_that_is_cut_comes_back_in_the_same_flight(controller: Controller, fly: Callable[..., Flying]) -> None:
    fly()
    controller.drop.set()
    until(lambda: controller.accepted == 2)
    controller.wait_for(20)
    assert {row for _, row in controller.sticks} == {STEADY}


@pytest.mark.whole
def test_a_link_that_is_cut_during_the_landing_comes_back(controller: Controller, fly: Callable[..., Flying]) -> None:
    flight = fly(dataclasses.replace(PLAN, throttle=((0.0, 1400), (3.0, 1000))))
    flight.process.kill()
    until(lambda: controller.sticks[-1][1][2] == 1400)
    controller.drop.set()
    until(lambda: controller.accepted == 2)
    until(lambda: controller.sticks[-1][1][2] == 1000)


def test_the_bridge_hears_of_a_lost_link(controller: Controller) -> None:
    link = watched(controller)
    controller.drop.set()
    until(lambda: link.poll(0.0) or not link.alive)
    assert "closed the connection" in link.reason
    until(lambda: link.poll(0.0) or link.alive)
    assert link.connections == 2 and link.reason == ""
    link.close()


def test_a_plan_that_cannot_be_read_leaves_the_last_one(controller: Controller) -> None:
    link = watched(controller)
    link.plan(PLAN)
    for content in (b"Pgarbage", b"P{}", b"P[]", b"P\xff", b'P{"pulses": 5}', b"?"):
        link._hand(content)
    until(lambda: link.poll(0.0) or link.taken_over)  # the bridge, silent, is taken for hung: it lands by the plan
    until(lambda: 1400 in [row[2] for _, row in controller.sticks])
    os.kill(link._process.pid, signal.SIGKILL)
    link.close()


class Told(Wire):
    """A link to a controller that says whether it is armed, and the time that passes with each round."""

    def __init__(self, armed: Callable[[float], bool | None]) -> None:
        super().__init__()
        self.armed, self.now, self.sticks, self.closed = armed, 0.0, [], False

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds

    def send(self, data: bytes) -> None:
        for frame in self.decoder.feed(data):
            if frame.code == SET_RAW_RC:
                self.sticks.append(struct.unpack(f"<{len(frame.payload) // 2}H", frame.payload))
            elif frame.code == StatusEx.CODE and (armed := self.armed(self.now)) is not None:
                payload = struct.pack("<HHHIBHBBBBIB", 250, 0, 0, int(armed), 0, 0, 4, 0, 0, 29, 0, 0)
                self.inbox += encode(MspFrame(StatusEx.CODE, payload, REPLY))

    def close(self) -> None:
        self.closed = True


def test_the_throttle_stays_closed_until_the_pilot_has_disarmed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where an old override is handed back, the throttle stick in its middle would have the motors."""
    link = Told(lambda now: now < 60.0 and not 5.0 < now < 5.015)  # one answer in error does not end it
    monkeypatch.setattr(watchdog, "time", link)
    watchdog.land(link, PLAN)  # type: ignore[arg-type]
    assert 60.0 < link.now < 60.1 and link.closed
    assert {row[2] for row in link.sticks[100:]} == {1000}


def test_a_controller_that_says_nothing_any_more_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    link = Told(lambda now: True if now < 2.0 else None)
    monkeypatch.setattr(watchdog, "time", link)
    watchdog.land(link, PLAN)  # type: ignore[arg-type]
    assert 2.0 + watchdog.DEAF_S - 0.1 < link.now < 2.0 + watchdog.DEAF_S + 0.1 and link.closed


def test_it_starts_without_numpy_and_onnx_runtime() -> None:
    code = "import sys, e2efly.flight.betaflight.watchdog; print({'numpy', 'onnxruntime', 'serial'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True).stdout.strip() == b"set()"
