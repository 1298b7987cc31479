"""Images from `e2efly hil` on another computer."""

import sys

from e2efly.flight.sight.captured import Captured, open_captured
from e2efly.flight.sight.registry import register
from e2efly.policy.images import Image

ADVICE = "start e2efly hil with --image IMAGE=tcp:PORT and --host there first"
"""What to do if it does not open."""


@register("hil", "hil:HOST:PORT")
def open_hil(text: str, image: Image) -> Captured:
    """Receive the image stream of a HIL node at HOST:PORT. Exposure times are given on this computer's clock.

    Raises:
        ValueError: for another text, or if no server answers there.
    """
    host, _, port = text.rpartition(":")
    if not host or not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535):
        raise ValueError(f"image source is hil:{text}; accepted: hil:HOST:PORT, with a port of 1 to 65535")
    return open_captured(f"hil:{text}", image, [sys.executable], ADVICE, text)
