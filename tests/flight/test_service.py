"""The bridge under a service manager: what it is told, what a restart may not do, and who ends last."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from e2efly.flight.betaflight.allowed_modes import ARM, OVERRIDE
from e2efly.flight.betaflight.codec import REPLY, MspFrame, encode
from e2efly.flight.betaflight.messages import SET_RAW_RC, StatusEx
from e2efly.flight.betaflight.mode_slots import BoxIds
from e2efly.flight.flight_loop import fly
from e2efly.flight.service import Service
from tests.flight.msp_golden import REPLIES, payload
from tests.flight.test_flight_loop import Clock, Grounded
from tests.flight.test_msp_client import controller, recorded
from tests.waiting import free_port, until


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(str(tmp_path / "notify"))
        listener.setblocking(False)
        yield listener


def told(manager: socket.socket) -> list[str]:
    """What has come since, datagram by datagram."""
    found = []
    while True:
        try:
            found.append(manager.recv(4096).decode())
        except BlockingIOError:
            return found


class Heard(Grounded):
    """A bridge whose manager reads at each step, as a socket holds ten datagrams or so."""

    def __init__(self, manager: socket.socket) -> None:
        super().__init__()
        self.manager, self.lines = manager, list[str]()

    def tick(self, now: float, lateness: float, slack: float) -> None:
        super().tick(now, lateness, slack)
        self.lines += told(self.manager)


def looped(bridge: Grounded, seconds: float, address: str | None = None) -> None:
    clock, service = Clock(), Service(address)
    end = clock.now() + seconds
    fly(bridge, 100.0, stop=lambda: clock.now() > end, service=service, clock=clock)  # type: ignore[arg-type]
    service.close()


def test_the_loop_makes_it_ready_once_and_feeds_its_watchdog(manager: socket.socket) -> None:
    bridge = Heard(manager)
    looped(bridge, 3.0, manager.getsockname())
    first, *rest = bridge.lines
    assert first == "READY=1\nWATCHDOG=1"
    assert set(rest) == {"WATCHDOG=1"}
    assert 25 <= len(rest) <= 31  # every 0.1 s
    assert told(manager)[-1].startswith("STOPPING=1\n")


def test_a_loop_that_stands_still_feeds_nothing(manager: socket.socket) -> None:
    bridge, within = Heard(manager), list[str]()
    step = bridge.tick

    def tick(now: float, lateness: float, slack: float) -> None:
        step(now, lateness, slack)
        if bridge.steps == 100:
            time.sleep(0.4)
            within.extend(told(manager))

    bridge.tick = tick  # type: ignore[method-assign]
    looped(bridge, 1.5, manager.getsockname())
    assert len(bridge.lines) >= 12
    assert within == []


def test_without_a_manager_nothing_is_told_and_one_that_is_gone_or_full_holds_up_nothing(
    manager: socket.socket, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    looped(Grounded(), 1.0)
    assert told(manager) == []
    looped(Grounded(), 1.0, str(tmp_path / "gone"))
    began = time.monotonic()
    looped(Grounded(), 300.0, manager.getsockname())  # 3000 datagrams, of which the socket holds fewer
    assert time.monotonic() - began < 60
    assert len(told(manager)) < 3000


def test_an_abstract_socket_of_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listener:
        listener.bind(f"\0e2efly-{os.getpid()}")
        listener.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", f"@e2efly-{os.getpid()}")
        looped(Grounded(), 0.5)
        assert told(listener)[0].startswith("READY=1")


@contextmanager
def flies(reply: Callable[[int], bytes], log: Path, **more: Any) -> Iterator[subprocess.Popen[str]]:
    """`e2efly fly` as a process, with a controller."""
    with controller(reply) as client:
        command = [sys.executable, "-m", "e2efly", "fly", "hover", "--link", client.link.name]  # type: ignore[attr-defined]
        command += ["--pose", f"udp:{free_port()}", "--log", str(log)]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL, text=True, **more)
        try:
            yield process
        finally:
            if isinstance(reply, Flying):
                reply.boxes = ()  # else the watchdog of one that began would stay
            process.kill()
            process.wait()


def test_the_command_feeds_it_until_it_hangs(manager: socket.socket, tmp_path: Path) -> None:
    environment, lines = {**os.environ, "NOTIFY_SOCKET": manager.getsockname()}, list[str]()

    def heard(first: str) -> bool:
        lines.extend(told(manager))
        return any(line.startswith(first) for line in lines)

    with flies(recorded, tmp_path / "flight.mcap", env=environment) as process:
        until(lambda: heard("READY=1") and len(lines) > 5, 60.0)
        assert lines[0].startswith("READY=1")
        process.send_signal(signal.SIGSTOP)
        time.sleep(0.3)
        told(manager)
        time.sleep(0.5)
        assert told(manager) == []
        process.send_signal(signal.SIGCONT)
        process.send_signal(signal.SIGTERM)
        until(lambda: heard("STOPPING=1"), 60.0)
        assert process.wait(30) == 0


class Flying:
    """The recorded controller, with modes on."""

    def __init__(self, *boxes: int) -> None:
        self.boxes = boxes
        self.asked: set[int] = set()
        """Codes of what it was sent."""
        self._ids = (*BoxIds.parse(payload(REPLIES[1][BoxIds.CODE])).ids, OVERRIDE)

    def __call__(self, code: int) -> bytes:
        self.asked.add(code)
        if code == BoxIds.CODE:
            return encode(MspFrame(code, bytes(self._ids), REPLY))
        if code != StatusEx.CODE:
            return recorded(code)
        status = bytearray(payload(REPLIES[1][StatusEx.CODE]))
        status[6:10] = sum(1 << self._ids.index(box) for box in self.boxes).to_bytes(4, "little")
        return encode(MspFrame(code, bytes(status), REPLY))


def test_started_in_flight_it_takes_nothing_over(tmp_path: Path) -> None:
    """Its first frame would close the throttle."""
    reply, log = Flying(ARM, OVERRIDE), tmp_path / "flight.mcap"
    with flies(reply, log, stderr=subprocess.PIPE) as process:
        said = " ".join(process.communicate(timeout=60)[1].split())
    assert process.returncode == 2
    assert "armed and its override is on, so that the first frame, which closes the throttle, would stop" in said
    assert "accepted: disarmed, or override low" in said
    assert StatusEx.CODE in reply.asked
    assert SET_RAW_RC not in reply.asked
    assert not log.exists()


@pytest.mark.whole(but=1)
@pytest.mark.parametrize("boxes", [(), (ARM,), (OVERRIDE,)], ids=["neither", "armed", "override"])
def test_on_the_ground_or_beside_a_pilot_who_flies_it_begins(boxes: tuple[int, ...], tmp_path: Path) -> None:
    reply = Flying(*boxes)
    with flies(reply, tmp_path / "flight.mcap") as process:
        until(lambda: SET_RAW_RC in reply.asked or process.poll() is not None, 60.0)
        assert process.poll() is None
        reply.boxes = ()  # disarmed, it ends
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0


def test_the_first_process_ends_after_what_its_command_leaves_behind(tmp_path: Path) -> None:
    """As the watchdog does, which lands the vehicle. The exit status is the command's, or its signal's."""
    first = [sys.executable, "-m", "e2efly.flight.scripts.first", "sh", "-c"]
    done = subprocess.run([*first, f"(sleep 0.5; touch {tmp_path}/landed) & exit 3"])
    assert done.returncode == 3
    assert (tmp_path / "landed").exists()
    assert subprocess.run([*first, "kill -9 $$"]).returncode == 137


def test_the_first_process_hands_signals_on(tmp_path: Path) -> None:
    first = [sys.executable, "-m", "e2efly.flight.scripts.first", "sh", "-c"]
    script = f"trap 'touch {tmp_path}/asked; exit 0' TERM; touch {tmp_path}/begun; while :; do sleep 0.05; done"
    process = subprocess.Popen([*first, script])
    try:
        until((tmp_path / "begun").exists, 30.0)
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
        assert (tmp_path / "asked").exists()
    finally:
        process.kill()
        process.wait()


def test_the_first_process_hands_a_signal_on_that_comes_as_the_command_starts() -> None:
    """`docker stop` may come at any time. The command gets the signal, and its end by it is the status."""
    code = """if True:
        import os, signal, subprocess, sys
        from e2efly.flight.scripts.first import main

        class Asked(subprocess.Popen):
            def __init__(self, command):
                super().__init__(command)
                os.kill(os.getpid(), signal.SIGTERM)

        subprocess.Popen = Asked
        sys.exit(main(["sleep", "30"]))"""
    assert subprocess.run([sys.executable, "-c", code], timeout=25).returncode == 143
