"""A flight's records as messages on ROS's topics, whoever carries the messages."""

from __future__ import annotations

import importlib
from typing import Any


class Topics:
    """Advertises all topics at once, so that a subscriber finds them before the first message."""

    detail = ""
    """Where to, and by which package."""

    def __init__(self, config: dict[str, Any]) -> None:
        self._words = importlib.import_module("ros_topics")
        prefix = config.get("prefix", "")
        self._by_channel: dict[str, list[Any]] = {}
        for topic in self._words.TOPICS:
            handle = self.advertise(prefix + topic.name, topic.kind, topic.latched)
            self._by_channel.setdefault(topic.channel, []).append((topic, handle))
        kind = self._words.IMAGE_TYPE
        self._images = {
            name: (layout, self.advertise(f"{prefix}/image/{name}", kind, False))
            for name, layout in config["images"].items()
        }

    def write(self, channel: str, stamp: int, values: dict[str, Any]) -> None:
        """Publish what a record says."""
        for topic, handle in self._by_channel.get(channel, ()):
            tree = topic.build(values, stamp)
            if tree is not None:
                self.send(handle, topic.kind, stamp, tree)

    def show(self, name: str, stamp: int, data: bytes) -> None:
        """Publish an image."""
        layout, handle = self._images[name]
        self.send(handle, self._words.IMAGE_TYPE, stamp, self._words.image(layout, stamp, data))

    def advertise(self, topic: str, kind: str, latched: bool) -> Any:
        """Announce a topic; what `send` is to be given."""
        raise NotImplementedError

    def send(self, handle: Any, kind: str, stamp: int, tree: dict[str, Any]) -> None:
        """Publish a message of a type from its tree."""
        raise NotImplementedError

    def flush(self) -> None:
        """Write out what waits."""

    def close(self) -> None:
        """End in order."""
