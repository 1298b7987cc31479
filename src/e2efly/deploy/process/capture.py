"""Takes the images of a camera and publishes them in shared memory: `sight/capture.py` starts it.

It runs as a script in a process of its own: drivers of cameras block, start threads and can crash, and none of that may
happen in the control loop. It needs nothing but Python (3.8 or newer) and the package that it speaks for, so that any
interpreter which has that package can run it, such as the system's for ROS.

    capture.py KIND NAME SEES FOV WHERE

NAME is that of the shared memory, SEES what the policy sees, FOV the field of view as `ACROSSxDOWN` in rad, `policy`
for that of the policy's camera, or empty for what the source says of itself, and WHERE what the kind needs to know. It
writes the lines of `speech.py`; it is ready when the first image is published.
"""

from __future__ import annotations

import importlib
import sys
import time
from typing import Any

OTHER_CLOCK_S = 10.0
"""A first image whose stamp is farther from now, s, was stamped by another clock."""


class Output:
    """Where a kind puts its images."""

    def __init__(self, speech: Any, name: str, sees: str, fov: str) -> None:
        """Nothing is published until the first image comes, as nothing is known of it."""
        self.speech, self.sees = speech, sees
        self.fov: tuple[float, float] | None = None
        """What was given; None: that of the source."""
        if fov:
            across, _, down = (fov if fov != "policy" else "0x0").partition("x")
            self.fov = float(across), float(down)
        self._name, self._publisher = name, None
        speech.leave = self._leave

    def put(self, moment: float, values: Any, shape: tuple[int, ...], kind: str, fov: Any, detail: str) -> None:
        """Publish an image.

        Args:
            moment: of the exposure, s on the monotonic clock.
            values: bytes, little-endian, row by row.
            shape: (h, w) or (h, w, 3).
            kind: of the values: float32, uint8, uint16.
            fov: what the source says of its field of view, rad; what was given counts.
            detail: said of the source when the first image is there.

        Raises:
            ValueError: when it is not like the first.
        """
        shared = importlib.import_module("shared_images")
        layout = shared.Layout.wanted(tuple(shape), kind, self.fov or fov)
        if self._publisher is None:
            self._publisher = shared.Publisher(self._name, layout)
            self._publisher.put(moment, values)
            self.speech.say("ready", detail)
            return
        if layout != self._publisher.layout:
            raise ValueError(f"its images have become {layout}; they were {self._publisher.layout}")
        self._publisher.put(moment, values)

    def _leave(self) -> None:
        """Nobody else knows the name."""
        if self._publisher is not None and self._publisher.path.exists():
            self._publisher.path.unlink()


class Stamps:
    """Stamps of the wall clock as times on the monotonic clock.

    The first decides: one that is none, or far from now, is of another clock, and then the arrival counts. A clock that
    jumps later is seen as such by who checks the images.
    """

    def __init__(self, speech: Any, what: str) -> None:
        """Nothing is decided yet; `what` is stamped, for people."""
        self._speech, self._what = speech, what
        self._believed: bool | None = None

    def moment(self, stamp: float) -> float:
        """When something was exposed that comes now, s on the monotonic clock.

        Args:
            stamp: on the wall clock, s; 0: there is none.
        """
        age = time.time() - stamp
        if self._believed is None:
            self._believed = stamp > 0 and abs(age) < OTHER_CLOCK_S
            if not self._believed:
                said = f"are {age:.0f} s from this computer's clock" if stamp > 0 else "are zero"
                self._speech.say("problem", f"stamps of {self._what} {said}: the times of arrival are taken")
        return time.monotonic() - (age if self._believed else 0.0)


def run(module: str, function: str) -> Any:
    """A kind: a function of a module, mostly of one beside this one, given an output and where the images are from."""

    def started(speech: Any, name: str, sees: str, fov: str, where: str) -> None:
        getattr(importlib.import_module(module), function)(Output(speech, name, sees, fov), where)

    return started


KINDS = {
    "hil": run("capture_hil", "capture"),
    "ros1": run("capture_ros", "capture_ros1"),
    "ros2": run("capture_ros", "capture_ros2"),
    "v4l2": run("capture_video", "capture"),
    "realsense": run("capture_realsense", "capture"),
    "mask": run("e2efly.deploy.sight.mask", "capture"),
}

if __name__ == "__main__":
    importlib.import_module("speech").main(KINDS, sys.argv[1:])
