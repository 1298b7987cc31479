"""A live flight: its records to Foxglove, ROS 1, ROS 2, an MCAP file or a bag, each through its own process.

The control loop puts a record into a socket that buffers a megabyte, and never waits for it. What a process, its
subscribers or its disk do not take in time is dropped and counted.
"""

import math
import os
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from e2efly.control import Quat
from e2efly.flight.child import ROS_PYTHON, first_opened, pythons
from e2efly.flight.outlet import Outlet
from e2efly.flight.scripts.shared_images import AT_SEQUENCE, AT_SLOTS
from e2efly.flight.sight.quality import SeenImages
from e2efly.flight.sight.shared import SharedImages
from e2efly.logs.channels import CHANNELS, json_schema
from e2efly.logs.mcap_file import encode
from e2efly.policy.images import Image

FORMS = "foxglove[:[HOST:]PORT], ros1[:/PREFIX], ros2[:/PREFIX], mcap:FILE.mcap, bag:FILE.bag"
"""How outlets are written."""
PORT = 8765
"""Port of Foxglove."""
PREFIX = "/e2efly"
"""Prefix of topics."""
THIS_PYTHON = "E2EFLY_LIVE_PYTHON"
"""Environment variable that names an interpreter for all kinds except ROS."""
ADVICE = {
    "foxglove": "pip install 'e2efly[live]'",
    "ros1": "install rospy (Debian: apt-get install python3-rospy python3-nav-msgs python3-geometry-msgs "
    f"python3-sensor-msgs) and have roscore running, or name an interpreter that has it in {ROS_PYTHON}",
    "ros2": f"pip install 'e2efly[ros2]', or name an interpreter that has rclpy in {ROS_PYTHON}",
    "mcap": "pip install 'e2efly[ros]'",
    "bag": "pip install 'e2efly[ros]'",
}
"""What to do if a kind does not open."""
_FORMS = {"depth": "32FC1", "range": "32FC1", "mask": "mono8", "rgb": "rgb8", "normal": "rgb8"}


@dataclass(frozen=True)
class PublishTarget:
    """A destination for a flight's records."""

    text: str
    """The text as it was written."""
    kind: str
    """A key of `ADVICE`."""
    settings: dict[str, Any]
    """What this kind needs to know."""


def targets_of(texts: Sequence[str]) -> tuple[PublishTarget, ...]:
    """Parse the texts of `--live`. Nothing is opened.

    Raises:
        ValueError: naming the text and what is accepted.
    """
    found = tuple(_target(text) for text in texts)
    for i, target in enumerate(found):
        if any((target.kind, target.settings) == (other.kind, other.settings) for other in found[:i]):
            raise ValueError(f"--live {target.text} is given twice; accepted: each once")
    return found


def _target(text: str) -> PublishTarget:
    kind, colon, where = text.partition(":")
    refused = ValueError(f"--live is {text!r}; accepted: {FORMS}")
    if kind not in ADVICE or (colon and not where):
        raise refused
    if kind == "foxglove":
        host, _, port = where.rpartition(":")
        if where and not (port.isascii() and port.isdigit() and int(port) <= 65535):
            raise refused
        return PublishTarget(text, kind, {"host": host.strip("[]") or "127.0.0.1", "port": int(port or PORT)})
    if kind in ("ros1", "ros2"):
        prefix = where.rstrip("/") if colon else PREFIX
        if prefix and not all(part.isascii() and part.isidentifier() for part in prefix[1:].split("/")):
            raise ValueError(f"--live is {text!r}; accepted: a prefix from the root, such as {kind}:{PREFIX}")
        if prefix and not prefix.startswith("/"):
            raise ValueError(f"--live is {text!r}; accepted: a prefix from the root, such as {kind}:{PREFIX}")
        return PublishTarget(text, kind, {"prefix": prefix})
    if Path(where).suffix != f".{kind}":
        raise ValueError(f"--live is {text!r}; accepted: {kind}: and a file that ends in .{kind}")
    if Path(where).exists():
        raise ValueError(f"--live {text}: the file exists already; accepted: a new one")
    return PublishTarget(text, kind, {"file": where})


