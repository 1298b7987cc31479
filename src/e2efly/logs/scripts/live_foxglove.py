"""The records of a flight for Foxglove, from a WebSocket server of the package `foxglove-sdk`.

The channels are those of the flight log, under the same names, so a layout that was made for one also shows the other.
There are three more topics. `/tf` gives the poses of the vehicle and its cameras, for the 3D panel.
`/camera/NAME/image` gives what the policy sees. `/camera/NAME/camera_info` gives the parameters of that camera.
"""

from __future__ import annotations

import importlib
import json
from typing import Any, Callable  # noqa: UP035  # Python 3.8

RARE = ("mode", "event", "meta")
"""Channels whose last message is sent again to each new subscriber, because the next one may come much later."""
SITES = ("https://app.foxglove.dev", "file://")
"""Origins that may look at the flight, besides the pages that this machine serves: Foxglove's site, and the desktop
programs of Foxglove and Lichtblick, whose pages are files."""
BACKLOG = 256
"""The largest number of messages that wait for a slow browser. The oldest ones are dropped first."""


class Foxglove:
    """The server."""

    def __init__(self, config: dict[str, Any], put: Callable[[Any], None]) -> None:
        foxglove = importlib.import_module("foxglove")
        self._messages, channels = (
            importlib.import_module("foxglove.messages"),
            importlib.import_module("foxglove.channels"),
        )
        self._words = importlib.import_module("ros_topics")
        foxglove.set_log_level("ERROR")
        self._channels = {
            name: foxglove.Channel(
                name,
                message_encoding="json",
                schema=foxglove.Schema(name=f"e2efly.{name}", encoding="jsonschema", data=json.dumps(schema).encode()),
            )
            for name, schema in config["schemas"].items()
        }
        self._last: dict[str, tuple[int, dict[str, Any]]] = {}
        self._transform = channels.FrameTransformChannel("/tf")
        self._layouts = layouts = config["images"]
        self._images = {name: channels.RawImageChannel(self._words.IMAGE_TOPIC.format(name)) for name in layouts}
        self._infos = {
            name: channels.CameraCalibrationChannel(self._words.INFO_TOPIC.format(name))
            for name, layout in layouts.items()
            if layout["fov"]
        }

        class Listener(importlib.import_module("foxglove.websocket").ServerListener):
            def on_subscribe(self, client: Any, channel: Any) -> None:
                if channel.topic in RARE:
                    put(("again", 0.0, {"channel": channel.topic}))

        self._gate = importlib.import_module("origins").Gate(config["host"], config["port"], SITES)
        self._server = foxglove.start_server(
            name="e2efly", host=self._gate.inside, port=0, server_listener=Listener(), message_backlog_size=BACKLOG
        )
        self._gate.begin(self._server.port)
        self.detail = f"ws://{config['host']}:{self._gate.port}"

    def write(self, channel: str, stamp: int, values: dict[str, Any]) -> None:
        """Publish a record."""
        if channel == "again":
            channel = values["channel"]
            if channel not in self._last:
                return
            stamp, values = self._last[channel]
        elif channel in RARE:
            self._last[channel] = stamp, values
        self._channels[channel].log(values, log_time=stamp)
        if channel == "odometry":
            self._place(stamp, values)

    def show(self, name: str, stamp: int, data: bytes) -> None:
        """Publish an image and the parameters of its camera."""
        layout = self._layouts[name]
        if name in self._infos:
            info = self._messages.CameraCalibration(
                timestamp=self._time(stamp), frame_id=layout["frame"], width=layout["width"], height=layout["height"],
                distortion_model="plumb_bob", **self._words.intrinsics(layout),
            )  # fmt: skip
            self._infos[name].log(info, log_time=stamp)
        size = {key: layout[key] for key in ("width", "height", "encoding", "step")}
        image = self._messages.RawImage(timestamp=self._time(stamp), frame_id=layout["frame"], data=data, **size)
        self._images[name].log(image, log_time=stamp)

    def flush(self) -> None:
        """Do nothing: no data is buffered here."""

    def close(self) -> None:
        """End the server."""
        self._server.stop()
        self._gate.close(1.0)

    def _place(self, stamp: int, values: dict[str, Any]) -> None:
        for each in self._words.transforms(values, stamp, self._layouts):
            (x, y, z), q = each.position, each.quaternion
            moved = self._messages.FrameTransform(
                timestamp=self._time(each.stamp),
                parent_frame_id=each.parent,
                child_frame_id=each.child,
                translation=self._messages.Vector3(x=x, y=y, z=z),
                rotation=self._messages.Quaternion(x=q[1], y=q[2], z=q[3], w=q[0]),
            )
            self._transform.log(moved, log_time=stamp)

    def _time(self, stamp: int) -> Any:
        return self._messages.Timestamp(*divmod(stamp, 10**9))
