"""What real Betaflight firmware answered, as `record_msp` recorded it."""

import json
from pathlib import Path
from typing import Any

from e2efly.flight.betaflight.codec import Decoder

GOLDEN: dict[str, Any] = json.loads((Path(__file__).parents[1] / "data" / "msp_golden.json").read_text())
REPLIES = {
    int(version): {int(code): bytes.fromhex(data) for code, data in replies.items()}
    for version, replies in GOLDEN["replies"].items()
}
"""Bytes of each reply, by version of MSP and code."""
UNKNOWN = bytes.fromhex(GOLDEN["unknown"])
"""The answer to a code that the firmware does not know."""


def payload(data: bytes | str) -> bytes:
    """The payload of recorded bytes."""
    (frame,) = Decoder().feed(bytes.fromhex(data) if isinstance(data, str) else data)
    return frame.payload