class Live:
    """A `Log` that several processes publish. Only the first method waits for them or raises."""

    def __init__(self, targets: Sequence[PublishTarget], images: Sequence[Image] = ()) -> None:
        """Start the processes.

        Raises:
            ValueError: naming the target that does not open, why, and what to do.
        """
        self.say: Callable[[str], None] = lambda line: None
        """Called once for each process that ends in flight. It must not block. Set it before the flight."""
        self.outlets: list[Outlet] = []
        images = images if targets else ()
        self._images = opened = tuple(_Shown.of(image, i) for i, image in enumerate(images))
        shared = {shown.image.name: shown.layout() for shown in self._images}
        schemas = {name: json_schema(channel) for name, channel in CHANNELS.items()}
        wall = time.time_ns() - round(time.monotonic() * 1e9)  # setting the wall clock later does not matter
        try:
            for target in targets:
                config = {"kind": target.kind, "wall": wall, "images": shared, **target.settings}
                config |= {"schemas": schemas} if target.kind == "foxglove" else {}
                if "file" in config:
                    Path(config["file"]).parent.mkdir(parents=True, exist_ok=True)
                self.outlets.append(_opened(target, config))
        except BaseException:
            self.close()
            raise
        finally:
            for shown in opened:  # the processes have it open: it disappears when they end, in whatever way
                shown.memory.path.unlink(missing_ok=True)

    def record(self, channel: str, time: float, values: dict[str, Any]) -> None:
        """Hand a record to every process. A process without room does not get it."""
        try:
            data = encode([channel, time, values])
        except Exception:  # the flight's own log reports what was wrong with it
            return
        for outlet in self.outlets:
            if outlet.send(data):
                self.say(f"live {outlet.name}: {outlet.ended}; the flight goes on without it")

    def show(self, cameras: Sequence[SeenImages]) -> None:
        """Publish the images that the policy sees, if they are new. Call it after the sticks are sent."""
        for shown, seen in zip(self._images, cameras, strict=False):
            if seen.frame is not None and seen.frame.time != shown.last:
                shown.last = seen.frame.time
                shown.memory.publish(seen.frame.time, _drawn(shown.image, seen.frame.image))
                self.record("image", seen.frame.time, {"name": shown.image.name})

    @property
    def problems(self) -> list[str]:
        """The problems so far, for people."""
        return [f"{outlet.name}: {problem}" for outlet in self.outlets for problem in outlet.problems]

    def describe(self) -> list[str]:
        """Where each process publishes."""
        return [f"{outlet.name}: {outlet.detail}" for outlet in self.outlets]

    def close(self) -> None:
        """Let the processes publish what is waiting, and end. This takes a few seconds at most. May be called twice."""
        for outlet in self.outlets:
            outlet.close()
        for shown in self._images:
            shown.memory.close()
        self._images = ()


@dataclass
class _Shown:
    """An image of the policy that is published."""

    image: Image
    memory: SharedImages
    last: float | None = None

    @staticmethod
    def of(image: Image, number: int) -> "_Shown":
        dtype = "float32" if _FORMS[image.sees] == "32FC1" else "uint8"
        return _Shown(image, SharedImages(f"live_{os.getpid()}_{number}", image.shape, dtype))

    def layout(self) -> dict[str, Any]:
        """What a process needs to know to read and publish it."""
        layout = self.memory.layout
        step = layout.width * layout.channels * (4 if _FORMS[self.image.sees] == "32FC1" else 1)
        return {
            "path": str(self.memory.path), "sequence": AT_SEQUENCE, "slots": AT_SLOTS, "slot": layout.slot,
            "height": layout.height, "width": layout.width, "step": step, "encoding": _FORMS[self.image.sees],
            "frame": f"{self.image.name}_optical", "position": list(self.image.position_m),
            "quaternion": optical(self.image.pitch_rad),
            "fov": list(self.image.fov_rad) if self.image.projection == "pinhole" else None,
        }  # fmt: skip


def optical(pitch: float) -> list[float]:
    """The optical frame of a camera (x right, y down, z ahead) in the body frame, wxyz. `pitch` is that of the camera,
    downwards from straight ahead, rad.
    """
    down = Quat(math.cos(pitch / 2), 0.0, math.sin(pitch / 2), 0.0)
    return [float(part) for part in down.compose(Quat(0.5, -0.5, 0.5, -0.5)).stack()]


def _drawn(image: Image, values: np.ndarray) -> np.ndarray:
    """An image as ROS and Foxglove show it: in metres, or 0 to 255 for 0 to 1, and also for -1 to 1 of normals."""
    if _FORMS[image.sees] == "32FC1":
        return np.asarray(values, np.float32)
    low, high = image.limits
    return np.rint((np.clip(values, low, high) - low) * (255 / (high - low))).astype(np.uint8)


def _opened(target: PublishTarget, config: dict[str, Any]) -> Outlet:
    variable = ROS_PYTHON if target.kind in ("ros1", "ros2") else THIS_PYTHON
    return first_opened(pythons(variable), ADVICE[target.kind], lambda p: Outlet(target.text, p, config))
