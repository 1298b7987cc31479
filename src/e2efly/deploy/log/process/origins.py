"""Which requests a server may answer that a browser can reach.

A browser lets every web site send requests to this machine's own addresses, and reveals the site in the header
`Origin`. A site can also make its own name resolve to this machine ("DNS rebinding"), and then the header `Host` has that
name. Programs other than browsers send no `Origin`. Needs only Python (3.8 or newer), as the scripts beside it do.
"""

from __future__ import annotations

import asyncio
import ipaddress
import secrets
import socket
import threading
from contextlib import suppress
from typing import Sequence  # noqa: UP035  # Python 3.8
from urllib.parse import urlsplit

PATIENCE_S = 5.0
"""The longest time for a request to arrive, and at the end for the last bytes to leave, s."""
CHUNK = 1 << 16
"""The largest number of bytes that are passed on at once, and the longest request."""
REFUSED = "HTTP/1.1 403 Forbidden\r\nContent-Type: text/plain; charset=utf-8\r\nConnection: close\r\n\r\n"


def refusal(hosts: Sequence[str], origins: Sequence[str], host: str, sites: Sequence[str] | None = None) -> str:
    """Why a request is refused, or an empty text if it is accepted.

    Args:
        hosts: the values of its headers `Host`.
        origins: the values of its headers `Origin`.
        host: the address that the user gave to the server.
        sites: the origins that are accepted besides those on this machine. None: only the server's own pages are.
    """
    if len(hosts) != 1 or not _ours(_name(f"//{hosts[0]}"), host):
        return f"the Host is {', '.join(hosts)!r}; accepted: an IP address, localhost, or the address of the server"
    if not origins:
        return ""
    here = {f"http://{hosts[0]}", f"https://{hosts[0]}"}
    if len(origins) == 1:
        origin = origins[0].lower()
        if origin in {each.lower() for each in here}:
            return ""
        if sites is not None and (origin in sites or (origin.startswith("http") and _loopback(_name(origin)))):
            return ""
    accepted = f"http://{hosts[0]}" if sites is None else ", ".join(["a page of this machine", *sites])
    return f"the Origin is {', '.join(origins)!r}; accepted: {accepted}"


def _name(address: str) -> str:
    """The host's name in an address, empty if there is none."""
    try:
        return urlsplit(address).hostname or ""
    except ValueError:
        return ""


def _ours(name: str, host: str) -> bool:
    """Whether a name cannot be that of a web site: an IP address, this machine, or what the user gave."""
    with suppress(ValueError):
        return bool(ipaddress.ip_address(name))
    return name in ("localhost", host.lower())


def _loopback(name: str) -> bool:
    with suppress(ValueError):
        return ipaddress.ip_address(name).is_loopback
    return name == "localhost"
