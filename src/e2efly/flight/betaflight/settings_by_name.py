"""Settings that have no message of their own. They are requested by their names in the command line.

Only some firmware answers such a request. A reply is the text `name = value`. The firmware writes it to a buffer that
is as long as the request, so a request is the name followed by enough zeros for the value. A request that contains `=`
would change the setting, but a name never contains it.
"""

from e2efly.flight.betaflight.client import Client, ask
from e2efly.flight.betaflight.messages import text
from e2efly.flight.clock import MONOTONIC, Clock

CODE = 0x3010
"""Code of the message, of MSP version 2."""
NAMES = ("mixer_type", "msp_override_failsafe", "max_aux_channels", "serial_update_rate_hz")
"""The settings that matter to a flight and that no other message contains."""
_ROOM = 32
"""Number of bytes for ` = ` and the value."""


def request(name: str) -> bytes:
    """The payload of a request for a setting."""
    return name.encode("ascii") + bytes(_ROOM)


def value_of(name: str, payload: bytes) -> str:
    """The value in a reply.

    Raises:
        ValueError: the reply is about another setting, or has no value.
    """
    said, _, value = text(payload).partition(" = ")
    if said != name or not value:
        raise ValueError(f"MSP CLI_SETTING: {text(payload)!r} answers for {name}; accepted: '{name} = ...'")
    return value


def read(client: Client, timeout_s: float = 1.0, clock: Clock = MONOTONIC) -> tuple[tuple[str, str], ...]:
    """(name, value) of each of `NAMES` that the controller knows and reports.

    Raises:
        TimeoutError: a reply is missing after `timeout_s` seconds.
    """
    return tuple(pair for name in NAMES for pair in _told(client, name, timeout_s, clock))


def _told(client: Client, name: str, timeout_s: float, clock: Clock) -> list[tuple[str, str]]:
    try:
        return [(name, value_of(name, ask(client, CODE, timeout_s, request(name), clock)))]
    except ValueError:  # the firmware was built without its command line, or without this setting
        return []
