"""Serves the images of shared memory to other programs, in a separate process. `sight/give.py` starts it.

    give.py KIND NAME SEES REACH FOV WHERE...

KIND is the way in which the images are served, a key of `KINDS`. NAME is the name of the shared memory. SEES is what
the images show. REACH is the largest depth, m. FOV is the field of view as `ACROSSxDOWN`, rad. WHERE is what this kind
needs to know about the destination. A reader that is too slow misses images; the publisher never waits. The script
writes the lines of `speech.py`.
"""

from __future__ import annotations

import importlib
import sys
from array import array
from contextlib import suppress
from typing import Any

LOOK_S = 0.001
"""Time between two checks for a new image, s."""
MILLIMETRES = 65.535
"""Largest depth that uint16 holds, m."""


class Given:
    """The images that are served."""

    _numpy: Any = None

    def __init__(self, speech: Any, name: str, sees: str, reach: str, fov: str) -> None:
        """Open the shared memory."""
        with suppress(ImportError):  # the system's Python may lack it, with ROS
            self._numpy = importlib.import_module("numpy")
        self.speech, self.sees, self.reach = speech, sees, float(reach)
        across, _, down = fov.partition("x")
        self.fov = float(across), float(down)
        """Horizontal and vertical field of view, rad."""
        self.images = importlib.import_module("shared_reader").Reader(name)
        """The reader of the shared memory, whose values are float32."""

    def type(self, exact: bool) -> str:
        """The type of the values that are served: the smallest type that is precise enough, or float32 if `exact`."""
        if exact or self.sees == "normal":
            return "float32"
        if self.sees in ("depth", "range"):
            return "uint16" if self.reach <= MILLIMETRES else "float32"
        return "uint8"

    def values(self, raw: bytes, kind: str) -> bytes:
        """Convert values from float32 to another type: rounded to mm for uint16, or to 1/255 for uint8."""
        if kind == "float32":
            return raw
        scale, most = (1000.0, 65535) if kind == "uint16" else (255.0, 255)
        numpy = self._numpy
        if numpy is None:
            whole = [min(max(round(scale * x), 0), most) for x in array("f", raw)]
            return array({"uint16": "H", "uint8": "B"}[kind], whole).tobytes()
        numbers = numpy.rint(numpy.frombuffer(raw, "<f4") * scale).clip(0, most)
        return numbers.astype({"uint16": "<u2", "uint8": "u1"}[kind]).tobytes()


def run(module: str, function: str) -> Any:
    """A kind: a function of a module in the same folder, which is called with the images and with their destination."""

    def started(speech: Any, name: str, sees: str, reach: str, fov: str, *where: str) -> None:
        getattr(importlib.import_module(module), function)(Given(speech, name, sees, reach, fov), *where)

    return started


KINDS = {"tcp": run("give_tcp", "serve"), "ros1": run("give_ros", "give_ros1"), "ros2": run("give_ros", "give_ros2")}

if __name__ == "__main__":
    importlib.import_module("speech").main(KINDS, sys.argv[1:])
