"""The watchdog of a Crazyflie: its real process, between a bridge's process that is killed or stopped and a Crazyflie
on UDP.
"""

import json
import math
import os
import signal
import socket
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator

import pytest

from e2efly.flight.crazyflie.crazyflie_watchdog import BELOW, SPEED, CommanderLander, LandingPlan
from tests.waiting import running, until

BRIDGE = """
import sys, time
from e2efly.flight.crazyflie.crazyflie_watchdog import PROGRAM, LandingPlan
from e2efly.flight.crazyflie.crtp import setpoint
from e2efly.flight.watched_link import WatchedLink
link = WatchedLink(PROGRAM, sys.argv[1], 0.5)
print(link._process.pid, flush=True)
while not link.taken_over:
    link.poll(0.0)
    link.plan(LandingPlan(sys.argv[2] == "flies", 1.5))
    if link.alive:
        link.send(setpoint((0.0, 0.0, 0.0), 30000).framed())
    time.sleep(0.01)
print(link.alive, link.taken_over, flush=True)
sys.stdin.read()
"""
SET_POINT, LAND, HANDOVER = (7, 0, 11), (8, 0, 10), (7, 1, 0)
"""Port, channel and first byte of packets."""


class Ears:
    """A Crazyflie's end of the radio: what came, and answers to requests for a landing."""

    def __init__(self) -> None:
        self.line = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.line.bind(("127.0.0.1", 0))
        self.line.setblocking(False)
        self.target = f"crazyflie:udp:127.0.0.1:{self.line.getsockname()[1]}"
        self.came: list[tuple[int, int, int]] = []
        self.answer: int | None = None
        """To a request for a landing. None: no answer."""
        self.landing = b""

    def hear(self) -> list[tuple[int, int, int]]:
        """The kinds of all packets so far."""
        try:
            while True:
                data, peer = self.line.recvfrom(64)
                if data[0] & 0xF3 == 0xF3:
                    continue
                self.came.append((data[0] >> 4, data[0] & 3, data[1]))
                if self.came[-1] == LAND:
                    self.landing = data[1:]
                    if self.answer is not None:
                        self.line.sendto(data[:4] + bytes([self.answer]), peer)
        except BlockingIOError:
            return self.came


@pytest.fixture
def ears() -> Iterator[Ears]:
    held = Ears()
    yield held
    held.line.close()


@pytest.fixture
def fly(ears: Ears) -> Iterator[Callable[[str], tuple[subprocess.Popen[str], int]]]:
    flights: list[tuple[subprocess.Popen[str], int]] = []

    def begin(where: str) -> tuple[subprocess.Popen[str], int]:
        process = subprocess.Popen(
            [sys.executable, "-c", BRIDGE, ears.target, where], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        assert process.stdout is not None
        flights.append((process, int(process.stdout.readline())))
        until(lambda: ears.hear().count(SET_POINT) > 20)
        return flights[-1]

    yield begin
    for process, watchdog in flights:
        for pid in (process.pid, watchdog):
            if running(pid):
                os.kill(pid, signal.SIGKILL)
        process.communicate()


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGSTOP])
def test_a_bridge_that_is_killed_or_stopped_is_landed_for(
    number: signal.Signals, ears: Ears, fly: Callable[[str], tuple[subprocess.Popen[str], int]]
) -> None:
    process, _ = fly("flies")
    process.send_signal(number)
    until(lambda: ears.hear().count(LAND) > 5)
    assert HANDOVER not in ears.came  # without a landing, the firmware would stop the motors
    command, group, descent, relative, _, own_yaw, speed = struct.unpack("<BBf?f?f", ears.landing)
    assert (command, group, relative, own_yaw) == (10, 0, True, True)
    assert descent == pytest.approx(1.5 + BELOW) and speed == pytest.approx(SPEED)
    ears.answer = 16  # busy: it does not land
    until(lambda: ears.hear().count(LAND) > 10)
    assert HANDOVER not in ears.came
    ears.answer = 1
    until(lambda: ears.hear().count(HANDOVER) > 5)
    first = ears.came.index(LAND)
    assert set(ears.came[first:]) == {LAND, HANDOVER}
    if number == signal.SIGSTOP:
        process.send_signal(signal.SIGCONT)
        assert process.stdout is not None
        assert process.stdout.readline().startswith("False the watchdog has taken over: the bridge was silent for 0.")
        assert SET_POINT not in ears.hear()[first:]


def test_a_bridge_that_is_killed_on_the_ground_ends_it(
    ears: Ears, fly: Callable[[str], tuple[subprocess.Popen[str], int]]
) -> None:
    process, watchdog = fly("stands")
    process.kill()
    until(lambda: not running(watchdog))
    assert set(ears.hear()) == {SET_POINT}


def test_one_that_says_nothing_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    link = Silent()
    monkeypatch.setattr("e2efly.flight.crazyflie.crazyflie_watchdog.time", Passing(now))
    CommanderLander(LandingPlan(True, 1.0)).land(link)
    assert 9.9 < now[0] < 10.1 and link.closed


class Silent:
    """A link on which nothing comes."""

    alive, reason, connections = True, "", 1

    def __init__(self) -> None:
        self.closed = False

    def poll(self, now: float) -> None:
        del now

    def send(self, data: bytes) -> None:
        assert data[1] >> 4 == LAND[0]

    def receive(self) -> bytes:
        return b""

    def close(self) -> None:
        self.closed = True


class Passing:
    """A clock that goes on while it is slept by."""

    def __init__(self, now: list[float]) -> None:
        self.now = now

    def monotonic(self) -> float:
        return self.now[0]

    def sleep(self, seconds: float) -> None:
        self.now[0] += seconds


def test_a_plan_that_cannot_be_read_leaves_the_last_one() -> None:
    lander = CommanderLander()
    assert not lander.flying
    lander.follow(json.dumps({"flying": True, "height": 2.0}).encode())
    for content in (b"garbage", b"{}", b"[]", b"\xff", b'{"flying": true, "height": null}',
                    json.dumps({"flying": False, "height": math.nan}).encode()):  # fmt: skip
        lander.follow(content)
    assert lander.flying and lander.plan == LandingPlan(True, 2.0)
    assert LandingPlan(True, -3.0).descent == BELOW


def test_it_starts_without_numpy_and_onnx_runtime() -> None:
    code = "import sys, e2efly.flight.crazyflie.crazyflie_watchdog; print({'numpy', 'onnxruntime'} & set(sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=True, capture_output=True).stdout.strip() == b"set()"
