"""Links over real pseudo-terminals and real TCP sockets, with peers that drop, stall and vanish."""

import itertools
import os
import socket
from collections.abc import Iterator
from pathlib import Path
from unittest.mock import Mock

import pytest

from e2efly.flight.link import MAX_UNSENT, RETRY_S, StreamLink, open_link
from tests.waiting import until


def gather(link: StreamLink, size: int) -> bytes:
    data = bytearray()
    until(lambda: data.extend(link.receive()) or len(data) >= size)
    return bytes(data)


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(10.0)
        yield listener


def tcp(server: socket.socket) -> tuple[StreamLink, socket.socket]:
    link = open_link(f"tcp:127.0.0.1:{server.getsockname()[1]}")
    link.poll(0.0)
    peer = server.accept()[0]
    until(lambda: link.poll(0.0) or link.alive)
    return link, peer


@pytest.fixture
def terminal() -> Iterator[tuple[int, str]]:
    """Its master and the path of its slave."""
    master, slave = os.openpty()
    yield master, os.ttyname(slave)
    os.close(master)
    os.close(slave)


def test_serial_both_ways(terminal: tuple[int, str]) -> None:
    master, slave = terminal
    link = open_link(f"serial:{slave}?baud=57600")
    assert not link.alive
    link.poll(0.0)
    assert link.alive and link.reason == "" and link.connections == 1
    assert link.receive() == b""
    every = bytes(range(256))  # raw: no byte is a control character
    link.send(every)
    assert os.read(master, 300) == every
    os.write(master, every)
    assert gather(link, 256) == every
    link.close()


def test_serial_bare_path_and_exclusive(terminal: tuple[int, str]) -> None:
    first, second = (open_link(terminal[1]) for _ in range(2))
    first.poll(0.0)
    second.poll(0.0)
    assert first.alive and not second.alive
    assert "lock" in second.reason.lower()
    first.close()
    second.poll(RETRY_S + 0.01)
    assert second.alive
    second.close()


def test_serial_device_that_vanishes_and_comes_back(tmp_path: Path) -> None:
    device = tmp_path / "tty"
    master, slave = os.openpty()
    device.symlink_to(os.ttyname(slave))
    link = open_link(f"serial:{device}")
    link.poll(0.0)
    os.close(slave)
    os.close(master)
    until(lambda: link.receive() == b"" and not link.alive)
    assert str(device) in link.reason
    link.send(b"lost")  # no harm
    device.unlink()
    link.poll(1.0)
    link.poll(2.0)
    assert not link.alive and "No such file" in link.reason
    master, slave = os.openpty()
    device.symlink_to(os.ttyname(slave))
    link.poll(10.0)
    assert link.alive and link.connections == 2
    link.send(b"again")
    assert os.read(master, 100) == b"again"
    link.close()
    os.close(master)
    os.close(slave)


def test_serial_that_takes_nothing_breaks_instead_of_blocking(terminal: tuple[int, str]) -> None:
    link = open_link(terminal[1])
    link.poll(0.0)
    for _ in range(200):
        link.send(bytes(1000))
    assert not link.alive
    assert "stalled" in link.reason


def test_tcp_both_ways(server: socket.socket) -> None:
    link, peer = tcp(server)
    with peer:
        link.send(b"hello")
        assert peer.recv(10) == b"hello"
        peer.sendall(b"world")
        assert gather(link, 5) == b"world"
        assert link.receive() == b""
        link.close()
        link.close()
        link.poll(99.0)
        assert not link.alive


def test_tcp_peer_that_drops_is_found_again(server: socket.socket) -> None:
    link, peer = tcp(server)
    peer.sendall(b"last")
    peer.close()
    assert gather(link, 4) == b"last"
    until(lambda: link.receive() == b"" and not link.alive)
    assert "closed the connection" in link.reason
    link.poll(1.0)  # notes the break
    link.poll(1.0 + RETRY_S / 2)
    assert link.connections == 1
    link.poll(1.01 + RETRY_S)
    with server.accept()[0]:
        until(lambda: link.poll(1.1 + RETRY_S) or link.alive)
        assert link.connections == 2 and link.reason == ""
        link.close()


def test_tcp_nobody_there_is_tried_again_and_again(server: socket.socket) -> None:
    port = server.getsockname()[1]
    server.close()
    link = open_link(f"tcp:127.0.0.1:{port}")
    attempts, now = [], 0.0
    opener = link.opener

    def counted() -> object:
        attempts.append(now)
        return opener()

    link.opener = counted  # type: ignore[assignment]
    while now < 10.0:
        link.poll(now)
        now += 0.01
    assert not link.alive
    assert "refused" in link.reason
    waits = [b - a for a, b in itertools.pairwise(attempts)]
    assert max(waits) <= RETRY_S + 0.02  # what came back after a long time is found as soon
    link.close()


def test_tcp_peer_that_stalls_breaks_the_link_instead_of_blocking(server: socket.socket) -> None:
    link, peer = tcp(server)
    with peer:
        for _ in range(100_000):
            link.send(bytes(1000))
            if not link.alive:
                break
        assert not link.alive
        assert "stalled" in link.reason
        assert MAX_UNSENT < 5000


def test_attempt_without_answer_is_given_up() -> None:
    link = StreamLink("silent", lambda: Mock(**{"connected.return_value": False}))
    link.poll(0.0)
    link.poll(1.9)
    assert link.reason == "not polled yet"
    link.poll(2.1)
    assert "no answer" in link.reason


@pytest.mark.parametrize(
    "text",
    [
        "", "tpc:1.2.3.4:5", "udp:h", "tcp:127.0.0.1",
        "tcp::5", "tcp:h:0", "tcp:h:99999", "tcp:h:x", "serial:", "ttyUSB0",
        "serial:/dev/x?baud=fast", "serial:/dev/x?baud=0", "serial:/dev/x?bauds=9600", "tcp:no.such.host.invalid:5",
    ],
)  # fmt: skip
def test_other_texts_are_refused_with_what_is_accepted(text: str) -> None:
    with pytest.raises(
        ValueError,
        match=r"serial:/dev/ttyACM0\?baud=115200, /dev/ttyACM0, tcp:HOST:PORT, udp:HOST:PORT or udpout:HOST:PORT",
    ):
        open_link(text)
