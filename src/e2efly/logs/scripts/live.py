"""Publishes the records of a flight while they come, to Foxglove, ROS 1, ROS 2, an MCAP file or a bag.

It runs as a script in a separate process, because the packages that it uses may stall, crash, start threads and handle
signals, and none of that may happen in the control loop. It needs only Python (3.8 or newer) and the package of its
kind. So any interpreter that has this package can run it, for example the system's Python for ROS 1.

Its standard input is a socket of datagrams. Each datagram is a record in JSON, `[CHANNEL, TIME, VALUES]`. When an image
has come into shared memory, it is `["image", TIME, {"name": NAME}]`. The script writes `ready TEXT` once, or
`failed TEXT` instead. It writes `problem TEXT` for what could not be published, and at its end `lost NUMBER`, the
number of records for which it had no time. It ends when its input ends, which is when the bridge ends in whatever way.
It then closes its files and connections properly.
"""

from __future__ import annotations

import importlib
import json
import mmap
import os
import queue
import socket
import struct
import sys
import threading
import time
from typing import Any, Callable  # noqa: UP035  # Python 3.8

WAITING = 10_000
"""The largest number of records that wait to be published. Further records are lost."""
LONGEST = 1 << 22
"""The longest record, bytes."""
FLUSH_PERIOD = 0.5
"""Period with which files are flushed, s."""
PROBLEMS = 20
"""The largest number of problems that are reported. So many lines fit into a pipe even if nobody reads it."""


class SharedImage:
    """Reads the newest image of a camera from shared memory, as described in docs/image-sources.md."""

    def __init__(self, layout: dict[str, Any]) -> None:
        self.layout, self._last = layout, 0
        with open(layout["path"], "rb") as file:  # noqa: PTH123
            self._memory = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)

    def read(self) -> tuple[float, bytes] | None:
        """The time of exposure of the newest image, s, and its bytes. None: there is no new and complete image."""
        for _ in range(3):
            (count,) = struct.unpack_from("<Q", self._memory, self.layout["sequence"])
            if count == self._last:
                return None
            at = self.layout["slots"] + (count % 2) * self.layout["slot"]
            begun, exposed = struct.unpack_from("<Qd", self._memory, at)
            data = self._memory[at + 16 : at + 16 + self.layout["step"] * self.layout["height"]]
            if begun == count == struct.unpack_from("<Q", self._memory, at)[0]:
                self._last = count
                return exposed, data
        return None


def main(text: str) -> None:
    """Publish until the input ends. `text` is JSON that says what to open and where the images are."""
    config = json.loads(text)
    lines = os.fdopen(os.dup(1), "w", errors="backslashreplace")
    os.dup2(2, 1)  # packages also print to the standard output
    waiting: queue.SimpleQueue[Any] = queue.SimpleQueue()
    lost, told = [0], set()

    def say(*words: str) -> None:
        lines.write(" ".join(words).replace("\n", " ") + "\n")
        lines.flush()

    def put(data: Any) -> None:
        if waiting.qsize() < WAITING:
            waiting.put(data)
        else:
            lost[0] += 1

    def receive() -> None:
        source = socket.socket(fileno=0)
        while True:
            data = source.recv(LONGEST)
            if not data:
                break
            put(data)
        waiting.put(None)

    def publish(data: Any) -> None:
        channel, when, values = data if isinstance(data, tuple) else json.loads(data)
        if channel == "image":
            seen = images[values["name"]].read()
            if seen is not None:
                peer.show(values["name"], config["wall"] + round(seen[0] * 1e9), seen[1])
        else:
            peer.write(channel, config["wall"] + round(when * 1e9), values)

    try:
        images = {name: SharedImage(layout) for name, layout in config["images"].items()}
        peer = make(config, put)
        say("ready", peer.detail)
        os.nice(10)  # from here on, the control loop has priority if both share one core
    except Exception as error:
        say("failed", f"{type(error).__name__}: {error}")
        os._exit(1)
    threading.Thread(target=receive, daemon=True).start()
    going, flushed = True, time.monotonic()
    while going:
        try:
            try:
                data = waiting.get(timeout=FLUSH_PERIOD)
                going = data is not None
                if going:
                    publish(data)
            except queue.Empty:
                pass
            if time.monotonic() - flushed > FLUSH_PERIOD:
                flushed = time.monotonic()
                peer.flush()
        except Exception as error:  # with one record; the next one may succeed
            problem = f"{type(error).__name__}: {error}"
            if problem not in told and len(told) < PROBLEMS:
                told.add(problem)
                say("problem", problem[:300])
    try:
        peer.close()
        say("lost", str(lost[0]))
    except Exception as error:
        say("problem", f"at the end: {type(error).__name__}: {error}")
    os._exit(0)  # without the packages' own clean-up, which may hang


def make(config: dict[str, Any], put: Callable[[Any], None]) -> Any:
    """The publisher of a kind. Every publisher has `detail`, `write`, `show`, `flush` and `close`."""
    kind = config["kind"]
    if kind == "foxglove":
        return importlib.import_module("live_foxglove").Foxglove(config, put)
    if kind in ("ros1", "ros2"):
        return getattr(importlib.import_module("live_ros"), kind.title())(config)
    return getattr(importlib.import_module("live_files"), kind.title())(config)


if __name__ == "__main__":
    main(*sys.argv[1:])
