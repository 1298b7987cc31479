"""The recording of `e2efly hil`: an MCAP file with images, poses, latencies and collisions, from another process."""

import json
import os
import socket
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from e2efly.flight.child import Child
from e2efly.policy.images import Image


class Recorder:
    """A process that records. Messages that it cannot take at once are dropped, so sending never waits."""

    def __init__(self, path: Path, images: Sequence[Image], names: Sequence[str]) -> None:
        """Start the process. The file is new, and its name ends in .mcap. `names` are those of the shared memory of
        each image.

        Raises:
            ValueError: naming the file and what is accepted.
        """
        if path.suffix != ".mcap" or path.exists():
            raise ValueError(f"--record is {path}; accepted: a new file whose name ends in .mcap")
        path.parent.mkdir(parents=True, exist_ok=True)
        self.dropped = 0
        """Messages that were not taken. The number of dropped images is recorded in the file."""
        self._folder = tempfile.TemporaryDirectory(prefix="e2efly-hil-")
        self._place = f"{self._folder.name}/{os.getpid()}"
        parts = [part for image, name in zip(images, names, strict=True) for part in (name, image.name, image.sees)]
        try:
            self.child = Child(sys.executable, "record.py", "hil", str(path), self._place, *parts)
        except ValueError as error:
            self._folder.cleanup()
            raise ValueError(f"--record {path}: {error}") from None
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.setblocking(False)

    def tell(self, topic: str, message: dict[str, Any]) -> None:
        """Record a message on one of the topics of `scripts/record.py`."""
        try:
            self._socket.sendto(json.dumps({"topic": topic, **message}).encode(), self._place)
        except OSError:  # it is busy, or it has ended
            self.dropped += 1

    def close(self) -> None:
        """End the process. The file is then complete."""
        self.child.close()
        self._socket.close()
        with suppress(OSError):
            self._folder.cleanup()
