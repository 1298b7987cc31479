"""The camera stream of the AI Grand Prix, as public descriptions of its protocol have it."""

import sys

from e2efly.flight.sight.captured import Captured, open_captured
from e2efly.flight.sight.registry import register
from e2efly.flight.sight.sources.v4l2 import ADVICE
from e2efly.policy.images import Image


@register("aigp", "aigp:HOST:PORT")
def open_aigp(text: str, image: Image) -> Captured:
    """Receive JPEG images in datagrams at HOST:PORT of this machine (the simulator sends to 5600). The camera of the
    policy's contract has to see colours.

    Raises:
        ValueError: for a policy that sees something else, another text, or if no image comes.
    """
    if image.sees != "rgb":
        raise ValueError(f"image source aigp:{text} gives colours; accepted: a policy that sees rgb, not {image.sees}")
    host, _, port = text.rpartition(":")
    if not host or not (port.isascii() and port.isdigit() and 1 <= int(port) <= 65535):
        raise ValueError(f"image source is aigp:{text}; accepted: aigp:HOST:PORT, with a port of 1 to 65535")
    return open_captured(f"aigp:{text}", image, [sys.executable], ADVICE, text)
