"""The records of a flight as messages on ROS topics, independent of what transports or stores the messages."""

from __future__ import annotations

import importlib
from typing import Any


class Topics:
    """Advertises all topics at once, so that a subscriber finds them before the first message."""

    detail = ""
    """Where the messages go, and with which package."""
    version = 2
    """The version of ROS, 1 or 2."""

    def __init__(self, config: dict[str, Any]) -> None:
        self._words = importlib.import_module("ros_topics")
        prefix = config.get("prefix", "")
        self._by_channel: dict[str, list[Any]] = {}
        for topic in self._words.TOPICS:
            handle = self.advertise(prefix + topic.name, topic.kind, topic.latched)
            self._by_channel.setdefault(topic.channel, []).append((topic, handle))
        words, images = self._words, config["images"]
        self._layouts = images
        self._images = {
            name: self.advertise(prefix + words.IMAGE_TOPIC.format(name), words.IMAGE_TYPE, False) for name in images
        }
        self._infos = {
            name: self.advertise(prefix + words.INFO_TOPIC.format(name), words.INFO_TYPE, False)
            for name, layout in images.items()
            if layout["fov"]
        }
        self._transforms = self.advertise(words.TRANSFORMS_TOPIC, words.TRANSFORMS_TYPE, False)

    def write(self, channel: str, stamp: int, values: dict[str, Any]) -> None:
        """Publish the messages of a record."""
        for topic, handle in self._by_channel.get(channel, ()):
            tree = topic.build(values, stamp)
            if tree is not None:
                self.send(handle, topic.kind, stamp, tree)
        if channel == "odometry" and self._transforms is not None:
            found = self._words.transforms(values, stamp, self._layouts)
            if found:
                self.send(self._transforms, self._words.TRANSFORMS_TYPE, stamp, self._words.tf_message(found))

    def show(self, name: str, stamp: int, data: bytes) -> None:
        """Publish an image and the parameters of its camera."""
        words, layout = self._words, self._layouts[name]
        if name in self._infos:
            info = words.camera_info(layout, stamp, self.version)
            self.send(self._infos[name], words.INFO_TYPE, stamp, info)
        self.send(self._images[name], words.IMAGE_TYPE, stamp, words.image(layout, stamp, data))

    def advertise(self, topic: str, kind: str, latched: bool) -> Any:
        """Announce a topic. Returns the handle for `send`. None: the type of the topic is not installed."""
        raise NotImplementedError

    def send(self, handle: Any, kind: str, stamp: int, tree: dict[str, Any]) -> None:
        """Publish a message of a type, which is given as a tree."""
        raise NotImplementedError

    def flush(self) -> None:
        """Write the buffered data."""

    def close(self) -> None:
        """Close properly."""
