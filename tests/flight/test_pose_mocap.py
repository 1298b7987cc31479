"""Motion capture: the real client library decodes a server that speaks NatNet, OptiTrack's protocol."""

import importlib.util
import os
import signal
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from e2efly.flight import child
from e2efly.flight.pose.relay import RelaySource
from e2efly.flight.pose.sources import open_source
from tests.waiting import free_port, running, until

CONNECT, SERVER_INFO, REQUEST_MODEL, MODEL, FRAME = 0, 1, 4, 5, 7
BODY, NUMBER = b"quad", 7


@pytest.fixture(scope="module", autouse=True)
def package() -> None:
    if importlib.util.find_spec("motioncapture") is None:
        pytest.fail("needs motioncapture: pip install motioncapture; or E2EFLY_WITHOUT=mocap to go without these tests")


def packet(kind: int, body: bytes) -> bytes:
    return struct.pack("<HH", kind, len(body)) + body


def server_info(data_port: int) -> bytes:
    """A server of NatNet 3.0 that streams to one client, with a clock of 1 MHz."""
    name, version = b"server".ljust(256, b"\0"), bytes([3, 0, 0, 0])
    return packet(SERVER_INFO, name + version + version + struct.pack("<QH?4s", 10**6, data_port, False, bytes(4)))


def model() -> bytes:
    """One rigid body without an offset or markers."""
    return packet(MODEL, struct.pack("<ii", 1, 1) + BODY + b"\0" + struct.pack("<ii3fi", NUMBER, -1, 0, 0, 0, 0))


def frame(number: int, position: tuple, quaternion_xyzw: tuple, tracked: bool = True) -> bytes:
    """One frame of one rigid body."""
    body = struct.pack("<iiii", number, 0, 0, 1)  # no marker sets, no other markers
    body += struct.pack("<i7ffh", NUMBER, *position, *quaternion_xyzw, 0.0, tracked)
    body += struct.pack("<iiii", 0, 0, 0, 0)  # skeletons, labelled markers, force plates, devices
    body += struct.pack("<IIdQQQhi", 0, 0, number / 100, number, number, number, 0, 0)
    return packet(FRAME, body)


class Server:
    """Answers commands, and streams what `make` gives for each frame number until stopped."""

    def __init__(self, make: Callable[[int], bytes]) -> None:
        self.host = f"127.{1 + os.getpid() % 250}.{1 + os.getpid() // 250 % 250}.9"  # the command port is fixed
        self._command = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._command.bind((self.host, 1510))
        self._command.settimeout(0.01)
        self.port = free_port(udp=True)
        self.make, self._stop = make, threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        number = 0
        while not self._stop.is_set():
            number += 1
            self._command.sendto(self.make(number), ("127.0.0.1", self.port))
            try:
                request, client = self._command.recvfrom(4096)
            except TimeoutError:
                continue
            kind = struct.unpack_from("<H", request)[0]
            if kind == CONNECT:
                self._command.sendto(server_info(self.port), client)
            elif kind == REQUEST_MODEL:
                self._command.sendto(model(), client)

    def stop(self) -> None:
        self._stop.set()
        self._thread.join()
        self._command.close()


@pytest.fixture
def server() -> Iterator[Server]:
    server = Server(lambda number: frame(number, (1.0, 2.0, number / 128), (0.0, 0.0, 0.6, 0.8)))
    yield server
    server.stop()


def opened(text: str) -> RelaySource:
    source = open_source(text)
    assert isinstance(source, RelaySource)
    return source


def test_a_rigid_body_of_optitrack_is_followed(server: Server) -> None:
    source = opened(f"mocap:optitrack:{server.host}:quad")
    assert source.describe().startswith(f"mocap:optitrack:{server.host}:quad (motioncapture of ")
    samples = []
    until(lambda: samples.extend(source.read(time.monotonic())) or len(samples) >= 5, said=lambda: source.problem)
    source.close()
    assert source._child.process.returncode == 0
    for sample in samples:
        np.testing.assert_array_equal(sample.position[:2], [1, 2])
        np.testing.assert_allclose(sample.quaternion, [0.8, 0, 0, 0.6], atol=1e-7)
        assert (sample.stamp, sample.velocity, sample.body_rate, sample.frame) == (None, None, None, "")
    heights = [sample.position[2] for sample in samples]
    assert heights == sorted(set(heights))
    assert [sample.received for sample in samples] == sorted(sample.received for sample in samples)
    assert source.refused == 0


def test_a_body_that_is_lost_from_sight_gives_nothing_and_a_reason(server: Server) -> None:
    source = opened(f"mocap:optitrack:{server.host}:quad")
    until(lambda: bool(source.read(time.monotonic())), said=lambda: source.problem)
    server.make = lambda number: frame(number, (1.0, 2.0, 3.0), (0.0, 0.0, 0.6, 0.8), tracked=False)
    until(lambda: source.read(time.monotonic()) == [] and source.problem is not None, said=lambda: source.problem)
    assert "rigid body 'quad' is not tracked; there are: none" in source.problem
    server.make = lambda number: frame(number, (4.0, 2.0, 3.0), (0.0, 0.0, 0.6, 0.8))
    until(lambda: any(sample.position[0] == 4 for sample in source.read(time.monotonic())), said=lambda: source.problem)
    source.close()


def test_a_body_of_another_name_is_named(server: Server) -> None:
    source = opened(f"mocap:optitrack:{server.host}:drone")
    until(lambda: source.read(time.monotonic()) == [] and source.problem is not None, said=lambda: source.problem)
    assert "rigid body 'drone' is not tracked; there are: 'quad'" in source.problem
    source.close()


def test_a_client_that_dies_is_silent_and_says_so(server: Server) -> None:
    source = opened(f"mocap:optitrack:{server.host}:quad")
    os.kill(source._child.process.pid, signal.SIGKILL)
    until(
        lambda: source.read(time.monotonic()) is not None and "process has ended" in str(source.problem),
        said=lambda: source.problem,
    )
    assert source.read(time.monotonic()) == []
    source.close()
    source.close()


def test_the_client_s_own_errors_are_told() -> None:
    with pytest.raises(
        ValueError, match=r"mocap:optitrack:motive:quad: RuntimeError: .*; install the package motioncap"
    ):
        open_source("mocap:optitrack:motive:quad")


def test_a_system_that_does_not_answer_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(child, "OPENING", 0.5)
    with pytest.raises(ValueError, match=r"no answer within 0\.5 s; .*check that the system streams to this machine"):
        open_source("mocap:optitrack:127.0.0.1:quad")


def test_closing_ends_a_client_that_waits_for_a_frame(server: Server) -> None:
    source = opened(f"mocap:optitrack:{server.host}:quad")
    until(lambda: bool(source.read(time.monotonic())), said=lambda: source.problem)
    server.stop()
    source.close()
    assert source._child.process.returncode == 0


def test_the_client_ends_with_the_bridge_however_that_ends() -> None:
    code = (
        "import os, signal\n"
        "from e2efly.flight.pose.sources import open_source\n"
        "print(open_source('mocap:mock:localhost:quad')._child.process.pid, flush=True)\n"
        "os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == -signal.SIGKILL
    until(lambda: not running(int(done.stdout)))


def test_an_unknown_system_is_refused() -> None:
    with pytest.raises(ValueError, match="type is 'kinect'; accepted: vrpn, optitrack, vicon, qualisys"):
        open_source("mocap:kinect:localhost:quad")
