"""Depth or colours of an Intel RealSense camera, through pyrealsense2."""

import sys

from e2efly.flight.sight.captured import Captured, field_of_view, open_captured
from e2efly.flight.sight.registry import register
from e2efly.policy.images import Image

ADVICE = 'install the package pyrealsense2 (pip install "e2efly[realsense]"; Debian: apt-get install libusb-1.0-0)'
"""What to do if it cannot be imported."""


@register("realsense", "realsense:[SERIAL]")
def open_realsense(text: str, image: Image) -> Captured:
    """Read the camera with this serial number, or the only camera: depth or colours, depending on what the policy sees.

    Raises:
        ValueError: for a camera that is not connected or does not give what the policy sees, or for a missing package.
    """
    serial, fov = field_of_view(text, f"realsense:{text}")
    return open_captured(f"realsense:{serial}", image, [sys.executable], ADVICE, serial, fov)
