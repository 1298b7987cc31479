"""Colours of a Video4Linux camera or FPV receiver, or of a video file, through OpenCV."""

import sys

from e2efly.flight.sight.captured import Captured, field_of_view, open_captured
from e2efly.flight.sight.registry import register
from e2efly.policy.images import Image

ADVICE = 'install the package OpenCV (pip install "e2efly[video]")'
"""What to do if it does not open."""


@register("v4l2", "v4l2:/dev/videoN?fov=ACROSSxDOWN")
def open_v4l2(text: str, image: Image) -> Captured:
    """Read a device, or a file at its own frame rate. The end of a file is treated like an unplugged camera. The path
    comes with the field of view in rad, because no device reports it: `/dev/video0?fov=1.2x0.9`. The camera of the
    policy's contract has to see colours.

    Raises:
        ValueError: for a policy that sees something else, a missing field of view, or a device that does not open.
    """
    path, fov = field_of_view(text, f"v4l2:{text}")
    if image.sees != "rgb":
        raise ValueError(f"image source v4l2:{text} gives colours; accepted: a policy that sees rgb, not {image.sees}")
    if not path or not fov:
        missing = "field of view" if path else "path"
        raise ValueError(
            f"image source v4l2:{text} has no {missing}; accepted: v4l2:PATH?fov=ACROSSxDOWN, each in rad; or "
            "v4l2:PATH?fov=policy, where it is that of the policy's camera"
        )
    return open_captured(f"v4l2:{path}", image, [sys.executable], ADVICE, path, fov)
