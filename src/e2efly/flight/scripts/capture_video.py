"""Colours of a V4L2 device or of a video file, read with OpenCV."""

from __future__ import annotations

import importlib
import time
from typing import Any

RECENT_S = 1.0
"""If a device's stamp is older than this, s, it does not come from the monotonic clock."""


def capture(output: Any, path: str) -> None:
    """Publish each image. The images of a file are published at the file's rate, and its end counts like an unplugged
    camera.

    Raises:
        RuntimeError: the device or the file cannot be opened, or gives no more images.
    """
    cv2 = importlib.import_module("cv2")
    device = path.startswith("/dev/")
    video = cv2.VideoCapture(path, cv2.CAP_V4L2 if device else cv2.CAP_FFMPEG)
    if not video.isOpened():
        raise RuntimeError(f"{path} cannot be opened; accepted: a camera's /dev/videoN or the file of a video")
    if device:
        video.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # only the newest image
    period = 1.0 / (video.get(cv2.CAP_PROP_FPS) or 30.0)
    began, count = time.monotonic(), 0
    while not output.speech.closing.is_set():
        there, image = video.read()
        if not there:
            end = "gives no more images: it is unplugged" if device else "has ended"
            raise RuntimeError(f"{path} {end}" if count else f"{path} gives no image")
        if device:
            now, stamp = time.monotonic(), 1e-3 * video.get(cv2.CAP_PROP_POS_MSEC)  # the driver's, on the same clock
            moment = stamp if now - RECENT_S < stamp <= now else now
        else:
            moment = began + count * period
            output.speech.closing.wait(max(moment - time.monotonic(), 0.0))
        colours = cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
        output.put(moment, colours.tobytes(), colours.shape, "uint8", None, f"OpenCV {cv2.__version__}")
        count += 1
    video.release()
