"""Receives the images of a camera and publishes them in shared memory. `sight/capture.py` starts it.

It runs as a script in a separate process, because camera drivers block, start threads and can crash, and none of that
may happen in the control loop. It needs only Python (3.8 or newer) and the package of its image source. So any
interpreter that has this package can run it, for example the system's Python for ROS.

    capture.py KIND NAME SEES FOV WHERE

KIND is the kind of image source, a key of `KINDS`. NAME is the name of the shared memory. SEES is what the policy sees.
FOV is the field of view as `ACROSSxDOWN` in rad. If it is `policy`, it is that of the policy's camera; if it is empty,
it is what the source reports. WHERE is what this kind needs to find its source. The script writes the lines of
`speech.py`. It reports that it is ready when the first image is published.
"""

from __future__ import annotations

import importlib
import sys
import time
from typing import Any

OTHER_CLOCK_S = 10.0
"""If the stamp of the first image is farther from now than this, s, it comes from another clock."""


class ImageOutput:
    """Publishes the images that a kind of source delivers."""

    def __init__(self, speech: Any, name: str, sees: str, fov: str) -> None:
        """Publish nothing until the first image comes, because the layout of the images is not known before."""
        self.speech, self.sees = speech, sees
        self.fov: tuple[float, float] | None = None
        """The field of view that was given, rad. Zeros: that of the policy's camera. None: that of the source."""
        if fov:
            across, _, down = (fov if fov != "policy" else "0x0").partition("x")
            self.fov = float(across), float(down)
        self._name, self._publisher = name, None
        speech.leave = self._leave

    def put(self, moment: float, values: Any, shape: tuple[int, ...], kind: str, fov: Any, detail: str) -> None:
        """Publish an image.

        Args:
            moment: the time of the exposure, s on the monotonic clock.
            values: bytes, little-endian, row by row.
            shape: (h, w) or (h, w, 3).
            kind: the type of the values: float32, uint8, uint16.
            fov: the field of view that the source reports, rad. It is ignored if one was given at the start.
            detail: a description of the source, reported with the first image.

        Raises:
            ValueError: the layout of the image differs from that of the first one.
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
        """Remove the shared memory. No other process knows its name."""
        if self._publisher is not None and self._publisher.path.exists():
            self._publisher.path.unlink()


class Stamps:
    """Converts stamps of the wall clock to times on the monotonic clock.

    The first stamp decides. If it is zero or far from now, it comes from another clock, and the time of arrival is used
    from then on. If a clock jumps later, the check of the images detects it.
    """

    def __init__(self, speech: Any, what: str) -> None:
        """Nothing is decided yet. `what` names the stamped things in messages to people."""
        self._speech, self._what = speech, what
        self._believed: bool | None = None

    def moment(self, stamp: float) -> float:
        """When an image that arrives now was exposed, s on the monotonic clock. `stamp` is on the wall clock, s. 0:
        there is none.
        """
        age = time.time() - stamp
        if self._believed is None:
            self._believed = stamp > 0 and abs(age) < OTHER_CLOCK_S
            if not self._believed:
                said = f"are {age:.0f} s from this computer's clock" if stamp > 0 else "are zero"
                self._speech.say("problem", f"stamps of {self._what} {said}: the times of arrival are taken")
        return time.monotonic() - (age if self._believed else 0.0)


def run(module: str, function: str) -> Any:
    """A kind of source: a function of a module, which is called with an output and with the place of the images.

    Most of these modules are in the same folder.
    """

    def started(speech: Any, name: str, sees: str, fov: str, where: str) -> None:
        getattr(importlib.import_module(module), function)(ImageOutput(speech, name, sees, fov), where)

    return started


KINDS = {
    "hil": run("capture_hil", "capture"),
    "ros1": run("capture_ros", "capture_ros1"),
    "ros2": run("capture_ros", "capture_ros2"),
    "v4l2": run("capture_video", "capture"),
    "aigp": run("capture_aigp", "capture"),
    "realsense": run("capture_realsense", "capture"),
    "mask": run("e2efly.flight.sight.mask_source", "capture"),
}

if __name__ == "__main__":
    importlib.import_module("speech").main(KINDS, sys.argv[1:])
