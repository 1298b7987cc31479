"""Gives the images of shared memory to others, in a process of its own: `sight/give.py` starts it.

    give.py KIND NAME SEES REACH FOV WHERE...

NAME is that of the shared memory, SEES what the images show, REACH the largest depth, m, FOV the field of view as
`ACROSSxDOWN`, rad, and WHERE what the kind needs to know. Whoever reads too slowly misses images; the publisher never
waits. It writes the lines of `speech.py`.
"""

from __future__ import annotations

import importlib
import sys
from array import array
from contextlib import suppress
from typing import Any

LOOK_S = 0.001
"""Time between two looks for a new image, s."""
MILLIMETRES = 65.535
"""Largest depth that uint16 holds, m."""


class Given:
    """The images that are given."""

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
        """Where they come from: float32."""

    def type(self, exact: bool) -> str:
        """Of the values that are given: the least that holds them well."""
        if exact or self.sees == "normal":
            return "float32"
        if self.sees in ("depth", "range"):
            return "uint16" if self.reach <= MILLIMETRES else "float32"
        return "uint8"

    def values(self, raw: bytes, kind: str) -> bytes:
        """Values of float32 in another type: rounded to mm, or to 1/255."""
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
    """A kind: a function of a module beside this one, given the images and where they go."""

    def started(speech: Any, name: str, sees: str, reach: str, fov: str, *where: str) -> None:
        getattr(importlib.import_module(module), function)(Given(speech, name, sees, reach, fov), *where)

    return started


KINDS = {
    "tcp": run("give_tcp", "serve"),
    "ros1": run("give_ros", "give_ros1"),
    "ros2": run("give_ros", "give_ros2"),
}

if __name__ == "__main__":
    importlib.import_module("speech").main(KINDS, sys.argv[1:])
