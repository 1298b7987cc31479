"""Publishes a flight's records, as they come, to Foxglove, ROS 1, ROS 2, an MCAP file or a bag.

It runs as a script in a process of its own, as what it speaks to may stall, crash, start threads and handle signals,
and none of that may happen in the control loop. It needs nothing but Python (3.8 or newer) and the package that it
speaks for, so that any interpreter which has that package can run it, such as the system's for ROS 1.

Its standard input is a socket of datagrams, each a record in JSON, `[CHANNEL, TIME, VALUES]`, or, where an image has
come into shared memory, `["image", TIME, {"name": NAME}]`. Lines that it writes: `ready TEXT` once or `failed TEXT`
instead, `problem TEXT` for what could not be published, and at its end `lost NUMBER`, the records that it had no time
for. It ends when its input does, that is with the bridge, however that ends, and then closes what it writes in order.
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
"""Most records that wait for whom they are for."""
LONGEST = 1 << 22
"""Longest record, bytes."""
FLUSH_PERIOD = 0.5
"""How often files are written out, s."""
PROBLEMS = 20
"""Most problems that are told; their lines fit into a pipe that nobody reads."""


class SharedImage:
    """The newest image of a camera in shared memory: docs/image-sources.md."""

    def __init__(self, layout: dict[str, Any]) -> None:
        self.layout, self._last = layout, 0
        with open(layout["path"], "rb") as file:  # noqa: PTH123
            self._memory = mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ)

    def read(self) -> tuple[float, bytes] | None:
        """When it was exposed, s, and its bytes; None: none that is new and whole."""
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
    """Publish until the input ends; `text` is JSON: what to open, and where the images are."""
    config = json.loads(text)
    lines = os.fdopen(os.dup(1), "w", errors="backslashreplace")
    os.dup2(2, 1)  # the packages print there, too
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
        os.nice(10)  # from here on the control loop comes first, where both have one core
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
        except Exception as error:  # of one record: the next may do
            problem = f"{type(error).__name__}: {error}"
            if problem not in told and len(told) < PROBLEMS:
                told.add(problem)
                say("problem", problem[:300])
    try:
        peer.close()
        say("lost", str(lost[0]))
    except Exception as error:
        say("problem", f"at the end: {type(error).__name__}: {error}")
    os._exit(0)  # without the packages' own farewells, which may hang


def make(config: dict[str, Any], put: Callable[[Any], None]) -> Any:
    """What a kind is published by. Each has `detail`, `write`, `show`, `flush` and `close`."""
    kind = config["kind"]
    if kind == "foxglove":
        return importlib.import_module("live_foxglove").Foxglove(config, put)
    if kind in ("ros1", "ros2"):
        return getattr(importlib.import_module("live_ros"), kind.title())(config)
    return getattr(importlib.import_module("live_files"), kind.title())(config)


if __name__ == "__main__":
    main(*sys.argv[1:])
