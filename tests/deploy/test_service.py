"""The bridge under a service manager: what it is told, what a restart may not do, and who ends last."""

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from e2efly.commands.fly import Fly
from e2efly.commands.fly import run as fly_command
from e2efly.deploy.betaflight.codec import REPLY, Frame, encode
from e2efly.deploy.betaflight.instruments import ARM, OVERRIDE
from e2efly.deploy.betaflight.messages import SET_RAW_RC, StatusEx
from e2efly.deploy.betaflight.settings import BoxIds
from e2efly.deploy.flight_loop import fly
from e2efly.deploy.service import Service
from tests.commands.test_fly import free_port
from tests.deploy.msp_golden import REPLIES, payload
from tests.deploy.test_flight_loop import Clock, Grounded
from tests.deploy.test_msp_client import controller, recorded


@pytest.fixture
def manager(tmp_path: Path) -> Iterator[socket.socket]:
    """The socket of a service manager."""
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


def looped(bridge: Grounded, seconds: float, address: str | None = None) -> None:
    clock = Clock()
    end = clock.now() + seconds
    fly(bridge, 100.0, stop=lambda: clock.now() > end, service=Service(address), clock=clock)  # type: ignore[arg-type]


def test_the_loop_makes_it_ready_once_and_feeds_its_watchdog(manager: socket.socket) -> None:
    looped(Grounded(), 3.0, manager.getsockname())
    first, *rest, last = told(manager)
    assert first == "READY=1\nWATCHDOG=1"
    assert set(rest) == {"WATCHDOG=1"}
    assert 25 <= len(rest) <= 31  # every 0.1 s
    assert last.startswith("STOPPING=1\n")


def test_a_loop_that_stands_still_feeds_nothing(manager: socket.socket) -> None:
    bridge, found = Grounded(), list[list[str]]()
    step = bridge.tick

    def tick(now: float, lateness: float, slack: float) -> None:
        step(now, lateness, slack)
        if bridge.steps == 100:
            found.append(told(manager))
            time.sleep(0.4)
            found.append(told(manager))

    bridge.tick = tick  # type: ignore[method-assign]
    looped(bridge, 1.5, manager.getsockname())
    before, within = found
    assert len(before) >= 9
    assert within == []
    assert told(manager)  # and then it goes on


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


def test_the_command_feeds_it_until_it_hangs(manager: socket.socket, tmp_path: Path) -> None:
    with controller(recorded) as client:
        command = [sys.executable, "-m", "e2efly", "fly", "hover", "--link", client.link.name]  # type: ignore[attr-defined]
        command += ["--pose", f"udp:{free_port()}", "--log", str(tmp_path / "flight.mcap")]
        environment = {**os.environ, "NOTIFY_SOCKET": manager.getsockname()}
        process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL)
        try:
            heard = _until(manager, lambda lines: len(lines) > 5)
            assert heard[0].startswith("READY=1")
            process.send_signal(signal.SIGSTOP)
            time.sleep(0.3)
            told(manager)
            time.sleep(0.5)
            assert told(manager) == []
            process.send_signal(signal.SIGCONT)
            process.send_signal(signal.SIGTERM)
            _until(manager, lambda lines: any(line.startswith("STOPPING=1") for line in lines))
            assert process.wait(30) == 0
        finally:
            process.kill()
            process.wait()


def _until(manager: socket.socket, found: Callable[[list[str]], bool]) -> list[str]:
    lines, end = list[str](), time.monotonic() + 60
    while not found(lines):
        assert time.monotonic() < end, lines
        lines += told(manager)
        time.sleep(0.02)
    return lines


def flying(*boxes: int) -> Callable[[int], bytes]:
    """The recorded controller, with modes on; the codes that it is asked for are in `asked`."""
    ids = BoxIds.parse(payload(REPLIES[1][BoxIds.CODE])).ids
    status = bytearray(payload(REPLIES[1][StatusEx.CODE]))
    on = sum(1 << ids.index(box) for box in boxes)
    status[6:10] = (on & 0xFFFFFFFF).to_bytes(4, "little")
    extra = status[15] & 15
    status[16 : 16 + extra] = (on >> 32).to_bytes(extra, "little")

    def reply(code: int) -> bytes:
        asked.add(code)
        return encode(Frame(code, bytes(status), REPLY)) if code == StatusEx.CODE else recorded(code)

    asked = reply.asked = set[int]()  # type: ignore[attr-defined]
    return reply


def test_started_in_flight_it_takes_nothing_over(tmp_path: Path) -> None:
    """Its first frame would close the throttle."""
    reply = flying(ARM, OVERRIDE)
    with controller(reply) as client:
        options = Fly(vehicle="vis_r", link=client.link.name, pose=f"udp:{free_port()}", log=tmp_path / "f.mcap")  # type: ignore[attr-defined]
        with pytest.raises(ValueError, match=r"armed and its override is on, .*; accepted: disarmed, or override low"):
            fly_command(options)
    assert StatusEx.CODE in reply.asked  # type: ignore[attr-defined]
    assert SET_RAW_RC not in reply.asked  # type: ignore[attr-defined]
    assert not (tmp_path / "f.mcap").exists()


@pytest.mark.parametrize("boxes", [(), (ARM,), (OVERRIDE,)], ids=["neither", "armed", "override"])
def test_on_the_ground_or_beside_a_pilot_who_flies_it_begins(boxes: tuple[int, ...], tmp_path: Path) -> None:
    reply, began = flying(*boxes), time.monotonic()
    with controller(reply) as client:
        command = [sys.executable, "-m", "e2efly", "fly", "hover", "--link", client.link.name]  # type: ignore[attr-defined]
        command += ["--pose", f"udp:{free_port()}", "--log", str(tmp_path / "flight.mcap")]
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        try:
            while SET_RAW_RC not in reply.asked:  # type: ignore[attr-defined]
                assert process.poll() is None
                assert time.monotonic() < began + 60
                time.sleep(0.02)
        finally:
            process.kill()
            process.wait()


def test_the_first_process_ends_after_what_its_command_leaves_behind(tmp_path: Path) -> None:
    """As the watchdog does, which lands the vehicle. The exit status is the command's, or its signal's."""
    first = [sys.executable, "-m", "e2efly.deploy.process.first", "sh", "-c"]
    done = subprocess.run([*first, f"(sleep 0.5; touch {tmp_path}/landed) & exit 3"])
    assert done.returncode == 3
    assert (tmp_path / "landed").exists()
    assert subprocess.run([*first, "kill -9 $$"]).returncode == 137


def test_the_first_process_hands_signals_on(tmp_path: Path) -> None:
    first = [sys.executable, "-m", "e2efly.deploy.process.first", "sh", "-c"]
    script = f"trap 'touch {tmp_path}/asked; exit 0' TERM; touch {tmp_path}/begun; while :; do sleep 0.05; done"
    process = subprocess.Popen([*first, script])
    try:
        end = time.monotonic() + 30
        while not (tmp_path / "begun").exists():
            assert time.monotonic() < end
            time.sleep(0.02)
        process.send_signal(signal.SIGTERM)
        assert process.wait(30) == 0
        assert (tmp_path / "asked").exists()
    finally:
        process.kill()
        process.wait()
