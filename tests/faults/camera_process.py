"""A capture process whose camera is a socket of the test: as process/capture.py, with nothing else changed.

camera_process.py socket NAME SEES FOV PATH
"""

import importlib
import socket
import struct
import sys
from typing import Any

from e2efly.flight.child import SCRIPTS

FRAME = struct.Struct("<d2I")
"""Before an image: its time, s, and its rows and columns; float32 values follow."""


def capture(speech: Any, name: str, sees: str, fov: str, path: str) -> None:
    """Publish what comes until the socket is closed, as a camera's cable is pulled."""
    output = importlib.import_module("capture").ImageOutput(speech, name, sees, fov)
    with socket.socket(socket.AF_UNIX) as link:
        link.connect(path)
        stream = link.makefile("rb")
        while head := stream.read(FRAME.size):
            time, height, width = FRAME.unpack(head)
            output.put(time, stream.read(4 * height * width), (height, width), "float32", None, "a socket")
    raise RuntimeError("the camera is unplugged")


if __name__ == "__main__":
    sys.path.insert(0, str(SCRIPTS))
    importlib.import_module("speech").main({"socket": capture}, sys.argv[1:])
