"""Requests from other web sites: every server that a browser can reach refuses them."""

import socket
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import pytest

from e2efly.flight.publish import Live, targets_of
from e2efly.validation.processes import free_port
from e2efly.viewing.watch import viewer
from e2efly.viewing.watch.waiting import asked_for


@contextmanager
def viser_page() -> Iterator[int]:
    """The viewer's page."""
    server = viewer.serve("127.0.0.1", 0, "test")
    try:
        yield server.get_port()
    finally:
        server.stop()


@contextmanager
def waiting_page() -> Iterator[int]:
    """The page that waits for a browser, again and again."""
    port, over = free_port(), threading.Event()
    waiting = threading.Thread(target=lambda: [asked_for("127.0.0.1", port, over.is_set) for _ in range(20)])
    waiting.start()
    try:
        yield port
    finally:
        over.set()
        waiting.join()


@contextmanager
def foxglove() -> Iterator[int]:
    """A live flight's server."""
    live = Live(targets_of(["foxglove:0"]))
    try:
        yield int(live.outlets[0].detail.rpartition(":")[2])
    finally:
        live.close()


def status(port: int, *headers: str) -> int:
    """The status that a server answers to the start of a WebSocket with these headers."""
    said = [
        "GET / HTTP/1.1", "Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==", "Sec-WebSocket-Protocol: viser-v0, foxglove.sdk.v1", *headers,
    ]  # fmt: skip
    for _ in range(50):
        try:
            with socket.create_connection(("127.0.0.1", port), timeout=10) as link:
                link.sendall("\r\n".join([*said, "", ""]).encode())
                return int(link.makefile("rb").readline().split()[1])
        except ConnectionError:  # between two waiting pages
            threading.Event().wait(0.05)
    raise AssertionError("nobody answers")


@pytest.mark.parametrize(("opened", "good"), [(viser_page, 101), (waiting_page, 200), (foxglove, 101)])
def test_other_sites_and_foreign_names_are_refused(opened: Callable[..., Iterator[int]], good: int) -> None:
    with opened() as port:
        here = f"Host: 127.0.0.1:{port}"
        assert status(port, here) == good  # not a browser
        assert status(port, here, f"Origin: http://127.0.0.1:{port}") == good
        assert status(port, f"Host: LOCALHOST:{port}", f"Origin: http://localhost:{port}") == good
        assert status(port, f"Host: 10.1.2.3:{port}") == good  # forwarded; no site has a number for a name
        for origin in ("null", "http://site.example", f"http://127.0.0.1.site.example:{port}", "", "x://localhost",
                       "http://localhost.", "data:", "chrome-extension://localhost"):  # fmt: skip
            assert status(port, here, f"Origin: {origin}") == 403, origin
        for host in ("site.example", "127.0.0.1.site.example", "localhost.site.example", "", "127.1", "[::1"):
            assert status(port, f"Host: {host}", f"Origin: http://{host}") == 403, host
        assert status(port) in (400, 403)
        assert status(port, here, "Host: site.example") in (400, 403)
        assert status(port, here, f"Origin: http://127.0.0.1:{port}", "Origin: http://site.example") == 403
        # Pages that other programs of this machine serve may look at a flight, but not move the sliders.
        elsewhere = 101 if opened is foxglove else 403
        for origin in ("http://localhost:1", "https://app.foxglove.dev", "file://", "http://[::1]:8080"):
            assert status(port, here, f"Origin: {origin}") == elsewhere, origin


def test_a_viser_that_opens_its_server_otherwise_is_not_served(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("viser.ViserServer", lambda *_, **__: None)
    with pytest.raises(ValueError, match="cannot be checked"):
        viewer.serve("127.0.0.1", 0, "test")
