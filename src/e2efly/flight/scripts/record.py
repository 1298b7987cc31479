"""Records what `e2efly hil` does, and its images, in an MCAP file. It runs in a separate process.

    record.py hil FILE SOCKET [NAME IMAGE SEES]...

NAME is the name of an image's shared memory, IMAGE is the name of the image, and SEES is what it shows. Everything else
comes as datagrams of JSON, `{"topic": ..., "time": s on the monotonic clock, ...}`, on SOCKET, a socket file that this
script creates. If the disk stalls, this script misses images and datagrams; the node never waits. It needs the package
mcap.
"""

from __future__ import annotations

import base64
import importlib
import json
import select
import socket
import struct
import sys
import time
import zlib
from typing import Any

NUMBERS = {"type": "array", "items": {"type": "number"}}
TIME = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
SCHEMAS: dict[str, tuple[str, dict[str, Any]]] = {
    "image": (
        "foxglove.CompressedImage",
        {
            "timestamp": TIME,
            "frame_id": {"type": "string"},
            "data": {"type": "string", "contentEncoding": "base64"},
            "format": {"type": "string"},
        },
    ),
    "shown": (
        "e2efly.hil.shown",
        {
            "time": {"type": "number", "description": "of the pose, monotonic clock [s]"},
            "position": {**NUMBERS, "description": "of the vehicle in the room [m]"},
            "quaternion": {**NUMBERS, "description": "wxyz, body to room"},
            "scene_position": {**NUMBERS, "description": "of the vehicle in the scene [m]"},
            "scene_quaternion": {**NUMBERS, "description": "wxyz, body to scene"},
            "scene_time": {"type": "number", "description": "[s]"},
            "pose_to_image": {"type": "number", "description": "from the newest pose's arrival to publication [s]"},
        },
    ),
    "event": (
        "e2efly.hil.event",
        {"time": {"type": "number", "description": "monotonic clock [s]"}, "text": {"type": "string"}},
    ),
}
"""The schemas of the topics: their names, and the properties of their JSON objects. All images share the schema
`image`."""


def png(values: bytes, height: int, width: int, channels: int, depth: int) -> bytes:
    """A PNG file (W3C Recommendation, 2003) of grey or RGB values of 8 or 16 bits, big-endian, row by row."""
    row = len(values) // height

    def chunk(name: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))

    head = struct.pack(">2I5B", width, height, depth, 2 if channels == 3 else 0, 0, 0, 0)
    rows = b"".join(b"\0" + values[i : i + row] for i in range(0, len(values), row))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 1)) + chunk(b"IEND", b"")


def encoded(raw: bytes, layout: Any, sees: str) -> bytes:
    """Encode a float32 image as a PNG. Depth is in mm, up to 65.535 m. In all other images, 255 stands for 1."""
    numpy = importlib.import_module("numpy")
    scale, most, kind = (1000, 65535, ">u2") if sees in ("depth", "range") else (255, 255, "u1")
    numbers = numpy.frombuffer(raw, "<f4")
    numbers = numbers / 2 + 0.5 if sees == "normal" else numbers
    values = numpy.rint(numbers * scale).clip(0, most).astype(kind).tobytes()
    return png(values, layout.height, layout.width, layout.channels, 16 if most > 255 else 8)


def record(speech: Any, path: str, place: str, *images: str) -> None:
    """Record until the node ends."""
    importlib.import_module("numpy")  # import it now, not at the first image
    writers, reader = importlib.import_module("mcap.writer"), importlib.import_module("shared_reader").Reader
    names = [images[i : i + 3] for i in range(0, len(images), 3)]
    cameras = [(name, sees, reader(memory)) for memory, name, sees in names]
    inlet = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
    inlet.bind(place)
    with open(path, "xb") as file:  # noqa: PTH123
        writer = writers.Writer(file)
        writer.start(profile="e2efly", library="e2efly")
        channels: dict[str, int] = {}
        wall = time.time() - time.monotonic()

        def write(topic: str, kind: str, moment: float, message: dict[str, Any]) -> None:
            if topic not in channels:
                name, properties = SCHEMAS[kind]
                schema = json.dumps({"title": name, "type": "object", "properties": properties}).encode()
                number = writer.register_schema(name, "jsonschema", schema)
                channels[topic] = writer.register_channel(topic, "json", number)
            stamp = int((wall + moment) * 1e9)
            writer.add_message(channels[topic], stamp, json.dumps(message).encode(), stamp)

        speech.say("ready", path)
        last: dict[str, int] = {}
        missed = 0
        while not speech.closing.is_set():
            if select.select([inlet], [], [], 0.001)[0]:
                message = json.loads(inlet.recv(1 << 16))
                topic = message.pop("topic")
                write(topic, topic, message["time"], message)
            for name, sees, camera in cameras:
                if (new := camera.take()) is None:
                    continue
                number, moment, raw = new
                missed += number - last.get(name, number - 1) - 1
                last[name] = number
                seconds = wall + moment
                stamp = {"sec": int(seconds), "nsec": int(seconds % 1 * 1e9)}
                data = base64.b64encode(encoded(raw, camera.layout, sees)).decode()
                image = {"timestamp": stamp, "frame_id": name, "data": data, "format": "png"}
                write(name, "image", moment, image)
        if missed:
            now = time.monotonic()
            write("event", "event", now, {"time": now, "text": f"{missed} images are missing in this file"})
        writer.finish()


if __name__ == "__main__":
    importlib.import_module("speech").main({"hil": record}, sys.argv[1:])
