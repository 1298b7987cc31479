"""Colours of the AI Grand Prix's camera stream: JPEG images in numbered datagrams, decoded with OpenCV.

The layout is second-hand: from public descriptions of "AI Grand Prix, Virtual Qualifier Technical Specification",
VADR-TS-002 issue 00.02, section 4.6. The specification itself and its simulator were not at hand.
"""

from __future__ import annotations

import importlib
import math
import select
import socket
import struct
import time
from typing import Any

HEADER = struct.Struct("<IHHIIQ")
"""Before each part of an image: number of the image, of the part, number of parts, bytes of the whole JPEG and of this
part, time of the simulation, ns."""
LARGEST = 1 << 22
"""Largest JPEG, bytes."""
UNDER_WAY = 4
"""Images that may be incomplete at the same time. If there are more, the oldest is given up: a part was lost."""
LATE = 100
"""A part may belong to an image that is at most so many images older than the newest."""
FOCAL, SIZE = 320.0, (640, 360)
"""The camera: focal length and size, pixels."""
FOV = tuple(2 * math.atan(pixels / 2 / FOCAL) for pixels in SIZE)


def capture(output: Any, where: str) -> None:
    """Publish each complete image that comes to HOST:PORT of this machine.

    Raises:
        RuntimeError: the port is taken.
        ValueError: a complete image is no JPEG, or the sender begins anew.
    """
    cv2, numpy = importlib.import_module("cv2"), importlib.import_module("numpy")
    host, _, port = where.rpartition(":")
    parts, apart = JpegParts(), math.inf
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.bind((host, int(port)))
        except OSError as error:
            raise RuntimeError(f"{where}: {error.strerror or error}; accepted: a free port of this machine") from None
        while not output.speech.closing.is_set():
            if not select.select([line], [], [], 0.1)[0]:
                continue
            data, came = line.recv(1 << 16), time.monotonic()
            done = parts.take(data)
            if done is None:
                continue
            content, stamp = done
            image = cv2.imdecode(numpy.frombuffer(content, numpy.uint8), cv2.IMREAD_COLOR)
            if image is None:
                raise ValueError(f"{where}: a complete image is no JPEG")
            apart = min(apart, came - stamp)  # by the fastest so far
            colours = cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
            output.put(stamp + apart, colours.tobytes(), colours.shape, "uint8", FOV, f"OpenCV {cv2.__version__}")


class JpegParts:
    """Puts the parts of images together, in whatever order they come."""

    def __init__(self) -> None:
        self._open: dict[int, dict[int, bytes]] = {}
        self._newest = -1

    def take(self, data: bytes) -> tuple[bytes, float] | None:
        """One datagram. Returns the JPEG and its time, s on the sender's clock, if it is complete and newer than the
        last. What is no part of an image is left out.

        Raises:
            ValueError: the numbers begin anew, and so may the sender's clock.
        """
        if len(data) < HEADER.size:
            return None
        image, part, count, whole, size, stamp = HEADER.unpack_from(data)
        if not (part < count and size == len(data) - HEADER.size and 0 < whole <= LARGEST):
            return None
        if image <= self._newest:
            if self._newest - image > LATE:
                raise ValueError("the numbers of its images begin anew: open it again")
            return None
        found = self._open.setdefault(image, {})
        found[part] = data[HEADER.size :]
        if len(found) < count or sum(map(len, found.values())) != whole:
            while len(self._open) > UNDER_WAY:
                del self._open[min(self._open)]
            return None
        self._newest = image
        self._open = {number: parts for number, parts in self._open.items() if number > image}
        return b"".join(found[i] for i in range(count)), 1e-9 * stamp
