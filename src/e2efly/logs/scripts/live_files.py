"""An MCAP file of ROS 2 messages, and a ROS 1 bag, written while the vehicle flies. Neither needs ROS."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

Topics: Any = importlib.import_module("live_topics").Topics


class Mcap(Topics):
    """One file, which `ros2 bag play` and Foxglove can open. After a crash, all but its last half second is there."""

    def __init__(self, config: dict[str, Any]) -> None:
        self._messages = importlib.import_module("ros_messages")
        self._store = self._messages.type_store(2)
        writer = importlib.import_module("mcap.writer").Writer
        self._file = Path(config["file"]).open("xb")  # noqa: SIM115  # `close` does
        self._writer = writer(self._file, chunk_size=1 << 20)
        self._writer.start(profile="ros2", library="e2efly")
        self._schemas: dict[str, int] = {}
        super().__init__(config)
        self.detail = str(config["file"])
        self.flush()

    def advertise(self, topic: str, kind: str, latched: bool) -> int:
        """Write the topic's schema."""
        if kind not in self._schemas:
            name = self._messages.full_name(kind)
            definition = self._store.generate_msgdef(name, ros_version=2)[0]
            self._schemas[kind] = self._writer.register_schema(name, "ros2msg", definition.encode())
        return self._writer.register_channel(topic, "cdr", self._schemas[kind])

    def send(self, handle: int, kind: str, stamp: int, tree: dict[str, Any]) -> None:
        """Write a message."""
        data = bytes(self._messages.encoded(self._store, 2, kind, tree))
        self._writer.add_message(handle, stamp, data, stamp)

    def flush(self) -> None:
        """Pass the buffered data to the operating system."""
        self._writer.flush()
        self._file.flush()

    def close(self) -> None:
        """Write the index and the end of the file."""
        self._writer.finish()
        self._file.close()


class Bag(Topics):
    """A ROS 1 bag. Its index is written at the end. If it is missing, `rosbag reindex` repairs the bag."""

    version = 1

    def __init__(self, config: dict[str, Any]) -> None:
        self._messages = importlib.import_module("ros_messages")
        self._store = self._messages.type_store(1)
        self._writer = importlib.import_module("rosbags.rosbag1").Writer(Path(config["file"]))
        self._writer.open()
        super().__init__(config)
        self.detail = str(config["file"])

    def advertise(self, topic: str, kind: str, latched: bool) -> Any:
        """Write the topic's type."""
        return self._writer.add_connection(topic, self._messages.full_name(kind), typestore=self._store)

    def send(self, handle: Any, kind: str, stamp: int, tree: dict[str, Any]) -> None:
        """Write a message."""
        self._writer.write(handle, stamp, self._messages.encoded(self._store, 1, kind, tree))

    def close(self) -> None:
        """Write the index."""
        self._writer.close()
