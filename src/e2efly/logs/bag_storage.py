"""The messages in the files of ROS bags: sqlite3 and MCAP (ROS 2), .bag (ROS 1). Memory and time are bounded, whoever
wrote them; so the files are read here, and the package rosbags only decodes messages of known types.

Sources of the layouts: the ROS wiki, "Bags/Format/2.0"; ros2/rosbag2, `rosbag2_storage_sqlite3` and
`rosbag2_storage_mcap`.
"""

import contextlib
import sqlite3
import struct
from collections.abc import Iterator
from mmap import mmap
from pathlib import Path
from typing import NamedTuple

from e2efly.logs.expand import ZSTD, Expander
from e2efly.logs.flight_log import mapped
from e2efly.logs.mcap_records import MAGIC as MCAP
from e2efly.logs.mcap_records import McapRecords

SQLITE, ROS1 = b"SQLite format 3\0", b"#ROSBAG V2.0\n"
"""First bytes of a file of ROS 2 and of ROS 1."""
BEGINNINGS = (SQLITE, MCAP, ROS1, ZSTD)
"""First bytes of all files that are read here. zstd: such a file as ROS 2 compresses it."""
_STEPS = 10_000_000  # of sqlite's machine, beside ten a byte: rows cost some twenty
_TICK = 1_000_000
_LENGTH = struct.Struct("<I")


class BagTopic(NamedTuple):
    """A topic of a bag."""

    name: str
    kind: str
    """Type of its messages in the form of ROS 2: nav_msgs/msg/Odometry."""
    version: int
    """Of ROS, by which its messages are encoded: 1, or 2 (CDR)."""
    definition: str
    """Of the type, as .msg files with those that it needs. Empty if the bag does not have it."""


class BagFile:
    """One file of a bag."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.cut_off = ""
        """Why reading ended early. Empty at the proper end."""

    def __iter__(self) -> Iterator[tuple[BagTopic, bytes]]:
        """Read the messages, in the order of the file."""
        with mapped(self.path) as data:
            expand = Expander(len(data))
            yield from self._messages(data, expand)

    def _messages(self, data: bytes | mmap, expand: Expander) -> Iterator[tuple[BagTopic, bytes]]:
        if data[: len(ZSTD)] == ZSTD:
            data = expand("zstd", data[:])
        if data[: len(SQLITE)] == SQLITE:
            found = _sqlite(self.path, data)
        elif data[: len(ROS1)] == ROS1:
            found = _ros1(data, expand)
        else:
            found = self._mcap(data)
        try:
            for topic, message in found:
                yield topic, expand("zstd", message) if message[: len(ZSTD)] == ZSTD else message
        except (ValueError, KeyError, struct.error, sqlite3.Error) as error:
            self.cut_off = f"the file is damaged from here on ({error})"

    def _mcap(self, data: bytes | mmap) -> Iterator[tuple[BagTopic, bytes]]:
        records = McapRecords(data)
        versions = {"ros1": 1, "cdr": 2}
        for record in records:
            channel = record.channel
            if channel.encoding in versions:
                text = str(channel.schema, "utf-8", "replace") if channel.schema_encoding.endswith("msg") else ""
                yield BagTopic(channel.topic, _full(channel.kind), versions[channel.encoding], text), record.data
        self.cut_off = records.cut_off


def _ros1(data: bytes | mmap, expand: Expander) -> Iterator[tuple[BagTopic, bytes]]:
    topics: dict[bytes, BagTopic] = {}
    for header, content in _records(data, len(ROS1)):
        op = header.get(b"op")
        if op == b"\5":
            inner = _records(expand(str(header.get(b"compression", b""), "ascii", "replace"), content), 0)
        else:
            inner = [(header, content)]
        for head, message in inner:
            if head.get(b"op") == b"\7":
                about = _fields(message)
                kind, text = (str(about[key], "utf-8", "replace") for key in (b"type", b"message_definition"))
                topics[head[b"conn"]] = BagTopic(str(head[b"topic"], "utf-8", "replace"), _full(kind), 1, text)
            elif head.get(b"op") == b"\2":
                yield topics[head[b"conn"]], message


def _full(kind: str) -> str:
    """The name of a type in the form of ROS 2."""
    return kind if kind.count("/") != 1 else kind.replace("/", "/msg/")


def _records(data: bytes | mmap, at: int) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
    """The records of a ROS 1 bag or of one of its chunks: fields of the header, and content."""
    while at < len(data):
        head, at = _prefixed(data, at)
        content, at = _prefixed(data, at)
        if not head:
            raise ValueError("a record without a header")
        yield _fields(head), content


def _fields(head: bytes) -> dict[bytes, bytes]:
    found, at = {}, 0
    while at < len(head):
        field, at = _prefixed(head, at)
        name, _, value = field.partition(b"=")
        found[name] = value
    return found


def _prefixed(data: bytes | mmap, at: int) -> tuple[bytes, int]:
    (size,) = _LENGTH.unpack_from(data, at)
    at += _LENGTH.size
    if size > len(data) - at:
        raise ValueError("a record breaks off")
    return data[at : at + size], at + size


def _sqlite(path: Path, data: bytes | mmap) -> Iterator[tuple[BagTopic, bytes]]:
    """The messages of a sqlite3 file. `data` is its content, expanded if it was compressed."""
    size, steps = len(data), 0

    def too_long() -> bool:
        nonlocal steps
        steps += _TICK
        return steps > _STEPS + 10 * size

    if isinstance(data, bytes):
        base = sqlite3.connect(":memory:")
        base.deserialize(data[:18] + b"\1\1" + data[20:])  # a copy in memory has no write-ahead log
    else:
        unfinished = path.with_name(path.name + "-wal").exists()  # the recorder's last messages are in that file
        base = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro{'' if unfinished else '&immutable=1'}", uri=True)
    with contextlib.closing(base):
        base.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, max(size, 1))
        base.set_progress_handler(too_long, _TICK)
        base.execute("PRAGMA trusted_schema = OFF")
        there = dict(base.execute("SELECT name, type FROM sqlite_master WHERE type IN ('table', 'view')"))
        if missing := [name for name in ("topics", "messages") if there.get(name) != "table"]:
            raise ValueError(f"has no table {missing[0]}: no file that ros2 bag record wrote")
        columns = {row[1] for row in base.execute("PRAGMA table_info(message_definitions)")}
        known = "topic_type, encoded_message_definition FROM message_definitions WHERE encoding = 'ros2msg'"
        texts = dict(base.execute(f"SELECT {known}")) if "encoding" in columns else {}
        topics = {
            number: BagTopic(str(name), _full(str(kind)), 2, str(texts.get(kind) or ""))
            for number, name, kind, form in base.execute("SELECT id, name, type, serialization_format FROM topics")
            if form == "cdr"
        }
        for number, message in base.execute("SELECT topic_id, data FROM messages"):
            if number in topics and isinstance(message, bytes):
                yield topics[number], message
