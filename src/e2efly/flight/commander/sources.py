"""Where commands come from: `e2efly fly --commands TEXT`."""

from typing import Any

from e2efly.config.registry import check_methods, load, referenced
from e2efly.flight.commander.command import WHAT, parse_command
from e2efly.flight.commander.commander import CommandSource
from e2efly.flight.pose.registry import METHODS, MalformedError
from e2efly.flight.pose.sources.ros import open_ros
from e2efly.flight.pose.sources.udp import UdpSource, address_of

FORMS = (
    "udp:PORT; udp:HOST:PORT, with HOST an address of this machine; ros1:/topic; ros2:/topic; or "
    "path/to/file.py:Name[:...]"
)
"""How sources are written."""


def open_commands(text: str) -> CommandSource:
    """Open a source of commands, given as `FORMS` says. Without a HOST, it listens at 127.0.0.1.

    Raises:
        ValueError: naming the text and what is accepted. Also for a port that is taken. For a package that is not
            installed or a peer that does not answer, it says what to do.
    """
    kind, _, where = text.partition(":")
    source: Any
    if kind == "udp":
        try:
            host, port = address_of(where)
        except MalformedError:
            raise ValueError(f"--commands is {text!r}; accepted: {FORMS}") from None
        return UdpSource(host, port, parse_command, WHAT, tells_sender=True)
    if kind in ("ros1", "ros2"):
        return open_ros(int(kind[3:]), where, parse_command, WHAT)
    if found := referenced(text):
        source = load(found[0])(found[1])
        check_methods(source, METHODS)
        return source
    raise ValueError(f"--commands is {text!r}; accepted: {FORMS}")
