"""Which requests a server may answer that a browser can reach.

A browser lets every web site send requests to this machine's own addresses, and reveals the site in the header
`Origin`. A site can also make its own name resolve to this machine ("DNS rebinding"), and then the header `Host` has
that name. Programs other than browsers send no `Origin`. Needs only Python (3.8 or newer), as the scripts beside it do.
"""

from __future__ import annotations

import asyncio
import ipaddress
import secrets
import socket
import threading
from http.client import HTTPException, parse_headers
from io import BytesIO
from typing import Sequence  # noqa: UP035  # Python 3.8
from urllib.parse import urlsplit

PATIENCE_S = 5.0
"""The longest time for a request to arrive, s."""
CHUNK = 1 << 16
"""The longest head of a request, and the largest number of bytes that are passed on at once."""
REFUSED = "HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain; charset=utf-8\r\nConnection: close\r\n\r\n"


def refusal(hosts: Sequence[str], origins: Sequence[str], host: str, sites: Sequence[str] | None = None) -> str:
    """Why a request is refused. Empty: it is accepted.

    Args:
        hosts: the values of its headers `Host`.
        origins: the values of its headers `Origin`.
        host: the address that the user gave to the server.
        sites: origins that are accepted besides all pages of this machine. None: only the server's own page is.
    """
    name = _name(f"//{hosts[0]}") if len(hosts) == 1 else ""
    if not name or (_address(name) is None and name not in ("localhost", host.lower())):
        return f"Host is {', '.join(hosts)!r}; accepted: localhost, an IP address, or the address of this server"
    own = (f"http://{hosts[0].lower()}", f"https://{hosts[0].lower()}")
    if not origins or (len(origins) == 1 and origins[0].lower() in own):
        return ""
    if sites is None:
        return f"Origin is {', '.join(origins)!r}; accepted: {own[0]}"
    if len(origins) == 1 and (origins[0] in sites or _is_of_this_machine(origins[0])):
        return ""
    return f"Origin is {', '.join(origins)!r}; accepted: {', '.join(sites)}, or a page of this machine"


def _name(address: str) -> str:
    """The host in an address. Empty: there is none."""
    try:
        return urlsplit(address).hostname or ""
    except ValueError:
        return ""


def _address(name: str) -> ipaddress.IPv4Address | ipaddress.IPv6Address | None:
    """The IP address that a name is. None: it is a name that the owner of a web site may have chosen."""
    try:
        return ipaddress.ip_address(name)
    except ValueError:
        return None


def _is_of_this_machine(origin: str) -> bool:
    name = _name(origin)
    address = _address(name)
    return origin.startswith(("http://", "https://")) and (
        name == "localhost" or (address is not None and address.is_loopback)
    )


class Gate:
    """A server in front of another one that cannot check who asks. It passes on what `refusal` accepts.

    The server behind it gets a random address of this machine's 127.0.0.0/8, which no web site can guess.
    """

    def __init__(self, host: str, port: int, sites: Sequence[str]) -> None:
        """Open the port. Nothing is accepted before `begin`.

        Raises:
            OSError: for a port in use, and for an address that this machine does not have.
        """
        self._host, self._sites = host, sites
        self._socket = socket.create_server((host, port), family=socket.AF_INET6 if ":" in host else socket.AF_INET)
        self.port: int = self._socket.getsockname()[1]
        self.inside = f"127.{secrets.randbelow(254) + 1}.{secrets.randbelow(256)}.{secrets.randbelow(254) + 1}"
        """The address for the server behind it."""
        self._going: set[asyncio.Task[None]] = set()
        self._loop = asyncio.new_event_loop()

    def begin(self, port: int) -> None:
        """Pass requests on to a port of the server behind it, from a thread of its own."""
        opening = asyncio.start_server(lambda *ends: self._pass(port, *ends), sock=self._socket, limit=CHUNK)
        self._server = self._loop.run_until_complete(opening)
        threading.Thread(target=self._loop.run_forever, daemon=True, name="gate").start()

    def close(self, timeout: float) -> None:
        """Wait for the last bytes of a server that has ended, at most this long, s."""

        async def wait() -> None:
            if self._going:
                await asyncio.wait(self._going, timeout=timeout)

        asyncio.run_coroutine_threadsafe(wait(), self._loop).result()

    async def _pass(self, port: int, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._going.add(task)
        try:
            head = await asyncio.wait_for(reader.readuntil(b"\r\n\r\n"), PATIENCE_S)
            values = parse_headers(BytesIO(head.partition(b"\r\n")[2]))
            why = refusal(values.get_all("Host", []), values.get_all("Origin", []), self._host, self._sites)
            if why:
                writer.write((REFUSED + why).encode())
                await writer.drain()
                return
            there, to = await asyncio.open_connection(self.inside, port, limit=CHUNK)
            to.write(head)
            await asyncio.gather(_copy(reader, to), _copy(there, writer))
        except (TimeoutError, OSError, asyncio.IncompleteReadError, asyncio.LimitOverrunError, HTTPException):
            pass  # one of the two has gone, or what it sent is no request
        finally:
            self._going.discard(task)
            writer.close()


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """Pass bytes on until their sender ends."""
    try:
        while data := await reader.read(CHUNK):
            writer.write(data)
            await writer.drain()
    finally:
        writer.close()
